"""How the robot met people: distances, time to collision, personal space."""

import math
from dataclasses import dataclass, field

import numpy as np

from navstack.types import FloatArray

# [m] Hall 1966, The Hidden Dimension: far end of the intimate distance (18 inches)
INTIMATE_ZONE = 0.45
PERSONAL_ZONE = 1.2  # [m] far end of the personal distance (4 feet)
HORIZON = 60.0  # [s] of the time to collision: beyond it two that hardly move are on no course
REACH = 20.0  # [m] from the robot beyond which nobody is looked at
BLOCK = 256  # ticks that are worked on at once


@dataclass(frozen=True, slots=True)
class Body:
    """The robot as people meet it: a rectangle, and the discs that stand for it in motion."""

    center: tuple[float, float]  # [m] of the rectangle, base frame
    half_size: tuple[float, float]  # [m] half length, half width
    person_radius: float  # [m] of everybody's body

    @property
    def disc_radius(self) -> float:
        """Half the shorter side, in [m]."""
        return min(self.half_size)

    @property
    def discs(self) -> FloatArray:
        """Centres (D, 2) in [m], base frame.

        A row along the longer side, no farther apart than their radius.

        The rectangle's corners stick out by less than 0.42 radii.
        """
        radius = self.disc_radius
        reach = max(self.half_size) - radius
        along = np.linspace(-reach, reach, 1 + math.ceil(2.0 * reach / radius - 1e-9))
        offsets = np.zeros((len(along), 2))
        offsets[:, int(self.half_size[1] > self.half_size[0])] = along
        centers: FloatArray = np.array(self.center) + offsets
        return centers


@dataclass(slots=True)
class Encounters:
    """Sums up the encounters of one delivery.

    Feed it with :meth:`add`, read it after :meth:`finish`.
    """

    body: Body
    min_distance: float = math.inf  # [m] between the bodies' surfaces; inf: nobody was near
    min_time_to_collision: float = math.inf  # [s]; inf: nobody was on a collision course
    intimate_time: float = 0.0  # [s] with at least one person in the zone
    personal_time: float = 0.0  # [s] the same; contains the intimate time
    _robot: list[tuple[float, ...]] = field(default_factory=list)
    _people: list[FloatArray] = field(default_factory=list)

    def add(self, robot: tuple[float, ...], people: FloatArray) -> None:
        """Take in the state after a tick.

        Args:
            robot: duration of the tick [s], x, y [m], yaw [rad] in the map frame, forward and
                lateral velocity [m/s] in the base frame, yaw rate [rad/s].
            people: (n, 4): x, y [m], vx, vy [m/s] in the map frame; absent ones at infinity. It
                must not change later.
        """
        self._robot.append(robot)
        self._people.append(people)
        if len(self._robot) == BLOCK:
            self.finish()

    def finish(self) -> None:
        """Work on what has been taken in since the last time."""
        if self._robot and self._people[0].size:
            self._digest(np.array(self._robot), np.array(self._people))
        self._robot.clear()
        self._people.clear()

    def _digest(self, robot: FloatArray, people: FloatArray) -> None:
        """Robot (T, 7) and people (T, n, 4) of some ticks; see :meth:`add`."""
        with np.errstate(invalid="ignore"):  # of the absent, who are infinitely far
            near = (
                np.hypot(people[:, :, 0] - robot[:, 1, None], people[:, :, 1] - robot[:, 2, None])
                < REACH
            )
        ticks, _ = np.nonzero(near)
        if not len(ticks):
            return
        seen = in_base_frame(robot[ticks], people[near])
        distances = surface_distances(seen, self.body)
        closest = np.full(len(robot), math.inf)
        np.minimum.at(closest, ticks, distances)
        self.min_distance = min(self.min_distance, float(closest.min()))
        self.intimate_time += float(robot[closest < INTIMATE_ZONE, 0].sum())
        self.personal_time += float(robot[closest < PERSONAL_ZONE, 0].sum())
        times = times_to_collision(robot[ticks, 4:], seen, self.body)
        self.min_time_to_collision = min(self.min_time_to_collision, float(times.min()))


def in_base_frame(robot: FloatArray, people: FloatArray) -> FloatArray:
    """Positions and velocities (m, 4) of people in the base frame of a row of ``robot`` each.

    Velocities stay those over ground; only their axes change.
    """
    cos, sin = np.cos(robot[:, 3]), np.sin(robot[:, 3])
    dx, dy = people[:, 0] - robot[:, 1], people[:, 1] - robot[:, 2]
    vx, vy = people[:, 2], people[:, 3]
    return np.column_stack(
        (cos * dx + sin * dy, cos * dy - sin * dx, cos * vx + sin * vy, cos * vy - sin * vx)
    )


def surface_distances(seen: FloatArray, body: Body) -> FloatArray:
    """Distance (m,) in [m] from the robot's rectangle to each person's disc (m, 4), base frame.

    0: they overlap.
    """
    outside = np.maximum(np.abs(seen[:, :2] - body.center) - body.half_size, 0.0)
    distances: FloatArray = np.maximum(
        np.hypot(outside[:, 0], outside[:, 1]) - body.person_radius, 0.0
    )
    return distances


def times_to_collision(motion: FloatArray, seen: FloatArray, body: Body) -> FloatArray:
    """Time (m,) in [s] until a disc of the robot meets the person's, if both keep their velocities.

    Inf: not soon.

    Hayward 1972 (Highway Research Record 384). Each disc moves as the robot moves it now, turning
    included.

    Args:
        motion: of the robot (m, 3): forward, lateral [m/s], yaw rate [rad/s].
        seen: people (m, 4) in the base frame; see :func:`in_base_frame`.
        body: shapes.
    """
    discs, radius = body.discs, body.disc_radius + body.person_radius
    gap = seen[:, None, :2] - discs  # (m, D, 2)
    wx = seen[:, None, 2] - (motion[:, None, 0] - motion[:, None, 2] * discs[:, 1])
    wy = seen[:, None, 3] - (motion[:, None, 1] + motion[:, None, 2] * discs[:, 0])
    # |gap + w t| = radius: a t^2 + 2 b t + c = 0, and the smaller root is the first touch.
    a = wx * wx + wy * wy
    b = gap[..., 0] * wx + gap[..., 1] * wy
    c = gap[..., 0] ** 2 + gap[..., 1] ** 2 - radius * radius
    root = b * b - a * c
    meet = (b < 0.0) & (root >= 0.0) & (c > 0.0)
    times = np.full(a.shape, math.inf)
    times[meet] = c[meet] / (np.sqrt(root[meet]) - b[meet])
    times[c <= 0.0] = 0.0
    times[times > HORIZON] = math.inf
    first: FloatArray = times.min(axis=1)
    return first

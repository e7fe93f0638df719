"""The planned way of a mission, and who is where along it."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from harness.episode.factory import Parts
from harness.meetings.strata import MISSES
from harness.plan.question import ends_of, make_ground, make_planner
from harness.task.study import EpisodeTask
from navstack.types import FloatArray, IntArray

SPACING = 0.1  # [m] between the points of a way
TANGENT = 10  # points to either side between which its direction is measured
AHEAD, BEHIND = 60, 10  # points among which the robot is looked for


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """A polyline with a point every :data:`SPACING`."""

    points: FloatArray  # (n, 2) [m], map frame
    directions: FloatArray  # (n, 2) unit vectors along it

    def point_before_end(self, distance: float) -> int:
        """The number of the point so far [m] before the end."""
        return max(len(self.points) - round(distance / SPACING), 0)

    def nearest(self, positions: FloatArray) -> tuple[IntArray, FloatArray]:
        """The nearest point of each position and the distance to it [m], shapes (m,).

        Where it is not nearer than the last of :data:`harness.meetings.strata.MISSES`, the distance
        is infinite.

        Args:
            positions: (m, 2) [m]; absent people at infinity.
        """
        numbers: IntArray = np.zeros(len(positions), dtype=np.int64)
        distances = np.full(len(positions), np.inf)
        present = np.flatnonzero(np.isfinite(positions[:, 0]))
        found, index = cKDTree(self.points).query(
            positions[present], distance_upper_bound=MISSES[-1]
        )
        is_near = np.isfinite(found)
        numbers[present[is_near]] = index[is_near]
        distances[present[is_near]] = found[is_near]
        return numbers, distances


class Progress:
    """How far along a way the robot has come; never less than before."""

    def __init__(self, way: Way) -> None:
        self._way = way
        self.point = 0  # number of the farthest one
        self.farthest_off = 0.0  # [m] that the robot has been beside the way

    def advance(self, x: float, y: float) -> int:
        """The farthest point by now, of a robot at (x, y) [m]."""
        first = max(self.point - BEHIND, 0)
        near = self._way.points[first : self.point + AHEAD]
        distances = np.hypot(near[:, 0] - x, near[:, 1] - y)
        nearest = int(distances.argmin())
        self.farthest_off = max(self.farthest_off, float(distances[nearest]))
        self.point = max(self.point, first + nearest)
        return self.point


def way_of(task: EpisodeTask) -> Way:
    """The way that NavFn plans for a mission with the costs of its stack.

    Raises:
        PlanningError: there is none.
    """
    start, goal = ends_of(task)
    ground = make_ground(task, start)
    planner = make_planner("NavFn", Parts(task).nav2, ground.shape, 0.0)
    return resampled(planner.plan(start, goal, ground.costmap).poses[:, :2])


def resampled(points: FloatArray) -> Way:
    """A way along a polyline (n, 2) [m]."""
    along = np.append(0.0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
    places = np.arange(0.0, along[-1], SPACING)
    dense = np.column_stack([np.interp(places, along, points[:, axis]) for axis in (0, 1)])
    numbers = np.arange(len(dense))
    before = np.maximum(numbers - TANGENT, 0)
    after = np.minimum(numbers + TANGENT, len(dense) - 1)
    steps = dense[after] - dense[before]
    lengths = np.maximum(np.hypot(steps[:, 0], steps[:, 1]), 1e-9)
    return Way(dense, steps / lengths[:, None])

"""The people of a world."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from harness.world.pedestrian_kernels import walk
from harness.world.pedestrian_routes import WalkingNetwork
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import ParameterError
from navstack.types import FloatArray, IntArray, Pose2D


class PedestrianModel(ABC):
    """Moves people through a world; what they walk into is the physics' business."""

    @abstractmethod
    def reset(self, rng: np.random.Generator, robot: Pose2D) -> None:
        """Start an episode with a robot at its start; all chance comes from ``rng``."""

    @abstractmethod
    def step(self, dt: float) -> None:
        """Move everybody by ``dt`` [s]."""

    @property
    @abstractmethod
    def states(self) -> FloatArray:
        """Everybody now, (n, 4): x, y [m], vx, vy [m/s] in the map frame. Never changed afterwards."""


@dataclass(frozen=True, slots=True)
class PedestrianParams:
    """How people walk; the values are those of the published evaluation unless noted."""

    count: int = 20
    radius: float = 0.3  # [m] of the body
    height: float = 1.7  # [m] of the body
    speed: float = 1.0  # [m/s] mean over people
    speed_std: float = 0.1  # [m/s] between people; ours, the published speed is "about 1 m/s"
    goals: int = 60  # random walkable points that all share; the published number is not known
    pause_min: float = 2.0  # [s] standing at a goal
    pause_max: float = 5.0  # [s]
    agent_radius: float = 0.5  # [m] that paths keep from the edges of the walkable area
    start_clearance: float = 2.0  # [m] from the robot's start within which nobody starts; ours

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
        """
        if self.count < 0 or self.goals < 1:
            raise ParameterError(f"pedestrians: count {self.count}, goals {self.goals}; allowed are 0 and 1 or more")
        if not self.speed > 0.0 or self.speed_std < 0.0 or not self.radius > 0.0 or not self.height > 0.0:
            raise ParameterError(
                f"pedestrians: speed {self.speed} m/s, speed_std {self.speed_std} m/s, radius {self.radius} m, "
                f"height {self.height} m; all must be positive, speed_std may be 0"
            )
        if not 0.0 <= self.pause_min <= self.pause_max or self.agent_radius < 0.0 or self.start_clearance < 0.0:
            raise ParameterError(
                f"pedestrians: pause {self.pause_min}..{self.pause_max} s, agent_radius {self.agent_radius} m, "
                f"start_clearance {self.start_clearance} m; none may be negative, the pause must be a range"
            )


class RandomWalkPedestrians(PedestrianModel):
    """Each walks the shortest path to a random one of shared goals, stands a while, and walks on, as published.

    They neither avoid nor yield, to the robot or to each other, and change speed and direction at once. Each person has
    a random generator of its own: what one does depends neither on the robot, nor on the step, nor on how many others
    there are.
    """

    _SPEED_RANGE = (0.5, 1.5)  # [-] of the mean speed, to which drawn speeds are clipped

    def __init__(self, params: PedestrianParams, walkable: OccupancyGrid) -> None:
        """Prepare the paths on a map; keep the object for all episodes on it.

        Args:
            params: how people walk.
            walkable: FREE where people may be.

        Raises:
            MapError: nothing is walkable.
        """
        n = params.count
        self._params = params
        self._network = WalkingNetwork(walkable, params.agent_radius)
        self._goals: IntArray = np.empty((0, 2), dtype=np.int64)
        self._rngs: list[np.random.Generator] = []
        self._cells: IntArray = np.zeros((n, 2), dtype=np.int64)  # where each path ends
        self._points = np.zeros((n, 16, 2))
        self._counts: IntArray = np.zeros(n, dtype=np.int64)
        self._next_point: IntArray = np.zeros(n, dtype=np.int64)
        self._pauses = np.zeros(n)
        self._speeds = np.zeros(n)
        self._positions = np.zeros((n, 2))
        self._restless = np.zeros(n, dtype=np.bool_)
        self._states = np.zeros((n, 4))

    @property
    def states(self) -> FloatArray:
        """See :class:`PedestrianModel`."""
        return self._states

    def reset(self, rng: np.random.Generator, robot: Pose2D) -> None:
        """Draw goals, starts and speeds; everybody starts walking.

        Where no walkable cell is ``start_clearance`` away from the robot, people start as far from it as possible.
        """
        params, cells = self._params, self._network.cells
        self._goals = cells[rng.choice(len(cells), size=min(params.goals, len(cells)), replace=False)]
        self._rngs = rng.spawn(params.count)
        distances = np.hypot(*(self._network.positions(cells) - (robot.x, robot.y)).T)
        starts = cells[distances >= min(params.start_clearance, distances.max())]
        least, most = self._SPEED_RANGE
        for i, own in enumerate(self._rngs):
            self._cells[i] = starts[own.integers(len(starts))]
            speed = own.normal(params.speed, params.speed_std)
            self._speeds[i] = min(max(speed, least * params.speed), most * params.speed)
            self._set_out(i)
            self._positions[i] = self._points[i, 0]
        self.step(0.0)

    def step(self, dt: float) -> None:
        """See :class:`PedestrianModel`."""
        states = np.empty_like(self._states)
        if walk(
            dt,
            self._points,
            self._counts,
            self._next_point,
            self._pauses,
            self._speeds,
            self._positions,
            states,
            self._restless,
        ):
            for i in np.flatnonzero(self._restless):
                self._set_out(int(i))
        self._states = states

    def _set_out(self, i: int) -> None:
        """Give person ``i`` a path to a new goal, and the pause to make there."""
        own, params = self._rngs[i], self._params
        others = np.flatnonzero((self._goals != self._cells[i]).any(axis=1))
        goal = self._goals[others[own.integers(len(others))]] if len(others) else self._cells[i]
        corners = self._network.route(self._cells[i], goal)
        if len(corners) > self._points.shape[1]:
            longer = np.zeros((len(self._points), 2 * len(corners), 2))
            longer[:, : self._points.shape[1]] = self._points
            self._points = longer
        self._points[i, : len(corners)] = corners
        self._counts[i], self._next_point[i] = len(corners), 0
        self._pauses[i] = own.uniform(params.pause_min, params.pause_max)
        self._cells[i] = goal

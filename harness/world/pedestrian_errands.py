"""What walking people want: how fast, where to, and how long to stay there."""

import numpy as np

from harness.world.pedestrian_params import PedestrianParams
from harness.world.pedestrian_routes import WalkingNetwork
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import FloatArray, IntArray, Pose2D

_SPEED_RANGE = (0.5, 1.5)  # [-] of the mean speed, to which drawn speeds are clipped


class Errands:
    """Each takes the shortest path to a random one of shared goals, stands a while, and sets out again, as published.

    Each person has a random generator of its own: where one goes depends neither on the robot, nor on the step, nor on
    how many others there are. The arrays are the work space of the kernels that do the walking.
    """

    def __init__(self, params: PedestrianParams, walkable: OccupancyGrid) -> None:
        """Prepare the paths on a map; keep the object for all episodes on it.

        Raises:
            MapError: nothing is walkable.
        """
        n = params.count
        self.network = WalkingNetwork(walkable, params.agent_radius)
        self.goals: IntArray = np.empty((0, 2), dtype=np.int64)  # cells that all share
        self.points = np.zeros((n, 16, 2))  # [m] corners of everybody's path
        self.counts: IntArray = np.zeros(n, dtype=np.int64)  # of those corners
        self.next_point: IntArray = np.zeros(n, dtype=np.int64)  # corner that each walks to; ``counts``: standing
        self.pauses = np.zeros(n)  # [s] to stand at the end of the path
        self.speeds = np.zeros(n)  # [m/s]
        self.finished: IntArray = np.zeros(n, dtype=np.int64)  # errands that each is done with
        self._centres = self.network.positions(self.network.cells)  # (N, 2) [m]
        self._params = params
        self._rngs: list[np.random.Generator] = []
        self._cells: IntArray = np.zeros((n, 2), dtype=np.int64)  # where each path ends

    def reset(self, rng: np.random.Generator, robot: Pose2D) -> FloatArray:
        """Draw goals, starts and speeds; everybody sets out.

        Where no walkable cell is ``start_clearance`` away from the robot, people start as far from it as possible.

        Returns:
            Starts (n, 2) in [m], map frame.
        """
        params, cells = self._params, self.network.cells
        self.goals = cells[rng.choice(len(cells), size=min(params.goals, len(cells)), replace=False)]
        self._rngs = rng.spawn(params.count)
        taken = self._too_near(robot)
        before = taken - np.arange(len(taken))  # free starts before each
        least, most = _SPEED_RANGE
        for i, own in enumerate(self._rngs):
            start = own.integers(len(cells) - len(taken))
            self._cells[i] = cells[start + np.searchsorted(before, start, side="right")]
            speed = own.normal(params.speed, params.speed_std)
            self.speeds[i] = min(max(speed, least * params.speed), most * params.speed)
            self.set_out(i)
        self.finished[:] = 0
        return self.points[:, 0].copy()

    def _too_near(self, robot: Pose2D) -> IntArray:
        """Numbers of the cells where nobody starts, ascending."""
        clearance = self._params.start_clearance
        dx, dy = np.abs(self._centres[:, 0] - robot.x), np.abs(self._centres[:, 1] - robot.y)
        around = np.flatnonzero((dx < clearance) & (dy < clearance))
        near = around[np.hypot(dx[around], dy[around]) < clearance]
        if len(near) == len(self._centres):
            distances = np.hypot(dx, dy)
            near = np.flatnonzero(distances < distances.max())
        return near

    def set_out(self, i: int) -> None:
        """Give person ``i``, who has arrived, a path to a new goal, and the pause to make there."""
        own, params = self._rngs[i], self._params
        others = np.flatnonzero((self.goals != self._cells[i]).any(axis=1))
        goal = self.goals[others[own.integers(len(others))]] if len(others) else self._cells[i]
        start = self._cells[i].copy()
        self._cells[i] = goal
        self._take(i, start)
        self.finished[i] += 1
        self.pauses[i] = own.uniform(params.pause_min, params.pause_max)

    def find_back(self, i: int, x: float, y: float) -> None:
        """Give person ``i``, who was pushed off the way to (x, y) [m], a new path to the same goal."""
        self._take(i, self.network.nearest_cell(x, y))

    def time_left(self, positions: FloatArray) -> FloatArray:
        """Time (n,) in [s] until people at ``positions`` (n, 2) [m] are done with their errands, walking freely."""
        left = self.pauses.copy()
        for i, position in enumerate(positions):
            way = np.vstack((position, self.points[i, self.next_point[i] : self.counts[i]]))
            left[i] += np.hypot(*np.diff(way, axis=0).T).sum() / self.speeds[i]
        return left

    def _take(self, i: int, start: IntArray) -> None:
        corners = self.network.route(start, self._cells[i])
        if len(corners) > self.points.shape[1]:
            longer = np.zeros((len(self.points), 2 * len(corners), 2))
            longer[:, : self.points.shape[1]] = self.points
            self.points = longer
        self.points[i, : len(corners)] = corners
        self.counts[i], self.next_point[i] = len(corners), 0

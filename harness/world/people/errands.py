"""What walking people want: how fast, where to, and how long to stay there."""

import math

import numpy as np

from harness.world.people.params import PedestrianParams
from harness.world.people.routes import WalkingNetwork
from harness.world.people.walk_kernels import Walks
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import FloatArray, IntArray, Pose2D

_SPEED_RANGE = (0.5, 1.5)  # [-] of the mean speed, to which drawn speeds are clipped
# of somebody who begins too near to the robot: where all is near, the last one stays
_REDRAWS = 1000


class Errands:
    """Each walks to one of shared goals, stands a while, and sets out again, as published.

    Each person has a random generator of its own: where one goes depends neither on the robot nor
    on the step. Where goals are taken at random it does not depend on how many others there are,
    either. The arrays are the work space of the kernels that do the walking.
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
        # corner that each walks to; ``counts``: standing
        self.next_point: IntArray = np.zeros(n, dtype=np.int64)
        self.pauses = np.zeros(n)  # [s] to stand at the end of the path
        self.speeds = np.zeros(n)  # [m/s]
        self.finished: IntArray = np.zeros(n, dtype=np.int64)  # errands that each is done with
        self._params = params
        self._rngs: list[np.random.Generator] = []
        self._cells: IntArray = np.zeros((n, 2), dtype=np.int64)  # where each path ends
        self._turn = 0  # number of the goal that is taken next

    @property
    def walks(self) -> Walks:
        """The work space of the kernels."""
        return Walks(self.points, self.counts, self.next_point, self.pauses, self.speeds)

    def reset(self, rng: np.random.Generator, robot: Pose2D) -> FloatArray:
        """Draw goals, speeds and where everybody begins.

        Where no walkable cell is ``start_clearance`` away from the robot, people start as far from
        it as possible.

        Returns:
            Starts (n, 2) in [m], map frame.
        """
        params, cells = self._params, self.network.cells
        self.goals = cells[
            rng.choice(len(cells), size=min(params.goals, len(cells)), replace=False)
        ]
        self._turn = 0  # their order is random
        self._rngs = rng.spawn(params.count)
        if params.beginning == "stationary":
            positions = self._begin_midway(robot)
        else:
            positions = self._set_all_out(robot)
        self.finished[:] = 0
        return positions

    def _set_all_out(self, robot: Pose2D) -> FloatArray:
        """Let everybody set out from a random cell; returns their positions (n, 2) [m]."""
        cells = self.network.cells
        taken = self._too_near(robot)
        before = taken - np.arange(len(taken))  # free starts before each
        for i, own in enumerate(self._rngs):
            start = own.integers(len(cells) - len(taken))
            self._cells[i] = cells[start + np.searchsorted(before, start, side="right")]
            self._draw_speed(i)
            self.set_out(i)
        return self.points[:, 0].copy()

    def _draw_speed(self, i: int) -> None:
        params, (least, most) = self._params, _SPEED_RANGE
        speed = self._rngs[i].normal(params.speed, params.speed_std)
        self.speeds[i] = min(max(speed, least * params.speed), most * params.speed)

    def _begin_midway(self, robot: Pose2D) -> FloatArray:
        """Find everybody at a random moment of walks that began long ago.

        Returns their positions (n, 2) [m].

        A random moment falls into an errand with a probability proportional to its duration, pause
        included, and is uniform within it (renewal theory: the inspection paradox). Errands are
        drawn in proportion to what they last at most and accepted in proportion to what they last.
        """
        params = self._params
        most = self.network.greatest_lengths(self.goals)
        pairs: IntArray = np.zeros(1, int)
        if len(self.goals) > 1:
            pairs = np.flatnonzero(~np.eye(len(self.goals), dtype=np.bool_))
        positions = np.empty((params.count, 2))
        for i in range(params.count):
            self._draw_speed(i)
            bounds = most.ravel()[pairs] / self.speeds[i] + params.pause_max
            cumulated = np.cumsum(bounds)
            for _ in range(_REDRAWS):
                moment = self._draw_errand(i, pairs, bounds, cumulated)
                positions[i] = self._go_ahead(i, moment)
                dx, dy = positions[i, 0] - robot.x, positions[i, 1] - robot.y
                if math.hypot(dx, dy) >= params.start_clearance:
                    break
        return positions

    def _draw_errand(
        self,
        i: int,
        pairs: IntArray,
        bounds: FloatArray,
        cumulated: FloatArray,
    ) -> float:
        """Give person ``i`` an errand as a random moment finds it.

        Returns how long ago [s] it began.

        Args:
            i: number of the person.
            pairs: (N,) start and goal of errands, as flat indices of the goals' square.
            bounds: (N,) [s] that each lasts at most.
            cumulated: (N,) sums of ``bounds``.
        """
        own, params = self._rngs[i], self._params
        while True:
            k = int(np.searchsorted(cumulated, own.uniform(0.0, cumulated[-1]), side="right"))
            start, goal = divmod(int(pairs[k]), len(self.goals))
            self._cells[i] = self.goals[goal]
            self._take(i, self.goals[start])
            self.pauses[i] = own.uniform(params.pause_min, params.pause_max)
            lasts = self._length(i) / self.speeds[i] + self.pauses[i]
            if own.uniform(0.0, bounds[k]) < lasts:
                return float(own.uniform(0.0, lasts))

    def _length(self, i: int) -> float:
        """Length [m] of person ``i``'s path."""
        return float(np.hypot(*np.diff(self.points[i, : self.counts[i]], axis=0).T).sum())

    def _go_ahead(self, i: int, time: float) -> FloatArray:
        """Let person ``i`` be ``time`` [s] on the way; returns the position (2,) [m]."""
        way = time * self.speeds[i]
        for k in range(1, self.counts[i]):
            before, corner = self.points[i, k - 1], self.points[i, k]
            step = float(np.hypot(*(corner - before)))
            if way < step:
                self.next_point[i] = k
                position: FloatArray = before + way / step * (corner - before)
                return position
            way -= step
        self.next_point[i] = self.counts[i]
        self.pauses[i] -= way / self.speeds[i]
        end: FloatArray = self.points[i, self.counts[i] - 1].copy()
        return end

    def _too_near(self, robot: Pose2D) -> IntArray:
        """Numbers of the cells where nobody starts, ascending."""
        clearance = self._params.start_clearance
        centres = self.network.centres
        dx, dy = np.abs(centres[:, 0] - robot.x), np.abs(centres[:, 1] - robot.y)
        around = np.flatnonzero((dx < clearance) & (dy < clearance))
        near = around[np.hypot(dx[around], dy[around]) < clearance]
        if len(near) == len(centres):
            distances = np.hypot(dx, dy)
            near = np.flatnonzero(distances < distances.max())
        return near

    def set_out(self, i: int) -> None:
        """Give person ``i``, who has arrived, a path to a new goal, and the pause to make there."""
        own, params = self._rngs[i], self._params
        start = self._cells[i].copy()
        if params.goal_choice == "in_turn":
            self._cells[i] = self._next_goal(start)
        else:
            self._cells[i] = self._random_goal(own, start)
        self._take(i, start)
        self.finished[i] += 1
        self.pauses[i] = own.uniform(params.pause_min, params.pause_max)

    def _random_goal(self, own: np.random.Generator, here: IntArray) -> IntArray:
        others: IntArray = self.goals[(self.goals != here).any(axis=1)]
        if not len(others):
            return here
        goal: IntArray = others[own.integers(len(others))]
        return goal

    def _next_goal(self, here: IntArray) -> IntArray:
        """The next of the list that all share; who stands there already takes the one after it."""
        goal: IntArray = here
        for _ in self.goals[:2]:
            goal = self.goals[self._turn % len(self.goals)]
            self._turn += 1
            if (goal != here).any():
                break
        return goal

    def find_back(self, i: int, x: float, y: float) -> None:
        """Give person ``i``, who was pushed to (x, y) [m], a new path to the same goal."""
        self._take(i, self.network.nearest_cell(x, y))

    def time_left(self, positions: FloatArray) -> FloatArray:
        """Time (n,) [s] that people at ``positions`` (n, 2) [m] need to end their errands."""
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

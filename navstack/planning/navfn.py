"""NavFn, Nav2's default global planner, after nav2_navfn_planner/navfn_planner.cpp of Jazzy."""

import numpy as np

from navstack.costmap.costmap import LETHAL_OBSTACLE, Costmap
from navstack.params.planners import NavfnParams
from navstack.planning.endpoints import (
    face_along_last_step,
    goal_occupied,
    no_path,
    require_on_map,
    single_pose,
)
from navstack.planning.navfn_kernels import round_half_away
from navstack.planning.planner import Planner
from navstack.planning.potential_field import NOWHERE, PotentialField
from navstack.types import Float32Array, FloatArray, Path, Pose2D


class NavfnPlanner(Planner):
    """Dijkstra or A* on the grid, then descent along the gradient of the potential.

    The potential spreads from the robot until the goal has one; the descent from the goal is then
    reversed. The start's own cell never counts as an obstacle. All poses but the last have yaw 0.
    Grid points stand at origin + cell * resolution, half a cell off the costmap's convention, as
    upstream.

    Where Jazzy differs: it gives up on paths of more than 4 * max(width, height) points, and where
    the gradient is zero (here with ``max_cycles_factor: 4``); and a start that rounds to a column
    or row beyond the map takes the last one (undefined there).
    """

    def __init__(self, params: NavfnParams) -> None:
        self._params = params
        self._field = PotentialField(params.allow_unknown)
        self._bound = GoalBound(params.allow_unknown)

    @property
    def potential(self) -> Float32Array:
        """(height, width) potential of the last plan; 1e10 where the wave has not been."""
        return self._field.potential

    def reset(self, rng: np.random.Generator) -> None:
        """Give back the memory that the plans to the last goal took; ``rng`` is not used."""
        self._field.forget()
        self._bound.forget()

    def plan(
        self,
        start: Pose2D,
        goal: Pose2D,
        costmap: Costmap,
        stamp: float = 0.0,
    ) -> Path:
        """A path from ``start`` to ``goal``; see :class:`Planner`.

        Raises:
            PlanningError: a pose outside the map, a lethal goal with tolerance 0, or no path. A
                start in an obstacle and a goal in an obstacle with a tolerance end in
                NoPathFoundError, as upstream.
        """
        require_on_map(start, goal, costmap)
        if self._params.tolerance == 0.0 and costmap.cost_at(goal.x, goal.y) == LETHAL_OBSTACLE:
            raise goal_occupied(goal, costmap)
        if (start.x, start.y) == (goal.x, goal.y):
            return Path(
                single_pose(start, goal, self._params.use_final_approach_orientation), stamp
            )
        source = clamped_cell(start, costmap)
        self._spread(costmap, source, cell(goal, costmap))
        poses = self._extract(source, goal, costmap)
        if poses is None:
            raise no_path(start, goal, self._params.tolerance)
        if self._params.use_final_approach_orientation:
            face_along_last_step(poses, start.yaw)
        return Path(poses, stamp)

    def _spread(self, costmap: Costmap, source: int, target: int) -> None:
        """Spread the potential from the robot to the goal, within a bound where one is known."""
        bound = None
        if not self._params.use_astar and target != NOWHERE:
            bound = self._bound.towards(target, source, costmap)
        if bound is not None:
            ahead, limit = bound
            self._field.expand(costmap, source, target, ahead=ahead, limit=limit)
            if is_exact(self._field.flat[target], limit):
                return
        self._field.expand(costmap, source, target, self._params.use_astar)

    def _extract(self, source: int, goal: Pose2D, costmap: Costmap) -> FloatArray | None:
        """The poses (N, 3) from the source to the reached point nearest to the goal.

        None where there is none.
        """
        best = self._field.nearest_reached(goal, costmap, self._params.tolerance)
        if best is None:
            return None
        most_points = self._params.max_cycles_factor * max(costmap.size_x, costmap.size_y)
        points = self._field.descend(cell(best, costmap), source, most_points)
        if points is None:
            return None
        poses = np.zeros((len(points), 3))
        poses[:, :2] = (costmap.origin_x, costmap.origin_y) + points[::-1] * costmap.resolution
        return end_at(poses, best)


def cell(pose: Pose2D, costmap: Costmap) -> int:
    """The number of NavFn's grid point nearest to a pose on the map.

    NOWHERE beyond the last column or row.
    """
    column = round_half_away((pose.x - costmap.origin_x) / costmap.resolution)
    row = round_half_away((pose.y - costmap.origin_y) / costmap.resolution)
    if column < costmap.size_x and row < costmap.size_y:
        return int(row * costmap.size_x + column)
    return NOWHERE


def clamped_cell(pose: Pose2D, costmap: Costmap) -> int:
    """As :func:`cell`, but the last column or row where the nearest grid point is beyond it."""
    column = round_half_away((pose.x - costmap.origin_x) / costmap.resolution)
    row = round_half_away((pose.y - costmap.origin_y) / costmap.resolution)
    return int(min(row, costmap.size_y - 1) * costmap.size_x + min(column, costmap.size_x - 1))


def end_at(poses: FloatArray, goal: Pose2D) -> FloatArray:
    """The path with the goal as its last pose (smoothApproachToGoal).

    In place of the last one if that lies beyond the goal or within 1 mm of it, else after it.
    """
    target = goal.as_array()
    if len(poses) >= 2:
        last = poses[-1, :2]
        before = poses[-2, :2]
        beyond = np.sum((last - before) ** 2) > np.sum((target[:2] - before) ** 2)
        if beyond or np.sum((last - target[:2]) ** 2) < 1e-6:
            poses[-1] = target
            return poses
    return np.vstack((poses, target))


SLACK = 8000.0  # of potential (8 m of free cells) that a path may cost more than the bound says
RETREAT = 2000.0  # of potential that the robot may go back before the bound is made anew


class GoalBound:
    """A lower bound of NavFn's cost from every cell to one goal.

    It is NavFn's potential spread from the goal over the costmap's floor, the costs that no
    obstacle lowers. Potentials spread from the two ends of a way differ a little (each leaves out
    the cost of its own first cell, and the interpolation is not symmetric); half of ``SLACK`` is
    kept for that.
    """

    def __init__(self, allow_unknown: bool) -> None:
        self._field = PotentialField(allow_unknown)
        # what the bound was made of; the same object as long as the map is the same
        self._floor: object = None
        self._goal = -1

    def forget(self) -> None:
        """Forget the goal, and give back the memory that its bound took."""
        self._floor = None
        self._field.forget()

    def towards(self, goal: int, robot: int, costmap: Costmap) -> tuple[Float32Array, float] | None:
        """The bound (height * width,) of the cost to cell ``goal``, and the limit from ``robot``.

        None where the costmap has no floor, or where not even the floor lets the robot reach the
        goal.
        """
        if costmap.floor is None:
            return None
        if costmap.floor is not self._floor or goal != self._goal:
            self._renew(goal, robot, costmap)
        remaining = self._field.flat[robot]
        if remaining + SLACK > self._complete_below:
            self._renew(goal, robot, costmap)
            remaining = self._field.flat[robot]
        if remaining + SLACK > self._complete_below:
            return None
        return self._field.flat, float(remaining) + SLACK

    def _renew(self, goal: int, robot: int, costmap: Costmap) -> None:
        assert costmap.floor is not None
        self._floor = costmap.floor
        self._goal = goal
        floor = Costmap(costmap.floor, costmap.resolution, costmap.origin_x, costmap.origin_y)
        self._complete_below = self._field.expand(floor, goal, robot, margin=SLACK + RETREAT)


def is_exact(potential: np.float32, limit: float) -> bool:
    """Whether a goal reached at ``potential`` by a wave within ``limit`` has the least cost."""
    return bool(potential <= limit - 0.5 * SLACK)

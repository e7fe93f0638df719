"""Sampling-based planning with the Open Motion Planning Library (OMPL), a plugin of our own."""

import math
from typing import Any

import numpy as np
import ompl.base as ob
import ompl.geometric as og
import ompl.util as ou

from navstack.costmap.costmap import Costmap
from navstack.errors import NoPathFoundError, StartOccupiedError
from navstack.params.planners import OmplParams
from navstack.planning.ompl_kernels import (
    blocked_table,
    is_free,
    is_line_free,
    nearest_free_cell,
    polyline_cost,
    shortcut,
)
from navstack.planning.placement import goal_occupied, occupied, require_on_map, single_pose
from navstack.planning.planner import Planner
from navstack.types import BoolArray, ByteArray, FloatArray, Path, Pose2D

ALGORITHMS = {
    "BITstar": og.BITstar,
    "InformedRRTstar": og.InformedRRTstar,
    "RRTConnect": og.RRTConnect,
    "RRTstar": og.RRTstar,
}
SHORTCUTS = 300  # tries; a 100 m path through streets no longer gets shorter after about 200
LARGEST_SEED = 2**31 - 1

ou.setLogLevel(ou.LOG_NONE)  # it writes to standard output otherwise


class _Validity(ob.StateValidityChecker):  # type: ignore[misc]
    """Whether a point of the map, in [cells], is free."""

    def __init__(self, information: Any, costs: ByteArray, blocked: BoolArray) -> None:
        super().__init__(information)
        self._costs, self._blocked = costs, blocked

    def isValid(self, state: Any) -> bool:  # noqa: N802 - OMPL's name
        """OMPL needs a Python bool."""
        return bool(is_free(self._costs, self._blocked, state[0], state[1]))


class _Motion(ob.MotionValidator):  # type: ignore[misc]
    """Whether a straight line of the map, in [cells], is free."""

    def __init__(self, information: Any, costs: ByteArray, blocked: BoolArray) -> None:
        super().__init__(information)
        self._costs, self._blocked = costs, blocked

    def checkMotion(self, start: Any, end: Any, *_: Any) -> bool:  # noqa: N802 - OMPL's name
        """OMPL needs a Python bool."""
        return bool(is_line_free(self._costs, self._blocked, start[0], start[1], end[0], end[1]))


class _Objective(ob.OptimizationObjective):  # type: ignore[misc]
    """Length in [cells], each piece weighted by its mean cost; see polyline_cost."""

    def __init__(self, information: Any, costs: ByteArray, cost_weight: float) -> None:
        super().__init__(information)
        self._costs, self._cost_weight = costs, cost_weight

    def stateCost(self, _: Any) -> Any:  # noqa: N802 - OMPL's name
        """Points cost nothing."""
        return ob.Cost(0.0)

    def motionCost(self, start: Any, end: Any) -> Any:  # noqa: N802 - OMPL's name
        """Weighted length of a straight line."""
        line = np.array(((start[0], start[1]), (end[0], end[1])))
        return ob.Cost(float(polyline_cost(self._costs, line, self._cost_weight)))


class OmplPlanner(Planner):
    """Plans for a point in the plane with one of OMPL's algorithms.

    A plan is repeatable: the effort is limited by a count, and every plan seeds OMPL anew from the generator that
    ``reset`` gave, so that it does not depend on what else the process has planned. An occupied start or goal is
    replaced by the nearest free cell.
    """

    def __init__(self, params: OmplParams) -> None:
        self._params = params
        self._rng = np.random.default_rng(0)  # until reset
        self._blocked = blocked_table(params.max_allowed_cost, params.allow_unknown)

    def reset(self, rng: np.random.Generator) -> None:
        """Draw from ``rng`` from here on."""
        self._rng = rng

    def plan(self, start: Pose2D, goal: Pose2D, costmap: Costmap, stamp: float = 0.0) -> Path:
        """A path from ``start`` to ``goal`` in steps of one cell, each pose looking along it, the last one as the goal.

        Raises:
            PlanningError: start or goal outside the map or in an obstacle, or no path within ``max_iterations``.
        """
        seed = int(self._rng.integers(1, LARGEST_SEED))
        draws = self._rng.random((SHORTCUTS, 2))
        require_on_map(start, goal, costmap)
        if (start.x, start.y) == (goal.x, goal.y):
            return Path(single_pose(start, goal, False), stamp)
        first, last = self._free_point(start, costmap), self._free_point(goal, costmap)
        if first is None:
            raise StartOccupiedError(occupied("start", start, costmap))
        if last is None:
            raise goal_occupied(goal, costmap)
        points = self._solve(first, last, costmap.data, self._params.range / costmap.resolution, seed)
        if points is None:
            raise NoPathFoundError(
                f"{self._params.algorithm}: no path from ({start.x:g}, {start.y:g}) m to ({goal.x:g}, {goal.y:g}) m "
                f"in {self._params.max_iterations} iterations; raise max_iterations or check for closed ways"
            )
        if self._params.simplify:
            points = shortcut(costmap.data, self._blocked, points, self._params.cost_weight, draws)
        if tuple(points[0]) != _to_cells(start, costmap):
            points = np.vstack((_to_cells(start, costmap), points))
        return Path(_poses(points, goal.yaw, costmap), stamp)

    def _free_point(self, pose: Pose2D, costmap: Costmap) -> tuple[float, float] | None:
        """The pose, or the centre of the nearest free cell within the tolerance, in [cells]."""
        x, y = _to_cells(pose, costmap)
        if is_free(costmap.data, self._blocked, x, y):
            return x, y
        radius = self._params.tolerance / costmap.resolution
        column, row = nearest_free_cell(costmap.data, self._blocked, int(x), int(y), radius)
        return (column + 0.5, row + 0.5) if column >= 0 else None

    def _solve(
        self, first: tuple[float, float], last: tuple[float, float], costs: ByteArray, reach: float, seed: int
    ) -> FloatArray | None:
        """Way points (N, 2) in [cells], or None; ``reach`` is the longest extension of the tree in [cells]."""
        ou.RNG.setSeed(seed)  # what OMPL creates from here on draws its own seed from this one
        information = _space_information(costs, self._blocked)
        problem = ob.ProblemDefinition(information)
        problem.setStartAndGoalStates(_state(information, first), _state(information, last))
        weight = self._params.cost_weight
        plain = weight == 0.0
        problem.setOptimizationObjective(
            ob.PathLengthOptimizationObjective(information) if plain else _Objective(information, costs, weight)
        )
        planner = ALGORITHMS[self._params.algorithm](information)
        if hasattr(planner, "setRange"):
            planner.setRange(reach)
        planner.setProblemDefinition(problem)
        planner.setup()
        planner.solve(ob.PlannerTerminationCondition(_Countdown(self._params.max_iterations)))
        if not problem.hasExactSolution():
            return None
        return np.array([(state[0], state[1]) for state in problem.getSolutionPath().getStates()])


class _Countdown:
    """True from the given number of calls on."""

    def __init__(self, calls: int) -> None:
        self._left = calls

    def __call__(self) -> bool:
        self._left -= 1
        return self._left < 0


def _space_information(costs: ByteArray, blocked: BoolArray) -> Any:
    """OMPL's description of the map: a plane of width x height cells, its free points and lines."""
    space = ob.RealVectorStateSpace(2)
    bounds = ob.RealVectorBounds(2)
    for axis, size in enumerate((costs.shape[1], costs.shape[0])):
        bounds.setLow(axis, 0.0)
        bounds.setHigh(axis, float(size))
    space.setBounds(bounds)
    information = ob.SpaceInformation(space)
    information.setStateValidityChecker(_Validity(information, costs, blocked))
    information.setMotionValidator(_Motion(information, costs, blocked))
    information.setup()
    return information


def _state(information: Any, point: tuple[float, float]) -> Any:
    state = information.allocState()
    state[0], state[1] = float(point[0]), float(point[1])
    return state


def _to_cells(pose: Pose2D, costmap: Costmap) -> tuple[float, float]:
    """A point in [cells] from the map's lower left corner."""
    return (pose.x - costmap.origin_x) / costmap.resolution, (pose.y - costmap.origin_y) / costmap.resolution


def _poses(points: FloatArray, goal_yaw: float, costmap: Costmap) -> FloatArray:
    """Poses (M, 3) along a polyline (N, 2) in [cells], at most one cell apart, each corner kept."""
    places = [points[:1]]
    for start, end in zip(points[:-1], points[1:], strict=True):
        steps = max(1, math.ceil(math.hypot(*(end - start))))
        places.append(start + (end - start) * (np.arange(1, steps + 1) / steps)[:, None])
    dense = np.vstack(places)
    poses = np.empty((len(dense), 3))
    poses[:, :2] = (costmap.origin_x, costmap.origin_y) + dense * costmap.resolution
    step = np.diff(poses[:, :2], axis=0)
    poses[:-1, 2] = np.arctan2(step[:, 1], step[:, 0])
    poses[-1, 2] = goal_yaw
    return poses

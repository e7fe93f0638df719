"""What OMPL is asked: a space of states, which states and ways are free, and what ways cost."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import ompl.base as ob

from navstack.errors import NoPathFoundError, PlanningError
from navstack.params.planners import OmplParams
from navstack.planning.dubins import curve, is_curve_free, stands_free
from navstack.planning.ompl_kernels import Room, are_connected, can_reach, is_edge_free
from navstack.planning.polyline_kernels import polyline_cost, weighted_length
from navstack.types import BoolArray, ByteArray, FloatArray, Pose2D

STEP = 1.0  # [cells] between the poses at which a footprint is tried along a curve


@dataclass(frozen=True, slots=True, eq=False)
class Query:
    """A start and a goal on a costmap; lengths in [cells] from the map's lower left corner."""

    costs: ByteArray  # (height, width)
    blocked: BoolArray  # (256,) whether a cost blocks the way
    room: Room
    footprint: FloatArray  # (N, 2) convex hull, for poses
    first: FloatArray  # (2,) point, or (3,) pose with yaw [rad]
    last: FloatArray
    cost_weight: float  # see polyline_cost
    turning_radius: float  # of the curves between poses

    @property
    def has_yaw(self) -> bool:
        """Whether states are poses, joined by Dubins curves; else points, joined by lines."""
        return len(self.first) == 3

    def can_stand(self, state: FloatArray) -> bool:
        """Whether the robot can be at a state."""
        if self.has_yaw:
            return bool(stands_free(self.costs, self.blocked, *self._body, state))
        return self.can_reach(state, state)

    def can_reach(self, start: FloatArray, end: FloatArray) -> bool:
        """Whether the way between states is free and the robot can turn at its end.

        At start and goal it need not.
        """
        if self.has_yaw:
            return self.can_drive(start, end)  # its end is one of the poses that are tried
        x = end[0]
        y = end[1]
        turning = self.room.turning
        if self._is_end(x, y):
            turning = 0.0
        return bool(
            can_reach(self.costs, self.blocked, self.room, turning, start[0], start[1], x, y)
        )

    def can_drive(self, start: FloatArray, end: FloatArray) -> bool:
        """Whether the way between two states that are free themselves is free."""
        if self.has_yaw:
            poses = curve(start, end, self.turning_radius, STEP)
            return bool(is_curve_free(self.costs, self.blocked, *self._body, poses))
        return bool(
            is_edge_free(self.costs, self.blocked, self.room, start[0], start[1], end[0], end[1])
        )

    def cost(self, points: FloatArray) -> float:
        """Of a polyline (N, >= 2), in [cells]."""
        return float(polyline_cost(self.costs, points, self.cost_weight))

    def way_cost(self, start: FloatArray, end: FloatArray) -> float:
        """Of the way between two states, in [cells]."""
        if self.has_yaw:
            return self.cost(self.way(start, end))
        return float(
            weighted_length(self.costs, self.cost_weight, start[0], start[1], end[0], end[1])
        )

    def way(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Points of the way between two states, (N, 2) or (N, 3)."""
        if self.has_yaw:
            return curve(start, end, self.turning_radius, STEP)
        return np.stack((start, end))

    @property
    def _body(self) -> tuple[FloatArray, float, bool]:
        return self.footprint, self.room.turning, self.room.allow_unknown

    def _is_end(self, x: float, y: float) -> bool:
        return any(bool(x == end[0] and y == end[1]) for end in (self.first, self.last))


class _Validity(ob.StateValidityChecker):  # type: ignore[misc]
    """Whether a state is free."""

    def __init__(self, information: Any, query: Query) -> None:
        super().__init__(information)
        self._query = query
        self._read = reader(query)

    def isValid(self, state: Any) -> bool:  # noqa: N802 - OMPL's name
        """OMPL needs a Python bool."""
        return self._query.can_stand(self._read(state))


class _Motion(ob.MotionValidator):  # type: ignore[misc]
    """Whether a way between states is free."""

    def __init__(self, information: Any, query: Query) -> None:
        super().__init__(information)
        self._query = query
        self._read = reader(query)

    def checkMotion(self, start: Any, end: Any, *_: Any) -> bool:  # noqa: N802 - OMPL's name
        """OMPL needs a Python bool. The start is free, for it is in a tree."""
        return self._query.can_reach(self._read(start), self._read(end))


class _Objective(ob.PathLengthOptimizationObjective):  # type: ignore[misc]
    """Length in [cells], each piece weighted by its mean cost.

    Never below the length, so informed sampling holds.
    """

    def __init__(self, information: Any, query: Query) -> None:
        super().__init__(information)
        self._query = query
        self._read = reader(query)
        self._distance = information.distance

    def motionCost(self, start: Any, end: Any) -> Any:  # noqa: N802 - OMPL's name
        """Weighted length of the way."""
        return ob.Cost(self._query.way_cost(self._read(start), self._read(end)))

    def motionCostHeuristic(self, start: Any, end: Any) -> Any:  # noqa: N802 - OMPL's name
        """Its length, a lower bound."""
        return ob.Cost(self._distance(start, end))


def make_problem(query: Query) -> tuple[Any, Any]:
    """OMPL's space information and problem definition."""
    bounds = ob.RealVectorBounds(2)
    for axis, size in enumerate((query.costs.shape[1], query.costs.shape[0])):
        bounds.setLow(axis, 0.0)
        bounds.setHigh(axis, float(size))
    space = ob.RealVectorStateSpace(2)
    if query.has_yaw:
        space = ob.DubinsStateSpace(query.turning_radius)
    space.setBounds(bounds)
    information = ob.SpaceInformation(space)
    information.setStateValidityChecker(_Validity(information, query))
    information.setMotionValidator(_Motion(information, query))
    information.setup()
    definition = ob.ProblemDefinition(information)
    first = _state(information, query.first)
    last = _state(information, query.last)
    definition.setStartAndGoalStates(first, last)
    if query.cost_weight == 0.0:
        objective = ob.PathLengthOptimizationObjective(information)
    else:
        objective = _Objective(information, query)
    definition.setOptimizationObjective(objective)
    return information, definition


def reader(query: Query) -> Any:
    """The function that turns one of OMPL's states into an array."""
    if query.has_yaw:
        return lambda state: np.array((state.getX(), state.getY(), state.getYaw()))
    return lambda state: (state[0], state[1])


def _state(information: Any, values: FloatArray) -> Any:
    state = information.allocState()
    if len(values) == 3:
        state.setX(float(values[0]))
        state.setY(float(values[1]))
        state.setYaw(float(values[2]))
    else:
        state[0] = float(values[0])
        state[1] = float(values[1])
    return state


def why_no_path(query: Query, params: OmplParams, start: Pose2D, goal: Pose2D) -> PlanningError:
    """Why there is no path."""
    for name, pose, state in (("start", start, query.first), ("goal", goal, query.last)):
        if not query.can_stand(state):
            return NoPathFoundError(
                f"{name} ({pose.x:g}, {pose.y:g}) m: the footprint reaches into an obstacle "
                "there, though its centre is free; choose another pose"
            )
    between = f"from ({start.x:g}, {start.y:g}) m to ({goal.x:g}, {goal.y:g}) m"
    if not are_connected(query.costs, query.blocked, *query.first[:2], *query.last[:2]):
        return NoPathFoundError(
            f"{params.algorithm}: no path {between}: obstacles part them; check for closed ways"
        )
    spent = f"{params.max_iterations} iterations"
    key = "max_iterations"
    if params.max_planning_time > 0.0:
        spent = f"{params.max_planning_time:g} s"
        key = "max_planning_time"
    return NoPathFoundError(
        f"{params.algorithm}: no path {between} within {spent}, "
        f"though free cells connect them; raise {key} or take another algorithm"
    )

"""The cost-to-go field of the present goal, and when it is made anew."""

import math
from collections.abc import Sequence

from navstack.control.expected_cost.clearance import Clearance
from navstack.control.expected_cost.field import (
    CostToGo,
    CostToGoField,
    cost_at,
    make_field,
    make_field_around,
    ways_of,
    within,
)
from navstack.control.expected_cost.flow import PeopleFlow
from navstack.control.plan_handling import require_poses
from navstack.costmap.costmap import Costmap
from navstack.params.expected_cost import ExpectedCostParams
from navstack.types import Path, Pose2D, RobotState, Track

_GOAL_MOVED = 0.3  # [m] from which on a plan's end is another goal
_SLACK = 2.0  # [m] by which a plan may always be longer than the field's way
_PATIENCE = 5.0  # [s] between two fields on account of a longer plan
_FLOW_PERIOD = 1.0  # [s] between two looks at people, as between two plans of Nav2's tree
_BEYOND = 6.0  # [m] by which a field of a second reaches farther than motions from its middle
_ROUNDING = 1e-9  # [s]


class GoalField:
    """The field that the robot follows, and that of the ways without people."""

    def __init__(self, params: ExpectedCostParams, world: Costmap, cost_to_go: CostToGo) -> None:
        """Have no goal.

        Args:
            params: of the controller.
            world: the global costmap, on which fields are made.
            cost_to_go: makes them.
        """
        self._params = params
        self._world = world
        self._cost_to_go = cost_to_go
        self.reset()

    def reset(self) -> None:
        """Forget the goal, and where people walked."""
        self._without_people: CostToGoField | None = None
        self._followed: CostToGoField | None = None
        self._goal = Pose2D()
        self._stamp = -math.inf  # [s] when it was made
        self._detour_since: float | None = None  # [s] since when the plan is much longer
        self._flow: PeopleFlow | None = None
        self._looked = -math.inf  # [s] when people were looked at

    @property
    def followed(self) -> CostToGoField:
        """The field along which motions lead; there was a plan."""
        assert self._followed is not None
        return self._followed

    def way_left(self, pose: Pose2D) -> float:
        """The way [m] to the goal without people; there was a plan."""
        assert self._without_people is not None
        return cost_at(self._without_people, pose.x, pose.y)

    def take(self, plan: Path, state: RobotState) -> bool:
        """Make the field of a new plan's goal, or of a world that has changed.

        Returns whether the way is another one, so that progress counts anew.

        Raises:
            InvalidPathError: the plan is empty.
        """
        require_poses(plan)
        goal = Pose2D(*plan.poses[-1].tolist())
        is_new = (
            self._without_people is None
            or math.hypot(goal.x - self._goal.x, goal.y - self._goal.y) > _GOAL_MOVED
        )
        corridor = self._params.corridor
        if not (is_new or corridor > 0.0 or self._is_out_of_date(plan, state)):
            return False
        world = self._world
        shown = world.data
        if is_new and world.floor is not None:
            shown = world.floor
        known = Costmap(shown, world.resolution, world.origin_x, world.origin_y)
        self._ways = ways_of(known, self._params.cell)
        if corridor > 0.0:
            self._ways = within(self._ways, plan, corridor)
        self._without_people = make_field(self._ways, goal, self._cost_to_go)
        self._followed = self._without_people
        self._goal = goal
        self._stamp = state.stamp
        self._detour_since = None
        self._looked = -math.inf
        return is_new or corridor == 0.0

    def _is_out_of_date(self, plan: Path, state: RobotState) -> bool:
        """Whether the plan is much longer than the field's way, which then seems blocked.

        The blockage may end. With a ``detour_patience`` of 1 the robot waits as long as the detour
        would delay it, and loses at most twice as much as by the better choice (rent or buy, Karlin
        et al. 1988, Algorithmica 3). With any patience a much shorter plan renews the field, too.
        """
        if state.stamp - self._stamp < _PATIENCE:
            return False
        given = self._params
        ratio = given.replan_length_ratio
        # [m] costly cells count as longer, so it is at least the way's length
        ahead = self.way_left(state.pose)
        if plan.length <= ratio * ahead + _SLACK:
            self._detour_since = None
            return given.detour_patience > 0.0 and ahead > ratio * plan.length + _SLACK
        if self._detour_since is None:
            self._detour_since = state.stamp
        longer = (plan.length - ahead) / given.max_speed  # [s] that the detour takes
        return state.stamp - self._detour_since >= given.detour_patience * longer

    def look(self, tracks: Sequence[Track], state: RobotState, clearance: Clearance) -> None:
        """Once a second, see where people walk, and make the field that is followed anew."""
        given = self._params
        if given.flow_weight == 0.0 or state.stamp - self._looked < _FLOW_PERIOD - _ROUNDING:
            return
        assert self._without_people is not None
        if self._flow is None or not self._flow.is_of(self._ways):
            self._flow = PeopleFlow(self._ways, given.flow_memory, given.range, given.max_speed)
        self._looked = state.stamp
        self._flow.look(tracks, state.pose, state.stamp, clearance, self._without_people)
        dearer = self._flow.lengthen(self._ways, given.flow_weight)
        farthest = given.steps * given.step * max(given.max_speed, given.max_reverse_speed)
        self._followed = make_field_around(
            dearer, self._goal, self._cost_to_go, state.pose, farthest + _BEYOND
        )

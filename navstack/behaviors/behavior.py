"""What every behavior does, after nav2_behaviors::TimedBehavior."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

from navstack.action_codes import Codes
from navstack.control.footprint_cost import footprint_cost
from navstack.costmap.costmap import LETHAL_OBSTACLE, Costmap
from navstack.errors import BehaviorError
from navstack.params.servers import BehaviorServerParams
from navstack.types import FloatArray, Pose2D, RobotState, Twist2D


@dataclass(frozen=True, slots=True, kw_only=True)
class BehaviorGoal:
    """What a behavior is asked to do; each has a goal of its own."""

    time_allowance: float = 0.0  # [s] after which it has failed; 0: never


GoalT = TypeVar("GoalT", bound=BehaviorGoal)


class Behavior(ABC, Generic[GoalT]):
    """One behavior.

    :meth:`start` it, then :meth:`step` it at the server's ``cycle_frequency`` until it is done.

    How far the robot has got is measured in the odom frame, which does not jump; what lies ahead is
    looked up in the local costmap, around the believed pose.
    """

    goal_type: ClassVar[type[BehaviorGoal]]
    codes: ClassVar[Codes]  # Nav2's numbers of its errors

    def __init__(self, server: BehaviorServerParams, footprint: FloatArray, params: Any) -> None:
        """Make the behavior.

        Args:
            server: what all behaviors share.
            footprint: the local costmap's padded one, (V, 2) in [m], base frame.
            params: the plugin's own; None: it has none.
        """
        self._server = server
        self._footprint = footprint
        self._params = params

    def start(self, goal: GoalT, state: RobotState) -> None:
        """Take a goal; whatever ran before is forgotten.

        Raises:
            BehaviorError: INVALID_INPUT.
        """
        self._deadline = math.inf  # [s]
        if goal.time_allowance > 0.0:
            self._deadline = state.stamp + goal.time_allowance
        self._begin(goal, state)

    def step(self, state: RobotState, costmap: Costmap) -> Twist2D | None:
        """The velocity of this cycle in the base frame; None: the goal is reached.

        Raises:
            BehaviorError: TIMEOUT or COLLISION_AHEAD.
        """
        if state.stamp > self._deadline:
            raise self._failure("TIMEOUT", "the goal was not reached within the time allowance")
        return self._cycle(state, costmap)

    @abstractmethod
    def _begin(self, goal: GoalT, state: RobotState) -> None:
        """Take the goal (``onRun``)."""

    @abstractmethod
    def _cycle(self, state: RobotState, costmap: Costmap) -> Twist2D | None:
        """The velocity of this cycle; None: done (``onCycleUpdate``)."""

    def _require_free(self, poses: Iterable[Pose2D], costmap: Costmap) -> None:
        """Fail where the footprint's outline meets an obstacle, unknown cells or the map's end.

        That is nav2_costmap_2d's CostmapTopicCollisionChecker.
        """
        for pose in poses:
            if footprint_cost(costmap, self._footprint, pose) >= LETHAL_OBSTACLE:
                place = f"({pose.x:.2f}, {pose.y:.2f}) m, {pose.yaw:.2f} rad"
                message = f"the robot would touch an obstacle at {place}"
                raise self._failure("COLLISION_AHEAD", message)

    def _times_ahead(self) -> list[float]:
        """When to look for collisions, in [s] from now."""
        count = int(self._server.cycle_frequency * self._server.simulate_ahead_time)
        return [k / self._server.cycle_frequency for k in range(count)]

    def _failure(self, code: str, message: str) -> BehaviorError:
        return BehaviorError(code, self.codes[code], message)

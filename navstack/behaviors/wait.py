"""Stands still for a while: nav2_behaviors::Wait (``wait.cpp``)."""

from dataclasses import dataclass

from navstack.action_codes import WAIT
from navstack.behaviors.behavior import Behavior, BehaviorGoal
from navstack.costmap.costmap import Costmap
from navstack.types import RobotState, Twist2D

_ROUNDING = 1e-9  # [s]


@dataclass(frozen=True, slots=True)
class WaitGoal(BehaviorGoal):
    """How long to wait."""

    duration: float  # [s]


class Wait(Behavior[WaitGoal]):
    """Waits."""

    goal_type = WaitGoal
    codes = WAIT

    def _begin(self, goal: WaitGoal, state: RobotState) -> None:
        self._end = state.stamp + goal.duration  # [s]

    def _cycle(self, state: RobotState, costmap: Costmap) -> Twist2D | None:
        if state.stamp < self._end - _ROUNDING:
            return Twist2D()
        return None

"""When a goal counts as reached: the goal checkers of nav2_controller."""

import math
from abc import ABC, abstractmethod

import numpy as np

from navstack.geometry import shortest_angular_distance
from navstack.params.checkers import (
    PositionGoalCheckerParams,
    SimpleGoalCheckerParams,
    StoppedGoalCheckerParams,
)
from navstack.types import FloatArray, Path, Pose2D, Twist2D


class GoalChecker(ABC):
    """Decides whether the robot has arrived."""

    _plan: FloatArray = np.empty((0, 3))  # poses of the plan, for what looks at more than the goal

    @abstractmethod
    def reset(self) -> None:
        """Forget everything about the previous goal."""

    def set_plan(self, plan: Path) -> None:
        """Take over a newer plan to the goal."""
        self._plan = plan.poses

    @abstractmethod
    def is_goal_reached(self, pose: Pose2D, goal: Pose2D, velocity: Twist2D) -> bool:
        """Whether the robot at ``pose`` has reached ``goal``.

        ``velocity`` is measured, base frame.
        """


class SimpleGoalChecker(GoalChecker):
    """Position and heading within tolerances (``simple_goal_checker.cpp``).

    Stateful: once the position was within its tolerance only the heading is checked, until
    :meth:`reset`.
    """

    def __init__(self, params: SimpleGoalCheckerParams) -> None:
        self._params = params
        self._must_check_position = True

    def reset(self) -> None:
        """Check the position again."""
        self._must_check_position = True

    def is_goal_reached(self, pose: Pose2D, goal: Pose2D, velocity: Twist2D) -> bool:
        """See the base class; the velocity does not matter."""
        if self._must_check_position:
            dx = pose.x - goal.x
            dy = pose.y - goal.y
            if dx * dx + dy * dy > self._params.xy_goal_tolerance**2:
                return False
            self._must_check_position = not self._params.stateful
        away = abs(shortest_angular_distance(pose.yaw, goal.yaw))  # [rad]
        if self._params.symmetric_yaw_tolerance:
            away = min(away, math.pi - away)
        return away <= self._params.yaw_goal_tolerance


class PositionGoalChecker(SimpleGoalChecker):
    """Position within its tolerance, whatever the heading (``position_goal_checker.cpp``)."""

    def __init__(self, params: PositionGoalCheckerParams) -> None:
        super().__init__(
            SimpleGoalCheckerParams(params.xy_goal_tolerance, math.pi, params.stateful)
        )


class StoppedGoalChecker(SimpleGoalChecker):
    """As :class:`SimpleGoalChecker`, and the robot stands (``stopped_goal_checker.cpp``)."""

    def __init__(self, params: StoppedGoalCheckerParams) -> None:
        super().__init__(params)
        self._trans_stopped_velocity = params.trans_stopped_velocity
        self._rot_stopped_velocity = params.rot_stopped_velocity

    def is_goal_reached(self, pose: Pose2D, goal: Pose2D, velocity: Twist2D) -> bool:
        """See the base class."""
        return (
            super().is_goal_reached(pose, goal, velocity)
            and abs(velocity.angular_z) <= self._rot_stopped_velocity
            and math.hypot(velocity.linear_x, velocity.linear_y) <= self._trans_stopped_velocity
        )

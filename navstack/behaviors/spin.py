"""Turns on the spot: nav2_behaviors::Spin (``spin.cpp``)."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from navstack.action_codes import SPIN
from navstack.behaviors.behavior import Behavior, BehaviorGoal
from navstack.costmap.costmap import Costmap
from navstack.geometry import shortest_angular_distance
from navstack.types import Pose2D, RobotState, Twist2D

_REACHED = 1e-6  # [rad] left to turn


@dataclass(frozen=True, slots=True)
class SpinGoal(BehaviorGoal):
    """How far to turn."""

    target_yaw: float  # [rad] from the present heading; positive: counter-clockwise


class Spin(Behavior[SpinGoal]):
    """Turns as fast as it can still brake, within the limits of the rotational velocity."""

    goal_type = SpinGoal
    codes = SPIN

    def _begin(self, goal: SpinGoal, state: RobotState) -> None:
        self._target_yaw = goal.target_yaw
        self._last_yaw = state.odom_pose.yaw
        self._turned = 0.0  # [rad] since the start

    def _cycle(self, state: RobotState, costmap: Costmap) -> Twist2D | None:
        self._turned += shortest_angular_distance(self._last_yaw, state.odom_pose.yaw)
        self._last_yaw = state.odom_pose.yaw
        remaining = abs(self._target_yaw) - abs(self._turned)
        if remaining < _REACHED:
            return None
        velocity = math.copysign(self._speed(remaining), self._target_yaw)
        self._require_free(self._ahead(state.pose, velocity), costmap)
        return Twist2D(angular_z=velocity)

    def _speed(self, remaining: float) -> float:
        """The speed from which ``rotational_acc_lim`` stops within ``remaining`` [rad]."""
        speed = math.sqrt(2.0 * self._server.rotational_acc_lim * remaining)
        return min(max(speed, self._server.min_rotational_vel), self._server.max_rotational_vel)

    def _ahead(self, pose: Pose2D, velocity: float) -> Iterator[Pose2D]:
        """Predicted poses, to be checked for collisions.

        As upstream, they cover the angle turned so far, not the angle left to turn. So the first
        command is not checked, and obstacles ahead are detected late.
        """
        for time in self._times_ahead():
            turn = velocity * time
            if abs(turn) >= abs(self._turned):
                return
            yield Pose2D(pose.x, pose.y, pose.yaw + turn)

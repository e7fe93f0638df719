"""Drives straight on or back: nav2_behaviors::DriveOnHeading and nav2_behaviors::BackUp."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from navstack.action_codes import BACK_UP, DRIVE_ON_HEADING
from navstack.behaviors.behavior import Behavior, BehaviorGoal
from navstack.costmap.costmap import Costmap
from navstack.params.servers import DriveParams
from navstack.types import Pose2D, RobotState, Twist2D


@dataclass(frozen=True, slots=True)
class DriveGoal(BehaviorGoal):
    """How far to drive along the present heading, and how fast; both negative: backwards."""

    target_x: float  # [m]
    speed: float  # [m/s]


@dataclass(frozen=True, slots=True)
class BackUpGoal(DriveGoal):
    """How far to back up, and how fast; the signs do not matter."""


class DriveOnHeading(Behavior[DriveGoal]):
    """Drives a distance in a straight line."""

    goal_type = DriveGoal
    codes = DRIVE_ON_HEADING
    _params: DriveParams

    def _begin(self, goal: DriveGoal, state: RobotState) -> None:
        if (goal.target_x > 0.0) != (goal.speed > 0.0):
            message = (
                f"the distance {goal.target_x:g} m and the speed {goal.speed:g} m/s differ in sign"
            )
            raise self._failure("INVALID_INPUT", message)
        self._goal = goal
        self._start = state.odom_pose
        self._last_speed = 0.0  # [m/s] commanded in the previous cycle

    def _cycle(self, state: RobotState, costmap: Costmap) -> Twist2D | None:
        driven = math.hypot(state.odom_pose.x - self._start.x, state.odom_pose.y - self._start.y)
        remaining = abs(self._goal.target_x) - driven
        if remaining <= 0.0:
            return None
        velocity = math.copysign(self._speed(remaining), self._goal.speed)
        self._require_free(self._ahead(state.pose, velocity, remaining), costmap)
        self._last_speed = abs(velocity)
        return Twist2D(linear_x=velocity)

    def _speed(self, remaining: float) -> float:
        """The commanded speed, within the limits and able to stop at the end of the way."""
        speed, params = abs(self._goal.speed), self._params
        if params.acceleration_limit != 0.0 and params.deceleration_limit != 0.0:
            step = 1.0 / self._server.cycle_frequency  # [s]
            slowest = self._last_speed + params.deceleration_limit * step
            fastest = self._last_speed + params.acceleration_limit * step
            can_stop = math.sqrt(-2.0 * params.deceleration_limit * remaining)
            speed = min(max(speed, slowest), fastest, can_stop)
        return max(speed, params.minimum_speed)

    def _ahead(self, pose: Pose2D, velocity: float, remaining: float) -> Iterator[Pose2D]:
        """Where the robot will be until it arrives."""
        for time in self._times_ahead():
            way = velocity * time
            if abs(way) >= remaining:
                return
            x = pose.x + way * math.cos(pose.yaw)
            y = pose.y + way * math.sin(pose.yaw)
            yield Pose2D(x, y, pose.yaw)


class BackUp(DriveOnHeading):
    """Drives backwards, whatever the signs of the goal."""

    goal_type = BackUpGoal
    codes = BACK_UP

    def _begin(self, goal: DriveGoal, state: RobotState) -> None:
        super()._begin(BackUpGoal(target_x=-abs(goal.target_x), speed=-abs(goal.speed)), state)

"""When a robot counts as stuck: the progress checkers of nav2_controller."""

import math
from abc import ABC, abstractmethod

from navstack.geometry import shortest_angular_distance
from navstack.params.checkers import PoseProgressCheckerParams, SimpleProgressCheckerParams
from navstack.types import Pose2D


class ProgressChecker(ABC):
    """Decides whether the robot still gets anywhere."""

    @abstractmethod
    def reset(self) -> None:
        """Start over; the next pose is the new reference."""

    @abstractmethod
    def check(self, pose: Pose2D, stamp: float) -> bool:
        """Whether the robot, at ``pose`` at time ``stamp`` [s], has not been stuck for too long."""


class NoProgressChecker(ProgressChecker):
    """Of a file that lists none: the robot is never stuck (``controller_server.cpp``)."""

    def reset(self) -> None:
        """Nothing to forget."""

    def check(self, pose: Pose2D, stamp: float) -> bool:
        """See the base class."""
        return True


class SimpleProgressChecker(ProgressChecker):
    """A least distance within a time allowance (``simple_progress_checker.cpp``)."""

    def __init__(self, params: SimpleProgressCheckerParams) -> None:
        self._params = params
        self._baseline: Pose2D | None = None
        self._baseline_stamp = 0.0  # [s]

    def reset(self) -> None:
        """Take the next pose as the reference."""
        self._baseline = None

    def check(self, pose: Pose2D, stamp: float) -> bool:
        """See the base class."""
        if self._baseline is None or self._has_moved(self._baseline, pose):
            self._baseline = pose
            self._baseline_stamp = stamp
            return True
        return stamp - self._baseline_stamp <= self._params.movement_time_allowance

    def _has_moved(self, since: Pose2D, pose: Pose2D) -> bool:
        """Whether the robot has come far enough since the reference."""
        return (
            math.hypot(pose.x - since.x, pose.y - since.y) > self._params.required_movement_radius
        )


class PoseProgressChecker(SimpleProgressChecker):
    """As :class:`SimpleProgressChecker`, but turning far enough is progress too.

    After ``pose_progress_checker.cpp``.
    """

    def __init__(self, params: PoseProgressCheckerParams) -> None:
        super().__init__(params)
        self._required_movement_angle = params.required_movement_angle

    def _has_moved(self, since: Pose2D, pose: Pose2D) -> bool:
        turned = abs(shortest_angular_distance(since.yaw, pose.yaw))
        return super()._has_moved(since, pose) or turned > self._required_movement_angle

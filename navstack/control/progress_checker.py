"""When a robot counts as stuck: the progress checkers of nav2_controller."""

import math
from abc import ABC, abstractmethod

from navstack.params.checkers import SimpleProgressCheckerParams
from navstack.types import Pose2D


class ProgressChecker(ABC):
    """Decides whether the robot still gets anywhere."""

    @abstractmethod
    def reset(self) -> None:
        """Start over; the next pose is the new reference."""

    @abstractmethod
    def check(self, pose: Pose2D, stamp: float) -> bool:
        """Whether the robot, at ``pose`` at time ``stamp`` [s], has not been stuck for too long."""


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
        if self._baseline is None or self._distance(self._baseline, pose) > self._params.required_movement_radius:
            self._baseline = pose
            self._baseline_stamp = stamp
            return True
        return stamp - self._baseline_stamp <= self._params.movement_time_allowance

    @staticmethod
    def _distance(one: Pose2D, other: Pose2D) -> float:
        return math.hypot(other.x - one.x, other.y - one.y)


PROGRESS_CHECKERS: dict[str, type[SimpleProgressChecker]] = {
    "nav2_controller::SimpleProgressChecker": SimpleProgressChecker,
}

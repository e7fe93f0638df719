"""The turn on the spot that two controllers of Nav2 share."""

import math
from typing import Protocol

from navstack.types import Twist2D


class TurnLimits(Protocol):
    """What parameters say of turns on the spot."""

    @property
    def rotate_to_heading_angular_vel(self) -> float:
        """[rad/s]."""

    @property
    def max_angular_accel(self) -> float:
        """[rad/s2]."""


def turn_by(error: float, yaw_rate: float, limits: TurnLimits, period: float) -> Twist2D:
    """The turn by ``error`` [rad] within the limits, slow enough to stop in time."""
    sign = -1.0
    if error > 0.0:
        sign = 1.0
    change = limits.max_angular_accel * period
    wanted = sign * limits.rotate_to_heading_angular_vel
    wanted = min(max(wanted, yaw_rate - change), yaw_rate + change)
    stoppable = math.sqrt(2.0 * limits.max_angular_accel * abs(error))
    if abs(wanted) > stoppable:
        wanted = sign * stoppable
    return Twist2D(angular_z=wanted)

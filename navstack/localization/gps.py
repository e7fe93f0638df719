"""The plainest localizer: the last fix, and the inertial unit's heading."""

import math

import numpy as np

from navstack.localization.localizer import Localizer, health_of
from navstack.types import Belief, Observation, Pose2D

DEGRADED_AFTER = 0.5  # [s] without a fix: at 2 m/s the belief is a metre behind
LOST_AFTER = 3.0  # [s] without a fix: no controller should drive on
_POSITION_STD = 2.0  # [m] of a fix that states none, as the GPS-EKF's default
_YAW_STD = math.radians(2.0)  # [rad] of an absolute heading whose message states none
# [rad2] variance of a heading that may be any (uniform over a turn)
_UNKNOWN_YAW = math.pi**2 / 3.0


class GpsLocalizer(Localizer):
    """Believes the last fix and the last absolute heading, with no dead reckoning in between.

    The belief therefore lags by up to one period of the receiver, e.g. 0.2 m at 2 m/s and 10 Hz.
    The covariance is the receiver's own on the position and the inertial unit's on the heading.
    Until the first fix (or heading) the initial belief stands in for it. Health is DEGRADED when
    the last fix is older than ``DEGRADED_AFTER`` and LOST when it is older than ``LOST_AFTER``;
    before the first fix the first update counts as one.

    It needs an inertial unit with an absolute heading. Where the messages have none (nan) the
    heading of the initial belief stays, with the variance of an unknown one, and health is DEGRADED
    at best.
    """

    def __init__(self) -> None:
        self._belief = Belief(Pose2D())
        self._fix_stamp: float | None = None
        self._has_heading = True

    def reset(self, belief: Belief, rng: np.random.Generator) -> None:
        """Start over; the initial belief holds until measurements replace it."""
        self._belief = belief
        self._fix_stamp = None
        self._has_heading = True

    def update(self, observation: Observation) -> Belief:
        """The newest fix and heading; a message that did not come leaves the last one standing."""
        x, y, yaw = self._belief.pose.x, self._belief.pose.y, self._belief.pose.yaw
        covariance = self._belief.covariance.copy()
        if self._fix_stamp is None:
            self._fix_stamp = observation.stamp
        if observation.gps is not None:
            x, y = observation.gps.x, observation.gps.y
            self._fix_stamp = observation.gps.stamp
            covariance[:2, :] = covariance[:, :2] = 0.0
            position_std = observation.gps.position_std or _POSITION_STD
            covariance[0, 0] = covariance[1, 1] = position_std**2
        if observation.imu is not None:
            self._has_heading = not math.isnan(observation.imu.yaw)
            covariance[2, :] = covariance[:, 2] = 0.0
            covariance[2, 2] = _UNKNOWN_YAW
            if self._has_heading:
                yaw = observation.imu.yaw
                covariance[2, 2] = (observation.imu.yaw_std or _YAW_STD) ** 2
        age = observation.stamp - self._fix_stamp  # [s] of the last fix
        health = health_of(age > LOST_AFTER, age > DEGRADED_AFTER or not self._has_heading)
        self._belief = Belief(Pose2D(x, y, yaw), covariance, health, observation.stamp)
        return self._belief

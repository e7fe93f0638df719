"""The plainest localizer: the last fix, and the inertial unit's heading."""

import math

import numpy as np

from navstack.localization.localizer import health_of, is_sound_fix
from navstack.localization.running_time import TimedLocalizer
from navstack.types import Belief, Observation, Pose2D

DEGRADED_AFTER = 0.5  # [s] without a fix: at 2 m/s the belief is a metre behind
LOST_AFTER = 3.0  # [s] without a fix: no controller should drive on
_POSITION_STD = 2.0  # [m] of a fix that states none, as the GPS-EKF's default
_YAW_STD = math.radians(2.0)  # [rad] of an absolute heading whose message states none
# [rad2] variance of a heading that may be any (uniform over a turn)
_UNKNOWN_YAW = math.pi**2 / 3.0


class GpsLocalizer(TimedLocalizer):
    """Believes the last fix and the last absolute heading, with no dead reckoning in between.

    The belief therefore lags by up to one period of the receiver, e.g. 0.2 m at 2 m/s and 10 Hz.
    The covariance is the receiver's own on the position and the inertial unit's on the heading.
    Until the first fix (or heading) the initial belief stands in for it. Health is DEGRADED when
    the last fix is older than ``DEGRADED_AFTER`` and LOST when it is older than ``LOST_AFTER``;
    before the first fix the first update counts as one. A fix that is no number is passed over.

    It needs an inertial unit with an absolute heading. Where the messages have none (nan) the
    heading of the initial belief stays, with the variance of an unknown one, and health is DEGRADED
    at best; so it is while the last heading is older than ``DEGRADED_AFTER``.
    """

    def __init__(self) -> None:
        self.reset(Belief(Pose2D()), np.random.default_rng(0))

    def _begin(self, belief: Belief, rng: np.random.Generator) -> None:
        """The initial belief holds until measurements replace it."""
        self._belief = belief
        self._fix_stamp: float | None = None
        self._heading_stamp = 0.0  # [s]

    def _take(self, observation: Observation) -> Belief:
        """The newest fix and heading; a message that did not come leaves the last one standing."""
        now, pose = observation.stamp, self._belief.pose
        covariance = self._belief.covariance.copy()
        if self._fix_stamp is None:
            self._fix_stamp = self._heading_stamp = now
        fix, imu = observation.gps, observation.imu
        if fix is not None and is_sound_fix(fix):
            pose = Pose2D(fix.x, fix.y, pose.yaw)
            self._fix_stamp = fix.stamp
            covariance[:2, :] = covariance[:, :2] = 0.0
            covariance[0, 0] = covariance[1, 1] = (fix.position_std or _POSITION_STD) ** 2
        if imu is not None:
            self._heading_stamp = -math.inf
            covariance[2, :] = covariance[:, 2] = 0.0
            covariance[2, 2] = _UNKNOWN_YAW
            if math.isfinite(imu.yaw):
                pose = Pose2D(pose.x, pose.y, imu.yaw)
                self._heading_stamp = imu.stamp
                covariance[2, 2] = (imu.yaw_std or _YAW_STD) ** 2
        age = now - self._fix_stamp  # [s] of the last fix
        has_heading = now - self._heading_stamp <= DEGRADED_AFTER
        health = health_of(age > LOST_AFTER, age > DEGRADED_AFTER or not has_heading)
        self._belief = Belief(pose, covariance, health, now)
        return self._belief

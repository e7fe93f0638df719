"""AMCL with GPS: scans are matched with the map, and fixes correct what drifts globally."""

import math
from collections import deque

import numpy as np

from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.geometry import compose, normalize_angle, relative_to
from navstack.localization.amcl import AmclLocalizer, pose_at
from navstack.localization.localizer import is_sound_fix
from navstack.params.amcl import AmclGpsParams, AmclParams
from navstack.types import Belief, FloatArray, GpsFix, Health, Imu, LaserScan, Observation, Pose2D

_WAITING = 10  # fixes that wait for a scan that counts


class AmclGpsLocalizer(AmclLocalizer):
    """AMCL of which every scan that counts brings the newest fix along.

    The fix weighs each particle by a t-distribution of its distance from where that particle was at
    the fix's time, by the odometry; so a late fix is as good as a prompt one, unless it is older
    than the odometry that is kept. Errors of fixes last (multipath), and a scan match does not
    suffer from a hundred copies of one error: a fix counts as the share of an independent one that
    the time since the last fix is of twice the correlation time, at most as one.

    Where ``patience`` fixes in a row disagree with the belief, and where AMCL is lost, a small
    share of the particles is drawn anew at every resampling until that is over: the scan picks them
    among many poses about the last fix and about the particles alike, so that they appear at the
    fix only where the scan fits there at least as well (sensor resetting, Lenser & Veloso 2000).
    Scans count then even where the robot stands. Random
    particles of AMCL's own recovery are drawn about the fix too. Without a fix of the last seconds
    there are none: another will come, and a scan fits in many places.

    Health is AMCL's, but DEGRADED at best while fixes and belief disagree.
    """

    def __init__(
        self, params: AmclParams, gps_params: AmclGpsParams, static_map: OccupancyGrid
    ) -> None:
        """Prepare the map.

        Raises:
            MapError: the map is rotated.
        """
        self._gps_params = gps_params
        super().__init__(params, static_map)

    def _begin(self, belief: Belief, rng: np.random.Generator) -> None:
        super()._begin(belief, rng)
        self._fixes: deque[GpsFix] = deque(maxlen=_WAITING)
        self._last_fix: GpsFix | None = None  # that has weighed the particles
        self._heading: Imu | None = None  # the newest absolute one
        self._disagreeing = 0  # fixes in a row

    def _take(self, observation: Observation) -> Belief:
        """Fixes and headings are kept for the next scan that counts."""
        fix, imu = observation.gps, observation.imu
        if imu is not None and math.isfinite(imu.yaw):
            self._heading = imu
        if fix is not None and is_sound_fix(fix):
            self._fixes.append(fix)
            if self._knows(fix.stamp):
                self._disagreeing += 1
                if self._agrees(fix):
                    self._disagreeing = 0
        return super()._take(observation)

    def _knows(self, stamp: float) -> bool:
        """Whether the odometry that is kept goes back to a time."""
        return bool(self._odometry) and stamp >= self._odometry[0].stamp

    def _weigh(self, scan: LaserScan, in_odom: Pose2D) -> None:
        super()._weigh(scan, in_odom)
        fix = self._take_newest()
        if fix is not None:
            self.particles.multiply(self._likelihoods(fix, self._places_at(fix, in_odom)))
            self._last_fix = fix

    def _take_newest(self) -> GpsFix | None:
        """The newest fix not yet used of a time of which the odometry is known.

        Older ones are dropped.
        """
        used = self._stamp_used
        usable = [
            fix
            for fix in self._fixes
            if self._knows(fix.stamp) and used < fix.stamp <= self._odometry[-1].stamp
        ]
        newest = max(usable, key=lambda fix: fix.stamp, default=None)
        if newest is not None:
            later = [fix for fix in self._fixes if fix.stamp > newest.stamp]
            self._fixes = deque(later, maxlen=_WAITING)
        return newest

    @property
    def _stamp_used(self) -> float:
        """The time [s] of the last fix that has weighed the particles."""
        if self._last_fix is None:
            return -math.inf
        return self._last_fix.stamp

    def _places_at(self, fix: GpsFix, in_odom: Pose2D) -> FloatArray:
        """Where the particles (N, 2), which stand for ``in_odom``, were at a fix's time."""
        way = relative_to(in_odom, pose_at(self._odometry, fix.stamp))
        return self.particles.poses[:, :2] + _turned(way, self.particles.poses[:, 2])

    def _std(self, fix: GpsFix) -> float:
        """Standard deviation [m] per axis that a fix is taken to have."""
        stated = max(fix.position_std, 0.0) or self._gps_params.position_std
        return max(stated, self._gps_params.position_std_floor)

    def _agrees(self, fix: GpsFix) -> bool:
        """Whether a fix may come from where the heaviest cluster was at its time."""
        believed = self._belief.pose
        if self._map_to_odom is not None:
            believed = compose(self._map_to_odom, pose_at(self._odometry, fix.stamp))
        away = np.array((fix.x - believed.x, fix.y - believed.y))
        covariance = self._heaviest.covariance[:2, :2] + np.eye(2) * self._std(fix) ** 2
        distance = math.sqrt(away @ np.linalg.solve(covariance, away))  # Mahalanobis
        return distance <= self._gps_params.rejection_threshold

    def _likelihoods(self, fix: GpsFix, places: FloatArray) -> FloatArray:
        """The likelihood (N,) of a fix from places (N, 2); of no particular scale.

        Density of the bivariate t-distribution, to the power of the share of an independent fix
        that this one is.
        """
        given = self._gps_params
        freedom = given.degrees_of_freedom
        squares = ((places - (fix.x, fix.y)) ** 2).sum(axis=1) / self._std(fix) ** 2
        age = fix.stamp - self._stamp_used
        share = min(age / (2.0 * given.correlation_time), 1.0)
        likelihoods: FloatArray = (1.0 + squares / freedom) ** (-share * (freedom + 2.0) / 2.0)
        return likelihoods

    def _resample(self, scan: LaserScan, in_odom: Pose2D) -> None:
        fix = self._last_fix
        if fix is None or not self._knows(fix.stamp):
            self.particles.resample(self._rng, None)
            return
        least_share = 0.0
        if self._in_doubt:
            least_share = self._gps_params.recovery_share
        self.particles.resample(
            self._rng,
            lambda count, rng: self._draw_about(fix, count, scan, in_odom, rng),
            least_share,
        )

    @property
    def _disagree(self) -> bool:
        return self._disagreeing >= self._gps_params.patience

    def _draw_about(
        self, fix: GpsFix, count: int, scan: LaserScan, in_odom: Pose2D, rng: np.random.Generator
    ) -> FloatArray:
        """Poses (count, 3) at ``in_odom`` that a scan fits best, about the fix or the particles.

        Both are moved closer to the scan alike. If only those about the fix were, they would fit
        better than the particles about the true pose, which the motion's noise scatters.
        """
        candidates = rng.standard_normal((self._gps_params.recovery_candidates, 3)) * self._std(fix)
        candidates[:, :2] += (fix.x, fix.y)
        candidates[:, 2] = self._headings(len(candidates), in_odom, rng)
        way = relative_to(in_odom, pose_at(self._odometry, fix.stamp))
        candidates[:, :2] -= _turned(way, candidates[:, 2])
        poses, fits = self._guide.refine(candidates, scan, rng)
        own_poses, own_fits = self._guide.refine(self.particles.poses, scan, rng)
        order = np.argsort(-np.concatenate((own_fits, fits)), kind="stable")
        best = np.concatenate((own_poses, poses))[order]
        return best[np.arange(count) % len(best)]

    def _headings(self, count: int, in_odom: Pose2D, rng: np.random.Generator) -> FloatArray:
        """Yaws (count,) [rad] at ``in_odom``.

        Every second about the inertial unit's, which may be off; else any.
        """
        yaws: FloatArray = rng.uniform(-math.pi, math.pi, count)
        imu = self._heading
        if imu is not None and self._knows(imu.stamp):
            turned = in_odom.yaw - pose_at(self._odometry, imu.stamp).yaw
            std = max(imu.yaw_std, self._gps_params.heading_std_floor)
            errors = std * rng.standard_normal(len(yaws[::2]))
            yaws[::2] = normalize_angle(imu.yaw + turned) + errors
        return yaws

    @property
    def _in_doubt(self) -> bool:
        return self._disagree or self._belief.health is Health.LOST

    def _health(self) -> Health:
        health = super()._health()
        if self._disagree and health is Health.TRACKING:
            health = Health.DEGRADED
        return health


def _turned(way: Pose2D, yaws: FloatArray) -> FloatArray:
    """The way's x and y (N, 2) [m] in the map frame, for robots with yaws (N,)."""
    cos, sin = np.cos(yaws), np.sin(yaws)
    return np.column_stack((cos * way.x - sin * way.y, sin * way.x + cos * way.y))

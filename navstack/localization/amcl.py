"""Adaptive Monte Carlo localization, after nav2_amcl of Jazzy."""

import math
from collections import deque
from dataclasses import replace

import numpy as np

from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.geometry import compose, normalize_angle, relative_to, transform_points
from navstack.localization.amcl_recovery import ScanGuide
from navstack.localization.amcl_sensor_models import SENSOR_MODELS
from navstack.localization.free_space import FreeSpace
from navstack.localization.likelihood_field import LikelihoodField
from navstack.localization.localizer import health_of, initial_covariance, worst
from navstack.localization.motion_model import motion_model_of
from navstack.localization.particle_filter import Cluster, ParticleFilter
from navstack.localization.running_time import TimedLocalizer
from navstack.params.amcl import AmclParams
from navstack.types import Belief, FloatArray, Health, LaserScan, Observation, Odometry, Pose2D

# [m2, m2, rad2] of a start that comes without; Nav2's 0.5 m and 15 degrees
INITIAL_VARIANCES = (0.25, 0.25, 0.0685)

EXPLAINED_WITHIN = 0.5  # [m] of an obstacle on the map: a return there is explained
DEGRADED_BELOW, LOST_BELOW = 0.5, 0.25  # [-] share of explained returns
# [m] standard deviation of the heaviest cluster along the worst direction
DEGRADED_ABOVE, LOST_ABOVE = 0.5, 2.0
DEGRADED_UNDER, LOST_UNDER = 0.9, 0.5  # [-] weight of that cluster; the rest are elsewhere
FEWEST_RETURNS = 10  # of a scan that can tell anything

LOOK_AGAIN = 0.5  # [s] after which a robot in doubt looks again, even where it stands

# [s] for which nothing comes: Nav2's transform_tolerance of AMCL, after which its controllers stop;
# where none should drive on
DEGRADED_AFTER, LOST_AFTER = 1.0, 3.0

_WAITING = 10  # scans that wait for the odometry of their time, as nav2_amcl's message filter keeps
_KEPT = 5.0  # [s] of odometry messages


class AmclLocalizer(TimedLocalizer):
    """Matches scans with a map by a cloud of particles.

    Between matches the belief moves with the odometry.

    A scan counts when the robot has moved by ``update_min_d`` or ``update_min_a`` since the last
    one that did. The particles move by the odometry, are weighed by the scan and, after every
    ``resample_interval`` scans that counted, drawn anew; then the heaviest cluster's mean becomes
    the pose of the robot at the scan's time and the covariance of all particles that of the belief.
    What lies between is the map -> odom transform that Nav2 broadcasts.

    With ``recovery_candidates``, a robot that is lost looks again every ``LOOK_AGAIN`` even where
    its wheels stand: it may have been carried or pushed. Nav2 does so on request only
    (``request_nomotion_update``).

    Health is LOST where the heaviest cluster has less than ``LOST_UNDER`` of the weight, or its
    position a standard deviation above ``LOST_ABOVE``, or less than ``LOST_BELOW`` of the scan's
    returns end within ``EXPLAINED_WITHIN`` of an obstacle on the map, seen from the believed pose;
    DEGRADED likewise. A scan with fewer than ``FEWEST_RETURNS`` returns leaves that share as it
    was. It is LOST, too, where the last odometry is older than ``LOST_AFTER``, or the robot has
    moved as far as makes a scan count and the last usable scan is so old. DEGRADED likewise. A scan
    that is older than all odometry that is kept is not usable.
    """

    def __init__(self, params: AmclParams, static_map: OccupancyGrid) -> None:
        """Prepare the map.

        Raises:
            MapError: the map is rotated.
        """
        self._params = params
        self._field = LikelihoodField.of_map(static_map, params.laser_likelihood_max_dist)
        self._sensor_model = SENSOR_MODELS[params.laser_model_type](params, static_map, self._field)
        self._move = motion_model_of(params)
        self._free_space = FreeSpace(static_map, params.freespace_downsampling)
        self._guide = ScanGuide(
            self._free_space, self._field, self._sensor_model, params.recovery_candidates
        )
        self.particles = ParticleFilter(params, self._free_space)
        self.reset(Belief(Pose2D()), np.random.default_rng(0))

    def _begin(self, belief: Belief, rng: np.random.Generator) -> None:
        """Spread the particles about the belief.

        One without covariance gets ``INITIAL_VARIANCES``.
        """
        self._rng = rng
        if self._params.random_seed >= 0:
            self._rng = np.random.default_rng(self._params.random_seed)
        covariance = initial_covariance(belief, INITIAL_VARIANCES)
        self.particles.spread_normal(belief.pose, covariance, self._rng)
        self._map_to_odom: Pose2D | None = None
        self._odometry: deque[Odometry] = deque()
        self._scans: deque[LaserScan] = deque(maxlen=_WAITING)
        self._belief = Belief(belief.pose, covariance, stamp=belief.stamp)
        self._heaviest = Cluster(1.0, belief.pose, covariance)  # that gave the belief
        # [s] and in the odom frame: the last usable scan's; before it the first odometry's
        self._seen_stamp, self._seen_from = math.nan, Pose2D()
        self._forget_scans()

    def localize_globally(self) -> None:
        """Spread the particles over all that is free on the map, as Nav2's service does."""
        self.particles.spread_uniform(self._rng)
        self._forget_scans()

    def _forget_scans(self) -> None:
        """The next scan counts however little the robot moves, and gives a belief at once."""
        self._last_pose: Pose2D | None = None  # in the odom frame, when a scan counted last
        self._last_stamp = 0.0  # [s] of that scan
        self._counted = 0
        self._explained = 1.0

    def _take(self, observation: Observation) -> Belief:
        """See the class; a scan waits until odometry of its time or later has come."""
        if math.isnan(self._seen_stamp):
            self._seen_stamp = observation.stamp
        if observation.odometry is not None:
            if not self._odometry:
                self._seen_from = observation.odometry.pose
            self._odometry.append(observation.odometry)
            while self._odometry[0].stamp < observation.odometry.stamp - _KEPT:
                self._odometry.popleft()
        # of one without a range Nav2 says that it is malformed
        if observation.scan is not None and observation.scan.range_max > 0.0:
            self._scans.append(observation.scan)
        while self._scans and self._odometry and self._scans[0].stamp <= self._odometry[-1].stamp:
            scan = self._scans.popleft()
            if scan.stamp >= self._odometry[0].stamp - DEGRADED_AFTER:
                self._take_in(scan, pose_at(self._odometry, scan.stamp))
        self._belief = replace(self._belief, pose=self._pose_now(), stamp=observation.stamp)
        health = worst(self._belief.health, self._health_of_inputs(observation.stamp))
        if health is self._belief.health:
            return self._belief
        return replace(self._belief, health=health)

    def _health_of_inputs(self, now: float) -> Health:
        """What the age of odometry and scans means at a time [s]."""
        age = now - self._seen_stamp
        if self._odometry and not self._has_moved(self._seen_from, self._odometry[-1].pose):
            age = now - self._odometry[-1].stamp
        return health_of(age > LOST_AFTER, age > DEGRADED_AFTER)

    def _pose_now(self) -> Pose2D:
        if not self._odometry:
            return self._belief.pose
        in_odom = self._odometry[-1].pose
        if self._map_to_odom is None:
            self._map_to_odom = _frame_of(self._belief.pose, in_odom)
        return compose(self._map_to_odom, in_odom)

    def _take_in(self, scan: LaserScan, in_odom: Pose2D) -> None:
        """Match a scan that was taken at a pose of the odom frame, if it counts."""
        self._seen_stamp, self._seen_from = scan.stamp, in_odom
        is_due = self._in_doubt and scan.stamp - self._last_stamp >= LOOK_AGAIN
        last, is_first = self._last_pose, self._last_pose is None
        if last is not None and not is_due and not self._has_moved(last, in_odom):
            return
        if last is not None:
            draws = self._rng.standard_normal(self.particles.poses.shape)
            self._move(self.particles.poses, last, in_odom, draws)
        estimate = None
        if is_first:  # Nav2 publishes the start as it was spread
            estimate = self._estimate()
        self._last_pose, self._last_stamp = in_odom, scan.stamp
        self._weigh(scan, in_odom)
        self._counted += 1
        if self._counted % self._params.resample_interval == 0:
            self._resample(scan, in_odom)
            estimate = self._estimate()
        if estimate is not None:
            self._correct(*estimate, scan, in_odom)

    def _weigh(self, scan: LaserScan, in_odom: Pose2D) -> None:
        """Weigh the particles, which stand where the robot was at ``in_odom``, by measurements."""
        match = self._sensor_model.match(self.particles.poses, scan, self.particles.has_converged)
        self.particles.weigh(match.likelihoods, match.best)

    def _resample(self, scan: LaserScan, in_odom: Pose2D) -> None:
        """Draw the particles anew; ``in_odom`` as for :meth:`_weigh`."""
        self.particles.resample(self._rng, lambda count, rng: self._draw_strays(count, scan, rng))

    def _draw_strays(self, count: int, scan: LaserScan, rng: np.random.Generator) -> FloatArray:
        """Poses (count, 3) anywhere on the map, for the random particles of the recovery."""
        if self._params.recovery_candidates > 0:
            return self._guide.draw(count, scan, rng)
        return self._free_space.draw(count, rng)

    @property
    def _in_doubt(self) -> bool:
        """Whether scans count although the robot stands."""
        return self._params.recovery_candidates > 0 and self._belief.health is Health.LOST

    def _has_moved(self, last: Pose2D, now: Pose2D) -> bool:
        """Whether it is as far from one pose of the odom frame to another as makes scans count."""
        given = self._params
        far = max(abs(now.x - last.x), abs(now.y - last.y)) > given.update_min_d
        return far or abs(normalize_angle(now.yaw - last.yaw)) > given.update_min_a

    def _estimate(self) -> tuple[Cluster, FloatArray]:
        """The heaviest cluster, and the covariance of all particles."""
        heaviest = max(self.particles.clusters(), key=lambda cluster: cluster.weight)
        return heaviest, self.particles.overall().covariance

    def _correct(
        self, cluster: Cluster, covariance: FloatArray, scan: LaserScan, in_odom: Pose2D
    ) -> None:
        """Believe that the robot was where the cluster is when the scan was taken."""
        pose, self._heaviest = cluster.pose, cluster
        self._map_to_odom = _frame_of(pose, in_odom)
        ends = self._sensor_model.beams(scan).ends()
        if len(ends) >= FEWEST_RETURNS:
            distances = self._field.at(transform_points(pose, ends))
            self._explained = float((distances <= EXPLAINED_WITHIN).mean())
        self._belief = Belief(pose, covariance, self._health(), scan.stamp)

    def _health(self) -> Health:
        """What the heaviest cluster and the share of explained returns mean."""
        weight, covariance = self._heaviest.weight, self._heaviest.covariance[:2, :2]
        deviation = math.sqrt(max(float(np.linalg.eigvalsh(covariance)[-1]), 0.0))
        explained = self._explained
        return health_of(
            deviation > LOST_ABOVE or weight < LOST_UNDER or explained < LOST_BELOW,
            deviation > DEGRADED_ABOVE or weight < DEGRADED_UNDER or explained < DEGRADED_BELOW,
        )


def pose_at(odometry: deque[Odometry], stamp: float) -> Pose2D:
    """The pose in the odom frame at a time, between the two messages around it.

    The oldest one before all of them.
    """
    after = odometry[-1]
    for before in reversed(odometry):
        if before.stamp <= stamp:
            share = 0.0
            if after.stamp > before.stamp:
                share = (stamp - before.stamp) / (after.stamp - before.stamp)
            way = relative_to(before.pose, after.pose)
            return compose(before.pose, Pose2D(share * way.x, share * way.y, share * way.yaw))
        after = before
    return after.pose


def _frame_of(pose: Pose2D, in_frame: Pose2D) -> Pose2D:
    """The frame in which something at ``pose`` stands at ``in_frame``."""
    return compose(pose, relative_to(in_frame, Pose2D()))

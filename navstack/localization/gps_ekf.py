"""GPS-EKF: wheels, inertial unit, receiver and scans fused by an extended Kalman filter."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.geometry import largest_variance, normalize_angle
from navstack.localization.filterpy_engine import filterpy_engine
from navstack.localization.gps_ekf_filter import COMPILED, Engine, FilterState, GpsEkfFilter
from navstack.localization.gps_ekf_history import Apply, History
from navstack.localization.gps_ekf_kernels import GPS_X, GPS_Y, OFFSET, SIZE, SPEED, YAW, X, Y
from navstack.localization.heading_alignment import Alignment, HeadingAlignment
from navstack.localization.localizer import health_of, initial_covariance, is_sound_fix
from navstack.localization.running_time import TimedLocalizer
from navstack.params.gps_ekf import GpsEkfParams
from navstack.scan_matching.scan_aligner import ScanAligner
from navstack.types import (
    Belief,
    FloatArray,
    GpsFix,
    Health,
    Imu,
    LaserScan,
    Observation,
    Odometry,
    Pose2D,
)

# [m2, m2, rad2] of a start that comes without: set down on a mark. A wrong one ends in a lock-out,
# and so in a search for the heading
INITIAL_VARIANCES = (0.1**2, 0.1**2, 0.05**2)
# [rad] standard deviation of a heading from which an extended Kalman filter can start
KNOWN_BELOW = 0.35
ALIGNED_BELOW = 0.2  # [rad] that an alignment must reach
DOUBTED_STD = 0.5  # [rad] that is reported of a heading after a lock-out
UNKNOWN_YAW_VARIANCE = math.pi**2 / 3.0  # [rad2] of a heading that may be any
# order of messages of one stamp: the gyro says how the robot came there
_IMU, _ODOMETRY, _FIX, _SCAN = range(4)
# [m] of way after which a scan counts, for the errors of two scans of one place are alike; and of
# the position's standard deviation from which on any scan does
SCAN_STEP, SCAN_UNSURE = 0.3, 0.1
SEEN_WITHIN = 1.0  # [s] before a fix that disagrees, in which a scan fitted the map


_ENGINES: dict[str, Callable[[], Engine]] = {
    "kernel": lambda: COMPILED,
    "filterpy": filterpy_engine,
}


class GpsEkfLocalizer(TimedLocalizer):
    """Extended Kalman filter over wheel odometry, inertial unit and fixes.

    Messages count at their own stamps: one that comes late is put where it belongs and what
    followed is applied anew. One that is older than ``history_length`` is passed over. A fix that
    is too far off to be true is refused; when too many in succession are, the filter doubts itself
    instead and starts over. While the heading is unknown (to more than ``KNOWN_BELOW``) or doubted
    the position is that of the last fix and the heading is searched for by
    :class:`HeadingAlignment`; meanwhile the orientation of an inertial unit that states one is
    believed, or the heading that is doubted.

    With ``scan0_alignment`` scans correct the pose once the heading is known: see
    :class:`ScanAligner`.

    Health is LOST where the position has a standard deviation above ``lost_above`` or no fix was
    accepted for ``lost_after``; DEGRADED likewise, and while the heading is unknown.
    """

    def __init__(
        self,
        params: GpsEkfParams,
        static_map: OccupancyGrid | None = None,
        uses_fixes: bool = True,
    ) -> None:
        """Make the filter.

        Args:
            params: its parameters.
            static_map: what scans are aligned with; None: they are not.
            uses_fixes: whether it takes fixes.

        Raises:
            MapError: the map is rotated, and scans are aligned with it.
        """
        self._params = params
        self._aligner: ScanAligner | None = None
        if params.scan0_alignment and static_map is not None:
            self._aligner = ScanAligner(static_map)
        self._filter = GpsEkfFilter(params, _ENGINES[params.engine](), uses_fixes)
        self._uses_fixes = uses_fixes
        self.reset(Belief(Pose2D()), np.random.default_rng(0))

    def _begin(self, belief: Belief, rng: np.random.Generator) -> None:
        """Start over; a belief without covariance gets ``INITIAL_VARIANCES``.

        Nothing is left to chance.
        """
        covariance = initial_covariance(belief, INITIAL_VARIANCES)
        self._initial = Belief(belief.pose, covariance)
        self._history: History | None = None
        self._alignment: HeadingAlignment | None = None  # None: the heading is known
        if self._uses_fixes and covariance[2, 2] > KNOWN_BELOW**2:
            self._alignment = self._search()
        self._knows_offset = not self._uses_fixes or self._params.imu0_yaw_offset_std < KNOWN_BELOW
        self._needs_reference, self._filter.reference_yaw = self._params.imu0_relative, 0.0
        self._is_doubted = False  # whether the heading is searched for once more
        # [rad, rad] the last absolute heading less the reckoned one, and its standard deviation
        self._orientation: tuple[float, float] | None = None
        # while the heading is unknown; with the distance driven
        self._last_fix: tuple[GpsFix, float] | None = None
        self._last_scan = -math.inf  # [m] of way at the last scan that counted
        self._last_fit = -math.inf  # [s] of the last scan that fitted the map

    @property
    def state(self) -> FilterState:
        """The filter's state after the newest message; not to be changed."""
        assert self._history is not None, "no observation yet"
        return self._history.latest

    @property
    def knows_heading(self) -> bool:
        """Whether the heading is known well enough to be filtered."""
        return self._alignment is None

    def _take(self, observation: Observation) -> Belief:
        """See the class; messages with anything that is not a number are passed over."""
        odometry, imu, fix = observation.odometry, observation.imu, observation.gps
        if self._history is None:
            stamps = [message.stamp for message in (odometry, imu, fix) if message is not None]
            self._open_history(min([observation.stamp, *stamps]))
        if imu is not None and _is_sound_imu(imu):
            self._take_imu(imu)
        if odometry is not None and _is_sound_odometry(odometry):
            self._insert(odometry, _ODOMETRY, partial(self._filter.take_odometry, message=odometry))
        if fix is not None and self._uses_fixes and is_sound_fix(fix):
            self._take_fix(fix)
        if observation.scan is not None and self._aligner is not None:
            self._take_scan(observation.scan, self._aligner)
        return self._belief_at(observation.stamp)

    def _open_history(self, stamp: float) -> None:
        start = self._filter.start(self._initial.pose.as_array(), self._initial.covariance, stamp)
        start.accepted_stamp = stamp
        self._history = History(self._params.history_length, start)

    def _insert(
        self, message: Odometry | Imu | GpsFix | LaserScan, rank: int, apply: Apply
    ) -> FilterState | None:
        assert self._history is not None
        return self._history.insert(message.stamp, rank, apply)

    def _take_imu(self, imu: Imu) -> None:
        if self._needs_reference and math.isfinite(imu.yaw):
            self._needs_reference = False
            self._filter.reference_yaw = self._initial.pose.yaw - self._filter.absolute_yaw(imu)
        with_yaw = self._alignment is None or self._knows_offset
        apply = partial(self._filter.take_imu, message=imu, with_yaw=with_yaw)
        state = self._insert(imu, _IMU, apply)
        if self._alignment is None or state is None or not math.isfinite(imu.yaw):
            return
        offset = self._filter.absolute_yaw(imu) - state.mean.item(YAW)
        self._orientation = (offset, imu.yaw_std or self._params.imu0_yaw_std)
        if self.state.covariance[YAW, YAW] < KNOWN_BELOW**2:
            self._alignment = self._last_fix = None

    def _take_fix(self, fix: GpsFix) -> None:
        if self._alignment is None:
            self._insert(fix, _FIX, partial(self._filter.take_fix, message=fix))
            # what scans find on the map is no worse for fixes that err for long between houses
            is_seen = fix.stamp - self._last_fit <= SEEN_WITHIN
            if self._filter.is_locked_out(self.state) and not is_seen:
                self._doubt(fix)
            return
        state = self._insert(fix, _FIX, partial(self._filter.mark_fix, message=fix))
        if state is None:
            return
        self._last_fix = (fix, state.distance)
        reckoned = Pose2D(state.mean.item(X), state.mean.item(Y))
        self._alignment.add(reckoned, fix, self._variance_of(fix))
        found = self._alignment.solve(ALIGNED_BELOW)
        if found is not None:
            self._align(found, fix.stamp)

    def _take_scan(self, scan: LaserScan, aligner: ScanAligner) -> None:
        """Correct the pose by a scan, where it counts and fits the map.

        Where a lock-out is near every scan is looked at, whether it counts or not.
        """
        now = self.state
        is_near = now.distance - self._last_scan < SCAN_STEP
        is_sure = largest_variance(now.covariance) < SCAN_UNSURE**2
        counts = not (is_near and is_sure)
        is_disputed = self._filter.is_locked_out(now, SEEN_WITHIN)
        if self._alignment is not None or not (counts or is_disputed):
            return
        state = self._insert(scan, _SCAN, partial(self._filter.advance, stamp=scan.stamp))
        if state is None:
            return
        x, y, yaw = state.mean[:3].tolist()
        place = Pose2D(x, y, normalize_angle(yaw))
        found = aligner.align(aligner.returns(scan), place, state.covariance[:3, :3])
        if found is None:
            return
        self._last_fit = scan.stamp
        if counts:
            self._last_scan = state.distance
            take = partial(self._filter.take_alignment, message=found, stamp=scan.stamp)
            self._insert(scan, _SCAN, take)

    def _doubt(self, fix: GpsFix) -> None:
        """Believe a fix, keep what is known of wheels and gyro, and search for the heading."""
        state = self.state.copy()
        covariance, variance = state.covariance, self._variance_of(fix)
        for index in (X, Y, YAW, OFFSET, GPS_X, GPS_Y):
            covariance[index, :] = covariance[:, index] = 0.0
        state.mean[X], state.mean[Y], state.mean[GPS_X], state.mean[GPS_Y] = fix.x, fix.y, 0.0, 0.0
        covariance[X, X] = covariance[Y, Y] = variance
        covariance[YAW, YAW] = covariance[OFFSET, OFFSET] = UNKNOWN_YAW_VARIANCE
        state.rejected = 0
        self._history = History(self._params.history_length, state)
        self._alignment = self._search()
        self._is_doubted = True
        self._knows_offset = False

    def _search(self) -> HeadingAlignment:
        params = self._params
        return HeadingAlignment(params.gps0_correlated_share, params.gps0_correlation_time)

    def _variance_of(self, fix: GpsFix) -> float:
        return (fix.position_std or self._params.gps0_position_std) ** 2

    def _align(self, found: Alignment, fix_stamp: float) -> None:
        """Turn the dead-reckoned state into the map; what was before is forgotten."""
        state = self.state.copy()
        mean, kept = state.mean, state.covariance[SPEED:OFFSET, SPEED:OFFSET].copy()
        mean[X], mean[Y] = found.place(mean.item(X), mean.item(Y))
        mean[YAW] = normalize_angle(mean.item(YAW) + found.turn)
        mean[GPS_X] = mean[GPS_Y] = 0.0
        state.covariance = covariance = np.zeros((SIZE, SIZE))
        covariance[SPEED:OFFSET, SPEED:OFFSET] = kept
        # of the turn
        lever = np.array((found.center_there[1] - mean[Y], mean[X] - found.center_there[0], 1.0))
        covariance[:3, :3] = found.turn_variance * np.outer(lever, lever)
        for i, (axis, shared_axis) in enumerate(((X, GPS_X), (Y, GPS_Y))):
            covariance[axis, axis] += found.position_variance
            covariance[shared_axis, shared_axis] = found.shared_variance
            covariance[:3, shared_axis] = -lever * found.shared_with_turn[i]
            covariance[axis, shared_axis] -= found.shared_with_position
            covariance[shared_axis, :3] = covariance[:3, shared_axis]
        self._align_offset(state, found, lever)
        state.fix_stamp = state.accepted_stamp = fix_stamp
        self._history = History(self._params.history_length, state)
        self._alignment = self._last_fix = None

    def _align_offset(self, state: FilterState, found: Alignment, lever: FloatArray) -> None:
        """The absolute orientation's offset is what is left of it.

        Whatever errs in the heading errs in it, too.
        """
        covariance = state.covariance
        if self._orientation is None:
            state.mean[OFFSET] = 0.0
            covariance[OFFSET, OFFSET] = self._params.imu0_yaw_offset_std**2
            return
        offset, std = self._orientation
        state.mean[OFFSET] = normalize_angle(offset - found.turn)
        covariance[OFFSET, OFFSET] = found.turn_variance + std**2
        covariance[OFFSET, :3] = covariance[:3, OFFSET] = -found.turn_variance * lever
        for shared_axis, shared in zip((GPS_X, GPS_Y), found.shared_with_turn, strict=True):
            covariance[OFFSET, shared_axis] = covariance[shared_axis, OFFSET] = shared

    def _belief_at(self, stamp: float) -> Belief:
        state = self.state
        if stamp > state.stamp:
            state = state.copy()
            self._filter.advance(state, stamp)
        if self._alignment is not None:
            return self._provisional(state)
        x, y, yaw = state.mean[:3].tolist()
        covariance = state.covariance[:3, :3].copy()
        health = self._health(state, covariance)
        return Belief(Pose2D(x, y, normalize_angle(yaw)), covariance, health, stamp)

    def _provisional(self, state: FilterState) -> Belief:
        """What is believed while the heading is unknown."""
        x, y, yaw = state.mean[:3].tolist()
        covariance = state.covariance[:3, :3].copy()
        if self._is_doubted:
            covariance[2, 2] = DOUBTED_STD**2
        elif self._orientation is not None:
            yaw += self._orientation[0]
            covariance[2, 2] = self._params.imu0_yaw_offset_std**2 + self._orientation[1] ** 2
        if self._last_fix is not None:
            fix, driven = self._last_fix
            x, y = fix.x, fix.y
            variance = self._variance_of(fix) + (state.distance - driven) ** 2
            covariance[0, 0] = covariance[1, 1] = variance
            covariance[0, 1] = covariance[1, 0] = 0.0
        covariance[2, :2] = covariance[:2, 2] = 0.0
        health = self._health(state, covariance)
        if health is Health.TRACKING:
            health = Health.DEGRADED
        return Belief(Pose2D(x, y, normalize_angle(yaw)), covariance, health, state.stamp)

    def _health(self, state: FilterState, covariance: FloatArray) -> Health:
        params = self._params
        xx, xy, yy = covariance.item(0), covariance.item(1), covariance.item(4)
        variance = 0.5 * (xx + yy + math.hypot(xx - yy, 2.0 * xy))  # along the worst direction
        age = 0.0  # [s] of the last accepted fix
        if self._last_fix is not None:
            age = state.stamp - self._last_fix[0].stamp
        elif self._uses_fixes:
            age = state.stamp - state.accepted_stamp
        return health_of(
            variance > params.lost_above**2 or age > params.lost_after,
            variance > params.degraded_above**2 or age > params.degraded_after,
        )


class DeadReckoningLocalizer(GpsEkfLocalizer):
    """The same filter without fixes, ``odom_imu``: its error grows with the way."""

    def __init__(self, params: GpsEkfParams) -> None:
        super().__init__(params, uses_fixes=False)


def _is_sound_imu(imu: Imu) -> bool:
    turn, push = imu.angular_velocity_z, imu.linear_acceleration_x
    numbers = (imu.stamp, turn, push, imu.yaw_std, imu.yaw_rate_std, imu.pitch)
    return all(map(math.isfinite, numbers))


def _is_sound_odometry(odometry: Odometry) -> bool:
    speed, turn = odometry.twist.linear_x, odometry.twist.angular_z
    numbers = (odometry.stamp, speed, turn, odometry.velocity_std, odometry.yaw_rate_std)
    return all(map(math.isfinite, numbers))

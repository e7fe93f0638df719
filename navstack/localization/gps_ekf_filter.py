"""The GPS-EKF's steps: what wheels, inertial unit and satellite receiver say of the state."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from navstack.geometry import normalize_angle
from navstack.localization import gps_ekf_kernels as kernels
from navstack.localization.gps_ekf_kernels import (
    BIAS,
    GPS_X,
    GPS_Y,
    OFFSET,
    SCALE,
    SIZE,
    SPEED,
    YAW,
    X,
    Y,
)
from navstack.params.gps_ekf import GpsEkfParams
from navstack.scan_matching.scan_aligner import Alignment
from navstack.types import FloatArray, GpsFix, Imu, Odometry

STEP = 0.1  # [s] longest step of the motion model
LONGEST_GAP = 60.0  # [s] of silence that is reckoned through; what went before counts for nothing
# [s] without wheels after which the robot may have stood, or time was not even passing; assumed
SILENT_AFTER, UNKNOWN_FOR = 0.5, 1.0
SLIP_TIME = 0.5  # [s] over which wheels and accelerometer are compared
SLIP_LASTS = 1.0  # [s] assumed: for as long its error is one and the same
SLIP_GATE = 3.0  # [-] standard deviations beyond which they disagree
# [m/s, rad/s] of the wheels below which their yaw rate has no scale error
STANDING_SPEED, STANDING_RATE = 0.05, 0.05
# [-] error of a turning differential drive's yaw rate: the effective track width
RELATIVE_RATE = 0.1


class Engine(NamedTuple):
    """Who does the linear algebra; everything happens in place.

    See :mod:`gps_ekf_kernels` for the arguments.
    """

    propagate: Callable[[FloatArray, FloatArray, float, float, float, float, FloatArray], None]
    correct: Callable[[FloatArray, FloatArray, FloatArray, float, float], None]


COMPILED = Engine(kernels.propagate, kernels.correct)


def _row(*ones: int) -> FloatArray:
    row = np.zeros(SIZE)
    row[list(ones)] = 1.0
    return row


# Derivatives (9,) of what is measured by the state: all of it is linear.
SPEED_ROW, BIAS_ROW, YAW_ROW = _row(SPEED), _row(BIAS), _row(YAW, OFFSET)
FIX_X_ROW, FIX_Y_ROW = _row(X, GPS_X), _row(Y, GPS_Y)


@dataclass(slots=True)
class FilterState:
    """All that the filter remembers, so that it can go back to any moment."""

    mean: FloatArray  # (9,), see gps_ekf_kernels
    covariance: FloatArray  # (9, 9)
    stamp: float  # [s]
    yaw_rate: float = 0.0  # [rad/s] measured last, by the gyro or else by the wheels
    gyro: float = 0.0  # 1: by the gyro; 0: by the wheels
    rate_stamp: float = -math.inf  # [s] of it
    rate_density: float = 0.0  # [rad2/s] power spectral density of its noise
    acceleration: float = 0.0  # [m/s2] measured last
    acceleration_stamp: float = -math.inf  # [s] of it
    level: float = 1.0  # [-] share of the way that is horizontal: cosine of the pitch measured last
    wheel_speed: float = math.nan  # [m/s] measured last, of it the horizontal share
    wheel_stamp: float = -math.inf  # [s] of it
    slip: float = 0.0  # [m/s] by which the wheels recently sped up more than the accelerometer felt
    fix_stamp: float = -math.inf  # [s] of the last fix
    accepted_stamp: float = -math.inf  # [s] of the last fix that was let in
    rejected: int = 0  # fixes in succession
    rejected_since: float = 0.0  # [s]
    distance: float = 0.0  # [m] driven
    nis: float = math.nan  # normalized innovation squared of the last fix

    def copy(self) -> "FilterState":
        """A copy of its own."""
        return FilterState(self.mean.copy(), self.covariance.copy(), *_scalars(self))


# the fields after mean and covariance, in order
_scalars = attrgetter(*(each.name for each in fields(FilterState)[2:]))


@dataclass(slots=True)
class GpsEkfFilter:
    """Extended Kalman filter in the plane; see docs/localization.md for the equations."""

    params: GpsEkfParams
    engine: Engine
    # otherwise the absolute orientation is taken to be without offset, for nothing could tell
    uses_fixes: bool
    # [rad] added to the absolute orientation besides what the parameters say
    reference_yaw: float = 0.0
    _densities: FloatArray = field(init=False)  # (6,) see gps_ekf_kernels.process_noise

    def __post_init__(self) -> None:
        params = self.params
        walks = (
            params.imu0_yaw_rate_bias_walk,
            params.odom0_scale_walk,
            params.imu0_yaw_offset_walk,
        )
        self._densities = np.array((0.0, 0.0, 0.0, *walks)) ** 2
        if not self.uses_fixes:
            self._densities[5] = 0.0

    def start(self, mean: FloatArray, covariance: FloatArray, stamp: float) -> FilterState:
        """A state at rest.

        Args:
            mean: (3,) x, y, yaw.
            covariance: (3, 3) of it.
            stamp: [s].
        """
        params = self.params
        state = FilterState(np.zeros(SIZE), np.zeros((SIZE, SIZE)), stamp)
        state.mean[:3] = mean
        state.covariance[:3, :3] = covariance
        state.covariance[SPEED, SPEED] = 1.0  # [m2/s2] the wheels tell at once
        state.covariance[BIAS, BIAS] = params.imu0_yaw_rate_bias_std**2
        state.covariance[SCALE, SCALE] = params.odom0_scale_std**2
        if self.uses_fixes:
            state.covariance[OFFSET, OFFSET] = params.imu0_yaw_offset_std**2
        return state

    def advance(self, state: FilterState, stamp: float) -> None:
        """Predict to a time [s]; nothing happens when it is not later than the state's."""
        state.stamp = max(state.stamp, stamp - LONGEST_GAP)
        while (left := stamp - state.stamp) > 0.0:
            self._step(state, min(left, STEP))
            state.stamp = stamp if left <= STEP else state.stamp + STEP

    def _step(self, state: FilterState, dt: float) -> None:
        params, now = self.params, state.stamp
        acceleration, noise = state.acceleration, params.acceleration_noise
        if now - state.acceleration_stamp > params.sensor_timeout:
            acceleration, noise, state.slip = 0.0, params.acceleration_noise_without_imu, 0.0
        rate, gyro, density = state.yaw_rate, state.gyro, state.rate_density
        if now - state.rate_stamp > params.sensor_timeout:
            rate, gyro, density = 0.0, 0.0, 1.0  # [rad2/s] nobody knows how it turns
        densities, speed = self._densities, abs(state.mean.item(SPEED))
        densities[0] = density + params.yaw_noise**2
        densities[1] = noise * noise
        densities[2] = params.position_noise**2 * speed
        if now - state.wheel_stamp > SILENT_AFTER:
            densities[2] += speed * speed * UNKNOWN_FOR
        self.engine.propagate(state.mean, state.covariance, dt, rate, gyro, acceleration, densities)
        state.slip = (state.slip - acceleration * dt) * math.exp(-dt / SLIP_TIME)
        state.distance += speed * dt

    def take_odometry(self, state: FilterState, message: Odometry) -> None:
        """Wheels: the speed, less trusted while they slip; the yaw rate where there is no gyro."""
        params = self.params
        rate, speed = message.twist.angular_z, state.level * message.twist.linear_x
        rate_std = message.yaw_rate_std or params.odom0_yaw_rate_std
        has_gyro = bool(state.gyro) and message.stamp - state.rate_stamp <= params.sensor_timeout
        if not has_gyro and message.stamp - state.wheel_stamp <= params.sensor_timeout:
            state.yaw_rate = 0.5 * (state.yaw_rate + rate)  # of the time since the last message
        self.advance(state, message.stamp)
        variance = (message.velocity_std or params.odom0_velocity_std) ** 2
        slip = self._slip_variance(state, speed, variance)
        if has_gyro:
            slip += self._compare_turns(state, rate, rate_std, speed)
        else:
            rate_variance = rate_std**2 + (RELATIVE_RATE * rate) ** 2
            self._hold_rate(state, message.stamp, rate, 0.0, rate_variance)
        if slip > 0.0:  # as of white noise that has the same density at low frequencies
            period = min(max(message.stamp - state.wheel_stamp, 1e-3), SLIP_LASTS)
            variance += slip * SLIP_LASTS / period
        state.wheel_speed, state.wheel_stamp = speed, message.stamp
        innovation = speed - state.mean.item(SPEED)
        likely = (innovation / params.odom0_twist_rejection_threshold) ** 2
        allowed = max(variance, likely - state.covariance.item(SPEED, SPEED))
        self.engine.correct(state.mean, state.covariance, SPEED_ROW, innovation, allowed)

    def _compare_turns(
        self, state: FilterState, rate: float, rate_std: float, speed: float
    ) -> float:
        """The variance [m2/s2] of the speed that comes from wheels that disagree with the gyro.

        One wheel that slips is wrong by the difference times the track width, the mean of both by
        half of that. While the robot all but stands the wheels have nothing to slip on, and show
        the gyro's bias.
        """
        variance = rate_std**2 + self.params.imu0_yaw_rate_std**2
        difference = state.yaw_rate - state.mean.item(BIAS) - rate
        if abs(speed) < STANDING_SPEED and abs(rate) < STANDING_RATE:
            if difference**2 < 25.0 * (variance + state.covariance.item(BIAS, BIAS)):
                self.engine.correct(state.mean, state.covariance, BIAS_ROW, difference, variance)
            return 0.0
        usual = SLIP_GATE * math.sqrt(variance + (RELATIVE_RATE * rate) ** 2)
        return (max(0.0, abs(difference) - usual) * 0.5 * self.params.track_width) ** 2

    def _slip_variance(self, state: FilterState, speed: float, variance: float) -> float:
        """The variance [m2/s2] of the speed where wheels disagree with the accelerometer."""
        params = self.params
        if state.stamp - min(state.wheel_stamp, state.acceleration_stamp) > params.sensor_timeout:
            state.slip = 0.0
            return 0.0
        state.slip += speed - state.wheel_speed
        usual = 2.0 * variance + params.acceleration_noise**2 * SLIP_TIME
        squared = state.slip**2
        if squared > SLIP_GATE**2 * usual:
            return squared
        return 0.0

    def _hold_rate(
        self, state: FilterState, stamp: float, rate: float, gyro: float, variance: float
    ) -> None:
        """Hold a measured yaw rate; its white noise lasts from message to message."""
        period = min(stamp - state.rate_stamp, STEP)
        state.yaw_rate, state.gyro, state.rate_stamp = rate, gyro, stamp
        state.rate_density = variance * period

    def take_imu(self, state: FilterState, message: Imu, with_yaw: bool) -> None:
        """Inertial unit: turns and pushes the state.

        Its absolute orientation, if wanted, corrects it.
        """
        params = self.params
        state.level = math.cos(message.pitch)
        rate, acceleration = message.angular_velocity_z, state.level * message.linear_acceleration_x
        if state.gyro and message.stamp - state.rate_stamp <= params.sensor_timeout:
            state.yaw_rate = 0.5 * (state.yaw_rate + rate)  # of the time since the last message
            state.acceleration = 0.5 * (state.acceleration + acceleration)
        self.advance(state, message.stamp)
        rate_std = message.yaw_rate_std or params.imu0_yaw_rate_std
        self._hold_rate(state, message.stamp, rate, 1.0, rate_std**2)
        # a unit without accelerometer reports zeros
        if acceleration != 0.0 or message.linear_acceleration_y != 0.0:
            state.acceleration, state.acceleration_stamp = acceleration, message.stamp
        if with_yaw and math.isfinite(message.yaw):
            self._take_yaw(state, message)

    def absolute_yaw(self, message: Imu) -> float:
        """The absolute orientation [rad], corrected as the parameters say."""
        params = self.params
        corrected = message.yaw + params.magnetic_declination_radians + params.yaw_offset
        return corrected + self.reference_yaw

    def _take_yaw(self, state: FilterState, message: Imu) -> None:
        variance = (message.yaw_std or self.params.imu0_yaw_std) ** 2
        expected = state.mean.item(YAW) + state.mean.item(OFFSET)
        innovation = normalize_angle(self.absolute_yaw(message) - expected)
        covariance = state.covariance
        if self.uses_fixes:
            spread = covariance.item(YAW, YAW) + 2.0 * covariance.item(YAW, OFFSET)
            spread += covariance.item(OFFSET, OFFSET)
            if innovation**2 > self.params.imu0_pose_rejection_threshold**2 * (spread + variance):
                covariance[OFFSET, OFFSET] += innovation**2
        self.engine.correct(state.mean, covariance, YAW_ROW, innovation, variance)

    def mark_fix(self, state: FilterState, message: GpsFix) -> None:
        """Go to a fix's time without using it."""
        self.advance(state, message.stamp)

    def take_fix(self, state: FilterState, message: GpsFix) -> None:
        """Satellite receiver: the position, unless it is too far off to be true."""
        params = self.params
        self.advance(state, message.stamp)
        total = (message.position_std or params.gps0_position_std) ** 2
        shared = params.gps0_correlated_share * total
        white = (1.0 - params.gps0_correlated_share) * total
        decay = math.exp(-(message.stamp - state.fix_stamp) / params.gps0_correlation_time)
        kernels.age_shared_error(state.mean, state.covariance, decay, shared)
        state.fix_stamp = message.stamp
        x, y, state.nis = kernels.fix_innovation(
            state.mean, state.covariance, message.x, message.y, white
        )
        if state.nis > params.gps0_rejection_threshold**2:
            if not state.rejected:
                state.rejected_since = state.stamp
            state.rejected += 1
            return
        state.accepted_stamp, state.rejected = message.stamp, 0
        self.engine.correct(state.mean, state.covariance, FIX_X_ROW, x, white)
        y = message.y - state.mean.item(Y) - state.mean.item(GPS_Y)
        self.engine.correct(state.mean, state.covariance, FIX_Y_ROW, y, white)

    def take_alignment(self, state: FilterState, message: Alignment, stamp: float) -> None:
        """Scan and map: the pose, along the directions of which they say something.

        Those are left out along which it is too far off to be true.
        """
        self.advance(state, stamp)
        covariance = state.covariance
        gate = self.params.gps0_rejection_threshold**2
        aligned = message.pose.as_array()
        row = np.zeros(SIZE)
        for direction, offset, variance in zip(
            message.directions, message.offsets.tolist(), message.variances.tolist(), strict=True
        ):
            off = aligned - state.mean[:3]
            off[2] = normalize_angle(float(off[2]))
            innovation = float(direction @ off) + offset
            row[:3] = direction
            spread = float(direction @ covariance[:3, :3] @ direction) + variance
            if innovation * innovation <= gate * spread:
                self.engine.correct(state.mean, covariance, row, innovation, variance)

    def is_locked_out(self, state: FilterState, ahead: float = 0.0) -> bool:
        """Whether so many fixes were rejected that the state must be wrong, or is ``ahead`` [s]."""
        if state.rejected < self.params.gps0_lockout_count:
            return False
        return state.stamp + ahead - state.rejected_since >= self.params.gps0_lockout_time

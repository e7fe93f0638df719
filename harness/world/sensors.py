"""The robot's sensors: lidar, wheel odometry, inertial unit and satellite receiver, each at its own rate.

Every sensor has a random generator of its own, so that a change of one leaves the noise of the others as it was.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.world.body_state import BodyState
from harness.world.lidar import Lidar, LidarParams
from harness.world.sensor import NoiseStore, Sensor, check_deviations, check_rate
from navstack.clock import Clock
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.geometry import compose, normalize_angle
from navstack.types import FloatArray, GpsFix, Imu, Observation, Odometry, Pose2D, Twist2D


@dataclass(frozen=True, slots=True)
class OdometryParams:
    """How well the wheels measure. Scale errors are drawn once per episode, the other noise is white."""

    rate: float  # [Hz]
    linear_scale_std: float  # [-] relative error of lengths, e.g. of the wheel radius
    angular_scale_std: float  # [-] relative error of turns, e.g. of the track width
    linear_noise: float  # [m / sqrt(m)] of the distance, grows with the distance driven
    yaw_noise_per_distance: float  # [rad / sqrt(m)] of the heading
    yaw_noise_per_turn: float  # [rad / sqrt(rad)] of the heading
    velocity_std: float  # [m/s] of the reported forward velocity
    yaw_rate_std: float  # [rad/s] of the reported yaw rate

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
        """
        check_rate("odometry", self.rate)
        check_deviations(
            "odometry",
            linear_scale_std=self.linear_scale_std,
            angular_scale_std=self.angular_scale_std,
            linear_noise=self.linear_noise,
            yaw_noise_per_distance=self.yaw_noise_per_distance,
            yaw_noise_per_turn=self.yaw_noise_per_turn,
            velocity_std=self.velocity_std,
            yaw_rate_std=self.yaw_rate_std,
        )


@dataclass(frozen=True, slots=True)
class ImuParams:
    """How well the inertial unit measures. The bias is drawn once per episode, the other noise is white."""

    rate: float  # [Hz]
    yaw_std: float  # [rad] of the absolute heading
    yaw_rate_std: float  # [rad/s]
    yaw_rate_bias_std: float  # [rad/s]
    acceleration_std: float  # [m/s2] per axis

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
        """
        check_rate("imu", self.rate)
        check_deviations(
            "imu",
            yaw_std=self.yaw_std,
            yaw_rate_std=self.yaw_rate_std,
            yaw_rate_bias_std=self.yaw_rate_bias_std,
            acceleration_std=self.acceleration_std,
        )


@dataclass(frozen=True, slots=True)
class GpsParams:
    """How well the satellite receiver measures: white noise, which its report states honestly."""

    rate: float  # [Hz]
    position_std: float  # [m] per axis

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
        """
        check_rate("gps", self.rate)
        check_deviations("gps", position_std=self.position_std)


@dataclass(frozen=True, slots=True)
class SensorParams:
    """All sensors of a robot: one file of ``params/sensors``."""

    lidar: LidarParams
    odometry: OdometryParams
    imu: ImuParams
    gps: GpsParams


class WheelOdometry(Sensor):
    """Dead reckoning of a differential drive, starting at the origin of the odom frame.

    The wheels follow the ground forwards and do not feel what moves the robot sideways. Wheel spin while blocked is not
    modelled: the wheels are taken to turn as the robot moves.
    """

    def __init__(self, params: OdometryParams) -> None:
        self._params = params

    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Draw this episode's scale errors and start at the odom frame's origin."""
        self._linear_scale = 1.0 + self._params.linear_scale_std * rng.standard_normal()
        self._angular_scale = 1.0 + self._params.angular_scale_std * rng.standard_normal()
        self._noise = NoiseStore(rng, 5)
        self._body = body
        self._pose = Pose2D()

    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Odometry:
        """The integrated pose and the velocity now."""
        params, noise = self._params, self._noise.row()
        distance, turn = wheel_motion(self._body, body)
        self._body = body
        yaw_deviation = params.yaw_noise_per_distance * math.sqrt(abs(distance))
        distance = self._linear_scale * distance + params.linear_noise * math.sqrt(abs(distance)) * noise[0]
        yaw_noise = yaw_deviation * noise[1] + params.yaw_noise_per_turn * math.sqrt(abs(turn)) * noise[2]
        turn = self._angular_scale * turn + yaw_noise
        self._pose = compose(self._pose, Pose2D(*along_arc(distance, turn), turn))
        twist = Twist2D(
            self._linear_scale * body.vx + params.velocity_std * noise[3],
            0.0,
            self._angular_scale * body.yaw_rate + params.yaw_rate_std * noise[4],
        )
        return Odometry(stamp, self._pose, twist)


class InertialUnit(Sensor):
    """Gyro and accelerometers in the base frame's origin, with an absolute heading."""

    def __init__(self, params: ImuParams) -> None:
        self._params = params

    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Draw this episode's bias."""
        self._bias = self._params.yaw_rate_bias_std * rng.standard_normal()
        self._noise = NoiseStore(rng, 4)

    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Imu:
        """Heading, yaw rate and accelerations now."""
        params, noise = self._params, self._noise.row()
        return Imu(
            stamp,
            normalize_angle(body.yaw + params.yaw_std * noise[0]),
            body.yaw_rate + self._bias + params.yaw_rate_std * noise[1],
            body.ax + params.acceleration_std * noise[2],
            body.ay + params.acceleration_std * noise[3],
        )


class GpsReceiver(Sensor):
    """Position fixes of the base origin (the antenna's lever arm is taken as corrected), without delay or outages."""

    def __init__(self, params: GpsParams) -> None:
        self._params = params

    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Start an episode."""
        self._noise = NoiseStore(rng, 2)

    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> GpsFix:
        """The position now."""
        deviation, noise = self._params.position_std, self._noise.row()
        return GpsFix(stamp, body.x + deviation * noise[0], body.y + deviation * noise[1], deviation)


class SensorSuite:
    """All sensors of the robot; what is due is measured, the rest of the observation stays None."""

    def __init__(self, params: SensorParams, geometry: OccupancyGrid, pedestrian_radius: float) -> None:
        """Mount the sensors.

        Args:
            params: of every sensor.
            geometry: what the lidar can hit.
            pedestrian_radius: [m].
        """
        # Per sensor: the field of the observation that it fills, the name of its generator, its clock.
        self._sensors: tuple[tuple[str, str, Clock, Sensor], ...] = (
            ("odometry", "odometry", Clock(params.odometry.rate), WheelOdometry(params.odometry)),
            ("imu", "imu", Clock(params.imu.rate), InertialUnit(params.imu)),
            ("gps", "gps", Clock(params.gps.rate), GpsReceiver(params.gps)),
            ("scan", "lidar", Clock(params.lidar.rate), Lidar(params.lidar, geometry, pedestrian_radius)),
        )

    def reset(self, body: BodyState, generators: Mapping[str, np.random.Generator]) -> None:
        """Start an episode at time 0, at which every sensor is due.

        Args:
            body: true motion of the robot at the start.
            generators: one each under ``odometry``, ``imu``, ``gps`` and ``lidar``.
        """
        for _, name, clock, sensor in self._sensors:
            clock.reset()
            sensor.reset(body, generators[name])

    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Observation:
        """What the sensors that are due deliver at ``stamp`` [s]; see :meth:`Sensor.measure`."""
        delivered: dict[str, Any] = {
            field: sensor.measure(body, pedestrians, stamp)
            for field, _, clock, sensor in self._sensors
            if clock.is_due(stamp)
        }
        return Observation(stamp, **delivered)


def wheel_motion(before: BodyState, after: BodyState) -> tuple[float, float]:
    """How far [m] and by what angle [rad] the wheels rolled between two states, on an arc of constant curvature.

    The chord is projected on the mean heading, which drops sideways motion, and stretched to the arc's length.
    """
    turn = normalize_angle(after.yaw - before.yaw)
    middle = before.yaw + 0.5 * turn
    chord = (after.x - before.x) * math.cos(middle) + (after.y - before.y) * math.sin(middle)
    return chord / _chord_per_arc(turn), turn


def along_arc(distance: float, turn: float) -> tuple[float, float]:
    """The end x, y [m] of an arc of length ``distance`` [m] that turns by ``turn`` [rad], in the frame of its start."""
    chord = distance * _chord_per_arc(turn)
    return chord * math.cos(0.5 * turn), chord * math.sin(0.5 * turn)


def _chord_per_arc(turn: float) -> float:
    half = 0.5 * turn
    return math.sin(half) / half if abs(half) > 1e-6 else 1.0

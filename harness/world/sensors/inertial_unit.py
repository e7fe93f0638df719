"""The inertial unit: yaw gyro, accelerometers and, where it has one, an absolute heading."""

import math
from dataclasses import dataclass

import numpy as np

from harness.world.physics.body_state import BodyState
from harness.world.ranges import Latency, Rate
from harness.world.sensors.noise import GaussMarkov, NoiseStore, RandomWalk
from harness.world.sensors.sensor import Errors, Sensor
from navstack.geometry import normalize_angle
from navstack.ranges import NotNegative, Parameters, Positive
from navstack.types import FloatArray, Imu

# [rad] a heading without error states no less, for 0 means that nothing is stated
LEAST_STATED = 1e-4


@dataclass(frozen=True, slots=True)
class ImuParams(Parameters, whose="imu"):
    """How well the inertial unit measures.

    Noise is white but for the gyro's bias and the heading's wander.
    """

    rate: Rate  # [Hz]
    yaw_std: NotNegative  # [rad] of the absolute heading
    yaw_rate_std: NotNegative  # [rad/s]
    yaw_rate_bias_std: NotNegative  # [rad/s] of the bias with which an episode begins
    acceleration_std: NotNegative  # [m/s2] per axis
    has_heading: bool = True  # whether it knows north; without, the message's yaw is nan
    yaw_rate_bias_walk: NotNegative = 0.0  # [rad/s / sqrt(s)] random walk of the bias
    yaw_wander_std: NotNegative = 0.0  # [rad] slow error of the heading, Gauss-Markov
    yaw_wander_time: Positive = 60.0  # [s] its correlation time
    latency: Latency = 0.0  # [s] from measurement to delivery


class InertialUnit(Sensor[Imu]):
    """Gyro and accelerometers in the base frame's origin.

    The gyro's error is white noise on a bias, drawn at the start and walking from there; the
    heading's is white noise on a slow Gauss-Markov wander, as the iron that a magnetometer passes
    makes it. The message states the heading's whole deviation (white noise and wander), but the
    white one only of the yaw rate.
    """

    def __init__(self, params: ImuParams) -> None:
        self._params = params
        self._yaw_std = 0.0
        if params.has_heading:
            self._yaw_std = max(math.hypot(params.yaw_std, params.yaw_wander_std), LEAST_STATED)

    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Draw this episode's first bias."""
        bias_rng, wander_rng = rng.spawn(2)
        self._bias = self._params.yaw_rate_bias_std * rng.standard_normal()
        self._noise = NoiseStore(rng, 4)
        self._walk = RandomWalk(bias_rng)
        self._wander = GaussMarkov(wander_rng, 1, self._params.yaw_wander_time)

    def lasting(self, stamp: float) -> Errors:
        """The gyro's bias [rad/s] and the heading's wander."""
        bias = self._bias + self._params.yaw_rate_bias_walk * self._walk.value
        return bias, *self._wander.values

    def take_over(self, errors: Errors, age: float) -> None:
        """See :meth:`Sensor.take_over`."""
        self._bias, *wander = errors
        self._walk.begin_before(age)
        self._wander.go_on(wander, age)

    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Imu:
        """Heading, yaw rate and accelerations now."""
        params, noise = self._params, self._noise.row()
        bias, yaw = self._bias, math.nan
        if params.yaw_rate_bias_walk:
            bias += params.yaw_rate_bias_walk * self._walk.at(stamp)
        if params.has_heading:
            error = params.yaw_std * noise[0]
            if params.yaw_wander_std:
                error += params.yaw_wander_std * self._wander.at(stamp)[0]
            yaw = normalize_angle(body.yaw + error)
        return Imu(
            stamp,
            yaw,
            body.yaw_rate + bias + params.yaw_rate_std * noise[1],
            body.ax + params.acceleration_std * noise[2],
            body.ay + params.acceleration_std * noise[3],
            self._yaw_std,
            params.yaw_rate_std,
        )

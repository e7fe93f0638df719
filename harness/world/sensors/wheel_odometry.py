"""Wheel odometry of a differential drive."""

import math
from dataclasses import dataclass

import numpy as np

from harness.world.physics.body_state import BodyState
from harness.world.ranges import Latency, Rate
from harness.world.sensors.noise import NoiseStore
from harness.world.sensors.sensor import Errors, Sensor
from navstack.geometry import compose, normalize_angle
from navstack.ranges import NotNegative, Parameters
from navstack.types import FloatArray, Odometry, Pose2D, Twist2D

_GRAVITY = 9.81  # [m/s2]


@dataclass(frozen=True, slots=True)
class OdometryParams(Parameters, whose="odometry"):
    """How well the wheels measure.

    Scale errors and slip are drawn once per episode, the other noise is white.
    """

    rate: Rate  # [Hz]
    linear_scale_std: NotNegative  # [-] relative error of lengths, e.g. of the wheel radius
    angular_scale_std: NotNegative  # [-] relative error of turns, e.g. of the track width
    linear_noise: NotNegative  # [m / sqrt(m)] of the distance, grows with the distance driven
    yaw_noise_per_distance: NotNegative  # [rad / sqrt(m)] of the heading
    yaw_noise_per_turn: NotNegative  # [rad / sqrt(rad)] of the heading
    velocity_std: NotNegative  # [m/s] of the reported forward velocity
    yaw_rate_std: NotNegative  # [rad/s] of the reported yaw rate
    # [-] slip ratio per traction, the acceleration in g; root mean square over episodes
    slip: NotNegative = 0.0
    latency: Latency = 0.0  # [s] from measurement to delivery


class WheelOdometry(Sensor[Odometry]):
    """Dead reckoning of a differential drive, starting at the origin of the odom frame.

    The wheels follow the ground forwards and do not feel what moves the robot sideways. Where they
    pull they turn farther than the ground passes, where they brake less far: the slip ratio is
    proportional to the traction used (Gustafsson, "Slip-based tire-road friction estimation",
    Automatica 33(6), 1997), which is taken as the acceleration over gravity, at most 1; turns count
    too large by the lateral one. The slope is drawn per episode, for grounds differ. Wheel spin
    while blocked is not modelled.

    The message states the white deviations of its velocities; scale errors and slip come on top, as
    on real robots.
    """

    def __init__(self, params: OdometryParams) -> None:
        self._params = params

    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Draw this episode's scale errors and slip and start at the odom frame's origin."""
        (slip_rng,) = rng.spawn(1)
        self._linear_scale = 1.0 + self._params.linear_scale_std * rng.standard_normal()
        self._angular_scale = 1.0 + self._params.angular_scale_std * rng.standard_normal()
        self._noise = NoiseStore(rng, 5)
        self._slip = self._params.slip * abs(slip_rng.standard_normal())
        self._body = body
        self._pose = Pose2D()

    def lasting(self, stamp: float) -> Errors:
        """Scale errors and slip."""
        return self._linear_scale, self._angular_scale, self._slip

    def take_over(self, errors: Errors, age: float) -> None:
        """See :meth:`Sensor.take_over`."""
        self._linear_scale, self._angular_scale, self._slip = errors

    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Odometry:
        """The integrated pose and the velocity now."""
        params, noise = self._params, self._noise.row()
        distance, turn = wheel_motion(self._body, body)
        self._body = body
        yaw_deviation = params.yaw_noise_per_distance * math.sqrt(abs(distance))
        yaw_noise = (
            yaw_deviation * noise[1] + params.yaw_noise_per_turn * math.sqrt(abs(turn)) * noise[2]
        )
        linear, angular = self._linear_scale, self._angular_scale
        if self._slip:
            linear *= 1.0 + self._slip * _traction(math.copysign(body.ax, body.ax * body.vx))
            angular *= 1.0 + self._slip * _traction(abs(body.ay))
        distance = linear * distance + params.linear_noise * math.sqrt(abs(distance)) * noise[0]
        turn = angular * turn + yaw_noise
        x, y = along_arc(distance, turn)
        self._pose = compose(self._pose, Pose2D(x, y, turn))
        twist = Twist2D(
            linear * body.vx + params.velocity_std * noise[3],
            0.0,
            angular * body.yaw_rate + params.yaw_rate_std * noise[4],
        )
        return Odometry(stamp, self._pose, twist, params.velocity_std, params.yaw_rate_std)


def _traction(acceleration: float) -> float:
    """Share of the weight that an acceleration [m/s2] takes, at most all of it."""
    return max(-1.0, min(1.0, acceleration / _GRAVITY))


def wheel_motion(before: BodyState, after: BodyState) -> tuple[float, float]:
    """How far [m] and by what angle [rad] the wheels rolled between two states, on an arc.

    The chord is projected on the mean heading, which drops sideways motion, and stretched to the
    arc's length.
    """
    turn = normalize_angle(after.yaw - before.yaw)
    middle = before.yaw + 0.5 * turn
    chord = (after.x - before.x) * math.cos(middle) + (after.y - before.y) * math.sin(middle)
    return chord / _chord_per_arc(turn), turn


def along_arc(distance: float, turn: float) -> tuple[float, float]:
    """The end x, y [m] of an arc of a length [m] and a turn [rad], in the frame of its start."""
    chord = distance * _chord_per_arc(turn)
    return chord * math.cos(0.5 * turn), chord * math.sin(0.5 * turn)


def _chord_per_arc(turn: float) -> float:
    half = 0.5 * turn
    return math.sin(half) / half if abs(half) > 1e-6 else 1.0

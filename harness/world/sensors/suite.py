"""The robot's sensors, each at its own rate and with a random generator of its own."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Generic

import numpy as np

from harness.world.map.scene import Scene
from harness.world.map.shapes import Rect
from harness.world.physics.body_state import BodyState
from harness.world.sensors.gps_receiver import GpsParams, GpsReceiver
from harness.world.sensors.inertial_unit import ImuParams, InertialUnit
from harness.world.sensors.lidar import Lidar, LidarParams
from harness.world.sensors.message_precision import as_messages
from harness.world.sensors.sensor import Errors, Message, Sensor
from harness.world.sensors.sky import Sky
from harness.world.sensors.wheel_odometry import OdometryParams, WheelOdometry
from navstack.clock import Clock
from navstack.ranges import KEPT_OUT
from navstack.types import FloatArray, Observation

# [s] by which a message may be delivered early, so that rounding does not cost a tick
_ON_TIME = 1e-6


@dataclass(frozen=True, slots=True)
class SensorParams:
    """All sensors of a robot: one file of ``params/sensors``."""

    lidar: LidarParams
    odometry: OdometryParams
    imu: ImuParams
    gps: GpsParams
    # whether measurements are as messages of ROS 2 carry them: beams in float32, times in ns
    as_messages: bool = field(default=False, metadata=KEPT_OUT)


class Channel(Generic[Message]):
    """A sensor, when it measures, and its messages that are still under way."""

    def __init__(
        self,
        generator: str,
        sensor: Sensor[Message],
        rate: float,
        latency: float,
    ) -> None:
        """Connect a sensor.

        Args:
            generator: name of its generator.
            sensor: what measures.
            rate: [Hz].
            latency: [s] from measurement to delivery.
        """
        self.generator = generator
        self._sensor = sensor
        self._clock = Clock(rate)
        self._latency = latency
        self._under_way: deque[tuple[float, Message]] = deque()  # [s] of delivery, message

    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Start an episode with nothing under way."""
        self._clock.reset()
        self._under_way.clear()
        self._sensor.reset(body, rng)

    @property
    def sensor(self) -> Sensor[Message]:
        """What measures."""
        return self._sensor

    def deliver(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Message | None:
        """Measure if it is time to; returns the newest message that arrived since the last call."""
        measured = None
        if self._clock.is_due(stamp):
            measured = self._sensor.measure(body, pedestrians, stamp)
        if not self._latency:
            return measured
        if measured is not None:
            self._under_way.append((stamp + self._latency, measured))
        arrived = None
        while self._under_way and self._under_way[0][0] <= stamp + _ON_TIME:
            _, arrived = self._under_way.popleft()
        return arrived


class SensorSuite:
    """All sensors of the robot.

    An observation holds the messages that have arrived. Each carries the stamp of its measurement,
    which lies in the past where its sensor has a latency.
    """

    def __init__(self, params: SensorParams, scene: Scene, pedestrian_radius: float) -> None:
        """Mount the sensors.

        Args:
            params: of every sensor.
            scene: what the lidar can hit and what hides satellites.
            pedestrian_radius: [m].
        """
        odometry, imu, gps, lidar = params.odometry, params.imu, params.gps, params.lidar
        sky: Sky | None = None
        if gps.depends_on_sky:
            sky = sky_of(scene)
        receiver = GpsReceiver(gps, sky)
        self._as_messages = params.as_messages
        caster = Lidar(lidar, scene.geometry, pedestrian_radius, scene.obstacles)
        self._odometry = Channel(
            "odometry", WheelOdometry(odometry), odometry.rate, odometry.latency
        )
        self._imu = Channel("imu", InertialUnit(imu), imu.rate, imu.latency)
        self._gps = Channel("gps", receiver, gps.rate, gps.latency)
        self._lidar = Channel("lidar", caster, lidar.rate, lidar.latency)

        self._channels: tuple[Channel[Any], ...] = (
            self._odometry,
            self._imu,
            self._gps,
            self._lidar,
        )

    def reset(self, body: BodyState, generators: Mapping[str, np.random.Generator]) -> None:
        """Start an episode at time 0, at which every sensor is due.

        Args:
            body: true motion of the robot at the start.
            generators: one per sensor, by its name.
        """
        for channel in self._channels:
            channel.reset(body, generators[channel.generator])

    def lasting(self, stamp: float) -> dict[str, Errors]:
        """By sensor: its errors at ``stamp`` [s] that last beyond an episode."""
        return {each.generator: each.sensor.lasting(stamp) for each in self._channels}

    def take_over(self, errors: Mapping[str, Errors], age: float) -> None:
        """After a reset: go on with errors as they were ``age`` [s] before."""
        for channel in self._channels:
            channel.sensor.take_over(errors[channel.generator], age)

    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Observation:
        """What has arrived by ``stamp`` [s] since the last call; see :meth:`Sensor.measure`."""
        seen = Observation(
            stamp,
            odometry=self._odometry.deliver(body, pedestrians, stamp),
            imu=self._imu.deliver(body, pedestrians, stamp),
            gps=self._gps.deliver(body, pedestrians, stamp),
            scan=self._lidar.deliver(body, pedestrians, stamp),
        )
        if self._as_messages:
            return as_messages(seen)
        return seen


def sky_of(scene: Scene) -> Sky:
    """What hides the sky in a scene."""
    grid, corner = scene.geometry, scene.geometry.origin
    width, height = grid.width * grid.resolution, grid.height * grid.resolution
    return Sky(scene.obstacles, Rect(corner.x, corner.y, corner.x + width, corner.y + height))

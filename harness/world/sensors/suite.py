"""The robot's sensors: lidar, wheel odometry, inertial unit and satellite receiver, each at its own rate.

Every sensor has a random generator of its own, so that a change of one leaves the noise of the others as it was.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.world.map.scene import Scene
from harness.world.map.shapes import Rect
from harness.world.physics.body_state import BodyState
from harness.world.sensors.gps_receiver import GpsParams, GpsReceiver
from harness.world.sensors.inertial_unit import ImuParams, InertialUnit
from harness.world.sensors.lidar import Lidar, LidarParams
from harness.world.sensors.sensor import Measurement, Sensor
from harness.world.sensors.sky import Sky
from harness.world.sensors.wheel_odometry import OdometryParams, WheelOdometry
from navstack.clock import Clock
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


class _Channel:
    """A sensor, when it measures, and its messages that are still under way."""

    def __init__(self, generator: str, sensor: Sensor, rate: float, latency: float) -> None:
        """Connect a sensor.

        Args:
            generator: name of its generator.
            sensor: what measures.
            rate: [Hz].
            latency: [s] from measurement to delivery.
        """
        self.generator = generator
        self._sensor, self._clock, self._latency = sensor, Clock(rate), latency
        self._under_way: deque[tuple[float, Measurement]] = deque()  # when [s] what is delivered

    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Start an episode with nothing under way."""
        self._clock.reset()
        self._under_way.clear()
        self._sensor.reset(body, rng)

    def deliver(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Measurement | None:
        """Measure if it is time to, and hand out the newest message that has arrived since the last call, if any."""
        measured = (
            self._sensor.measure(body, pedestrians, stamp) if self._clock.is_due(stamp) else None
        )
        if not self._latency:
            return measured
        if measured is not None:
            self._under_way.append((stamp + self._latency, measured))
        arrived = None
        while self._under_way and self._under_way[0][0] <= stamp + _ON_TIME:
            arrived = self._under_way.popleft()[1]
        return arrived


class SensorSuite:
    """All sensors of the robot.

    What has arrived stands in the observation, the rest of it stays None.

    A message carries the stamp of its measurement, which lies in the past where its sensor has a
    latency.
    """

    def __init__(self, params: SensorParams, scene: Scene, pedestrian_radius: float) -> None:
        """Mount the sensors.

        Args:
            params: of every sensor.
            scene: what the lidar can hit and what hides satellites.
            pedestrian_radius: [m].
        """
        lidar, odometry, imu, gps = params.lidar, params.odometry, params.imu, params.gps
        receiver = GpsReceiver(gps, sky_of(scene) if gps.depends_on_sky else None)
        caster = Lidar(lidar, scene.geometry, pedestrian_radius, scene.obstacles)
        self._channels = (  # in the order of an observation's fields
            _Channel("odometry", WheelOdometry(odometry), odometry.rate, odometry.latency),
            _Channel("imu", InertialUnit(imu), imu.rate, imu.latency),
            _Channel("gps", receiver, gps.rate, gps.latency),
            _Channel("lidar", caster, lidar.rate, lidar.latency),
        )

    def reset(self, body: BodyState, generators: Mapping[str, np.random.Generator]) -> None:
        """Start an episode at time 0, at which every sensor is due.

        Args:
            body: true motion of the robot at the start.
            generators: one each under ``odometry``, ``imu``, ``gps`` and ``lidar``.
        """
        for channel in self._channels:
            channel.reset(body, generators[channel.generator])

    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Observation:
        """What has arrived by ``stamp`` [s] since the last call; see :meth:`Sensor.measure`."""
        messages = [channel.deliver(body, pedestrians, stamp) for channel in self._channels]
        return Observation(stamp, *messages)  # type: ignore[arg-type]


def sky_of(scene: Scene) -> Sky:
    """What hides the sky in a scene."""
    grid = scene.geometry
    x0, y0, r = grid.origin.x, grid.origin.y, grid.resolution
    return Sky(scene.obstacles, Rect(x0, y0, x0 + grid.width * r, y0 + grid.height * r))

"""What sensors saw, in the map frame: scans turned into points and kept for a while (``observation_buffer.cpp``)."""

import math
from dataclasses import dataclass, field

import numpy as np

from navstack.costmap import cell_kernels
from navstack.geometry import compose
from navstack.params.costmap import ObservationSourceParams
from navstack.types import FloatArray, IntArray, LaserScan, Pose2D

SECTORS = 360  # of the index of bearings
_BELOW_RANGE_MAX = 1e-4  # [m] a beam without return that counts as valid ends so far before range_max


class Bearings:
    """Points sorted by their bearing from the sensor."""

    def __init__(self, points: FloatArray, origin_x: float, origin_y: float) -> None:
        self.starts: IntArray = np.empty(SECTORS + 1, dtype=np.int64)
        self.order: IntArray = np.empty(len(points), dtype=np.int64)
        cell_kernels.sort_by_bearing(points, origin_x, origin_y, self.starts, self.order)


@dataclass(slots=True, eq=False)
class Observation:
    """The points of one scan in the map frame, with the place of the sensor."""

    stamp: float  # [s]
    points: FloatArray  # (n, 2) [m]; beams clear on the way to them
    marking: FloatArray  # (m, 2) [m] those that may mark
    origin_x: float  # [m] of the sensor
    origin_y: float  # [m]
    _bearings: Bearings | None = field(default=None, repr=False)

    @property
    def bearings(self) -> Bearings:
        """The index of the points' bearings, made when first asked for."""
        if self._bearings is None:
            self._bearings = Bearings(self.points, self.origin_x, self.origin_y)
        return self._bearings


class ScanProjector:
    """Turns scans into points (laser_geometry's ``projectLaser``); the beams' directions are kept between scans."""

    def __init__(self) -> None:
        self._key: tuple[float, float, int] = (0.0, 0.0, -1)
        self._directions: FloatArray = np.empty((0, 2))  # unit vectors in the sensor frame

    def project(self, scan: LaserScan, robot_pose: Pose2D, inf_is_valid: bool) -> Observation:
        """The points of a scan taken at ``robot_pose`` (map frame): range_min <= range < range_max.

        With ``inf_is_valid`` a beam without return gives a point just below range_max, which clears but is normally
        too far to mark; otherwise it gives none.
        """
        key = (scan.angle_min, scan.angle_increment, len(scan.ranges))
        if key != self._key:
            angles = scan.angle_min + np.arange(len(scan.ranges)) * scan.angle_increment
            self._directions = np.column_stack((np.cos(angles), np.sin(angles)))
            self._key = key
        ranges = scan.ranges
        if inf_is_valid:
            ranges = np.where(ranges == math.inf, scan.range_max - _BELOW_RANGE_MAX, ranges)
        is_valid = (ranges >= scan.range_min) & (ranges < scan.range_max)  # False for nan
        points = self._directions[is_valid] * ranges[is_valid, None]
        sensor = compose(robot_pose, scan.sensor_pose)
        cos, sin = math.cos(sensor.yaw), math.sin(sensor.yaw)
        moved = np.empty_like(points)
        moved[:, 0] = cos * points[:, 0] - sin * points[:, 1] + sensor.x
        moved[:, 1] = sin * points[:, 0] + cos * points[:, 1] + sensor.y
        return Observation(scan.stamp, moved, moved, sensor.x, sensor.y)


class ObservationBuffer:
    """The observations of one source that still count, the newest first."""

    def __init__(self, params: ObservationSourceParams) -> None:
        self.params = params
        self._observations: list[Observation] = []
        self._newest = -math.inf  # [s]

    def add(self, observation: Observation) -> None:
        """Take a new observation and drop what is out of date by then.

        Without persistence the newest stays alone, until the next one comes.
        """
        persistence = self.params.observation_persistence
        newer = observation.stamp
        kept = [old for old in self._observations if persistence > 0.0 and newer - old.stamp <= persistence]
        self._observations = [observation, *kept]
        self._newest = newer

    def is_current(self, now: float) -> bool:
        """Whether the newest observation is as young as ``expected_update_rate`` wants it."""
        expected = self.params.expected_update_rate
        return expected == 0.0 or now - self._newest <= expected

    def clear(self) -> None:
        """Drop everything."""
        self._observations = []
        self._newest = -math.inf

    @property
    def observations(self) -> list[Observation]:
        """The observations to apply now."""
        return self._observations

"""What sensors saw, in the map frame: scans turned into points and kept for a while (``observation_buffer.cpp``)."""

import math
from functools import cached_property

import numpy as np

from navstack.costmap import beam_kernels
from navstack.geometry import compose
from navstack.params.costmap import ObservationSourceParams
from navstack.types import FloatArray, IntArray, LaserScan, Pose2D

SECTORS = 512  # of the index of bearings
_BELOW_RANGE_MAX = 1e-4  # [m] a beam without return that counts as valid ends so far before range_max


class Bearings:
    """Points sorted by their bearing from the sensor."""

    def __init__(self, points: FloatArray, origin_x: float, origin_y: float) -> None:
        self.starts: IntArray = np.empty(SECTORS + 1, dtype=np.int64)
        self.points: FloatArray = np.empty(points.shape)
        beam_kernels.sort_by_bearing(points, origin_x, origin_y, self.starts, self.points)


class Observation:
    """The points of one scan in the map frame, with the place of the sensor."""

    def __init__(self, stamp: float, points: FloatArray, marking: FloatArray, origin_x: float, origin_y: float) -> None:
        """An observation.

        Args:
            stamp: [s].
            points: (n, 2) [m]; beams clear on the way to them.
            marking: (m, 2) [m] those that may mark.
            origin_x: [m] of the sensor.
            origin_y: [m].
        """
        self.stamp = stamp
        self.origin_x = origin_x
        self.origin_y = origin_y
        self.points = points
        self.marking = marking

    @cached_property
    def bearings(self) -> Bearings:
        """The index of the points' bearings, made when first asked for."""
        return Bearings(self.points, self.origin_x, self.origin_y)


class ScanObservation(Observation):
    """What a scan shows; its points, all of which may mark, are worked out when first asked for.

    Most scans that a slow costmap is shown are replaced by newer ones before it is updated.
    """

    def __init__(self, scan: LaserScan, sensor: Pose2D, directions: FloatArray, inf_is_valid: bool) -> None:
        """``sensor`` is in the map frame, ``directions`` (n, 2) are the beams' unit vectors in the sensor's frame."""
        self.stamp = scan.stamp
        self.origin_x = sensor.x
        self.origin_y = sensor.y
        self._yaw = sensor.yaw
        self._scan = scan
        self._directions = directions
        self._inf_is_valid = inf_is_valid

    @cached_property
    def points(self) -> FloatArray:  # type: ignore[override]
        """See :class:`Observation`."""
        scan = self._scan
        points = np.empty(self._directions.shape)
        count = beam_kernels.project(
            scan.ranges,
            self._directions,
            (scan.range_min, scan.range_max),
            scan.range_max - _BELOW_RANGE_MAX if self._inf_is_valid else math.inf,
            (self.origin_x, self.origin_y, math.cos(self._yaw), math.sin(self._yaw)),
            points,
        )
        return points[:count]

    @property
    def marking(self) -> FloatArray:  # type: ignore[override]
        """See :class:`Observation`."""
        return self.points


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
        return ScanObservation(scan, compose(robot_pose, scan.sensor_pose), self._directions, inf_is_valid)


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

"""What sensors saw, in the map frame.

Scans turned into points and kept for a while (``observation_buffer.cpp``).
"""

import math
from collections.abc import Callable
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np

from navstack.costmap import beam_kernels
from navstack.geometry import compose
from navstack.params.costmap import ObservationSourceParams
from navstack.params.spatio_temporal import SpatioTemporalSourceParams
from navstack.types import FloatArray, IntArray, LaserScan, Pose2D

SECTORS = 512  # of the index of bearings
SourceParams = ObservationSourceParams | SpatioTemporalSourceParams
Source = TypeVar("Source", bound=SourceParams, covariant=True)

# [m] a beam without return that counts as valid ends so far before range_max
_BELOW_RANGE_MAX = 1e-4


class PointObservation:
    """The points of one scan in the map frame, with the place of the sensor.

    They are worked out when first asked for: most scans that a slow costmap is shown are replaced
    by newer ones before it is updated.
    """

    def __init__(
        self,
        stamp: float,
        origin_x: float,
        origin_y: float,
        project: Callable[[], FloatArray],
        marking: FloatArray | None = None,
    ) -> None:
        """An observation.

        Args:
            stamp: [s].
            origin_x: [m] of the sensor.
            origin_y: [m].
            project: gives the points (n, 2) [m]; beams clear on the way to them.
            marking: (m, 2) [m] those that may mark; None: all.
        """
        self.stamp = stamp
        self.origin_x = origin_x
        self.origin_y = origin_y
        self._project = project
        self._marking = marking

    @cached_property
    def points(self) -> FloatArray:
        """Where the beams end (n, 2), [m]."""
        return self._project()

    @property
    def marking(self) -> FloatArray:
        """The points (m, 2) [m] that may mark."""
        if self._marking is None:
            return self.points
        return self._marking

    @cached_property
    def bearings(self) -> tuple[FloatArray, IntArray]:
        """The points sorted by their bearing from the sensor, and where each sector begins."""
        starts, ordered = np.empty(SECTORS + 1, dtype=np.int64), np.empty(self.points.shape)
        beam_kernels.sort_by_bearing(self.points, self.origin_x, self.origin_y, starts, ordered)
        return ordered, starts

    def shortened(self, by: float) -> "PointObservation":
        """The same from beams that end ``by`` [m] earlier, at the sensor at most."""

        def points() -> FloatArray:
            beams = self.points - (self.origin_x, self.origin_y)
            lengths = np.maximum(np.hypot(beams[:, 0], beams[:, 1]), by)
            shares = (lengths - by) / lengths
            ends: FloatArray = (self.origin_x, self.origin_y) + shares[:, None] * beams
            return ends

        return PointObservation(self.stamp, self.origin_x, self.origin_y, points)


class ScanProjector:
    """Turns scans into points (laser_geometry's ``projectLaser``).

    The beams' directions are kept between scans.
    """

    def __init__(self) -> None:
        self._key: tuple[float, float, int] = (0.0, 0.0, -1)
        self._directions: FloatArray = np.empty((0, 2))  # unit vectors in the sensor frame

    def project(self, scan: LaserScan, robot_pose: Pose2D, inf_is_valid: bool) -> PointObservation:
        """The points of a scan taken at ``robot_pose`` (map frame): range_min <= range < range_max.

        With ``inf_is_valid`` a beam without return gives a point just below range_max, which clears
        but is normally too far to mark; otherwise it gives none.
        """
        key = (scan.angle_min, scan.angle_increment, len(scan.ranges))
        if key != self._key:
            angles = scan.angle_min + np.arange(len(scan.ranges)) * scan.angle_increment
            self._directions = np.column_stack((np.cos(angles), np.sin(angles)))
            self._key = key
        sensor, directions = compose(robot_pose, scan.sensor_pose), self._directions

        def points() -> FloatArray:
            ends = np.empty(directions.shape)
            limits = (scan.range_min, scan.range_max)
            endless = math.inf
            if inf_is_valid:
                endless = scan.range_max - _BELOW_RANGE_MAX
            place = (sensor.x, sensor.y, math.cos(sensor.yaw), math.sin(sensor.yaw))
            count = beam_kernels.project(scan.ranges, directions, limits, endless, place, ends)
            return ends[:count]

        return PointObservation(scan.stamp, sensor.x, sensor.y, points)


class ObservationBuffer(Generic[Source]):
    """The observations of one source that still count, the newest first."""

    def __init__(self, params: Source) -> None:
        self.params = params
        self._observations: list[PointObservation] = []
        self._newest = -math.inf  # [s]

    def add(self, observation: PointObservation) -> None:
        """Take a new observation and drop what is out of date by then.

        Without persistence the newest stays alone, until the next one comes.
        """
        persistence = self.params.observation_persistence
        newer = observation.stamp
        kept = [
            old
            for old in self._observations
            if persistence > 0.0 and newer - old.stamp <= persistence
        ]
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
    def observations(self) -> list[PointObservation]:
        """The observations to apply now."""
        return self._observations

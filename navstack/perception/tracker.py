"""Follows people and whatever else moves about, from scans and the static map alone."""

import math

import numpy as np
from scipy.optimize import linear_sum_assignment

from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.geometry import compose, relative_to
from navstack.params.tracker import TrackerParams
from navstack.perception.maneuvering_filter import ManeuveringFilter
from navstack.perception.scan_clusters import background_of, find_bodies, mark_foreground
from navstack.perception.track_filter import TrackFilter, turned
from navstack.scan_matching.kernels import mark_unmapped
from navstack.scan_matching.scan_aligner import ScanAligner
from navstack.types import BoolArray, FloatArray, IntArray, LaserScan, Pose2D, Track

_FAR = 1e6  # squared distance in place of one beyond the gate
# standard deviations of the aligned place by which the margin about mapped surfaces grows
_MARGIN_STDS = 2.0
_CERTAIN: FloatArray = np.zeros((3, 3))


class Tracker:
    """Groups the returns that no map explains, and follows each group with a Kalman filter.

    Groups are assigned to bodies so that the sum of squared Mahalanobis distances is least, within
    a gate. A body is reported after ``min_hits`` groups and forgotten after ``max_coasting``
    without one. It is followed in the odom frame, where the robot's own motion is smooth, and
    reported in the map frame: a jump of the belief moves all bodies, but gives none of them a
    speed.
    """

    def __init__(self, params: TrackerParams, static_map: OccupancyGrid) -> None:
        """Prepare the map.

        Raises:
            MapError: the map is rotated.
        """
        self._params = params
        self._aligner: ScanAligner | None = None
        if params.aligns_scans:
            self._aligner = ScanAligner(static_map)
        else:
            self._background = background_of(static_map, params.background_margin)
        self._origin = np.array((static_map.origin.x, static_map.origin.y))
        self._resolution = static_map.resolution
        self.reset()

    def reset(self) -> None:
        """Forget everything, for a new episode."""
        self._filter = _filter(self._params)
        self._ids: IntArray = np.empty(0, dtype=np.int64)
        self._hits: IntArray = np.empty(0, dtype=np.int64)
        self._seen: FloatArray = np.empty(0)  # [s] when last
        self._next_id = 0
        self._stamp: float | None = None  # of the last scan
        self._map_to_odom = Pose2D()

    def observe(
        self,
        scan: LaserScan,
        in_map: Pose2D,
        in_odom: Pose2D,
        covariance: FloatArray = _CERTAIN,
    ) -> None:
        """Take in a scan.

        Args:
            scan: taken later than the one before; an older one is left out.
            in_map: believed pose of the robot when it was taken.
            in_odom: the same in the odom frame.
            covariance: (3, 3) of ``in_map``; counts only where scans are aligned.
        """
        if self._stamp is not None:
            if scan.stamp <= self._stamp:
                return
            if len(self._ids):
                self._filter.predict(scan.stamp - self._stamp)
        self._stamp = scan.stamp
        self._map_to_odom = compose(in_map, relative_to(in_odom, Pose2D()))
        places, variances = self._measure(scan, in_map, in_odom, covariance)
        if not len(places) and not len(self._ids):  # most scans, where few people are
            return
        bodies, groups = self._assign(places, variances)
        self._filter.update(bodies, places[groups], variances[groups])
        self._hits[bodies] += 1
        self._seen[bodies] = scan.stamp
        is_new = np.ones(len(places), dtype=bool)
        is_new[groups] = False
        self._begin(places[is_new], variances[is_new], scan.stamp)
        self._keep(scan.stamp - self._seen <= self._params.max_coasting)

    def tracks(self, stamp: float) -> list[Track]:
        """The bodies that are followed, at a time [s] no earlier than the last scan's."""
        reported = np.flatnonzero(self._hits >= self._params.min_hits)
        if not len(reported) or self._stamp is None:
            return []
        if stamp - self._stamp > self._params.max_coasting:  # scans have stopped
            return []
        frame = self._map_to_odom
        states, covariances = turned(
            *self._filter.ahead(reported, max(stamp - self._stamp, 0.0)), frame.yaw
        )
        ids = self._ids[reported].tolist()
        return [
            Track(
                id=number,
                stamp=stamp,
                x=x + frame.x,
                y=y + frame.y,
                vx=vx,
                vy=vy,
                radius=self._params.body_radius,
                covariance=covariance,
            )
            for number, (x, y, vx, vy), covariance in zip(
                ids, states.tolist(), covariances, strict=True
            )
        ]

    def _measure(
        self, scan: LaserScan, in_map: Pose2D, in_odom: Pose2D, covariance: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Centres (M, 2) [m] of the bodies in a scan, odom frame, and variances (M,) per axis."""
        given = self._params
        ranges = scan.ranges
        foreground = self._foreground(scan, in_map, covariance)
        found = np.empty((len(ranges), 3))
        increment = scan.angle_increment
        is_closed = abs(abs(increment) * len(ranges) - 2.0 * math.pi) < 0.5 * abs(increment)
        count = find_bodies(
            ranges,
            foreground,
            increment,
            is_closed,
            given.cluster_gap,
            given.min_points,
            given.max_width,
            given.body_radius,
            found,
        )
        sensor = compose(in_odom, scan.sensor_pose)
        bearings = sensor.yaw + scan.angle_min + increment * found[:count, 0]
        distances = found[:count, 1]
        places = np.column_stack(
            (sensor.x + distances * np.cos(bearings), sensor.y + distances * np.sin(bearings))
        )
        deviations = np.where(found[:count, 2] > 0.0, given.occluded_std, given.position_std)
        # The edges of a body are known to a beam's spacing: its middle has that of two uniform
        # errors.
        spacing = distances * abs(increment) / math.sqrt(24.0)
        return places, deviations**2 + spacing**2

    def _foreground(self, scan: LaserScan, in_map: Pose2D, covariance: FloatArray) -> BoolArray:
        """Which beams (n,) return from something that the map does not show."""
        given, aligner = self._params, self._aligner
        foreground: BoolArray = np.empty(len(scan.ranges), dtype=np.bool_)
        if aligner is not None:
            points = aligner.returns(scan)
            found = aligner.align(points, in_map, covariance)
            if found is not None:
                in_map, covariance = found.pose, found.covariance(covariance)
            pose = in_map.as_array()
            limits = (given.max_range, given.background_margin, _MARGIN_STDS)
            mark_unmapped(points, pose, covariance, *limits, aligner.field, foreground)
            return foreground
        mark_foreground(
            scan.ranges,
            scan.angle_min,
            scan.angle_increment,
            scan.range_min,
            min(scan.range_max, given.max_range),
            compose(in_map, scan.sensor_pose).as_array(),
            self._background,
            self._origin,
            self._resolution,
            foreground,
        )
        return foreground

    def _assign(self, places: FloatArray, variances: FloatArray) -> tuple[IntArray, IntArray]:
        """Which bodies are seen again in which groups: indices (K,) and (K,)."""
        squared = self._filter.distances(places, variances)
        bodies, groups = linear_sum_assignment(
            np.where(squared <= self._params.gate, squared, _FAR)
        )
        is_near = squared[bodies, groups] <= self._params.gate
        return bodies[is_near], groups[is_near]

    def _begin(self, places: FloatArray, variances: FloatArray, stamp: float) -> None:
        count = len(places)
        self._filter.add(places, variances)
        self._ids = np.concatenate((self._ids, np.arange(self._next_id, self._next_id + count)))
        self._hits = np.concatenate((self._hits, np.ones(count, dtype=np.int64)))
        self._seen = np.concatenate((self._seen, np.full(count, stamp)))
        self._next_id += count

    def _keep(self, chosen: BoolArray) -> None:
        self._filter.keep(chosen)
        self._ids = self._ids[chosen]
        self._hits = self._hits[chosen]
        self._seen = self._seen[chosen]


def _filter(params: TrackerParams) -> TrackFilter | ManeuveringFilter:
    """The filter of the parameters: of one model, or of two where people may turn sharply."""
    straight = TrackFilter(params.acceleration_std, params.initial_speed_std)
    if params.turning_acceleration_std == 0.0:
        return straight
    turning = TrackFilter(params.turning_acceleration_std, params.initial_speed_std)
    return ManeuveringFilter(straight, turning, params.straight_time, params.turning_time)

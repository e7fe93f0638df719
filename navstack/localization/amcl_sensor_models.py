"""AMCL's sensor models: the likelihood of a scan from where each particle stands."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from navstack.costmap.distances import squared_distances
from navstack.costmap.occupancy_grid import FREE, OccupancyGrid
from navstack.localization.amcl_kernels import (
    beam_ends,
    cast_rays,
    count_agreeing,
    screen_ranges,
    sum_over_beams,
)
from navstack.localization.likelihood_field import LikelihoodField
from navstack.params.amcl import AmclParams
from navstack.types import FloatArray, LaserScan, Pose2D

LONGEST_LEAP = 255  # [cells] of a ray over free ground


class Beams(NamedTuple):
    """The part of a scan that counts."""

    ranges: FloatArray  # (n,) [m]; at least range_max: no return; never NaN
    bearings: FloatArray  # (n,) [rad] in the base frame
    directions: FloatArray  # (2, n) their cosines and sines
    range_max: float  # [m]
    sensor: Pose2D  # in the base frame

    def ends(self) -> FloatArray:
        """Where the beams that returned end (m, 2), in [m] of the base frame."""
        return beam_ends(self.ranges, self.directions, self.range_max, self.sensor.x, self.sensor.y)


class Match(NamedTuple):
    """How well a scan fits particles."""

    likelihoods: FloatArray  # (N,) one per particle; of no particular scale
    best: float  # the same if every return that counted ended on an obstacle


class SensorModel(ABC):
    """Weighs particles by a scan."""

    def __init__(self, params: AmclParams) -> None:
        self._params = params
        self._key: tuple[float, ...] = ()  # of the bearings below, which seldom change
        self._bearings, self._directions = np.empty(0), np.empty((2, 0))

    @abstractmethod
    def match(self, poses: FloatArray, scan: LaserScan, has_converged: bool) -> Match:
        """How well a scan fits poses of the base.

        Args:
            poses: (N, 3) the particles, in the map frame.
            scan: what was measured.
            has_converged: whether the particles stand close together.
        """

    def likelihoods(self, poses: FloatArray, scan: LaserScan, has_converged: bool) -> FloatArray:
        """The likelihoods (N,) of :meth:`match` alone."""
        return self.match(poses, scan, has_converged).likelihoods

    def _step(self, count: int) -> int:
        """Every how many beams of ``count`` one is looked at."""
        return max((count - 1) // (self._params.max_beams - 1), 1)

    def beams(self, scan: LaserScan) -> Beams:
        """The beams that are looked at.

        What is too near counts as no return, NaN not at all (``amcl_node.cpp``).
        """
        given = self._params
        longest, shortest = scan.range_max, scan.range_min
        if given.laser_max_range > 0.0:
            longest = min(longest, given.laser_max_range)
        if given.laser_min_range > 0.0:
            shortest = max(shortest, given.laser_min_range)
        step = self._step(len(scan.ranges))
        ranges = np.array(scan.ranges[::step], dtype=np.float64)
        bearings, directions = self._look(scan, step, len(ranges))
        if screen_ranges(ranges, shortest, longest):
            known = ~np.isnan(ranges)
            ranges, bearings, directions = ranges[known], bearings[known], directions[:, known]
        return Beams(ranges, bearings, directions, longest, scan.sensor_pose)

    def _look(self, scan: LaserScan, step: int, count: int) -> tuple[FloatArray, FloatArray]:
        """Bearings (n,) [rad] in the base frame and their cosines and sines (2, n)."""
        key = (scan.angle_min, scan.angle_increment, scan.sensor_pose.yaw, step, count)
        if key != self._key:
            self._key = key
            self._bearings = np.arange(count, dtype=np.float64) * (scan.angle_increment * step)
            self._bearings += scan.sensor_pose.yaw + scan.angle_min
            self._directions = np.stack((np.cos(self._bearings), np.sin(self._bearings)))
        return self._bearings, self._directions


class LikelihoodFieldModel(SensorModel):
    """One plus the sum over the returns of p^3, p falling off with the distance to obstacles.

    The sum of cubes in place of a product is Nav2's (``likelihood_field_model.cpp``): a few beams
    that hit what is not on the map do little harm.
    """

    def __init__(self, params: AmclParams, field: LikelihoodField) -> None:
        super().__init__(params)
        self._field = field
        self._range_max, self._values = 0.0, np.empty(0)

    def match(self, poses: FloatArray, scan: LaserScan, has_converged: bool) -> Match:
        """See :meth:`SensorModel.match`."""
        beams = self.beams(scan)
        ends = beams.ends() / self._field.resolution
        likelihoods = self._sum(self._field.to_cells(poses), ends, beams.range_max, 1.0)
        return Match(likelihoods, 1.0 + len(ends) * float(self._values[0]))

    def _sum(
        self, cells: FloatArray, ends: FloatArray, range_max: float, first: float
    ) -> FloatArray:
        """``first`` plus the sum of the terms of all ends (n, 2), for particles (N, 3); [cells]."""
        if range_max != self._range_max:  # it seldom changes
            self._range_max, self._values = range_max, self._terms(range_max)
        return sum_over_beams(self._field.codes, self._values, cells, ends, first)

    def _terms(self, range_max: float) -> FloatArray:
        """What a return adds to the sum, for each code of the field."""
        terms: FloatArray = self._of_returns(range_max) ** 3
        return terms

    def _of_returns(self, range_max: float) -> FloatArray:
        """The likelihood of a return for each code of the field; not normalised, as in Nav2."""
        given = self._params
        return (
            given.z_hit * np.exp(-((self._field.distances / given.sigma_hit) ** 2) / 2.0)
            + given.z_rand / range_max
        )


class LikelihoodFieldProbModel(LikelihoodFieldModel):
    """The product over the returns, with beam skipping (``likelihood_field_model_prob.cpp``).

    Beams for which too few particles find an obstacle near their end are ignored once the particles
    have converged: they hit somebody who is not on the map. Where nearly all beams would be
    ignored, the particles have converged to the wrong place, and none is. Beams without return do
    not count in either case; Nav2 then counts what an older scan left in their place, or nothing
    and so a likelihood of 0, after which all particles weigh the same.
    """

    def match(self, poses: FloatArray, scan: LaserScan, has_converged: bool) -> Match:
        """See :meth:`SensorModel.match`.

        Beams that are ignored do not count for the best either.
        """
        beams = self.beams(scan)
        ends = beams.ends() / self._field.resolution
        cells = self._field.to_cells(poses)
        if self._params.do_beamskip and has_converged:
            ends = self._not_skipped(cells, ends)
        likelihoods = np.exp(self._sum(cells, ends, beams.range_max, 0.0))
        return Match(likelihoods, math.exp(len(ends) * float(self._values[0])))

    def _terms(self, range_max: float) -> FloatArray:
        return np.log(np.maximum(self._of_returns(range_max), np.finfo(np.float64).tiny))

    def _step(self, count: int) -> int:
        return max(math.ceil(count / self._params.max_beams), 1)

    def _not_skipped(self, cells: FloatArray, ends: FloatArray) -> FloatArray:
        given = self._params
        agrees = self._field.distances < given.beam_skip_distance
        agrees[self._field.outside] = False
        counts = count_agreeing(self._field.codes, agrees, cells, ends)
        count = counts / len(cells) > given.beam_skip_threshold
        # beams without return are among them, as in Nav2
        skipped = given.max_beams - int(count.sum())
        if skipped >= given.max_beams * given.beam_skip_error_threshold:
            return ends
        return ends[count]


class BeamModel(SensorModel):
    """One plus the sum of p^3 over the beams, p by comparison with the map (``beam_model.cpp``).

    A range of infinity is a beam without return; Nav2 takes only one of exactly the greatest range
    for that.
    """

    def __init__(self, params: AmclParams, grid: OccupancyGrid) -> None:
        """Prepare the map on which rays are cast.

        Raises:
            MapError: the map is rotated.
        """
        grid.require_unrotated("map")
        super().__init__(params)
        squares = squared_distances(
            np.pad(grid.data != FREE, 1, constant_values=True), 2 * (LONGEST_LEAP - 1) ** 2
        )
        # a square about the cell, inside the circle
        self._clear = np.ceil(np.sqrt(squares / 2.0)).astype(np.uint8)
        self._resolution = grid.resolution
        self._origin = np.array((grid.origin.x, grid.origin.y))

    def match(self, poses: FloatArray, scan: LaserScan, has_converged: bool) -> Match:
        """See :meth:`SensorModel.match`.

        For the best, beams without return find none on the map either.
        """
        given, beams = self._params, self.beams(scan)
        ranges, returned = np.minimum(beams.ranges, beams.range_max), beams.ranges < beams.range_max
        expected = self._expected(poses, beams)
        miss = ranges - expected
        likelihood = given.z_hit * np.exp(-(miss**2) / (2.0 * given.sigma_hit**2))
        short = given.z_short * given.lambda_short * np.exp(-given.lambda_short * ranges)
        likelihood += np.where(miss < 0.0, short, 0.0)
        anywhere = np.where(returned, given.z_rand / beams.range_max, given.z_max)
        likelihood += anywhere
        best = 1.0 + float(((given.z_hit + anywhere) ** 3).sum())
        return Match(1.0 + (likelihood**3).sum(axis=1), best)

    def _expected(self, poses: FloatArray, beams: Beams) -> FloatArray:
        """What each beam (n,) would measure from each pose (N,) on the map, (N, n) in [m]."""
        cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        sensors = np.empty_like(poses)
        sensors[:, 0] = poses[:, 0] + cos * beams.sensor.x - sin * beams.sensor.y
        sensors[:, 1] = poses[:, 1] + sin * beams.sensor.x + cos * beams.sensor.y
        sensors[:, 2] = poses[:, 2]
        sensors[:, :2] = (sensors[:, :2] - self._origin) / self._resolution + 1.5
        ranges = cast_rays(self._clear, sensors, beams.bearings, beams.range_max / self._resolution)
        return ranges * self._resolution


# A sensor model is made from its parameters, the map and the map's likelihood field.
SENSOR_MODELS: dict[str, Callable[[AmclParams, OccupancyGrid, LikelihoodField], SensorModel]] = {
    "likelihood_field": lambda params, _, field: LikelihoodFieldModel(params, field),
    "likelihood_field_prob": lambda params, _, field: LikelihoodFieldProbModel(params, field),
    "beam": lambda params, grid, _: BeamModel(params, grid),
}

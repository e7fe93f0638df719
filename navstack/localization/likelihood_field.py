"""How far every place of a map is from the nearest obstacle, for sensor models that look up where beams end."""

import math
from copy import copy

import numpy as np
import numpy.typing as npt

from navstack.costmap.field_cache import cached_array, content_key
from navstack.costmap.occupancy_grid import OCCUPIED, OccupancyGrid
from navstack.jit import njit
from navstack.types import BoolArray, FloatArray, IntArray, Pose2D

CodeArray = npt.NDArray[np.unsignedinteger]


class LikelihoodField:
    """Distances to the nearest obstacle, up to a greatest one, as codes of which a sensor model makes likelihoods.

    Code k < ``far`` stands for a distance of sqrt(k) cells; ``far`` for all beyond the greatest distance, ``outside``
    for places off the map. As in nav2_amcl (``map.hpp``), cell i is *centred* at origin + i * resolution, half a cell
    off the convention of costmaps. The codes have a border of one cell that reads ``outside``.
    """

    def __init__(self, codes: CodeArray, resolution: float, origin: Pose2D, max_distance: float) -> None:
        """A field of known codes.

        Args:
            codes: (H + 2, W + 2) as :func:`bordered_codes` makes them.
            resolution: [m/cell].
            origin: of the map's lower left corner, [m]; its yaw does not count.
            max_distance: [m].
        """
        self.far = farthest_code(max_distance, resolution) + 1
        self.outside = self.far + 1
        self.distances = self._distances(resolution, max_distance)
        self.resolution = resolution
        self.origin = origin
        self.codes = codes

    @classmethod
    def of_map(cls, grid: OccupancyGrid, max_distance: float) -> "LikelihoodField":
        """The field of a map's occupied cells (occupancy 100), exact; kept on disk between runs.

        Raises:
            MapError: the map is rotated.
        """
        grid.require_unrotated("map")
        farthest = farthest_code(max_distance, grid.resolution)
        occupied = grid.data >= OCCUPIED
        key = content_key("likelihood codes 1", np.packbits(occupied), grid.width, grid.height, farthest)
        codes = cached_array(key, lambda: bordered_codes(squared_distances(occupied, farthest), farthest + 1))
        return cls(codes, grid.resolution, grid.origin, max_distance)

    @classmethod
    def of_distances(
        cls, distances: npt.NDArray[np.floating], resolution: float, origin: Pose2D, max_distance: float
    ) -> "LikelihoodField":
        """The field of known distances (H, W) in [m] between cells; rounded to those that cells can have."""
        codes = np.rint((distances.astype(np.float64) / resolution) ** 2).astype(np.int64)
        beyond = farthest_code(max_distance, resolution) + 1
        codes = np.where(distances < max_distance, codes, beyond)
        return cls(bordered_codes(codes, beyond), resolution, origin, max_distance)

    def _distances(self, resolution: float, max_distance: float) -> FloatArray:
        """The distance (outside + 1,) in [m] that each code stands for; off the map it is the greatest."""
        return np.concatenate((np.sqrt(np.arange(self.far)) * resolution, (max_distance, max_distance)))

    def thinned(self, factor: int) -> "LikelihoodField":
        """Every so many cells along x and y, with the same distances: less to look at."""
        field = copy(self)
        field.codes = np.pad(self.codes[1:-1:factor, 1:-1:factor], 1, constant_values=self.outside)
        field.resolution = self.resolution * factor
        return field

    def to_cells(self, poses: FloatArray) -> FloatArray:
        """Poses (N, 3) with x, y in cells of ``codes``, so that truncation gives the indices; yaw unchanged."""
        cells = poses.copy()
        cells[:, :2] = self._cells_of(poses[:, :2])
        return cells

    def _cells_of(self, points: FloatArray) -> FloatArray:
        cells: FloatArray = (points - (self.origin.x, self.origin.y)) / self.resolution + 1.5  # 1 for the border
        return cells

    def at(self, points: FloatArray) -> FloatArray:
        """The distance (N,) in [m] from points (N, 2) of the map frame to the nearest obstacle."""
        cells = self._cells_of(points)
        height, width = self.codes.shape
        columns = np.clip(cells[:, 0], 0.0, width - 1.0).astype(np.int64)
        rows = np.clip(cells[:, 1], 0.0, height - 1.0).astype(np.int64)
        found: FloatArray = self.distances[self.codes[rows, columns]]
        return found


def bordered_codes(squares: npt.NDArray[np.integer], far: int) -> CodeArray:
    """Squared distances (H, W) in cells as codes up to ``far``, with a border of one cell that reads ``far`` + 1."""
    codes = np.minimum(squares, far).astype(np.min_scalar_type(far + 1))
    return np.pad(codes, 1, constant_values=far + 1)


def farthest_code(max_distance: float, resolution: float) -> int:
    """The greatest squared distance in cells that is not beyond ``max_distance``."""
    return math.floor((max_distance / resolution) ** 2 + 1e-6)  # a map's resolution is often a 32-bit number


@njit(cache=True)
def squared_distances(obstacles: BoolArray, farthest: int) -> npt.NDArray[np.int32]:
    """Squared distance in cells from every cell to the nearest obstacle, exact; ``farthest`` + 1 for all beyond.

    Two passes (Meijster, Roerdink & Hesselink 2000): the nearest obstacle in each column, then in each row the lower
    envelope of the parabolas that stand on these.

    Args:
        obstacles: (H, W).
        farthest: squared distance in cells of no interest beyond; at most 2^30.

    Returns:
        (H, W) int32.
    """
    height, width = obstacles.shape
    reach = np.int32(math.floor(math.sqrt(farthest)))
    column = np.empty((height, width), np.int32)  # distance in cells to the nearest obstacle of the column
    above = np.full(width, reach + np.int32(1), np.int32)
    for y in range(height):
        for x in range(width):
            above[x] = np.int32(0) if obstacles[y, x] else min(above[x] + np.int32(1), reach + np.int32(1))
            column[y, x] = above[x]
    for y in range(height - 2, -1, -1):
        for x in range(width):
            column[y, x] = min(column[y, x], column[y + 1, x] + np.int32(1))
    squares = np.empty((height, width), np.int32)
    sites, begins = np.empty(width, np.int64), np.empty(width, np.int64)
    for y in range(height):
        _row_envelope(column[y], np.int64(reach), np.int64(farthest), sites, begins, squares[y])
    return squares


@njit(cache=True)
def _row_envelope(
    column: npt.NDArray[np.int32],
    reach: np.int64,
    farthest: np.int64,
    sites: IntArray,
    begins: IntArray,
    squares: npt.NDArray[np.int32],
) -> None:
    """One row of squared distances; ``sites`` and ``begins`` are room for the parabolas and where each is lowest."""
    width = len(column)
    last = -1
    for x in range(width):
        g = np.int64(column[x])
        if g > reach:
            continue
        while last >= 0 and _parabola(begins[last], sites[last], column) > _parabola(begins[last], x, column):
            last -= 1
        if last < 0:
            last = 0
            sites[0], begins[0] = x, 0
            continue
        site = sites[last]
        h = np.int64(column[site])
        begin = 1 + (x * x - site * site + g * g - h * h) // (2 * (x - site))
        if begin < width:
            last += 1
            sites[last], begins[last] = x, begin
    for x in range(width - 1, -1, -1):
        squared = farthest + 1
        if last >= 0:
            squared = min(squared, _parabola(x, sites[last], column))
            if x == begins[last]:
                last -= 1
        squares[x] = squared


@njit(cache=True, inline="always")
def _parabola(x: int, site: int, column: npt.NDArray[np.int32]) -> np.int64:
    """Squared distance from x to the nearest obstacle of the column at ``site``."""
    height = np.int64(column[site])
    return np.int64(x - site) * np.int64(x - site) + height * height

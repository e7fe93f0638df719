"""How far every place of a map is from the nearest obstacle, for sensor models."""

import math
from copy import copy

import numpy as np
import numpy.typing as npt

from navstack.costmap.distances import squared_distances
from navstack.costmap.field_cache import cached_array, content_key
from navstack.costmap.occupancy_grid import OCCUPIED, OccupancyGrid
from navstack.errors import ParameterError
from navstack.localization.amcl_kernels import CodeArray, cells_of
from navstack.types import FloatArray, Pose2D

MOST_CELLS = 4000  # to an obstacle; a field has a number for each squared distance


class LikelihoodField:
    """Distances to the nearest obstacle, up to a greatest one, as codes.

    Code k < ``far`` stands for a distance of sqrt(k) cells; ``far`` for all beyond the greatest
    distance, ``outside`` for places off the map. As in nav2_amcl (``map.hpp``), cell i is *centred*
    at origin + i * resolution, half a cell off the convention of costmaps. The codes have a border
    of one cell that reads ``outside``.
    """

    def __init__(
        self, codes: CodeArray, resolution: float, origin: Pose2D, max_distance: float
    ) -> None:
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
        key = content_key(
            "likelihood codes 1", np.packbits(occupied), grid.width, grid.height, farthest
        )
        codes = cached_array(
            key, lambda: bordered_codes(squared_distances(occupied, farthest), farthest + 1)
        )
        return cls(codes, grid.resolution, grid.origin, max_distance)

    @classmethod
    def of_distances(
        cls,
        distances: npt.NDArray[np.floating],
        resolution: float,
        origin: Pose2D,
        max_distance: float,
    ) -> "LikelihoodField":
        """The field of known distances (H, W) in [m] between cells.

        Rounded to those that cells can have.
        """
        codes = np.rint((distances.astype(np.float64) / resolution) ** 2).astype(np.int64)
        beyond = farthest_code(max_distance, resolution) + 1
        codes = np.where(distances < max_distance, codes, beyond)
        return cls(bordered_codes(codes, beyond), resolution, origin, max_distance)

    def _distances(self, resolution: float, max_distance: float) -> FloatArray:
        """The distance (outside + 1,) in [m] that each code stands for.

        Off the map it is the greatest.
        """
        return np.concatenate(
            (np.sqrt(np.arange(self.far)) * resolution, (max_distance, max_distance))
        )

    def thinned(self, factor: int) -> "LikelihoodField":
        """Every so many cells along x and y, with the same distances: less to look at."""
        field = copy(self)
        field.codes = np.pad(self.codes[1:-1:factor, 1:-1:factor], 1, constant_values=self.outside)
        field.resolution = self.resolution * factor
        return field

    def to_cells(self, poses: FloatArray) -> FloatArray:
        """Poses (N, 3) with x, y in cells of ``codes``, so that truncation gives the indices.

        Yaw unchanged.
        """
        # the border and half a cell
        return cells_of(poses, self.origin.x, self.origin.y, self.resolution, 1.5)

    def at(self, points: FloatArray) -> FloatArray:
        """The distance (N,) in [m] from points (N, 2) of the map frame to the nearest obstacle."""
        cells = (points - (self.origin.x, self.origin.y)) / self.resolution + 1.5
        height, width = self.codes.shape
        columns = np.clip(cells[:, 0], 0.0, width - 1.0).astype(np.int64)
        rows = np.clip(cells[:, 1], 0.0, height - 1.0).astype(np.int64)
        found: FloatArray = self.distances[self.codes[rows, columns]]
        return found


def bordered_codes(squares: npt.NDArray[np.integer], far: int) -> CodeArray:
    """Squared distances (H, W) [cells] as codes up to ``far``, with a border of ``far`` + 1."""
    codes = np.minimum(squares, far).astype(np.min_scalar_type(far + 1))
    return np.pad(codes, 1, constant_values=far + 1)


def farthest_code(max_distance: float, resolution: float) -> int:
    """The greatest squared distance in cells that is not beyond ``max_distance``.

    Raises:
        ParameterError: it is too far.
    """
    if not 0.0 <= max_distance <= MOST_CELLS * resolution:
        raise ParameterError(
            f"amcl: laser_likelihood_max_dist {max_distance:g} m on a map of {resolution:g} "
            "m/cell; "
            f"0 to {MOST_CELLS} cells can be told apart, here up to {MOST_CELLS * resolution:g} m"
        )
    # a map's resolution is often a 32-bit number
    return math.floor((max_distance / resolution) ** 2 + 1e-6)

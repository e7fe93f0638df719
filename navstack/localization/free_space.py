"""The free cells of a map, to draw places from."""

import math

import numpy as np

from navstack.costmap.occupancy_grid import FREE, OccupancyGrid
from navstack.types import FloatArray, IntArray

BLOCK = 64  # cells that are counted together


class FreeSpace:
    """Draws poses from all that is free on a map, however large it is."""

    def __init__(self, grid: OccupancyGrid, downsampled: bool = False) -> None:
        """``downsampled``: of every other row and column only."""
        self._grid = grid
        is_free = grid.data == FREE
        if downsampled:
            is_free[1::2] = False
            is_free[:, 1::2] = False
        self._is_free = np.pad(is_free.reshape(-1), (0, -grid.data.size % BLOCK))
        self._until: IntArray = np.cumsum(
            self._is_free.reshape(-1, BLOCK).sum(axis=1, dtype=np.int64)
        )

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Poses (count, 3) in the map frame: a free cell each, with any yaw in [-pi, pi).

        As in nav2_amcl, cell i is centred at origin + i * resolution. A map without free cells
        gives its first cell.
        """
        grid, draws = self._grid, rng.random((2, count))
        total = int(self._until[-1])
        cells = self._cells((draws[0] * total).astype(np.int64)) if total else 0
        poses = np.empty((count, 3))
        poses[:, 0] = grid.origin.x + cells % grid.width * grid.resolution
        poses[:, 1] = grid.origin.y + cells // grid.width * grid.resolution
        poses[:, 2] = draws[1] * 2.0 * math.pi - math.pi
        return poses

    def _cells(self, wanted: IntArray) -> IntArray:
        """The flat index (N,) of the free cell that has so many before it."""
        blocks = np.searchsorted(self._until, wanted, side="right")
        # free cells from the wanted one to the end of the block
        left = self._until[blocks] - wanted
        from_end = np.cumsum(self._is_free.reshape(-1, BLOCK)[blocks, ::-1], axis=1)
        found: IntArray = blocks * BLOCK + BLOCK - 1 - (from_end >= left[:, None]).argmax(axis=1)
        return found

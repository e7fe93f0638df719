"""The free cells of a map, to draw places from."""

import math

import numpy as np

from navstack.costmap.occupancy_grid import FREE, OccupancyGrid
from navstack.jit import njit
from navstack.types import BoolArray, FloatArray, IntArray

BLOCK = 64  # cells that are counted together


class FreeSpace:
    """Draws poses from all that is free on a map, however large it is."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grid = grid
        self._is_free = np.pad((grid.data == FREE).reshape(-1), (0, -grid.data.size % BLOCK))
        self._until: IntArray = np.cumsum(self._is_free.reshape(-1, BLOCK).sum(axis=1, dtype=np.int64))

    def draw(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Poses (count, 3) in the map frame: a free cell each, with any yaw in [-pi, pi).

        As in nav2_amcl, cell i is centred at origin + i * resolution. A map without free cells gives its first cell.
        """
        grid, draws = self._grid, rng.random((2, count))
        total = int(self._until[-1])
        cells = _free_cells(self._is_free, self._until, (draws[0] * total).astype(np.int64)) if total else 0
        poses = np.empty((count, 3))
        poses[:, 0] = grid.origin.x + cells % grid.width * grid.resolution
        poses[:, 1] = grid.origin.y + cells // grid.width * grid.resolution
        poses[:, 2] = draws[1] * 2.0 * math.pi - math.pi
        return poses


@njit(cache=True)
def _free_cells(is_free: BoolArray, until: IntArray, wanted: IntArray) -> IntArray:
    """The flat index (N,) of the free cell that has so many before it.

    Args:
        is_free: flat, in whole blocks.
        until: number of free cells up to the end of each block.
        wanted: (N,) less than the last of these.
    """
    found = np.empty(len(wanted), np.int64)
    for n in range(len(wanted)):
        low, high = 0, len(until) - 1
        while low < high:
            middle = (low + high) // 2
            if until[middle] > wanted[n]:
                high = middle
            else:
                low = middle + 1
        left = until[low] - wanted[n]  # free cells from the wanted one to the end of the block
        at = (low + 1) * BLOCK
        while left > 0:
            at -= 1
            left -= is_free[at]
        found[n] = at
    return found

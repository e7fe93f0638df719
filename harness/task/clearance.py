"""How far free ground is from its edge, on a coarse grid."""

import numpy as np

from navstack.costmap.field_cache import cached_array, content_key
from navstack.costmap.occupancy_grid import FREE, OccupancyGrid
from navstack.jit import njit
from navstack.types import BoolArray, BoolMatrix, Float32Array, IntArray


def coarse_clearance(mesh: OccupancyGrid, factor: int) -> Float32Array:
    """Distance [m] of every ``factor`` x ``factor`` cells to the nearest cell that is not free.

    It is measured from the centre of the middle cell, and the map's edge counts too. The distance
    to that cell's centre less half a cell: the distance to its border, up to 0.2 cells more on
    diagonals.
    """
    free: BoolArray = mesh.data == FREE

    def compute() -> Float32Array:
        distance = np.sqrt(_squared_distances(np.pad(free, 1), factor).astype(np.float64))
        clearance: Float32Array = (np.maximum(distance - 0.5, 0.0) * mesh.resolution).astype(
            np.float32
        )
        return clearance

    return cached_array(
        content_key("mission clearance 3", np.packbits(free), mesh.width, mesh.resolution, factor),
        compute,
    )


@njit(ahead=True)
def _squared_distances(free: BoolMatrix, factor: int) -> IntArray:
    """Squared distances [cells] of the middle cells of blocks to the nearest cell that is not free.

    Rosenfeld and Pfaltz' separable transform (1966): down the columns, then along the rows, as
    far as a nearer cell can be. Exact, as all numbers are whole.

    Args:
        free: (H + 2, W + 2), with a rim that is not free.
        factor: cells of a block's side.
    """
    height, width = free.shape
    first = 1 + factor // 2
    rows = len(range(first, height - 1, factor))
    columns = len(range(first, width - 1, factor))
    vertical = _vertical_distances(free, first, rows, factor)
    squared = np.empty((rows, columns), dtype=np.int64)
    for row in range(rows):
        for column in range(columns):
            x = first + column * factor
            least = vertical[row, x] ** 2
            aside = 1
            while aside * aside < least:
                for beside in (x - aside, x + aside):
                    if 0 <= beside < width:
                        least = min(least, aside * aside + vertical[row, beside] ** 2)
                aside += 1
            squared[row, column] = least
    return squared


@njit()
def _vertical_distances(free: BoolMatrix, first: int, rows: int, factor: int) -> IntArray:
    """Distances (rows, W + 2) [cells] of every ``factor``-th row's cells to one above or below."""
    height, width = free.shape
    vertical = np.empty((rows, width), dtype=np.int64)
    run = np.zeros(width, dtype=np.int64)
    for y in range(height):
        for x in range(width):
            run[x] = (run[x] + 1) * free[y, x]
        if y >= first and (y - first) % factor == 0 and (y - first) // factor < rows:
            vertical[(y - first) // factor] = run
    run[:] = 0
    for y in range(height - 1, -1, -1):
        for x in range(width):
            run[x] = (run[x] + 1) * free[y, x]
        if y >= first and (y - first) % factor == 0 and (y - first) // factor < rows:
            row = (y - first) // factor
            for x in range(width):
                vertical[row, x] = min(vertical[row, x], run[x])
    return vertical

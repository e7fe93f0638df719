"""How far it is from every cell of a grid to the nearest of some cells."""

import math

import numpy as np
import numpy.typing as npt

from navstack.jit import njit
from navstack.types import BoolMatrix, IntArray

Int32Array = npt.NDArray[np.int32]


@njit(ahead=True)
def squared_distances(obstacles: BoolMatrix, farthest: int) -> Int32Array:
    """Squared distance in cells from every cell to the nearest obstacle, exact.

    ``farthest`` + 1 for all beyond.

    Two passes (Meijster, Roerdink & Hesselink 2000): the nearest obstacle in each column, then in
    each row the lower envelope of the parabolas that stand on these.

    Args:
        obstacles: (H, W).
        farthest: squared distance in cells of no interest beyond; at most 2^30.

    Returns:
        (H, W) int32.
    """
    height, width = obstacles.shape
    reach = np.int32(math.floor(math.sqrt(farthest)))
    # distance in cells to the nearest obstacle of the column
    column = np.empty((height, width), np.int32)
    above = np.full(width, reach + np.int32(1), np.int32)
    for y in range(height):
        for x in range(width):
            above[x] = (
                np.int32(0) if obstacles[y, x] else min(above[x] + np.int32(1), reach + np.int32(1))
            )
            column[y, x] = above[x]
    for y in range(height - 2, -1, -1):
        for x in range(width):
            column[y, x] = min(column[y, x], column[y + 1, x] + np.int32(1))
    squares = np.empty((height, width), np.int32)
    sites, begins = np.empty(width, np.int64), np.empty(width, np.int64)
    for y in range(height):
        _row_envelope(column[y], np.int64(reach), np.int64(farthest), sites, begins, squares[y])
    return squares


@njit()
def _row_envelope(
    column: Int32Array,
    reach: np.int64,
    farthest: np.int64,
    sites: IntArray,
    begins: IntArray,
    squares: Int32Array,
) -> None:
    """One row of squared distances.

    ``sites`` and ``begins`` are room for the parabolas and where each is lowest.
    """
    width = len(column)
    last = -1
    for x in range(width):
        g = np.int64(column[x])
        if g > reach:
            continue
        while last >= 0 and _parabola(begins[last], sites[last], column) > _parabola(
            begins[last], x, column
        ):
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


@njit(inline="always")
def _parabola(x: int, site: int, column: Int32Array) -> np.int64:
    """Squared distance from x to the nearest obstacle of the column at ``site``."""
    height = np.int64(column[site])
    return np.int64(x - site) * np.int64(x - site) + height * height

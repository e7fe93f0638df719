"""Numba kernels of the inflation around listed cells: quick where these stand in lines.

Of all cells of a column only the nearest one above or below counts in a row: first every column
that holds cells learns how far the nearest one is in each row, then each row takes the costs that
this distance leaves on both sides. A line of n cells along y so costs n + 2 radius rows instead of
n (2 radius + 1).
"""

# mypy: disable-error-code="assignment, call-overload"
# as in the other kernels: mypy takes fixed-width numbers for mistakes

import numpy as np
import numpy.typing as npt

from navstack.costmap.costmap import Box
from navstack.costmap.inflation_kernels import BLOCK
from navstack.jit import njit
from navstack.types import ByteArray, ByteMatrix, ByteVector, Int32Matrix, IntArray, IntMatrix

DistanceArray = npt.NDArray[np.unsignedinteger]  # [cells]

# unsigned indices: numba then omits the treatment of negative ones, and the loop vectorises
_u = np.uint64


@njit(ahead=True)
def measure_columns(
    cells: Int32Matrix,
    count: int,
    around: ByteVector,
    radius: int,
    box: Box,
    nearest: ByteVector,
    ends: IntMatrix,
) -> None:
    """How far the nearest cell of each column of a box, and ``radius`` beside, is in each row.

    Args:
        cells: (n, 2) lattice x, y; the first ``count`` count.
        count: see there.
        around: (w,) distance in a single cell's column, from ``radius`` below it on; w a multiple
            of BLOCK, filled up with radius + 1: beyond.
        radius: [cells].
        box: lattice x0, xn, y0, yn, ends exclusive.
        nearest: room for the distances, column by column from yours to yn.
        ends: (columns, 2) room for the rows, counted from y0, among which distances up to
            ``radius`` lie; first and end. What ``nearest`` holds of columns without any is left as
            it is.
    """
    x0, xn, y0, yn = box
    height, columns, first, side = yn - y0, xn - x0 + 2 * radius, x0 - radius, 2 * radius + 1
    far = around.dtype.type(radius + 1)
    for column in range(columns):
        ends[column, 0], ends[column, 1] = height, 0
    for i in range(_u(count)):
        column, low = np.int64(cells[i, 0]) - first, np.int64(cells[i, 1]) - radius - y0
        if column < 0 or column >= columns or low + side <= 0 or low >= height:
            continue
        begin = column * height
        if ends[column, 1] == 0:
            for j in range(_u(begin), _u(begin + height)):
                nearest[j] = far
        ends[column, 0] = min(ends[column, 0], max(low, 0))
        ends[column, 1] = max(ends[column, 1], min(low + side, height))
        if low >= 0 and low + len(around) <= height:
            at, source = _u(begin + low), _u(0)
            for _ in range(len(around) // BLOCK):
                for j in range(_u(BLOCK)):
                    nearest[at + j] = min(nearest[at + j], around[source + j])
                at += _u(BLOCK)
                source += _u(BLOCK)
        else:
            for k in range(max(low, 0), min(low + side, height)):
                nearest[_u(begin + k)] = min(nearest[_u(begin + k)], around[_u(k - low)])


@njit(ahead=True)
def spread(
    target: ByteMatrix,
    corner: tuple[int, int],
    radius: int,
    profiles: ByteMatrix,
    box: Box,
    nearest: ByteVector,
    ends: IntMatrix,
    tile: ByteVector,
) -> None:
    """Raise ``target`` in a box to what the distances of :func:`measure_columns` leave in each row.

    It is done in tiles of BLOCK rows and columns, in which every write is of a whole row of the
    tile.

    Args:
        target: costs; its first cell is the lattice cell ``corner``.
        corner: see there.
        radius: [cells].
        profiles: (radius + 1, w) costs on both sides of a column by the distance there; its own at
            BLOCK + radius, with at least BLOCK zeros at each end.
        box: lattice x0, xn, y0, yn within the target, ends exclusive.
        nearest: see :func:`measure_columns`.
        ends: see :func:`measure_columns`.
        tile: (BLOCK * BLOCK,) room.
    """
    x0, xn, y0, yn = box
    stride, to = target.shape[1], target.reshape(-1)
    for left in range(x0, xn, BLOCK):
        width = min(BLOCK, xn - left)
        for low in range(0, yn - y0, BLOCK):
            place = (left - x0, low, width, yn - y0)
            first, end = _fill_tile(tile, place, radius, profiles, nearest, ends)
            for k in range(first, end):
                at, source = (
                    _u((y0 - corner[1] + low + k) * stride + left - corner[0]),
                    _u(k * BLOCK),
                )
                for j in range(_u(width)):
                    to[at + j] = max(to[at + j], tile[source + j])


@njit(inline="always")
def _fill_tile(
    tile: ByteArray,
    place: Box,
    radius: int,
    profiles: ByteArray,
    nearest: DistanceArray,
    ends: IntArray,
) -> tuple[int, int]:
    """The costs of a tile.

    Returns its first row and the end of its rows that have any, the others are not written.

    ``place`` is the tile's first column and row, its width and the height of the box. See
    :func:`spread` for the rest.
    """
    left, low, width, height = place
    span, costs = _u(profiles.shape[1]), profiles.reshape(-1)
    first, end = BLOCK, 0
    for column in range(_u(left), _u(left + width + 2 * radius)):
        begin, stop = max(ends[column, 0] - low, 0), min(ends[column, 1] - low, BLOCK)
        if begin >= stop:
            continue
        if end == 0:
            for j in range(_u(BLOCK * BLOCK)):
                tile[j] = 0
        first, end = min(first, begin), max(end, stop)
        shift, at = _u(BLOCK + 2 * radius + left) - column, column * _u(height) + _u(low)
        for k in range(_u(begin), _u(stop)):
            distance = _u(nearest[at + k])
            if distance > _u(radius):
                continue
            source, into = distance * span + shift, k * _u(BLOCK)
            for j in range(_u(BLOCK)):
                tile[into + j] = max(tile[into + j], costs[source + j])
    return first, end

"""Numba kernels of the inflation: finding sources and stamping cost kernels with the maximum."""

import numpy as np
import numpy.typing as npt
from numba import njit

from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, NO_INFORMATION
from navstack.types import ByteArray

CellArray = npt.NDArray[np.int32]

BLOCK = 64  # bytes; kernels are padded to whole blocks, because loops of fixed length compile to vector instructions

_LETHAL = np.uint8(LETHAL_OBSTACLE)
_UNKNOWN = np.uint8(NO_INFORMATION)
_INSCRIBED = np.uint8(INSCRIBED_INFLATED_OBSTACLE)
_u = np.uint64  # unsigned indices: numba then omits the treatment of negative ones, and the loop vectorises


@njit(cache=True, inline="always")
def _is_source(cost: np.uint8, around_unknown: bool) -> bool:
    return cost == _LETHAL or (around_unknown and cost == _UNKNOWN)


@njit(cache=True)
def _holds_source(flat: ByteArray, start: int, length: int) -> bool:
    """Whether one of ``length`` costs from ``start`` on is lethal or unknown; compiles to vector instructions."""
    found = np.uint8(0)
    first = _u(start)
    for j in range(_u(length)):
        found |= np.uint8(flat[first + j] >= _LETHAL)
    return bool(found != 0)


@njit(cache=True)
def _spreads(flat: ByteArray, at: np.uint64, x: int, y: int, width: int, height: int, around_unknown: bool) -> bool:
    """Whether the cell (x, y) at index ``at`` is a source that some other cell may be nearest to."""
    if flat[at] != _LETHAL:
        return around_unknown
    return (
        (x > 0 and not _is_source(flat[at - _u(1)], around_unknown))
        or (x < width - 1 and not _is_source(flat[at + _u(1)], around_unknown))
        or (y > 0 and not _is_source(flat[at - _u(width)], around_unknown))
        or (y < height - 1 and not _is_source(flat[at + _u(width)], around_unknown))
    )


@njit(cache=True)
def find_sources(costs: ByteArray, x0: int, xn: int, y0: int, yn: int, around_unknown: bool, cells: CellArray) -> int:
    """Cells of ``costs`` [y0:yn, x0:xn] from which inflation spreads, into ``cells`` (n, 2) as (x, y).

    Only the rim of the lethal areas counts: a source between four others is never the nearest to a cell that is no
    source. Unknown sources count all, since they themselves become lethal.

    Returns:
        How many there are; those beyond the end of ``cells`` are not stored.
    """
    height, width = costs.shape
    flat = costs.reshape(-1)
    capacity = cells.shape[0]
    count = 0
    for y in range(y0, yn):
        for block in range(x0, xn, BLOCK):
            length = min(BLOCK, xn - block)
            if not _holds_source(flat, y * width + block, length):
                continue
            for x in range(block, block + length):
                at = _u(y * width + x)
                if flat[at] >= _LETHAL and _spreads(flat, at, x, y, width, height, around_unknown):
                    if count < capacity:
                        cells[count, 0] = x
                        cells[count, 1] = y
                    count += 1
    return count


@njit(cache=True)
def stamp(
    target: ByteArray,
    cells: CellArray,
    count: int,
    kernel: ByteArray,
    radius: int,
    x0: int,
    xn: int,
    y0: int,
    yn: int,
) -> None:
    """Raise ``target`` to ``kernel``, centred on each of the first ``count`` cells (x, y), within [y0:yn, x0:xn].

    ``kernel`` is (2 radius + 1, w), w a multiple of BLOCK, zero beyond column 2 radius; cells may lie outside.
    """
    side = 2 * radius + 1
    span = kernel.shape[1]
    stride = target.shape[1]
    flat = target.reshape(-1)
    flat_kernel = kernel.reshape(-1)
    for i in range(count):
        left = cells[i, 0] - radius
        top = cells[i, 1] - radius
        xa, xb = max(left, x0), min(left + side, xn)
        ya, yb = max(top, y0), min(top + side, yn)
        if xa >= xb:
            continue
        if xa == left and left + span <= xn:
            for y in range(ya, yb):
                to = _u(y * stride + xa)
                source = _u((y - top) * span)
                for _ in range(span // BLOCK):
                    for j in range(_u(BLOCK)):
                        flat[to + j] = max(flat[to + j], flat_kernel[source + j])
                    to += _u(BLOCK)
                    source += _u(BLOCK)
        else:
            length = _u(xb - xa)
            for y in range(ya, yb):
                to = _u(y * stride + xa)
                source = _u((y - top) * span + xa - left)
                for j in range(length):
                    flat[to + j] = max(flat[to + j], flat_kernel[source + j])


@njit(cache=True)
def merge(costs: ByteArray, influence: ByteArray, x0: int, xn: int, y0: int, yn: int, inflate_unknown: bool) -> None:
    """Merge inflated costs into ``costs`` [y0:yn, x0:xn]; ``influence`` is (yn - y0, xn - x0).

    An unknown cell takes costs of 253 and more, or any above 0 with ``inflate_unknown``; others take the maximum.
    """
    least = np.uint8(1) if inflate_unknown else _INSCRIBED
    for y in range(y0, yn):
        for x in range(x0, xn):
            cost = influence[y - y0, x - x0]
            old = costs[y, x]
            if old == _UNKNOWN:
                if cost >= least:
                    costs[y, x] = cost
            elif cost > old:
                costs[y, x] = cost

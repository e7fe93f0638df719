"""Numba kernels of the inflation: finding sources, merging costs with a grid, copying costs."""

import numpy as np

from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, NO_INFORMATION
from navstack.jit import njit
from navstack.types import (
    ByteArray,
    ByteMatrix,
    FixedByteMatrix,
    Int32Matrix,
    IntMatrix,
    IntVector,
)

# bytes; kernels are padded to whole blocks, because loops of fixed length compile to vector
# instructions
BLOCK = 64

_LETHAL = np.uint8(LETHAL_OBSTACLE)
_UNKNOWN = np.uint8(NO_INFORMATION)
_INSCRIBED = np.uint8(INSCRIBED_INFLATED_OBSTACLE)
# unsigned indices: numba then omits the treatment of negative ones, and the loop vectorises
_u = np.uint64


@njit(inline="always")
def _is_source(cost: np.uint8, around_unknown: bool) -> bool:
    return cost == _LETHAL or (around_unknown and cost == _UNKNOWN)


@njit()
def _holds_source(flat: ByteArray, start: int, length: int) -> bool:
    """Whether one of ``length`` costs from ``start`` on is lethal or unknown.

    Compiles to vector instructions.
    """
    found = np.uint8(0)
    first = _u(start)
    for j in range(_u(length)):
        found |= np.uint8(flat[first + j] >= _LETHAL)
    return bool(found != 0)


@njit()
def _are_lethal(flat: ByteArray, start: int, length: int) -> bool:
    """Whether all of ``length`` costs from ``start`` on are lethal; compiles to vectors, too."""
    others = np.uint8(0)
    first = _u(start)
    for j in range(_u(length)):
        others |= np.uint8(flat[first + j] != _LETHAL)
    return bool(others == 0)


@njit()
def _lies_inside(flat: ByteArray, x: int, y: int, length: int, width: int, height: int) -> bool:
    """Whether ``length`` cells from (x, y) on lie within a lethal area, so that none spreads."""
    if x == 0 or x + length == width or y == 0 or y == height - 1:
        return False
    at = y * width + x
    return (
        _are_lethal(flat, at - 1, length + 2)
        and _are_lethal(flat, at - width, length)
        and _are_lethal(flat, at + width, length)
    )


@njit()
def _spreads(
    flat: ByteArray, at: np.uint64, x: int, y: int, width: int, height: int, around_unknown: bool
) -> bool:
    """Whether the cell (x, y) at index ``at`` is a source that may be nearest to another cell."""
    if flat[at] != _LETHAL:
        return around_unknown
    return (
        (x > 0 and not _is_source(flat[at - _u(1)], around_unknown))
        or (x < width - 1 and not _is_source(flat[at + _u(1)], around_unknown))
        or (y > 0 and not _is_source(flat[at - _u(width)], around_unknown))
        or (y < height - 1 and not _is_source(flat[at + _u(width)], around_unknown))
    )


@njit(ahead=True)
def find_sources(
    costs: ByteMatrix, x0: int, xn: int, y0: int, yn: int, around_unknown: bool, cells: Int32Matrix
) -> int:
    """Put x, y of the cells of ``costs`` [y0:yn, x0:xn] that inflate into ``cells`` (n, 2).

    Only the rim of the lethal areas counts: a source between four others is never the nearest to a
    cell that is no source. Unknown sources count all, since they themselves become lethal.

    Returns:
        How many there are; those beyond the end of ``cells`` are not stored.
    """
    height, width = costs.shape
    flat = costs.reshape(-1)
    count = 0
    for y in range(y0, yn):
        for block in range(x0, xn, BLOCK):
            length = min(BLOCK, xn - block)
            if not _holds_source(flat, y * width + block, length):
                continue
            if _lies_inside(flat, block, y, length, width, height):
                continue
            for x in range(block, block + length):
                at = _u(y * width + x)
                if flat[at] < _LETHAL or not _spreads(
                    flat, at, x, y, width, height, around_unknown
                ):
                    continue
                if count < cells.shape[0]:
                    cells[count, 0], cells[count, 1] = x, y
                count += 1
    return count


@njit()
def merge(
    costs: ByteArray,
    influence: ByteArray,
    x0: int,
    xn: int,
    y0: int,
    yn: int,
    inflate_unknown: bool,
) -> None:
    """Merge inflated costs into ``costs`` [y0:yn, x0:xn]; ``influence`` is (yn - y0, xn - x0).

    An unknown cell takes costs of 253 and more, or any above 0 with ``inflate_unknown``; others
    take the maximum.
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


@njit(ahead=True)
def copy_boxes(
    source: FixedByteMatrix,
    margin: int,
    fill: int,
    target: ByteMatrix,
    window: IntVector,
    boxes: IntMatrix,
) -> None:
    """Copy lattice boxes (k, 4) x0, xn, y0, yn (ends exclusive) of the window to ``target``.

    The lattice cell (x, y) is ``source`` [y + margin, x + margin], or ``fill`` where that is beyond
    the edges. ``window`` is x, y of the target's first cell, width and height.
    """
    height, width = source.shape
    flat, to, cost = source.reshape(-1), target.reshape(-1), np.uint8(fill)
    for k in range(boxes.shape[0]):
        x0, xn = boxes[k, 0], boxes[k, 1]
        # what the source has
        begin, end = min(max(x0, -margin), xn), max(min(xn, width - margin), x0)
        for y in range(boxes[k, 2], boxes[k, 3]):
            at = _u((y - window[1]) * window[2] + x0 - window[0])
            row = y + margin
            if row < 0 or row >= height or begin >= end:
                for j in range(_u(xn - x0)):
                    to[at + j] = cost
                continue
            for j in range(_u(begin - x0)):
                to[at + j] = cost
            into, out = at + _u(begin - x0), _u(row * width + begin + margin)
            for j in range(_u(end - begin)):
                to[into + j] = flat[out + j]
            for j in range(_u(end - x0), _u(xn - x0)):
                to[at + j] = cost

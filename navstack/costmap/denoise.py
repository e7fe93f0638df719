"""Removing obstacle groups of a few cells, as sensor noise makes them (nav2_costmap_2d's ``denoise_layer``)."""

import numpy as np

from navstack.costmap.costmap import FREE_SPACE, INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION
from navstack.jit import njit
from navstack.types import ByteArray, IntArray

_FREE = np.uint8(FREE_SPACE)
_INSCRIBED = np.uint8(INSCRIBED_INFLATED_OBSTACLE)
_UNKNOWN = np.uint8(NO_INFORMATION)

_NOT_SEEN, _IN_GROUP, _STAYS = np.uint8(0), np.uint8(1), np.uint8(2)  # marks of cells


@njit(cache=True)
def remove_small_groups(costs: ByteArray, minimal_size: int, connectivity: int, unknown_is_obstacle: bool) -> None:
    """Free the groups of fewer than ``minimal_size`` obstacle cells of ``costs`` (height, width), in place.

    Obstacles are costs of 253 and 254, and 255 with ``unknown_is_obstacle``. With a ``connectivity`` of 4 cells with a
    common side are one group, with 8 those with a common corner too. What lies beyond the edges does not count.
    """
    height, width = costs.shape
    if minimal_size <= 1:
        return
    marks = np.zeros((height, width), dtype=np.uint8)
    group = np.empty((min(minimal_size, height * width + 1), 2), dtype=np.int64)  # cells as y, x
    for row in range(height):
        for column in range(width):
            if costs[row, column] < _INSCRIBED or marks[row, column] != _NOT_SEEN:
                continue
            if not _is_obstacle(costs[row, column], unknown_is_obstacle):
                continue
            group[0, 0], group[0, 1] = row, column
            size, stays = _grow_group(costs, marks, group, connectivity, unknown_is_obstacle)
            for i in range(size):
                marks[group[i, 0], group[i, 1]] = _STAYS
                if not stays:
                    costs[group[i, 0], group[i, 1]] = _FREE


@njit(cache=True)
def _is_obstacle(cost: np.uint8, unknown_is_obstacle: bool) -> bool:
    return bool(cost >= _INSCRIBED and (unknown_is_obstacle or cost != _UNKNOWN))


@njit(cache=True)
def _grow_group(
    costs: ByteArray, marks: ByteArray, group: IntArray, connectivity: int, unknown_is_obstacle: bool
) -> tuple[int, bool]:
    """Add what is connected with the first cell of ``group`` until that is full or meets a cell known to stay.

    Returns:
        How many cells were added, and whether they stay.
    """
    height, width = costs.shape
    marks[group[0, 0], group[0, 1]] = _IN_GROUP
    size, done = 1, 0
    while done < size:
        y, x = group[done, 0], group[done, 1]
        done += 1
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                if (connectivity == 4 and v != y and u != x) or marks[v, u] == _IN_GROUP:
                    continue
                if marks[v, u] == _STAYS:
                    return size, True
                if _is_obstacle(costs[v, u], unknown_is_obstacle):
                    marks[v, u] = _IN_GROUP
                    group[size, 0], group[size, 1] = v, u
                    size += 1
                    if size == len(group):
                        return size, True
    return size, False

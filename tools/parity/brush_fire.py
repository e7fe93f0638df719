"""The distances that Nav2's AMCL takes for those to the nearest obstacle (``map_cspace.cpp``).

A fire spreads from all obstacles at once, nearest cells first; each cell passes the obstacle from
which it was reached on to its neighbours. A cell's nearest obstacle may reach it by none of them.
"""

import heapq
from dataclasses import dataclass

import numpy as np

from navstack.types import BoolArray, FloatArray


@dataclass(slots=True)
class _Cell:
    """A burning cell, and the obstacle from which it was reached."""

    distance: float  # [cells] between the two
    column: int
    row: int
    from_column: int
    from_row: int

    def __lt__(self, other: "_Cell") -> bool:
        return self.distance < other.distance


def brush_fire(occupied: BoolArray, resolution: float, farthest: float) -> FloatArray:
    """Distances (H, W) in [m], at most ``farthest``.

    Of equally near cells the heap of C++'s standard library decides; Python's keeps the same order.

    Args:
        occupied: (H, W), row 0 the lowest y.
        resolution: [m/cell].
        farthest: [m].
    """
    height, width = occupied.shape
    radius = int(farthest / resolution)
    distances = np.where(occupied, 0.0, farthest)
    is_reached = occupied.copy()
    # all equally near: already a heap, in the order in which Nav2 pushes them
    heap = [_Cell(0.0, i, j, i, j) for i, j in np.argwhere(occupied.T).tolist()]
    while heap:
        now = heap[0]
        for dx, dy in ((-1, 0), (0, -1), (1, 0), (0, 1)):
            column, row = now.column + dx, now.row + dy
            if not (0 <= column < width and 0 <= row < height) or is_reached[row, column]:
                continue
            distance = float(np.hypot(column - now.from_column, row - now.from_row))
            if distance <= radius:
                distances[row, column] = distance * resolution
                is_reached[row, column] = True
                next_one = _Cell(distance, column, row, now.from_column, now.from_row)
                heapq.heappush(heap, next_one)
        heapq.heappop(heap)
    return distances

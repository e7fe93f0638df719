"""Solid bodies from an occupancy grid alone: its cells, merged and raised to walls."""

import numpy as np

from harness.world.map.scene import Obstacle
from harness.world.map.shapes import Rect
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.jit import njit
from navstack.types import BoolArray, IntArray

WALL_HEIGHT = 1.5  # [m] of what is known from a map only


def extrude(grid: OccupancyGrid, solid: BoolArray) -> tuple[Obstacle, ...]:
    """Obstacles of kind 'unknown' that cover the cells of ``solid`` (H, W) of a grid."""
    x0, y0, r = grid.origin.x, grid.origin.y, grid.resolution
    return tuple(
        Obstacle(
            "unknown", Rect(x0 + c0 * r, y0 + r0 * r, x0 + c1 * r, y0 + r1 * r).polygon, WALL_HEIGHT
        )
        for r0, c0, r1, c1 in merge_rectangles(np.ascontiguousarray(solid)).tolist()
    )


@njit()
def merge_rectangles(solid: BoolArray) -> IntArray:
    """Cover a mask (H, W) with disjoint rectangles (N, 4).

    First row, first column, end row, end column.

    Greedy: from each uncovered cell in reading order, the larger of the rectangle grown along the
    row first and the one grown along the column first.
    """
    left = solid.copy()
    height, width = solid.shape
    found = np.empty((256, 4), np.int64)
    count = 0
    for row in range(height):
        for column in range(width):
            if not left[row, column]:
                continue
            row_a, column_a = _grow(left, row, column)
            column_b, row_b = _grow(left.T, column, row)
            if (row_a - row) * (column_a - column) >= (row_b - row) * (column_b - column):
                end_row, end_column = row_a, column_a
            else:
                end_row, end_column = row_b, column_b
            left[row:end_row, column:end_column] = False
            if count == len(found):
                found = np.concatenate((found, np.empty_like(found)))
            found[count] = (row, column, end_row, end_column)
            count += 1
    return found[:count].copy()


@njit()
def _grow(mask: BoolArray, row: int, column: int) -> tuple[int, int]:
    """End row and end column of a rectangle, first as wide as possible, then as high."""
    height, width = mask.shape
    end_column = column + 1
    while end_column < width and mask[row, end_column]:
        end_column += 1
    end_row = row + 1
    while end_row < height:
        for k in range(column, end_column):
            if not mask[end_row, k]:
                return end_row, end_column
        end_row += 1
    return end_row, end_column

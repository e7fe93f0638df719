"""The opening of a mask by a square: what the square can cover while it stays inside."""

import numpy as np

from navstack.jit import njit
from navstack.types import BoolMatrix


@njit()
def opened(mask: BoolMatrix, size: int) -> BoolMatrix:
    """Erosion, then dilation, by an axis-parallel square; beyond the mask everything is False.

    By lengths of runs, which are counted once along each axis.

    Args:
        mask: (H, W).
        size: [cells] of the square's side.

    Returns:
        A new mask (H, W).
    """
    height, width = mask.shape
    result = np.empty((height, width), dtype=np.bool_)
    above = np.zeros(width, dtype=np.int64)  # cells upwards from here that begin a run of size
    for row in range(height - 1, -1, -1):
        run = 0
        for column in range(width - 1, -1, -1):
            run = run + 1 if mask[row, column] else 0
            above[column] = above[column] + 1 if run >= size else 0
            result[row, column] = above[column] >= size
    rows_left = np.zeros(width, dtype=np.int64)  # that a square from below still covers
    for row in range(height):
        columns_left = 0  # likewise, of one from the left
        for column in range(width):
            rows_left[column] = size if result[row, column] else max(rows_left[column] - 1, 0)
            columns_left = size if rows_left[column] > 0 else max(columns_left - 1, 0)
            result[row, column] = columns_left > 0
    return result

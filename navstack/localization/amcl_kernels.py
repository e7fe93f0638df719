"""Kernels of AMCL's sensor models: how well a scan fits the map from where each particle stands.

Particles are given as cells (N, 3) of a likelihood field (see ``LikelihoodField.to_cells``), the ends of the beams as
points in the base frame, in cells.
"""

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from navstack.localization.likelihood_field import CodeArray
from navstack.types import BoolArray, FloatArray, IntArray

_u = np.uint64  # unsigned indices: numba then omits the treatment of negative ones


@njit(cache=True, inline="always")
def _end_cells(
    pose: FloatArray,
    ends_x: FloatArray,
    ends_y: FloatArray,
    reach: float,
    height: int,
    width: int,
    cells: npt.NDArray[np.uint32],
) -> None:
    """The flat index of the cell in which each beam ends; what is off the map ends in its border.

    ``reach`` is the greatest distance of an end: where it stays on the map, so do all.
    """
    x, y = pose[0], pose[1]
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    right, top = width - 1.0, height - 1.0
    columns = np.int32(width)
    if reach < x < right - reach and reach < y < top - reach:
        for i in range(len(ends_x)):
            column = x + cos * ends_x[i] - sin * ends_y[i]
            row = y + sin * ends_x[i] + cos * ends_y[i]
            cells[i] = np.int32(row) * columns + np.int32(column)
        return
    for i in range(len(ends_x)):
        column = min(max(x + cos * ends_x[i] - sin * ends_y[i], 0.0), right)
        row = min(max(y + sin * ends_x[i] + cos * ends_y[i], 0.0), top)
        cells[i] = np.int32(row) * columns + np.int32(column)


@njit(cache=True, inline="always")
def _reach(ends_x: FloatArray, ends_y: FloatArray) -> float:
    """The greatest distance of an end, and a little more."""
    squared = 0.0
    for i in range(len(ends_x)):
        squared = max(squared, ends_x[i] * ends_x[i] + ends_y[i] * ends_y[i])
    return math.sqrt(squared) + 1.0


@njit(cache=True)
def sum_over_beams(
    codes: CodeArray, values: FloatArray, poses: FloatArray, ends_x: FloatArray, ends_y: FloatArray, first: float
) -> FloatArray:
    """``first`` plus the sum over the beams of the value of where each ends, for every particle.

    Args:
        codes: (H, W) of a likelihood field.
        values: of each code.
        poses: (N, 3) particles in cells.
        ends_x: (n,) ends of the beams in the base frame, in cells.
        ends_y: (n,).
        first: what an empty sum is.

    Returns:
        (N,). The sum runs in four lanes, beam i in lane i modulo 4, because one addition waits for the one before.
    """
    height, width = codes.shape
    flat = codes.reshape(-1)
    n = len(ends_x)
    cells, reach = np.empty(n, np.uint32), _reach(ends_x, ends_y)
    sums = np.empty(len(poses))
    for j in range(len(poses)):
        _end_cells(poses[j], ends_x, ends_y, reach, height, width, cells)
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for i in range(0, n - 3, 4):
            a += values[_u(flat[cells[i]])]
            b += values[_u(flat[cells[i + 1]])]
            c += values[_u(flat[cells[i + 2]])]
            d += values[_u(flat[cells[i + 3]])]
        for i in range(n - n % 4, n):
            a += values[_u(flat[cells[i]])]
        sums[j] = first + ((a + b) + (c + d))
    return sums


@njit(cache=True)
def count_agreeing(
    codes: CodeArray, agrees: BoolArray, poses: FloatArray, ends_x: FloatArray, ends_y: FloatArray
) -> IntArray:
    """For how many particles each beam (n,) ends where the map agrees.

    Args:
        codes: (H, W) of a likelihood field.
        agrees: whether each code does.
        poses: (N, 3) particles in cells.
        ends_x: (n,) ends of the beams in the base frame, in cells.
        ends_y: (n,).
    """
    height, width = codes.shape
    flat = codes.reshape(-1)
    cells, reach = np.empty(len(ends_x), np.uint32), _reach(ends_x, ends_y)
    counts = np.zeros(len(ends_x), np.int64)
    for j in range(len(poses)):
        _end_cells(poses[j], ends_x, ends_y, reach, height, width, cells)
        for i in range(len(ends_x)):
            counts[i] += agrees[_u(flat[cells[i]])]
    return counts


@njit(cache=True)
def cast_rays(clear: CodeArray, sensors: FloatArray, bearings: FloatArray, reach: float) -> FloatArray:
    """Distance in cells from each particle's sensor along each beam to the first cell that is not free.

    The cells of Bresenham's line to the ray's end, as nav2_amcl's ``map_range.c`` visits them; leaps over what
    ``clear`` knows to be free give the same cells, because the line's row after k columns is known in closed form.
    Off the map nothing is free.

    Args:
        clear: (H, W) for each cell, an upper bound of k such that all cells within k - 1 rows and columns are free; 0
            where the cell itself is not. The outermost cells, all 0, are the border.
        sensors: (N, 3) poses of the sensor in cells.
        bearings: (n,) [rad] in the sensor's frame.
        reach: [cells]; where nothing is hit the distance is this.

    Returns:
        (N, n).
    """
    found = np.empty((len(sensors), len(bearings)))
    for j in range(len(sensors)):
        for i in range(len(bearings)):
            found[j, i] = _cast(clear, sensors[j, 0], sensors[j, 1], sensors[j, 2] + bearings[i], reach)
    return found


@njit(cache=True)
def _cast(clear: CodeArray, x: float, y: float, angle: float, reach: float) -> float:
    height, width = clear.shape
    column, row = math.floor(x), math.floor(y)
    across = math.floor(x + reach * math.cos(angle)) - column
    along = math.floor(y + reach * math.sin(angle)) - row
    is_steep = abs(along) > abs(across)
    major, minor = (abs(along), abs(across)) if is_steep else (abs(across), abs(along))
    step_x, step_y = (1 if across > 0 else -1), (1 if along > 0 else -1)
    k = np.int64(0)  # steps along the major axis
    while k <= major + 1:  # Nav2 looks at one cell beyond the end
        side = (2 * k * minor + major) // (2 * major) if major > 0 else k
        dx, dy = (side, k) if is_steep else (k, side)
        cx, cy = column + step_x * dx, row + step_y * dy
        is_inside = 0 <= cx < width and 0 <= cy < height
        free = np.int64(clear[cy, cx] if is_inside else 0)
        if free == 0:
            return math.sqrt(float(dx * dx + dy * dy))
        k += free
    return reach

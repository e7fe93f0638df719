"""Kernels of AMCL's sensor models: how well a scan fits the map from where each particle stands.

Particles are given as cells (N, 3) of a likelihood field (see ``LikelihoodField.to_cells``), the
ends of the beams as points in the base frame, in cells.
"""

import math

import numpy as np
import numpy.typing as npt

from navstack.jit import njit
from navstack.types import BoolArray, FloatArray, FloatMatrix, FloatVector, IntArray, Uint16Matrix

CodeArray = npt.NDArray[np.unsignedinteger]
CellArray = npt.NDArray[np.uint32]  # flat indices

GROUP = 128  # particles that are taken together: what is kept of them stays in the nearest cache
BEAMS = 8  # a multiple of 4 that are added up at a time

_u = np.uint64  # unsigned indices: numba then omits the treatment of negative ones


@njit(inline="always")
def _take_group(
    poses: FloatArray, begin: int, group: FloatArray, reach: float, right: float, top: float
) -> bool:
    """Put x, y, cosine and sine of particles from ``begin`` on into ``group`` (4, GROUP).

    Returns:
        Whether no end of a beam, ``reach`` away at most, lies beyond ``right``, ``top`` or 0.
    """
    inside = True
    for j in range(min(GROUP, len(poses) - begin)):
        x, y, yaw = poses[begin + j, 0], poses[begin + j, 1], poses[begin + j, 2]
        group[0, j], group[1, j], group[2, j], group[3, j] = x, y, math.cos(yaw), math.sin(yaw)
        inside = inside and reach < x < right - reach and reach < y < top - reach
    return inside


@njit(inline="always")
def _end_cells(
    group: FloatArray,
    size: int,
    ends: FloatArray,
    i: int,
    inside: bool,
    shape: tuple[int, int],
    cells: CellArray,
) -> None:
    """The flat index of the cell in which beam ``i`` ends, for each particle.

    What is off the map is in its border.
    """
    xs, ys, coss, sins = group[0], group[1], group[2], group[3]
    right, top, columns = shape[1] - 1.0, shape[0] - 1.0, np.int32(shape[1])
    end_x, end_y = ends[i, 0], ends[i, 1]
    if inside:
        for j in range(_u(size)):
            column = xs[j] + coss[j] * end_x - sins[j] * end_y
            row = ys[j] + sins[j] * end_x + coss[j] * end_y
            cells[j] = np.int32(row) * columns + np.int32(column)
        return
    for j in range(_u(size)):
        column = min(max(xs[j] + coss[j] * end_x - sins[j] * end_y, 0.0), right)
        row = min(max(ys[j] + sins[j] * end_x + coss[j] * end_y, 0.0), top)
        cells[j] = np.int32(row) * columns + np.int32(column)


@njit(inline="always")
def _reach(ends: FloatArray) -> float:
    """The greatest distance of an end, and a little more."""
    squared = 0.0
    for i in range(len(ends)):
        squared = max(squared, ends[i, 0] * ends[i, 0] + ends[i, 1] * ends[i, 1])
    return math.sqrt(squared) + 1.0


@njit(ahead=True)
def cells_of(
    poses: FloatMatrix, origin_x: float, origin_y: float, resolution: float, offset: float
) -> FloatArray:
    """Poses (N, 3) with x, y counted from an origin, in cells and moved by ``offset``."""
    cells = np.empty_like(poses)
    for j in range(len(poses)):
        cells[j, 0] = (poses[j, 0] - origin_x) / resolution + offset
        cells[j, 1] = (poses[j, 1] - origin_y) / resolution + offset
        cells[j, 2] = poses[j, 2]
    return cells


@njit(ahead=True)
def screen_ranges(ranges: FloatVector, shortest: float, longest: float) -> bool:
    """Set the ranges (n,) that are not above ``shortest`` to ``longest``, in place.

    Returns whether one is NaN.
    """
    has_nan = False
    for i in range(len(ranges)):
        has_nan = has_nan or math.isnan(ranges[i])
        if ranges[i] <= shortest:
            ranges[i] = longest
    return has_nan


@njit(ahead=True)
def beam_ends(
    ranges: FloatVector, directions: FloatMatrix, range_max: float, sensor_x: float, sensor_y: float
) -> FloatArray:
    """Where the beams that returned end (m, 2), in the frame of the sensor's position.

    Args:
        ranges: (n,) [m]; ``range_max`` and more: no return.
        directions: (2, n) cosines and sines of the bearings.
        range_max: [m].
        sensor_x: [m].
        sensor_y: [m].
    """
    ends = np.empty((len(ranges), 2))
    count = 0
    for i in range(len(ranges)):
        if ranges[i] < range_max:
            ends[count, 0] = sensor_x + ranges[i] * directions[0, i]
            ends[count, 1] = sensor_y + ranges[i] * directions[1, i]
            count += 1
    return ends[:count]


@njit(ahead=True)
def sum_over_beams(
    codes: Uint16Matrix, values: FloatVector, poses: FloatMatrix, ends: FloatMatrix, first: float
) -> FloatArray:
    """``first`` plus the sum over the beams of the value of where each ends, for every particle.

    A group of particles looks at a few beams, then at the next ones: of one beam they look at cells
    that lie together.

    Args:
        codes: (H, W) of a likelihood field.
        values: of each code.
        poses: (N, 3) particles in cells.
        ends: (n, 2) of the beams in the base frame, in cells.
        first: what an empty sum is.

    Returns:
        (N,). The sum runs in four lanes, beam i in lane i modulo 4 (those of the last incomplete
        four in lane 0), because one addition waits for the one before.
    """
    shape, flat = codes.shape, codes.reshape(-1)
    reach, right, top = _reach(ends), codes.shape[1] - 1.0, codes.shape[0] - 1.0
    group, cells, lanes = (
        np.empty((4, GROUP)),
        np.empty((BEAMS, GROUP), np.uint32),
        np.empty((GROUP, 4)),
    )
    sums = np.empty(len(poses))
    for begin in range(0, len(poses), GROUP):
        size = min(GROUP, len(poses) - begin)
        inside = _take_group(poses, begin, group, reach, right, top)
        lanes[:] = 0.0
        for i in range(0, len(ends), BEAMS):
            count = min(BEAMS, len(ends) - i)
            for k in range(count):
                _end_cells(group, size, ends, i + k, inside, shape, cells[k])
            if count == BEAMS:
                _add_all(flat, values, cells, size, lanes)
            else:
                _add_last(flat, values, cells, size, count, lanes)
        for j in range(size):
            sums[begin + j] = first + ((lanes[j, 0] + lanes[j, 1]) + (lanes[j, 2] + lanes[j, 3]))
    return sums


@njit(inline="always")
def _add_all(
    flat: CodeArray, values: FloatArray, cells: CellArray, size: int, lanes: FloatArray
) -> None:
    """Add the values of ``BEAMS`` beams to the lanes (GROUP, 4) of each particle.

    Nothing is stored in between.
    """
    at, step = cells.reshape(-1), _u(GROUP)
    for j in range(_u(size)):
        a, b, c, d = lanes[j, 0], lanes[j, 1], lanes[j, 2], lanes[j, 3]
        for k in range(_u(BEAMS // 4)):
            first = k * (_u(4) * step) + j
            a += values[_u(flat[at[first]])]
            b += values[_u(flat[at[first + step]])]
            c += values[_u(flat[at[first + _u(2) * step]])]
            d += values[_u(flat[at[first + _u(3) * step]])]
        lanes[j, 0], lanes[j, 1], lanes[j, 2], lanes[j, 3] = a, b, c, d


@njit(inline="always")
def _add_last(
    flat: CodeArray, values: FloatArray, cells: CellArray, size: int, count: int, lanes: FloatArray
) -> None:
    """As :func:`_add_all` with the last, fewer beams."""
    for k in range(count):
        lane = k % 4 if k < count - count % 4 else 0
        for j in range(_u(size)):
            lanes[j, lane] += values[_u(flat[cells[k, j]])]


@njit()
def count_agreeing(
    codes: CodeArray, agrees: BoolArray, poses: FloatArray, ends: FloatArray
) -> IntArray:
    """For how many particles each beam (n,) ends where the map agrees.

    Args:
        codes: (H, W) of a likelihood field.
        agrees: whether each code does.
        poses: (N, 3) particles in cells.
        ends: (n, 2) of the beams in the base frame, in cells.
    """
    shape, flat = codes.shape, codes.reshape(-1)
    reach, right, top = _reach(ends), codes.shape[1] - 1.0, codes.shape[0] - 1.0
    group, cells = np.empty((4, GROUP)), np.empty(GROUP, np.uint32)
    counts = np.zeros(len(ends), np.int64)
    for begin in range(0, len(poses), GROUP):
        size = min(GROUP, len(poses) - begin)
        inside = _take_group(poses, begin, group, reach, right, top)
        for i in range(len(ends)):
            _end_cells(group, size, ends, i, inside, shape, cells)
            for j in range(_u(size)):
                counts[i] += agrees[_u(flat[cells[j]])]
    return counts


@njit()
def cast_rays(
    clear: CodeArray, sensors: FloatArray, bearings: FloatArray, reach: float
) -> FloatArray:
    """Distance [cells] from each particle's sensor along each beam to the first occupied cell.

    The cells of Bresenham's line to the ray's end, as nav2_amcl's ``map_range.c`` visits them;
    leaps over what ``clear`` knows to be free give the same cells, because the line's row after k
    columns is known in closed form. Off the map nothing is free.

    Args:
        clear: (H, W) for each cell, an upper bound of k such that all cells within k - 1 rows and
            columns are free; 0 where the cell itself is not. The outermost cells, all 0, are the
            border.
        sensors: (N, 3) poses of the sensor in cells.
        bearings: (n,) [rad] in the sensor's frame.
        reach: [cells]; where nothing is hit the distance is this.

    Returns:
        (N, n).
    """
    found = np.empty((len(sensors), len(bearings)))
    for j in range(len(sensors)):
        for i in range(len(bearings)):
            found[j, i] = _cast(
                clear, sensors[j, 0], sensors[j, 1], sensors[j, 2] + bearings[i], reach
            )
    return found


@njit()
def _cast(clear: CodeArray, x: float, y: float, angle: float, reach: float) -> float:
    height, width = clear.shape
    column, row = math.floor(x), math.floor(y)
    across = math.floor(x + reach * math.cos(angle)) - column
    along = math.floor(y + reach * math.sin(angle)) - row
    is_steep = abs(along) > abs(across)
    major, minor = max(abs(across), abs(along)), min(abs(across), abs(along))
    step_x, step_y = (1 if across > 0 else -1), (1 if along > 0 else -1)
    k = np.int64(0)  # steps along the major axis
    while k <= major + 1:  # Nav2 looks at one cell beyond the end
        side = k
        if major > 0:
            side = (2 * k * minor + major) // (2 * major)
        dx, dy = k, side
        if is_steep:
            dx, dy = side, k
        cx, cy = column + step_x * dx, row + step_y * dy
        free = np.int64(0)
        if 0 <= cx < width and 0 <= cy < height:
            free = np.int64(clear[cy, cx])
        if free == 0:
            return math.sqrt(float(dx * dx + dy * dy))
        k += free
    return reach

"""Numba kernels of the obstacle layer on a dense grid, cell for cell as ``obstacle_layer.cpp``.

World coordinates are in [m]; a grid is given by the ``origin`` (x, y) [m] of its lower left corner
and its ``resolution`` [m/cell]. ``limits`` are the least and the greatest range [m] that counts.
``bounds`` (4,) collects what was touched: min x, max x, min y, max y [m].
"""

import math

import numpy as np

from navstack.costmap.costmap import FREE_SPACE, LETHAL_OBSTACLE, NO_INFORMATION, Box
from navstack.jit import njit
from navstack.types import (
    ByteArray,
    ByteMatrix,
    FloatArray,
    FloatMatrix,
    FloatVector,
    IntArray,
    IntVector,
)

_FREE = np.uint8(FREE_SPACE)
_LETHAL = np.uint8(LETHAL_OBSTACLE)
_UNKNOWN = np.uint8(NO_INFORMATION)
_INSIDE_EDGE = 0.001  # [m] an end point clipped at the far edges is put so far inside the grid


@njit()
def to_cell(
    x: float,
    y: float,
    origin_x: float,
    origin_y: float,
    resolution: float,
    size_x: int,
    size_y: int,
) -> tuple[int, int]:
    """The cell of a point, or (-1, -1) off the grid (``Costmap2D::worldToMap``)."""
    if x < origin_x or y < origin_y:
        return -1, -1
    mx = int((x - origin_x) / resolution)
    my = int((y - origin_y) / resolution)
    if mx < size_x and my < size_y:
        return mx, my
    return -1, -1


@njit()
def clip_to_grid(
    ox: float,
    oy: float,
    wx: float,
    wy: float,
    origin_x: float,
    origin_y: float,
    end_x: float,
    end_y: float,
) -> tuple[float, float]:
    """The point (wx, wy), drawn in towards (ox, oy) onto the grid (``raytraceFreespace``)."""
    a = wx - ox
    b = wy - oy
    if wx < origin_x:
        wx = origin_x
        wy = oy + b * ((origin_x - ox) / a)
    if wy < origin_y:
        wx = ox + a * ((origin_y - oy) / b)
        wy = origin_y
    if wx > end_x:
        wx = end_x - _INSIDE_EDGE
        wy = oy + b * ((end_x - ox) / a)
    if wy > end_y:
        wx = ox + a * ((end_y - oy) / b)
        wy = end_y - _INSIDE_EDGE
    return wx, wy


@njit()
def ray(
    x0: int, y0: int, x1: int, y1: int, max_length: float, min_length: float
) -> tuple[int, int, int, int, int]:
    """A Bresenham line from cell 0 to cell 1 (``nav2_util::raytraceLine``).

    It is cut to [min_length, max_length] cells.

    Returns:
        The first cell x, y, the signed differences x, y from there to cell 1 and the number of
        steps, -1: no cell.
    """
    dx, dy = x1 - x0, y1 - y0
    squared = dx * dx + dy * dy
    if min_length == 0.0 and squared <= max_length * max_length:
        return x0, y0, dx, dy, max(abs(dx), abs(dy))
    distance = math.sqrt(float(squared))
    if distance < min_length:
        return x0, y0, 0, 0, -1
    if distance == 0.0:
        return x0, y0, 0, 0, 0
    start_x = int(x0 + dx / distance * min_length)
    start_y = int(y0 + dy / distance * min_length)
    dx, dy = x1 - start_x, y1 - start_y
    longer = max(abs(dx), abs(dy))
    return start_x, start_y, dx, dy, min(int(min(1.0, max_length / distance) * longer), longer)


@njit()
def touch(bounds: FloatArray, x: float, y: float) -> None:
    """Grow the bounds to hold a point."""
    bounds[0] = min(bounds[0], x)
    bounds[1] = max(bounds[1], x)
    bounds[2] = min(bounds[2], y)
    bounds[3] = max(bounds[3], y)


@njit()
def clear_rays(
    grid: ByteArray,
    points: FloatArray,
    ox: float,
    oy: float,
    origin: FloatArray,
    resolution: float,
    limits: tuple[float, float],
    bounds: FloatArray,
) -> None:
    """Free the cells from the sensor (ox, oy) through each point's cell.

    ``limits`` are the raytrace ranges. The bounds grow to the ends of the beams, not to all of
    their cells.
    """
    size_y, size_x = grid.shape
    origin_x, origin_y = origin[0], origin[1]
    x0, y0 = to_cell(ox, oy, origin_x, origin_y, resolution, size_x, size_y)
    if x0 < 0:
        return
    touch(bounds, ox, oy)
    end_x, end_y = origin_x + size_x * resolution, origin_y + size_y * resolution
    min_cells = float(math.ceil(limits[0] / resolution))
    max_cells = float(math.ceil(limits[1] / resolution))
    for i in range(points.shape[0]):
        wx, wy = clip_to_grid(ox, oy, points[i, 0], points[i, 1], origin_x, origin_y, end_x, end_y)
        x1, y1 = to_cell(wx, wy, origin_x, origin_y, resolution, size_x, size_y)
        if x1 < 0:
            continue
        x, y, dx, dy, steps = ray(x0, y0, x1, y1, max_cells, min_cells)
        free_line(grid, x, y, dx, dy, steps)
        distance = math.hypot(wx - ox, wy - oy)
        if distance >= limits[0]:
            scale = 1.0
            if distance > limits[1]:
                scale = limits[1] / distance
            touch(bounds, ox + (wx - ox) * scale, oy + (wy - oy) * scale)


@njit()
def free_line(grid: ByteArray, x: int, y: int, dx: int, dy: int, steps: int) -> None:
    """Free ``steps`` + 1 cells from (x, y) on along the direction (dx, dy)."""
    if steps < 0:
        return
    step_x = 1 if dx > 0 else -1
    step_y = 1 if dy > 0 else -1
    flat = grid.reshape(-1)
    stride = grid.shape[1]
    if abs(dx) >= abs(dy):
        longer, shorter, along, across = abs(dx), abs(dy), step_x, step_y * stride
    else:
        longer, shorter, along, across = abs(dy), abs(dx), step_y * stride, step_x
    at = y * stride + x
    error = longer // 2
    for _ in range(steps):
        flat[np.uint64(at)] = _FREE
        at += along
        error += shorter
        if error >= longer:
            at += across
            error -= longer
    flat[np.uint64(at)] = _FREE


@njit()
def is_in_range(px: float, py: float, ox: float, oy: float, limits: tuple[float, float]) -> bool:
    """The test of a point's horizontal distance [m] that comes before the one of its cell."""
    squared = (px - ox) * (px - ox) + (py - oy) * (py - oy)
    return bool(limits[0] * limits[0] <= squared < limits[1] * limits[1])


@njit(ahead=True)
def mark_points(
    grid: ByteMatrix,
    points: FloatMatrix,
    ox: float,
    oy: float,
    origin: FloatVector,
    resolution: float,
    limits: tuple[float, float],
    bounds: FloatVector,
) -> None:
    """Make the cells of points lethal within the obstacle ranges ``limits`` of the sensor (ox, oy).

    The points must be within them in [m] and in whole cells. The bounds grow to these points.
    """
    size_y, size_x = grid.shape
    x0, y0 = math.floor((ox - origin[0]) / resolution), math.floor((oy - origin[1]) / resolution)
    least, most = math.ceil(limits[0] / resolution), math.ceil(limits[1] / resolution)
    for i in range(points.shape[0]):
        px, py = points[i, 0], points[i, 1]
        if not is_in_range(px, py, ox, oy, limits):
            continue
        mx, my = to_cell(px, py, origin[0], origin[1], resolution, size_x, size_y)
        if mx >= 0 and least <= int(math.hypot(mx - x0, my - y0)) <= most:
            grid[my, mx] = _LETHAL
            touch(bounds, px, py)


@njit()
def _outline(
    x: int, y: int, dx: int, dy: int, steps: int, lowest: IntArray, highest: IntArray
) -> None:
    """Widen each column's span by the cells of one line."""
    step_x = 1 if dx > 0 else -1
    step_y = 1 if dy > 0 else -1
    x_is_longer = abs(dx) >= abs(dy)
    longer, shorter = max(abs(dx), abs(dy)), min(abs(dx), abs(dy))
    error = longer // 2
    for _ in range(steps + 1):
        lowest[x] = min(lowest[x], y)
        highest[x] = max(highest[x], y)
        error += shorter
        turns = error >= longer
        if turns:
            error -= longer
        if x_is_longer or turns:
            x += step_x
        if not x_is_longer or turns:
            y += step_y


@njit(ahead=True)
def transform(points: FloatMatrix, x: float, y: float, yaw: float, moved: FloatMatrix) -> None:
    """Express points (N, 2), given in the frame at (x, y) [m], ``yaw`` [rad], in its parent."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    for i in range(points.shape[0]):
        moved[i, 0] = points[i, 0] * cos - points[i, 1] * sin + x
        moved[i, 1] = points[i, 0] * sin + points[i, 1] * cos + y


@njit(ahead=True)
def polygon_columns(
    polygon: FloatMatrix,
    origin: FloatVector,
    resolution: float,
    size_x: int,
    size_y: int,
    lowest: IntVector,
    highest: IntVector,
) -> tuple[int, int]:
    """The cells of a convex polygon (N, 2) [m], column by column (``Costmap2D::convexFillCells``).

    ``lowest`` and ``highest`` (size_x,) take the first and last row of each column.

    Returns:
        First and last column, or (0, -1) where a vertex lies off the grid: Nav2 then leaves the
        whole polygon out.
    """
    count = polygon.shape[0]
    cells = np.empty((count, 2), dtype=np.int64)
    first, last = size_x, -1
    for i in range(count):
        cells[i, 0], cells[i, 1] = to_cell(
            polygon[i, 0], polygon[i, 1], origin[0], origin[1], resolution, size_x, size_y
        )
        if cells[i, 0] < 0:
            return 0, -1
        first, last = min(first, cells[i, 0]), max(last, cells[i, 0])
    for column in range(first, last + 1):
        lowest[column], highest[column] = size_y, -1
    for i in range(count):
        j = (i + 1) % count
        x, y, dx, dy, steps = ray(cells[i, 0], cells[i, 1], cells[j, 0], cells[j, 1], math.inf, 0.0)
        _outline(x, y, dx, dy, steps, lowest, highest)
    return first, last


@njit(ahead=True)
def free_columns(
    grid: ByteMatrix, first: int, last: int, lowest: IntVector, highest: IntVector
) -> None:
    """Free the cells of a polygon given by :func:`polygon_columns`."""
    for x in range(first, last + 1):
        for y in range(lowest[x], highest[x] + 1):
            grid[y, x] = _FREE


@njit(ahead=True)
def combine_maximum(
    master: ByteMatrix,
    region: Box,
    layer: ByteMatrix,
    x: int,
    y: int,
    keep_unknown: bool,
) -> None:
    """Raise ``master`` to the known costs of ``layer`` (``updateWithMax``).

    Args:
        master: costs.
        region: cells x0, xn, y0, yn of it, ends exclusive; those that the layer lacks do not
            change.
        layer: costs; its first cell lies on the master's cell (x, y).
        x: see there.
        y: see there.
        keep_unknown: what is unknown in the master stays so
            (``updateWithMaxWithoutUnknownOverwrite``).
    """
    x0, xn = max(region[0], x), min(region[1], x + layer.shape[1])
    flat, own, one = master.reshape(-1), layer.reshape(-1), np.uint8(1)
    length = np.uint64(max(xn - x0, 0))
    for row in range(max(region[2], y), min(region[3], y + layer.shape[0])):
        to = np.uint64(row * master.shape[1] + x0)
        at = np.uint64((row - y) * layer.shape[1] + x0 - x)
        # No branches, so that it compiles to vector instructions.
        if keep_unknown:
            for j in range(length):
                flat[to + j] = max(flat[to + j], _FREE if own[at + j] == _UNKNOWN else own[at + j])
        else:  # unknown is the highest cost; with 1 added it wraps around to the lowest
            for j in range(length):
                flat[to + j] = np.uint8(
                    max(np.uint8(flat[to + j] + one), np.uint8(own[at + j] + one)) - one
                )

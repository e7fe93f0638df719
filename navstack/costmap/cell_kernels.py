"""Numba kernels of the obstacle layer as a list of its lethal cells, with the results of the dense ``kernels``.

Lattice cells are counted from a fixed corner; ``window`` (4,) is the grid's x, y of the first cell, width and height.
The first ``count`` rows of ``cells`` (n, 2) are the lethal cells, as lattice x, y. ``present`` (height, width) holds a
1 for each, wrapped around (x modulo width, y modulo height), so that a moving window copies nothing. ``changed`` (4,)
grows to the box x0, xn, y0, yn (ends exclusive) of all cells that came or went.

A dense grid visits each cell of each beam. Here each lethal cell looks for a beam that passes through it: only beams
with a bearing near its own come into question, and whether a Bresenham line holds a cell is one division.
"""

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from navstack.costmap.kernels import clip_to_grid, is_in_range, ray, to_cell
from navstack.types import ByteArray, FloatArray, IntArray

CellArray = npt.NDArray[np.int32]
LineArray = npt.NDArray[np.int32]

_u = np.uint64  # unsigned indices spare the treatment of negative ones


@njit(cache=True)
def sort_by_bearing(points: FloatArray, ox: float, oy: float, starts: IntArray, order: IntArray) -> None:
    """Sort points (n, 2) into sectors around (ox, oy): sector k holds ``order[starts[k]:starts[k + 1]]``."""
    sectors = starts.shape[0] - 1
    sector_of = np.empty(points.shape[0], dtype=np.int64)
    starts[:] = 0
    for i in range(points.shape[0]):
        share = (math.atan2(points[i, 1] - oy, points[i, 0] - ox) + math.pi) / (2.0 * math.pi)
        sector_of[i] = min(int(share * sectors), sectors - 1)
        starts[sector_of[i] + 1] += 1
    for k in range(sectors):
        starts[k + 1] += starts[k]
    place = starts[:sectors].copy()
    for i in range(points.shape[0]):
        order[place[sector_of[i]]] = i
        place[sector_of[i]] += 1


@njit(cache=True)
def trace_rays(
    points: FloatArray,
    order: IntArray,
    ox: float,
    oy: float,
    origin: FloatArray,
    resolution: float,
    window: IntArray,
    limits: FloatArray,
) -> LineArray:
    """The lines (n, 8) that clear, for the points in the given ``order``.

    Each holds its first lattice cell x, y, the unit steps x, y, the longer and the shorter difference, the number of
    steps (-1: no line) and whether x is the longer axis. ``limits`` are the raytrace ranges min, max [m]; ``origin``
    [m] is the window's corner.
    """
    lines = np.full((points.shape[0], 8), -1, dtype=np.int32)
    size_x, size_y = window[2], window[3]
    x0, y0 = to_cell(ox, oy, origin[0], origin[1], resolution, size_x, size_y)
    if x0 < 0:
        return lines
    end_x, end_y = origin[0] + size_x * resolution, origin[1] + size_y * resolution
    min_cells, max_cells = math.ceil(limits[0] / resolution), math.ceil(limits[1] / resolution)
    for k in range(order.shape[0]):
        i = order[k]
        wx, wy = clip_to_grid(ox, oy, points[i, 0], points[i, 1], origin[0], origin[1], end_x, end_y)
        x1, y1 = to_cell(wx, wy, origin[0], origin[1], resolution, size_x, size_y)
        if x1 < 0:
            continue
        x, y, dx, dy, steps = ray(x0, y0, x1, y1, max_cells, min_cells)
        line = lines[k]
        line[0], line[1] = x + window[0], y + window[1]
        line[2], line[3] = 1 if dx > 0 else -1, 1 if dy > 0 else -1
        line[4], line[5] = max(abs(dx), abs(dy)), min(abs(dx), abs(dy))
        line[6], line[7] = steps, abs(dx) >= abs(dy)
    return lines


@njit(cache=True)
def _any_holds(lines: LineArray, first: int, end: int, x: int, y: int) -> bool:
    """Whether one of the lines passes through a cell.

    After i steps a Bresenham line has moved (longer // 2 + i * shorter) // longer cells across.
    """
    for k in range(_u(first), _u(end)):
        along = (x - lines[k, _u(0)]) * lines[k, _u(2)]
        across = (y - lines[k, _u(1)]) * lines[k, _u(3)]
        if lines[k, _u(7)] == 0:
            along, across = across, along
        if along < 0 or along > lines[k, _u(6)]:
            continue
        longer = lines[k, _u(4)]
        if longer == 0:
            if across == 0:
                return True
            continue
        rest = longer // 2 + along * lines[k, _u(5)] - across * longer
        if 0 <= rest < longer:
            return True
    return False


@njit(cache=True)
def _is_hit(x: int, y: int, sensor: FloatArray, lines: LineArray, starts: IntArray) -> bool:
    """Whether any line passes through a cell; see :func:`drop_hit`."""
    dx, dy = x + 0.5 - sensor[0], y + 0.5 - sensor[1]
    squared = dx * dx + dy * dy
    if squared > sensor[2] * sensor[2]:
        return False
    sectors = starts.shape[0] - 1
    if squared <= sensor[3] * sensor[3]:
        return _any_holds(lines, 0, starts[sectors], x, y)
    half = math.asin(sensor[3] / math.sqrt(squared))
    bearing = math.atan2(dy, dx) + math.pi
    first = math.floor((bearing - half) / (2.0 * math.pi) * sectors)
    last = math.floor((bearing + half) / (2.0 * math.pi) * sectors)
    if first < 0:
        return _any_holds(lines, starts[first + sectors], starts[sectors], x, y) or _any_holds(
            lines, 0, starts[last + 1], x, y
        )
    if last >= sectors:
        return _any_holds(lines, starts[first], starts[sectors], x, y) or _any_holds(
            lines, 0, starts[last - sectors + 1], x, y
        )
    return _any_holds(lines, starts[first], starts[last + 1], x, y)


@njit(cache=True)
def grow(changed: IntArray, x: int, y: int) -> None:
    """Grow a box to hold a cell."""
    changed[0] = min(changed[0], x)
    changed[1] = max(changed[1], x + 1)
    changed[2] = min(changed[2], y)
    changed[3] = max(changed[3], y + 1)


@njit(cache=True)
def settle(cells: CellArray, kept: int, present: ByteArray, x: int, y: int, is_dropped: bool, changed: IntArray) -> int:
    """Drop a cell, or move it up behind the ``kept`` ones that stay; returns how many stay then."""
    if is_dropped:
        height, width = present.shape
        present[y % height, x % width] = 0
        grow(changed, x, y)
        return kept
    cells[kept, 0], cells[kept, 1] = x, y
    return kept + 1


@njit(cache=True)
def drop_hit(
    cells: CellArray,
    count: int,
    present: ByteArray,
    sensor: FloatArray,
    lines: LineArray,
    starts: IntArray,
    changed: IntArray,
) -> int:
    """Drop the cells that a line passes through; returns how many remain.

    ``lines`` come from :func:`trace_rays` in the order of :func:`sort_by_bearing`, ``starts`` are those of its sectors.
    ``sensor`` holds its lattice position x, y, its reach and how far a line's cells may lie from their beam, [cells].
    """
    kept = 0
    for i in range(count):
        x, y = cells[i, 0], cells[i, 1]
        kept = settle(cells, kept, present, x, y, _is_hit(x, y, sensor, lines, starts), changed)
    return kept


@njit(cache=True)
def drop_box(
    cells: CellArray, count: int, present: ByteArray, box: IntArray, drop_inside: bool, changed: IntArray
) -> int:
    """Drop the cells inside (or outside) the box x0, xn, y0, yn (ends exclusive); returns how many remain."""
    kept = 0
    for i in range(count):
        x, y = cells[i, 0], cells[i, 1]
        inside = box[0] <= x < box[1] and box[2] <= y < box[3]
        kept = settle(cells, kept, present, x, y, inside == drop_inside, changed)
    return kept


@njit(cache=True)
def drop_columns(
    cells: CellArray,
    count: int,
    present: ByteArray,
    window: IntArray,
    span: tuple[int, int],
    lowest: IntArray,
    highest: IntArray,
    changed: IntArray,
) -> int:
    """Drop the cells of a polygon given by ``kernels.polygon_columns``; returns how many remain."""
    kept = 0
    for i in range(count):
        x, y = cells[i, 0], cells[i, 1]
        column, row = x - window[0], y - window[1]
        inside = span[0] <= column <= span[1] and lowest[column] <= row <= highest[column]
        kept = settle(cells, kept, present, x, y, inside, changed)
    return kept


@njit(cache=True)
def mark_cells(
    cells: CellArray,
    count: int,
    present: ByteArray,
    points: FloatArray,
    ox: float,
    oy: float,
    origin: FloatArray,
    resolution: float,
    window: IntArray,
    limits: FloatArray,
    changed: IntArray,
) -> int:
    """Add the cells of points within the obstacle ranges ``limits`` min, max [m]; returns how many there are then."""
    height, width = present.shape
    x0 = math.floor((ox - origin[0]) / resolution)
    y0 = math.floor((oy - origin[1]) / resolution)
    min_cells, max_cells = math.ceil(limits[0] / resolution), math.ceil(limits[1] / resolution)
    for i in range(points.shape[0]):
        px, py = points[i, 0], points[i, 1]
        if not is_in_range(px, py, ox, oy, limits):
            continue
        mx, my = to_cell(px, py, origin[0], origin[1], resolution, window[2], window[3])
        if mx < 0:
            continue
        distance = int(math.hypot(mx - x0, my - y0))
        if distance < min_cells or distance > max_cells:
            continue
        x, y = mx + window[0], my + window[1]
        if present[y % height, x % width] == 0:
            present[y % height, x % width] = 1
            cells[count, 0], cells[count, 1] = x, y
            count += 1
            grow(changed, x, y)
    return count

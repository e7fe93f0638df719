"""Numba kernels of the obstacle layer as a list of its lethal cells.

Their results are those of the dense ``kernels``. Lattice cells are counted from a fixed corner.
``changed`` (4,) grows to the box x0, xn, y0, yn (ends exclusive) of all cells that came or went.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from navstack.costmap.beam_kernels import UNTRACED, is_hit, view_from
from navstack.costmap.costmap import LETHAL_OBSTACLE, Box
from navstack.costmap.kernels import is_in_range, polygon_columns, to_cell
from navstack.jit import njit
from navstack.types import (
    ByteArray,
    ByteMatrix,
    FixedByteMatrix,
    FloatMatrix,
    FloatVector,
    Int32Matrix,
    IntArray,
    IntMatrix,
    IntVector,
)

CellArray = npt.NDArray[np.int32]

LISTED = 1  # in the list of cells
DOUBTED = 2  # a beam has passed through it; it goes unless a return marks it again

_FARTHEST = 1 << 30  # lattice cells from the corner: what 32 bits hold, with room for a window

_LETHAL = np.uint8(LETHAL_OBSTACLE)
_u = np.uint64  # unsigned indices spare the treatment of negative ones


class Listed(NamedTuple):
    """The lethal cells, all of them in the window."""

    cells: Int32Matrix  # (n, 2) lattice x, y; the first ``length`` count
    length: int
    # (height, width) state of each cell of the window: 0, LISTED, or LISTED and DOUBTED; wrapped
    # around (x modulo width, y modulo height), so that a moving window copies nothing
    present: ByteMatrix
    window: IntVector  # (4,) lattice x, y of its first cell, width and height


@njit()
def wrapping(window: IntArray, present: ByteArray) -> tuple[int, int]:
    """What is added to x and y of a cell of the window before they are wrapped around once."""
    height, width = present.shape
    return window[0] % width - window[0], window[1] % height - window[1]


@njit()
def place_of(x: int, y: int, shift: tuple[int, int], present: ByteArray) -> int:
    """Where the flat ``present`` holds the state of a cell of the window.

    ``shift`` is of :func:`wrapping`, which divides: too slow to be done for every cell.
    """
    height, width = present.shape
    column, row = x + shift[0], y + shift[1]
    if column >= width:
        column -= width
    if row >= height:
        row -= height
    return int(row * width + column)


@njit()
def grow(changed: IntArray, x: int, y: int) -> None:
    """Grow a box to hold a cell that came or went."""
    changed[0] = min(changed[0], x)
    changed[1] = max(changed[1], x + 1)
    changed[2] = min(changed[2], y)
    changed[3] = max(changed[3], y + 1)


@njit(ahead=True)
def clear_hit(
    listed: Listed,
    points: FloatMatrix,
    starts: IntVector,
    place: tuple[float, float],
    origin: FloatVector,
    resolution: float,
    limits: tuple[float, float],
    lateral: float,
    lines: Int32Matrix,
) -> None:
    """Let the cells be doubted that a beam passes through.

    Args:
        listed: the cells.
        points: (n, 2) [m] where the beams end, sorted by bearing.
        starts: of their sectors, see ``beam_kernels.sort_by_bearing``.
        place: x, y [m] of the sensor.
        origin: x, y [m] of the window's corner.
        resolution: [m/cell].
        limits: raytrace ranges min, max [m].
        lateral: [cells] how far a line's cells may lie from their beam.
        lines: (m, 8) room for the beams' lines, m at least n.
    """
    cells, count, present, window = listed
    flat = present.reshape(-1)
    shift = wrapping(window, present)
    ox, oy = place
    sensor = (
        (ox - origin[0]) / resolution + window[0],
        (oy - origin[1]) / resolution + window[1],
        (limits[0] + limits[1]) / resolution + 5.0,  # no cell of a line is farther away
        lateral,
    )
    view = view_from(ox, oy, origin, resolution, window, limits)
    for k in range(_u(points.shape[0])):
        lines[k, 6] = UNTRACED
    for i in range(_u(count)):
        x, y = int(cells[i, 0]), int(cells[i, 1])
        if is_hit(x, y, sensor, points, starts, view, lines):
            flat[_u(place_of(x, y, shift, present))] |= DOUBTED


@njit(ahead=True)
def mark_cells(
    listed: Listed,
    points: FloatMatrix,
    place: tuple[float, float],
    origin: FloatVector,
    resolution: float,
    limits: tuple[float, float],
    background: FixedByteMatrix,
    margin: int,
    changed: IntVector,
) -> int:
    """Add the cells of points within the obstacle ranges ``limits`` min, max [m].

    Returns how many there are then.

    ``background`` holds the costs of the map: the lattice cell (x, y) at [y + margin, x + margin].
    What is lethal there is left out, and so is everything where the window lies farther off than 32
    bits count.
    """
    cells, count, present, window = listed
    flat = present.reshape(-1)
    shift = wrapping(window, present)
    ox, oy = place
    origin_x, origin_y, size_x, size_y = origin[0], origin[1], window[2], window[3]
    if max(abs(window[0]), abs(window[1])) > _FARTHEST:
        return count
    x0, y0 = math.floor((ox - origin_x) / resolution), math.floor((oy - origin_y) / resolution)
    least = float(math.ceil(limits[0] / resolution))
    most = float(math.ceil(limits[1] / resolution)) + 1.0
    for i in range(_u(points.shape[0])):
        px, py = points[i, 0], points[i, 1]
        if not is_in_range(px, py, ox, oy, limits):
            continue
        mx, my = to_cell(px, py, origin_x, origin_y, resolution, size_x, size_y)
        if mx < 0:
            continue
        squared = (mx - x0) * (mx - x0) + (my - y0) * (my - y0)
        # the distance is truncated to whole cells
        if squared < least * least or squared >= most * most:
            continue
        x, y = mx + window[0], my + window[1]
        at = _u(place_of(x, y, shift, present))
        if flat[at] != 0:
            flat[at] = LISTED
            continue
        column, row = x + margin, y + margin
        inside = 0 <= column < background.shape[1] and 0 <= row < background.shape[0]
        if inside and background[_u(row), _u(column)] == _LETHAL:
            continue
        flat[at] = LISTED
        cells[count, 0], cells[count, 1] = x, y
        count += 1
        grow(changed, x, y)
    return count


@njit()
def drop_doubted(listed: Listed, changed: IntArray) -> int:
    """Drop the cells that are doubted; returns how many remain."""
    cells, count, present, window = listed
    flat = present.reshape(-1)
    shift = wrapping(window, present)
    kept = 0
    for i in range(_u(count)):
        x, y = int(cells[i, 0]), int(cells[i, 1])
        at = _u(place_of(x, y, shift, present))
        if flat[at] & DOUBTED:
            grow(changed, x, y)
            flat[at] = 0
        else:
            cells[kept, 0], cells[kept, 1] = x, y
            kept += 1
    return kept


@njit(ahead=True)
def drop_outside(
    listed: Listed,
    box: Box,
    changed: IntVector,
) -> int:
    """Drop the cells outside the box x0, xn, y0, yn (ends exclusive), of which none is doubted.

    Returns how many remain.
    """
    cells, count, present, window = listed
    flat = present.reshape(-1)
    shift = wrapping(window, present)
    kept = 0
    for i in range(_u(count)):
        x, y = int(cells[i, 0]), int(cells[i, 1])
        if box[0] <= x < box[1] and box[2] <= y < box[3]:
            cells[kept, 0], cells[kept, 1] = x, y
            kept += 1
        else:
            grow(changed, x, y)
            flat[_u(place_of(x, y, shift, present))] = 0
    return kept


@njit(ahead=True)
def drop_polygon(
    listed: Listed,
    polygon: FloatMatrix,
    origin: FloatVector,
    resolution: float,
    columns: IntMatrix,
    changed: IntVector,
) -> int:
    """Drop the doubted cells and those of a convex polygon (N, 2) [m]; returns how many remain.

    ``columns`` (2, width) is room for the first and last row of each column, see
    ``kernels.polygon_columns``.
    """
    cells, count, present, window = listed
    flat = present.reshape(-1)
    shift = wrapping(window, present)
    first, last = polygon_columns(
        polygon, origin, resolution, window[2], window[3], columns[0], columns[1]
    )
    for i in range(_u(count)):
        x, y = int(cells[i, 0]), int(cells[i, 1])
        column, row = x - window[0], y - window[1]
        if first <= column <= last and columns[0, column] <= row <= columns[1, column]:
            flat[_u(place_of(x, y, shift, present))] |= DOUBTED
    return drop_doubted(listed, changed)

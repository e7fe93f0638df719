"""Numba kernels from ranges to the lines that their beams clear.

Projection, order by bearing, line tests.

A dense grid visits each cell of each beam. Here each lethal cell looks for a beam that passes
through it: only beams with a bearing near its own come into question, and whether a Bresenham line
holds a cell is one comparison.

A bearing is given as a number that grows with it and needs no arc tangent: 0 to 4, one per
quadrant.
"""

import math

import numpy as np
import numpy.typing as npt

from navstack.costmap.kernels import clip_to_grid, ray, to_cell
from navstack.jit import njit
from navstack.types import FloatArray, FloatMatrix, FloatVector, IntArray, IntVector

LineArray = npt.NDArray[np.int32]
View = tuple[
    tuple[float, float, float, float, float, float, float, float, float],
    tuple[int, int, int, int, int, int],
]  # see view_from

# steps of a line that nobody has asked for, and of one that does not exist
UNTRACED, NO_LINE = -2, -1

_u = np.uint64  # unsigned indices spare the treatment of negative ones
# asin(x) / x is less for x up to 1/2; and the bearing's number grows by at most 1 per rad
_ARC = 1.05


@njit(ahead=True)
def project(
    ranges: FloatVector,
    directions: FloatMatrix,
    limits: tuple[float, float],
    endless: float,
    sensor: tuple[float, float, float, float],
    points: FloatMatrix,
) -> int:
    """The ends of beams in the frame of the sensor's pose, into ``points`` (n, 2).

    Args:
        ranges: (n,) [m].
        directions: (n, 2) unit vectors of the beams in the sensor's frame.
        limits: [m] the least range that counts, and the greatest, which no longer does.
        endless: [m] in place of an infinite range.
        sensor: x, y [m], cos and sin of its yaw.
        points: room for the result.

    Returns:
        How many points there are.
    """
    x, y, cos, sin = sensor
    count = 0
    for i in range(_u(ranges.shape[0])):
        reach = endless if ranges[i] == math.inf else ranges[i]
        if reach >= limits[0] and reach < limits[1]:  # False for nan
            px, py = directions[i, 0] * reach, directions[i, 1] * reach
            points[count, 0] = cos * px - sin * py + x
            points[count, 1] = sin * px + cos * py + y
            count += 1
    return count


@njit()
def _bearing(dx: float, dy: float) -> float:
    """A number in [0, 4) that grows with the bearing; 0 where there is none."""
    total = abs(dx) + abs(dy)
    if total == 0.0:
        return 0.0
    share = dy / total
    if dx < 0.0:
        return 2.0 - share
    if share < 0.0:
        return 4.0 + share
    return share


@njit(ahead=True)
def sort_by_bearing(
    points: FloatMatrix, ox: float, oy: float, starts: IntVector, ordered: FloatMatrix
) -> None:
    """Sort points (n, 2) into sectors around (ox, oy).

    Sector k holds ``ordered[starts[k]:starts[k + 1]]``.
    """
    sectors = starts.shape[0] - 1
    count = points.shape[0]
    sector_of = np.empty(count, dtype=np.int64)
    place = np.zeros(sectors + 1, dtype=np.int64)
    for i in range(count):
        share = _bearing(points[i, 0] - ox, points[i, 1] - oy) * 0.25
        # nan: it has no line
        sector_of[i] = min(int(share * sectors), sectors - 1) if share >= 0.0 else 0
        place[sector_of[i] + 1] += 1
    starts[0] = 0
    for k in range(sectors):
        place[k + 1] += place[k]
        starts[k + 1] = place[k + 1]
    for i in range(count):
        at = place[sector_of[i]]
        ordered[at, 0], ordered[at, 1] = points[i, 0], points[i, 1]
        place[sector_of[i]] = at + 1


@njit()
def trace_ray(px: float, py: float, view: View, line: LineArray) -> None:
    """The line (8,) that clears on the way to a point (px, py) [m].

    ``view``: see :func:`view_from`.

    It holds its first lattice cell x, y, the unit steps x, y, the longer and the shorter
    difference, the number of steps (NO_LINE: none) and whether x is the longer axis.
    """
    ox, oy, origin_x, origin_y, resolution, end_x, end_y, least, most = view[0]
    x0, y0, size_x, size_y, left, low = view[1]
    line[6] = NO_LINE
    wx, wy = clip_to_grid(ox, oy, px, py, origin_x, origin_y, end_x, end_y)
    x1, y1 = to_cell(wx, wy, origin_x, origin_y, resolution, size_x, size_y)
    if x0 < 0 or x1 < 0:
        return
    x, y, dx, dy, steps = ray(x0, y0, x1, y1, most, least)
    line[0], line[1] = x + left, y + low
    line[2], line[3] = 1 if dx > 0 else -1, 1 if dy > 0 else -1
    line[4], line[5] = max(abs(dx), abs(dy)), min(abs(dx), abs(dy))
    line[6], line[7] = steps, abs(dx) >= abs(dy)


@njit()
def view_from(
    ox: float,
    oy: float,
    origin: FloatArray,
    resolution: float,
    window: IntArray,
    limits: tuple[float, float],
) -> View:
    """What all beams from (ox, oy) [m] have in common.

    Args:
        ox: [m].
        oy: [m].
        origin: x, y [m] of the window's corner.
        resolution: [m/cell].
        window: lattice x, y of its first cell, width and height.
        limits: raytrace ranges min, max [m].

    Returns:
        Sensor x, y, corner x, y, resolution, far corner x, y [m] and the limits in whole cells;
        then the sensor's cell in the window (-1: off it) and the window.
    """
    x0, y0 = to_cell(ox, oy, origin[0], origin[1], resolution, window[2], window[3])
    end_x, end_y = origin[0] + window[2] * resolution, origin[1] + window[3] * resolution
    least, most = float(math.ceil(limits[0] / resolution)), float(math.ceil(limits[1] / resolution))
    metric = (ox, oy, origin[0], origin[1], resolution, end_x, end_y, least, most)
    return metric, (x0, y0, window[2], window[3], window[0], window[1])


@njit()
def is_hit(
    x: int,
    y: int,
    sensor: tuple[float, float, float, float],
    points: FloatArray,
    starts: IntArray,
    view: View,
    lines: LineArray,
) -> bool:
    """Whether the line to any point passes through a lattice cell.

    After i steps a Bresenham line has moved (longer // 2 + i * shorter) // longer cells across.

    Args:
        x: of the cell.
        y: of the cell.
        sensor: its lattice position x, y, its reach and how far a line's cells may lie from their
            beam, [cells].
        points: (n, 2) [m] in the order of :func:`sort_by_bearing`.
        starts: of its sectors.
        view: see :func:`view_from`.
        lines: (m, 8), m at least n: the lines that have been traced, the others UNTRACED.
    """
    first, count = candidates(
        x + 0.5 - sensor[0], y + 0.5 - sensor[1], sensor[2], sensor[3], starts
    )
    for j in range(count):
        cyclic = first + j
        if cyclic >= points.shape[0]:
            cyclic -= points.shape[0]
        k = _u(cyclic)
        line = lines[k]
        if line[6] == UNTRACED:
            trace_ray(points[k, 0], points[k, 1], view, line)
        along = (x - line[0]) * line[2]
        across = (y - line[1]) * line[3]
        if line[7] == 0:
            along, across = across, along
        if along < 0 or along > line[6]:
            continue
        longer = line[4]
        rest = (longer >> 1) + along * line[5] - across * longer
        if 0 <= rest < longer or (longer == 0 and across == 0):
            return True
    return False


@njit()
def candidates(
    dx: float, dy: float, reach: float, lateral: float, starts: IntArray
) -> tuple[int, int]:
    """The first of the points whose lines may hold a cell, and how many there are, cyclically.

    Args:
        dx: [cells] from the sensor to the cell's centre.
        dy: the same along y.
        reach: [cells] no line holds a cell beyond.
        lateral: [cells] how far a line's cells may lie from their beam.
        starts: of the points' sectors, see :func:`sort_by_bearing`.
    """
    squared = dx * dx + dy * dy
    if not squared <= reach * reach:  # nan, too
        return 0, 0
    sectors = starts.shape[0] - 1
    if squared <= 4.0 * lateral * lateral:
        return 0, starts[sectors]
    half = _ARC * lateral / math.sqrt(squared)
    bearing = _bearing(dx, dy)
    first = math.floor((bearing - half) * 0.25 * sectors)
    last = math.floor((bearing + half) * 0.25 * sectors) + 1
    around = 0  # points of a whole turn, where the sectors go beyond the last
    if first < 0:
        first += sectors
        around = starts[sectors]
    elif last > sectors:
        last -= sectors
        around = starts[sectors]
    begin = starts[first]
    return begin, starts[last] - begin + around

"""Numba kernels of the bounds within which an update of a costmap writes, as nav2_costmap_2d has them.

``bounds`` (4,) collects in [m] what was touched: min x, max x, min y, max y. Grids, ranges and the rest are as in
:mod:`~navstack.costmap.kernels`; ``size`` is a grid's width and height in cells.
"""

import math

from navstack.costmap.kernels import clip_to_grid, marked_cell, to_cell
from navstack.jit import njit
from navstack.types import FloatArray


@njit(cache=True)
def touch(bounds: FloatArray, x: float, y: float) -> None:
    """Grow the bounds to hold a point."""
    bounds[0] = min(bounds[0], x)
    bounds[1] = max(bounds[1], x)
    bounds[2] = min(bounds[2], y)
    bounds[3] = max(bounds[3], y)


@njit(cache=True)
def touch_all(bounds: FloatArray, points: FloatArray) -> None:
    """Grow the bounds to hold points (N, 2)."""
    for i in range(points.shape[0]):
        touch(bounds, points[i, 0], points[i, 1])


@njit(cache=True)
def touch_rays(
    points: FloatArray,
    ox: float,
    oy: float,
    origin: FloatArray,
    resolution: float,
    size: tuple[int, int],
    limits: tuple[float, float],
    bounds: FloatArray,
) -> None:
    """Grow the bounds to the ends of the beams that ``kernels.clear_rays`` follows; not to all of their cells."""
    size_x, size_y = size
    origin_x, origin_y = origin[0], origin[1]
    if to_cell(ox, oy, origin_x, origin_y, resolution, size_x, size_y)[0] < 0:
        return
    touch(bounds, ox, oy)
    end_x, end_y = origin_x + size_x * resolution, origin_y + size_y * resolution
    for i in range(points.shape[0]):
        wx, wy = clip_to_grid(ox, oy, points[i, 0], points[i, 1], origin_x, origin_y, end_x, end_y)
        if to_cell(wx, wy, origin_x, origin_y, resolution, size_x, size_y)[0] < 0:
            continue
        distance = math.hypot(wx - ox, wy - oy)
        if distance >= limits[0]:
            scale = min(1.0, limits[1] / distance) if distance > 0.0 else 1.0
            touch(bounds, ox + (wx - ox) * scale, oy + (wy - oy) * scale)


@njit(cache=True)
def touch_marks(
    points: FloatArray,
    ox: float,
    oy: float,
    origin: FloatArray,
    resolution: float,
    size: tuple[int, int],
    limits: tuple[float, float],
    bounds: FloatArray,
) -> None:
    """Grow the bounds to the points that ``kernels.mark_points`` marks."""
    for i in range(points.shape[0]):
        if marked_cell(points[i, 0], points[i, 1], ox, oy, origin, resolution, size, limits)[0] >= 0:
            touch(bounds, points[i, 0], points[i, 1])

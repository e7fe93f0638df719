"""Hot loops of the sampling-based planners: which points and straight lines of a costmap are free."""

import math

import numpy as np
from numba import njit

from navstack.types import BoolArray, ByteArray, FloatArray


def blocked_table(max_allowed_cost: int, allow_unknown: bool) -> BoolArray:
    """Whether each costmap value 0..255 blocks the way."""
    blocked = np.arange(256) > max_allowed_cost
    blocked[255] = not allow_unknown
    return blocked


@njit(cache=True)
def is_free(costs: ByteArray, blocked: BoolArray, x: float, y: float) -> bool:
    """Whether the point (x, y) in [cells] from the map's corner lies in a free cell of ``costs`` (height, width)."""
    if not (0.0 <= x < costs.shape[1] and 0.0 <= y < costs.shape[0]):
        return False
    return not blocked[costs[int(y), int(x)]]


@njit(cache=True)
def is_line_free(costs: ByteArray, blocked: BoolArray, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether every cell that a straight line touches is free; points in [cells].

    Cell by cell (Amanatides and Woo, 1987): no corner is cut, as sampling at a step would.
    """
    if not (is_free(costs, blocked, x0, y0) and is_free(costs, blocked, x1, y1)):
        return False
    dx, dy = x1 - x0, y1 - y0
    column, row = int(x0), int(y0)
    step_x, step_y = (1 if dx > 0.0 else -1), (1 if dy > 0.0 else -1)
    per_column = abs(1.0 / dx) if dx != 0.0 else np.inf  # of the line's parameter 0..1
    per_row = abs(1.0 / dy) if dy != 0.0 else np.inf
    next_column = ((column + 1 - x0) if dx > 0.0 else (x0 - column)) * per_column if dx != 0.0 else np.inf
    next_row = ((row + 1 - y0) if dy > 0.0 else (y0 - row)) * per_row if dy != 0.0 else np.inf
    for _ in range(abs(int(x1) - column) + abs(int(y1) - row)):
        if next_column < next_row:
            column, next_column = column + step_x, next_column + per_column
        else:
            row, next_row = row + step_y, next_row + per_row
        if not (0 <= column < costs.shape[1] and 0 <= row < costs.shape[0]) or blocked[costs[row, column]]:
            return False
    return True


@njit(cache=True)
def line_cost(costs: ByteArray, x0: float, y0: float, x1: float, y1: float) -> float:
    """Mean costmap value at half-cell steps along a straight line within the map; points in [cells]."""
    steps = max(1, math.ceil(2.0 * math.hypot(x1 - x0, y1 - y0)))
    total = 0.0
    for i in range(steps + 1):
        t = i / steps
        column = min(int(x0 + t * (x1 - x0)), costs.shape[1] - 1)
        row = min(int(y0 + t * (y1 - y0)), costs.shape[0] - 1)
        total += costs[row, column]
    return total / (steps + 1)


@njit(cache=True)
def nearest_free_cell(costs: ByteArray, blocked: BoolArray, column: int, row: int, radius: float) -> tuple[int, int]:
    """The free cell nearest to a cell within ``radius`` [cells]; (-1, -1) where there is none."""
    best, best_column, best_row = radius * radius + 1e-9, -1, -1
    reach = int(math.ceil(radius))
    for y in range(max(0, row - reach), min(costs.shape[0], row + reach + 1)):
        for x in range(max(0, column - reach), min(costs.shape[1], column + reach + 1)):
            squared = float((x - column) ** 2 + (y - row) ** 2)
            if squared < best and not blocked[costs[y, x]]:
                best, best_column, best_row = squared, x, y
    return best_column, best_row


@njit(cache=True)
def shortcut(
    costs: ByteArray, blocked: BoolArray, points: FloatArray, cost_weight: float, draws: FloatArray
) -> FloatArray:
    """Take short cuts between random points of a polyline (N, 2) in [cells] (Geraerts and Overmars, 2007).

    A short cut is taken where it is free and not costlier. ``draws`` (M, 2) in [0, 1) are places along the line.
    """
    path = points
    for i in range(len(draws)):
        along = cumulative_length(path)
        a, b = draws[i].min() * along[-1], draws[i].max() * along[-1]
        first, last = np.searchsorted(along, a, side="right"), np.searchsorted(along, b, side="left")
        if first >= last:
            continue  # on one segment
        start, end = point_at(path, along, a), point_at(path, along, b)
        bypass = np.concatenate((start, path[first:last].copy().ravel(), end)).reshape(-1, 2)
        straight = np.concatenate((start, end)).reshape(-1, 2)
        if not is_line_free(costs, blocked, start[0], start[1], end[0], end[1]):
            continue
        if polyline_cost(costs, straight, cost_weight) <= polyline_cost(costs, bypass, cost_weight):
            path = np.concatenate((path[:first].copy().ravel(), straight.ravel(), path[last:].copy().ravel())).reshape(
                -1, 2
            )
    return path


@njit(cache=True)
def cumulative_length(path: FloatArray) -> FloatArray:
    """Length of a polyline (N, 2) up to each of its points."""
    along = np.zeros(len(path))
    for i in range(1, len(path)):
        along[i] = along[i - 1] + math.hypot(path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1])
    return along


@njit(cache=True)
def point_at(path: FloatArray, along: FloatArray, distance: float) -> FloatArray:
    """The point (2,) at a distance along a polyline whose cumulative length is ``along``."""
    x, y = np.interp(distance, along, path[:, 0]), np.interp(distance, along, path[:, 1])
    return np.array((x, y))


@njit(cache=True)
def polyline_cost(costs: ByteArray, path: FloatArray, cost_weight: float) -> float:
    """Length of a polyline in [cells], each piece times 1 + cost_weight * mean cost / 252."""
    total = 0.0
    for i in range(1, len(path)):
        x0, y0, x1, y1 = path[i - 1, 0], path[i - 1, 1], path[i, 0], path[i, 1]
        length = math.hypot(x1 - x0, y1 - y0)
        if cost_weight > 0.0 and length > 0.0:
            length *= 1.0 + cost_weight * line_cost(costs, x0, y0, x1, y1) / 252.0
        total += length
    return total

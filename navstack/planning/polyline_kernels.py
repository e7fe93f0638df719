"""Polylines on a costmap: their lengths and costs, and short cuts."""

import math

import numpy as np

from navstack.jit import njit
from navstack.planning.ompl_kernels import Room, can_turn, is_edge_free
from navstack.types import BoolArray, ByteArray, FloatArray


@njit()
def line_cost(
    costs: ByteArray,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
) -> float:
    """Mean costmap value at half-cell steps along a straight line within the map.

    Points in [cells].
    """
    steps = max(1, math.ceil(2.0 * math.hypot(x1 - x0, y1 - y0)))
    total = 0.0
    for i in range(steps + 1):
        t = i / steps
        column = min(int(x0 + t * (x1 - x0)), costs.shape[1] - 1)
        row = min(int(y0 + t * (y1 - y0)), costs.shape[0] - 1)
        total += costs[row, column]
    return total / (steps + 1)


@njit()
def shortcut(
    costs: ByteArray,
    blocked: BoolArray,
    room: Room,
    points: FloatArray,
    cost_weight: float,
    draws: FloatArray,
) -> FloatArray:
    """Take short cuts between random points of a polyline (N, 2) (Geraerts and Overmars, 2007).

    A short cut is taken where it is free and not costlier. ``draws`` (M, 2) in [0, 1) are places
    along the line.
    """
    path = points
    for i in range(len(draws)):
        along = cumulative_length(path)
        a = draws[i].min() * along[-1]
        b = draws[i].max() * along[-1]
        first = np.searchsorted(along, a, side="right")
        last = np.searchsorted(along, b, side="left")
        if first >= last:
            continue  # on one segment
        start = point_at(path, along, a)
        end = point_at(path, along, b)
        bypass = np.concatenate((start, path[first:last].copy().ravel(), end)).reshape(-1, 2)
        straight = np.concatenate((start, end)).reshape(-1, 2)
        if not is_edge_free(costs, blocked, room, start[0], start[1], end[0], end[1]):
            continue
        if not (
            can_turn(costs, blocked, room, start[0], start[1])
            and can_turn(costs, blocked, room, end[0], end[1])
        ):
            continue
        if polyline_cost(costs, straight, cost_weight) <= polyline_cost(costs, bypass, cost_weight):
            path = np.concatenate(
                (path[:first].copy().ravel(), straight.ravel(), path[last:].copy().ravel())
            ).reshape(-1, 2)
    return path


@njit()
def cumulative_length(path: FloatArray) -> FloatArray:
    """Length of a polyline (N, 2) up to each of its points."""
    along = np.zeros(len(path))
    for i in range(1, len(path)):
        along[i] = along[i - 1] + math.hypot(
            path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1]
        )
    return along


@njit()
def point_at(path: FloatArray, along: FloatArray, distance: float) -> FloatArray:
    """The point (2,) at a distance along a polyline whose cumulative length is ``along``."""
    x = np.interp(distance, along, path[:, 0])
    y = np.interp(distance, along, path[:, 1])
    return np.array((x, y))


@njit()
def weighted_length(
    costs: ByteArray,
    cost_weight: float,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
) -> float:
    """Length of a straight line in [cells], times 1 + cost_weight * mean cost / 252."""
    length = math.hypot(x1 - x0, y1 - y0)
    if cost_weight > 0.0 and length > 0.0:
        length *= 1.0 + cost_weight * line_cost(costs, x0, y0, x1, y1) / 252.0
    return length


@njit()
def polyline_cost(costs: ByteArray, path: FloatArray, cost_weight: float) -> float:
    """Length of a polyline in [cells], each piece times 1 + cost_weight * mean cost / 252."""
    total = 0.0
    for i in range(1, len(path)):
        total += weighted_length(
            costs, cost_weight, path[i - 1, 0], path[i - 1, 1], path[i, 0], path[i, 1]
        )
    return total

"""Hot loops of the sampling-based planners.

Which points and straight lines of a costmap are free.
"""

import math
from typing import NamedTuple

import numpy as np

from navstack.costmap.costmap import LETHAL_OBSTACLE, NO_INFORMATION
from navstack.jit import njit
from navstack.types import BoolArray, ByteArray, FloatArray


class Room(NamedTuple):
    """How far obstacles must be from the robot's centre, in [cells]; 0: the costs alone decide."""

    corridor: float = 0.0  # while it drives along a line
    turning: float = 0.0  # where it may turn
    allow_unknown: bool = True


def blocked_table(max_allowed_cost: int, allow_unknown: bool) -> BoolArray:
    """Whether each costmap value 0..255 blocks the way."""
    blocked = np.arange(256) > max_allowed_cost
    blocked[255] = not allow_unknown
    return blocked


@njit()
def has_room(
    costs: ByteArray,
    x: float,
    y: float,
    radius: float,
    allow_unknown: bool,
) -> bool:
    """Whether a disc holds no part of an obstacle's cell (cost 254, or unknown where that counts).

    All in [cells].

    Nothing stands beyond the map. ``radius`` 0 or less: there is room.
    """
    if radius <= 0.0:
        return True
    for row in range(
        max(0, math.floor(y - radius)), min(costs.shape[0], math.floor(y + radius) + 1)
    ):
        dy = max(row - y, y - (row + 1), 0.0)
        half = math.sqrt(max(radius * radius - dy * dy, 0.0))
        for column in range(
            max(0, math.floor(x - half)), min(costs.shape[1], math.floor(x + half) + 1)
        ):
            cost = costs[row, column]
            if cost == LETHAL_OBSTACLE or (cost == NO_INFORMATION and not allow_unknown):
                return False
    return True


@njit()
def has_corridor(
    costs: ByteArray,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    radius: float,
    allow_unknown: bool,
) -> bool:
    """Whether discs at steps of half a cell along a line all have room; all in [cells]."""
    steps = max(1, math.ceil(2.0 * math.hypot(x1 - x0, y1 - y0)))
    for i in range(steps + 1):
        t = i / steps
        if not has_room(costs, x0 + t * (x1 - x0), y0 + t * (y1 - y0), radius, allow_unknown):
            return False
    return True


@njit()
def are_connected(
    costs: ByteArray,
    blocked: BoolArray,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
) -> bool:
    """Whether free cells, each beside the next, lead from one free point to another.

    Points in [cells].
    """
    width = costs.shape[1]
    cells = costs.size
    reached = np.zeros(cells, dtype=np.bool_)
    waiting = np.empty(cells, dtype=np.int32)
    source = int(y0) * width + int(x0)
    target = int(y1) * width + int(x1)
    reached[source] = True
    waiting[0] = source
    count = 1
    while count > 0 and not reached[target]:
        count -= 1
        n = waiting[count]
        column = n % width
        for m, is_there in (
            (n - 1, column > 0),
            (n + 1, column < width - 1),
            (n - width, True),
            (n + width, True),
        ):
            if (
                is_there
                and 0 <= m < cells
                and not reached[m]
                and not blocked[costs[m // width, m % width]]
            ):
                reached[m] = True
                waiting[count] = m
                count += 1
    return bool(reached[target])


@njit()
def is_free(costs: ByteArray, blocked: BoolArray, x: float, y: float) -> bool:
    """Whether (x, y) in [cells] from the map's corner lies in a free cell of ``costs``."""
    if not (0.0 <= x < costs.shape[1] and 0.0 <= y < costs.shape[0]):
        return False
    return not blocked[costs[int(y), int(x)]]


@njit()
def is_line_free(
    costs: ByteArray,
    blocked: BoolArray,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
) -> bool:
    """Whether every cell that a straight line touches is free; points in [cells].

    Cell by cell (Amanatides and Woo, 1987): no corner is cut, as sampling at a step would.
    """
    if not (is_free(costs, blocked, x0, y0) and is_free(costs, blocked, x1, y1)):
        return False
    dx = x1 - x0
    dy = y1 - y0
    column = int(x0)
    row = int(y0)
    step_x = 1 if dx > 0.0 else -1
    step_y = 1 if dy > 0.0 else -1
    # of the line's parameter 0..1: from one column or row to the next, and to the first one
    per_column = per_row = next_column = next_row = np.inf
    if dx != 0.0:
        per_column = abs(1.0 / dx)
        next_column = (x0 - column) * per_column
    if dx > 0.0:
        next_column = (column + 1 - x0) * per_column
    if dy != 0.0:
        per_row = abs(1.0 / dy)
        next_row = (y0 - row) * per_row
    if dy > 0.0:
        next_row = (row + 1 - y0) * per_row
    for _ in range(abs(int(x1) - column) + abs(int(y1) - row)):
        if next_column < next_row:
            column = column + step_x
            next_column = next_column + per_column
        else:
            row = row + step_y
            next_row = next_row + per_row
        if (
            not (0 <= column < costs.shape[1] and 0 <= row < costs.shape[0])
            or blocked[costs[row, column]]
        ):
            return False
    return True


@njit()
def nearest_free_cell(
    costs: ByteArray,
    blocked: BoolArray,
    column: int,
    row: int,
    radius: float,
) -> tuple[int, int]:
    """The free cell nearest to a cell within ``radius`` [cells]; (-1, -1) where there is none."""
    best = radius * radius + 1e-9
    best_column = -1
    best_row = -1
    reach = int(math.ceil(radius))
    for y in range(max(0, row - reach), min(costs.shape[0], row + reach + 1)):
        for x in range(max(0, column - reach), min(costs.shape[1], column + reach + 1)):
            squared = float((x - column) ** 2 + (y - row) ** 2)
            if squared < best and not blocked[costs[y, x]]:
                best = squared
                best_column = x
                best_row = y
    return best_column, best_row


@njit()
def is_edge_free(
    costs: ByteArray,
    blocked: BoolArray,
    room: Room,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
) -> bool:
    """Whether the robot can drive along a straight line, in either direction; points in [cells]."""
    if not is_line_free(costs, blocked, x0, y0, x1, y1):
        return False
    return room.corridor <= 0.0 or has_corridor(
        costs, x0, y0, x1, y1, room.corridor, room.allow_unknown
    )


@njit()
def is_polyline_free(costs: ByteArray, blocked: BoolArray, room: Room, points: FloatArray) -> bool:
    """Whether the robot can drive along all pieces of a polyline (N, 2) in [cells]."""
    for i in range(1, len(points)):
        if not is_edge_free(
            costs, blocked, room, points[i - 1, 0], points[i - 1, 1], points[i, 0], points[i, 1]
        ):
            return False
    return True


@njit()
def can_turn(
    costs: ByteArray,
    blocked: BoolArray,
    room: Room,
    x: float,
    y: float,
) -> bool:
    """Whether the robot can stand at a point, in [cells], and turn there into any direction."""
    return is_free(costs, blocked, x, y) and has_room(costs, x, y, room.turning, room.allow_unknown)


@njit()
def can_reach(
    costs: ByteArray,
    blocked: BoolArray,
    room: Room,
    turning: float,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
) -> bool:
    """Whether the robot can drive along a line and turn at its end, within ``turning`` [cells]."""
    return is_edge_free(costs, blocked, room, x0, y0, x1, y1) and has_room(
        costs, x1, y1, turning, room.allow_unknown
    )

"""What critics score where trajectories end: inner loops of :mod:`.choice_kernels`."""

import math
from typing import NamedTuple

import numpy as np

from navstack.control.dwb.end_score import (
    CELL_COST,
    GIVEN,
    GOAL_ALIGNMENT,
    GOAL_DISTANCE,
    OUTLINE_COST,
)
from navstack.control.dwb.kernels import CellArray
from navstack.control.plan_handling import cells_of_points, densify
from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, Grid
from navstack.jit import njit
from navstack.types import ByteArray, Float32Array, FloatArray, IntArray

# [cells] next to a cell's border the sine and cosine of the recurrence are not good enough
BORDER = 1e-6


class Terms(NamedTuple):
    """What C critics score, see :mod:`.end_score`."""

    kinds: IntArray  # (C,)
    numbers: FloatArray  # (C,) that go with them
    scales: Float32Array  # (C,) weights, none of them 0


class Surface(NamedTuple):
    """Where the robot drives, and its outline."""

    costs: ByteArray  # (height, width)
    grid: Grid
    footprint: FloatArray  # (V, 2) [m]


@njit()
def goal_cells(
    robot: FloatArray,
    terms: Terms,
    plan: FloatArray,
    seeds: IntArray,
    goal: tuple[float, float],
    surface: Surface,
) -> tuple[IntArray, bool]:
    """The cell (C, 2) as (mx, my) that each critic measures from, unless it needs none.

    Whether all are on the map.
    """
    kinds, numbers, grid = terms.kinds, terms.numbers, surface.grid
    goals = np.zeros((len(kinds), 2), dtype=np.int64)
    bearing = math.atan2(goal[1] - robot[1], goal[0] - robot[0])
    for c in range(len(kinds)):
        if kinds[c] == GOAL_DISTANCE and len(seeds) > 0:
            goals[c, 0], goals[c, 1] = seeds[-1, 0], seeds[-1, 1]
        elif kinds[c] == GOAL_ALIGNMENT:
            moved = plan.copy()
            moved[-1, 0] += numbers[c] * math.cos(bearing)
            moved[-1, 1] += numbers[c] * math.sin(bearing)
            cells = cells_of_points(densify(moved, grid[2]), surface.costs, grid)
            if len(cells) == 0:
                return goals, False
            goals[c, 0], goals[c, 1] = cells[-1, 0], cells[-1, 1]
    return goals, len(seeds) > 0


@njit()
def score_ends(
    ends: FloatArray,
    terms: Terms,
    given: FloatArray,
    goals: IntArray,
    surface: Surface,
    cells: CellArray,
) -> FloatArray:
    """Raw scores (C, K) of the ends, 0 for distances to the plan and outlines.

    Inf: the end is illegal.

    The cells (C, 2, K) that critics look at are written, those of equal points once.
    """
    kinds, numbers, costs = terms.kinds, terms.numbers, surface.costs
    count = ends.shape[1]
    raw = np.zeros((len(kinds), count))
    for c in range(len(kinds)):
        if kinds[c] == GIVEN:
            for k in range(count):
                raw[c, k] = given[int(numbers[c]), k]
        if kinds[c] < CELL_COST or kinds[c] == OUTLINE_COST:
            continue
        known = -1
        for other in range(c):
            if CELL_COST <= kinds[other] < OUTLINE_COST and numbers[other] == numbers[c]:
                known = other
        if known >= 0:
            for k in range(count):
                cells[c, 0, k], cells[c, 1, k] = cells[known, 0, k], cells[known, 1, k]
        else:
            locate(ends, numbers[c], costs.shape[1], costs.shape[0], surface.grid, cells[c])
        score_cells(kinds[c], cells[c], goals[c], costs, raw[c])
    return raw


@njit()
def score_cells(
    kind: int, cells: CellArray, goal: IntArray, costs: ByteArray, raw: FloatArray
) -> None:
    """Write the scores (K,) of the cells (2, K).

    Their cost, their distance to ``goal``, or 0 for one to the plan.
    """
    mx, my = cells[0], cells[1]
    goal_x, goal_y = np.int32(goal[0]), np.int32(goal[1])
    for k in range(len(raw)):
        score = 0.0
        if mx[k] < 0:
            score = math.inf
        elif kind == CELL_COST:
            cost = costs[my[k], mx[k]]
            score = float(cost) if cost < INSCRIBED_INFLATED_OBSTACLE else math.inf
        elif kind == GOAL_DISTANCE or kind == GOAL_ALIGNMENT:
            score = float(abs(mx[k] - goal_x) + abs(my[k] - goal_y))
        raw[k] = score


@njit()
def locate(
    ends: FloatArray, ahead: float, width: int, height: int, grid: Grid, cells: CellArray
) -> None:
    """Write the cells (2, K) of the points ``ahead`` [m] of the ends; -1 off the map.

    Next to a cell's border the ends' sine and cosine are made exact first.
    """
    for _ in range(2):
        near_border = 0
        for k in range(ends.shape[1]):
            fx = (ends[0, k] + ahead * ends[4, k] - grid[0]) / grid[2]
            fy = (ends[1, k] + ahead * ends[3, k] - grid[1]) / grid[2]
            rest_x, rest_y = fx - math.floor(fx), fy - math.floor(fy)
            near_border += min(rest_x, rest_y) < BORDER or max(rest_x, rest_y) > 1.0 - BORDER
            inside = fx >= 0.0 and fy >= 0.0 and fx < width and fy < height
            cells[0, k] = np.int32(fx) if inside else np.int32(-1)
            cells[1, k] = np.int32(fy) if inside else np.int32(-1)
        if near_border == 0 or ahead == 0.0:
            break
        for k in range(ends.shape[1]):
            ends[3, k], ends[4, k] = math.sin(ends[2, k]), math.cos(ends[2, k])

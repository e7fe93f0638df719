"""A* on the cells of a costmap (Node2D of nav2_smac_planner), and a heuristic for Hybrid-A*."""

import heapq
import math
from typing import NamedTuple

import numpy as np

from navstack.jit import njit
from navstack.planning.endpoints import way_back
from navstack.types import BoolArray, ByteArray, Float32Array, IntArray

FULL_COST = 252.0  # the highest cost that is no contact
NEIGHBOURS = np.array(
    ((-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)), dtype=np.int64
)


class SearchLimits(NamedTuple):
    """How far a search goes."""

    tolerance: float  # [cells] of a goal that is not reached itself
    max_iterations: int
    max_on_approach_iterations: int  # after a cell within the tolerance was found


@njit(inline="always")
def octile(dx: float, dy: float) -> float:
    """The shortest way on the grid's eight directions, [cells]."""
    long = max(abs(dx), abs(dy))
    short = min(abs(dx), abs(dy))
    return long + (math.sqrt(2.0) - 1.0) * short


@njit(inline="always")
def step_cost(cost: int, is_diagonal: bool, multiplier: float) -> float:
    """A step's length [cells] times 1 + ``multiplier`` * cost / 252 of the cell it leads to."""
    length = math.sqrt(2.0) if is_diagonal else 1.0
    share = min(float(cost), FULL_COST) / FULL_COST
    return length * (1.0 + multiplier * share)


@njit()
def search_grid(
    costs: ByteArray,
    blocked: BoolArray,
    start: tuple[int, int],
    goal: tuple[int, int],
    multiplier: float,
    limits: SearchLimits,
    travelled: Float32Array,
    came_by: ByteArray,
) -> tuple[int, int]:
    """A* from cell to cell (column, row) over eight neighbours; :func:`step_cost` adds up.

    Args:
        costs: (height, width).
        blocked: (256,) costs that the way must not have; unknown cells that are open are so at full
            cost.
        start: its own cost does not matter.
        goal: where to.
        multiplier: cost_travel_multiplier.
        limits: when to be content with a cell near the goal, and when to give up.
        travelled: (height * width,) room for the cost of the way to each cell, all inf.
        came_by: (height * width,) room for the number of the neighbour by which it was entered.

    Returns:
        The cell (row * width + column) that was reached, -1: none; and the iterations.
    """
    height, width = costs.shape
    first = start[1] * width + start[0]
    last = goal[1] * width + goal[0]
    travelled[first] = 0.0
    heap = [(np.float32(octile(goal[0] - start[0], goal[1] - start[1])), first)]
    nearest = math.inf
    best = -1
    iterations = approaching = 0
    while len(heap) > 0 and iterations < limits.max_iterations:
        priority, n = heapq.heappop(heap)
        row = n // width
        column = n % width
        left = octile(goal[0] - column, goal[1] - row)
        if priority > np.float32(travelled[n] + left):
            continue  # a better way to it was found meanwhile
        if n == last:
            return int(n), iterations
        iterations += 1
        distance = math.hypot(goal[0] - column, goal[1] - row)
        if distance < nearest:
            nearest = distance
            best = n
        if nearest <= limits.tolerance:
            approaching += 1
            if approaching > limits.max_on_approach_iterations:
                return best, iterations
        for k in range(len(NEIGHBOURS)):
            x = column + NEIGHBOURS[k, 0]
            y = row + NEIGHBOURS[k, 1]
            if not (0 <= x < width and 0 <= y < height) or blocked[costs[y, x]]:
                continue
            m = y * width + x
            total = np.float32(travelled[n] + step_cost(costs[y, x], k >= 4, multiplier))
            if total < travelled[m]:
                travelled[m] = total
                came_by[m] = k
                heapq.heappush(heap, (np.float32(total + octile(goal[0] - x, goal[1] - y)), m))
    return best if nearest <= limits.tolerance else -1, iterations


def trace_back(reached: int, first: int, width: int, came_by: ByteArray) -> IntArray:
    """The cells (n, 2) as column, row from the first one to the one that was reached."""
    return way_back(reached, first, width, lambda n: n - int(NEIGHBOURS[came_by[n]] @ (1, width)))

"""The cost of the way to the goal on the grid, however the robot is turned.

The heuristic of searches over poses.
"""

import heapq
import math
from typing import NamedTuple

import numpy as np

from navstack.jit import njit
from navstack.planning.smac.grid_kernels import FULL_COST, NEIGHBOURS, octile
from navstack.planning.smac.pose_problem import Goal, SearchGround
from navstack.types import BoolArray, ByteArray, Float32Array, FloatArray


@njit()
def lowest_cost(costs: ByteArray, column: int, row: int, coarse: int) -> int:
    """The lowest cost of a square of cells."""
    lowest = 255
    for y in range(row * coarse, min((row + 1) * coarse, costs.shape[0])):
        for x in range(column * coarse, min((column + 1) * coarse, costs.shape[1])):
            lowest = min(lowest, costs[y, x])
    return lowest


class HeuristicField(NamedTuple):
    """The cost of the way to the goal, however the robot is turned, as far as it was asked for."""

    coarse: int  # cells along the edge of one of its squares
    columns: int
    rows: int
    towards_x: int  # the robot's square
    towards_y: int
    goal_x: int  # the goal's square
    goal_y: int
    # [squares] about an occupied goal that the way may lead through what is occupied; free: less
    # than 0
    buried: float
    ways: Float32Array  # (rows * columns,) [squares]
    is_known: BoolArray  # (rows * columns,)


@njit()
def make_field(
    ground: SearchGround, start: FloatArray, goal: Goal
) -> tuple[HeuristicField, list[tuple[float, int]]]:
    """A field in which only the goal's square is waiting."""
    coarse = goal.coarse
    columns = (ground.costs.shape[1] + coarse - 1) // coarse
    rows = (ground.costs.shape[0] + coarse - 1) // coarse
    ways = np.full(columns * rows, np.inf, dtype=np.float32)
    goal_x = int(goal.pose[0]) // coarse
    goal_y = int(goal.pose[1]) // coarse
    target = goal_y * columns + goal_x
    ways[target] = 0.0
    is_known = np.zeros(columns * rows, dtype=np.bool_)
    is_buried = ground.blocked[lowest_cost(ground.costs, goal_x, goal_y, coarse)]
    buried = goal.tolerance / coarse if is_buried else -1.0
    towards_x = int(start[0]) // coarse
    towards_y = int(start[1]) // coarse
    field = HeuristicField(
        coarse, columns, rows, towards_x, towards_y, goal_x, goal_y, buried, ways, is_known
    )
    return field, [(0.0, target)]


@njit()
def way_to_goal(
    ground: SearchGround,
    field: HeuristicField,
    waiting: list[tuple[float, int]],
    cost_penalty: float,
    x: float,
    y: float,
) -> float:
    """The cost of the way from a place to the goal, [cells]; inf: there is none.

    The search from the goal goes on, in A*'s order towards the robot, until the square of the place
    is known: what is known stays known, whichever is asked for next.
    """
    wanted = int(y) // field.coarse * field.columns + int(x) // field.coarse
    while not field.is_known[wanted] and len(waiting) > 0:
        _, n = heapq.heappop(waiting)
        if field.is_known[n]:
            continue
        field.is_known[n] = True
        row = n // field.columns
        column = n % field.columns
        for k in range(len(NEIGHBOURS)):
            u = column + NEIGHBOURS[k, 0]
            v = row + NEIGHBOURS[k, 1]
            if not (0 <= u < field.columns and 0 <= v < field.rows):
                continue
            m = v * field.columns + u
            if field.is_known[m]:
                continue
            cost = lowest_cost(ground.costs, u, v, field.coarse)
            if ground.blocked[cost]:
                if math.hypot(u - field.goal_x, v - field.goal_y) > field.buried:
                    continue
                cost = 0  # nobody drives there: the way is the distance from the goal
            length = math.sqrt(2.0) if k >= 4 else 1.0
            share = cost_penalty * min(float(cost), FULL_COST) / FULL_COST
            way = field.ways[n] + length * (1.0 + share)
            if way < field.ways[m]:
                field.ways[m] = way
                heapq.heappush(waiting, (way + octile(u - field.towards_x, v - field.towards_y), m))
    if not field.is_known[wanted]:
        return math.inf
    return field.coarse * float(field.ways[wanted])

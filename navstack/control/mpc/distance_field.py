"""How far static obstacles are, and in which direction, read from the inflated local costmap.

Inflation writes a function of the distance to the nearest obstacle into every cell; its inverse is
a distance field that costs nothing. Below the inscribed radius, where the cost says no more, the
nearest lethal cell is looked for.
"""

import math
from typing import NamedTuple

import numpy as np

from navstack.costmap.costmap import (
    FREE_SPACE,
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Grid,
)
from navstack.costmap.inflation import HIGHEST_FALLING_COST
from navstack.jit import njit
from navstack.types import ByteMatrix, FloatArray, FloatVector

_STENCIL = 2.0  # [cells] to either side, over which gradients are taken


class DistanceField(NamedTuple):
    """The distance field's ingredients, which every look at it takes."""

    costs: ByteMatrix  # (height, width)
    grid: Grid
    table: FloatVector  # (256,) [m]
    inscribed_radius: float  # [m]


def distance_table(inscribed_radius: float, cost_scaling_factor: float) -> FloatArray:
    """The distance (256,) in [m] that each cost stands for (the inverse of ``inflation_cost``).

    Free is as 1.
    """
    costs = np.arange(256).clip(1, HIGHEST_FALLING_COST)
    table: FloatArray = (
        inscribed_radius - np.log(costs / HIGHEST_FALLING_COST) / cost_scaling_factor
    )
    table[FREE_SPACE] = table[NO_INFORMATION] = table[1]  # unknown cells are no obstacles
    table[LETHAL_OBSTACLE] = 0.0
    return table


@njit()
def cell_distance(field: DistanceField, mx: int, my: int) -> float:
    """The distance [m] from a cell to the nearest obstacle cell; far beyond the grid."""
    costs = field.costs
    resolution = field.grid[2]
    table = field.table
    height, width = costs.shape
    if mx < 0 or my < 0 or mx >= width or my >= height:
        return float(table[FREE_SPACE])
    cost = costs[my, mx]
    if cost != INSCRIBED_INFLATED_OBSTACLE:
        return float(table[cost])
    reach = int(field.inscribed_radius / resolution) + 1
    least = reach * reach + 1
    for y in range(max(0, my - reach), min(height, my + reach + 1)):
        for x in range(max(0, mx - reach), min(width, mx + reach + 1)):
            squared = (x - mx) * (x - mx) + (y - my) * (y - my)
            if squared < least and costs[y, x] == LETHAL_OBSTACLE:
                least = squared
    return min(field.inscribed_radius, math.sqrt(least) * resolution)


@njit()
def distance_at(field: DistanceField, cx: float, cy: float) -> float:
    """The distance [m] at a point (cx, cy) in cells from the first cell's centre, interpolated."""
    mx = math.floor(cx)
    my = math.floor(cy)
    fx = cx - mx
    fy = cy - my
    low = (1.0 - fx) * cell_distance(field, mx, my)
    low += fx * cell_distance(field, mx + 1, my)
    high = (1.0 - fx) * cell_distance(field, mx, my + 1)
    high += fx * cell_distance(field, mx + 1, my + 1)
    return (1.0 - fy) * low + fy * high


@njit()
def distance_and_gradient(
    field: DistanceField, x: float, y: float, farthest: float
) -> tuple[float, float, float]:
    """Distance [m] to the nearest obstacle cell, and its gradient, at most 1 long; map frame.

    Beyond ``farthest`` [m] the gradient is 0.
    """
    origin_x, origin_y, resolution = field.grid
    cx = (x - origin_x) / resolution - 0.5
    cy = (y - origin_y) / resolution - 0.5
    distance = distance_at(field, cx, cy)
    if distance > farthest:
        return distance, 0.0, 0.0
    span = 2.0 * _STENCIL * resolution
    gx = distance_at(field, cx + _STENCIL, cy)
    gx = (gx - distance_at(field, cx - _STENCIL, cy)) / span
    gy = distance_at(field, cx, cy + _STENCIL)
    gy = (gy - distance_at(field, cx, cy - _STENCIL)) / span
    length = math.hypot(gx, gy)
    if length > 1.0:
        gx = gx / length
        gy = gy / length
    return distance, gx, gy

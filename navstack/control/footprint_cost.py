"""The costmap under a footprint's outline, after nav2_costmap_2d's FootprintCollisionChecker."""

import math

from navstack.costmap.costmap import (
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Costmap,
    Grid,
)
from navstack.jit import njit
from navstack.types import ByteArray, ByteMatrix, FloatArray, FloatMatrix, Pose2D


@njit()
def line_cost(
    costs: ByteArray,
    x0: int,
    y0: int,
    x1: int,
    y1: int,
) -> int:
    """The greatest cost on a Bresenham line between two cells, both included.

    After ``line_iterator.hpp``; LETHAL_OBSTACLE wherever there is a lethal cell, whether or not
    another one is unknown.
    """
    dx = abs(x1 - x0)
    dy = abs(y1 - y0)
    width = costs.shape[1]
    step_along = 1
    step_aside = width
    if x1 < x0:
        step_along = -1
    if y1 < y0:
        step_aside = -width
    if dx < dy:
        step_along, step_aside = step_aside, step_along
    along = max(dx, dy)
    across = min(dx, dy)
    flat = costs.reshape(-1)
    cell = y0 * width + x0
    error = along // 2
    worst = 0
    for _ in range(along + 1):
        cost = int(flat[cell])
        if cost == LETHAL_OBSTACLE:
            return LETHAL_OBSTACLE
        worst = max(worst, cost)
        error += across
        aside = 1 if error >= along else 0  # no branch: it would be guessed wrong too often
        cell += step_along + aside * step_aside
        error -= aside * along
    return worst


@njit(ahead=True)
def outline_cost(
    costs: ByteMatrix,
    grid: Grid,
    footprint: FloatMatrix,
    x: float,
    y: float,
    yaw: float,
) -> int:
    """The greatest cost 0..255 under the outline of ``footprint`` (V, 2) at a pose.

    LETHAL_OBSTACLE off the map.

    As upstream, an unknown cell hides the lethal ones under later edges, but none under its own or
    earlier ones.
    """
    return walk_outline(costs, grid, footprint, x, y, math.cos(yaw), math.sin(yaw), True)


@njit()
def walk_outline(
    costs: ByteArray,
    grid: Grid,
    footprint: FloatArray,
    x: float,
    y: float,
    cosine: float,
    sine: float,
    unknown_hides: bool,
) -> int:
    """See :func:`outline_cost`.

    Unless ``unknown_hides``, LETHAL_OBSTACLE wherever there is a lethal cell.
    """
    height, width = costs.shape
    count = len(footprint)
    worst = 0
    last_x = last_y = 0
    for i in range(count + 1):
        vx = footprint[i % count, 0]
        vy = footprint[i % count, 1]
        fx = (x + vx * cosine - vy * sine - grid[0]) / grid[2]
        fy = (y + vx * sine + vy * cosine - grid[1]) / grid[2]
        if not (fx >= 0.0 and fy >= 0.0 and fx < width and fy < height):
            return LETHAL_OBSTACLE
        mx = int(fx)
        my = int(fy)
        if i > 0:
            cost = line_cost(costs, last_x, last_y, mx, my)
            if cost == LETHAL_OBSTACLE and not (unknown_hides and worst == NO_INFORMATION):
                return LETHAL_OBSTACLE
            worst = max(worst, cost)
        last_x = mx
        last_y = my
    return worst


@njit()
def is_occupied(
    costs: ByteArray,
    grid: Grid,
    footprint: FloatArray,
    x: float,
    y: float,
    yaw: float,
) -> bool:
    """Whether the outline at (x, y, yaw) lies on a lethal cell or reaches over the map's edge.

    As upstream, nothing is known where the robot's centre is off the map, and an unknown cell under
    the outline hides a lethal one as :func:`outline_cost` says.
    """
    height, width = costs.shape
    fx = (x - grid[0]) / grid[2]
    fy = (y - grid[1]) / grid[2]
    if not (fx >= 0.0 and fy >= 0.0 and fx < width and fy < height):
        return False
    cost = outline_cost(costs, grid, footprint, x, y, yaw)
    return bool(cost >= LETHAL_OBSTACLE and cost != NO_INFORMATION)


@njit()
def is_centre_occupied(costs: ByteArray, grid: Grid, x: float, y: float) -> bool:
    """Whether a round robot at (x, y) meets an obstacle: the cell is lethal or inscribed.

    As upstream, nothing is known off the map.
    """
    height, width = costs.shape
    fx = (x - grid[0]) / grid[2]
    fy = (y - grid[1]) / grid[2]
    if not (fx >= 0.0 and fy >= 0.0 and fx < width and fy < height):
        return False
    cost = costs[int(fy), int(fx)]
    return bool(cost >= INSCRIBED_INFLATED_OBSTACLE and cost != NO_INFORMATION)


def footprint_cost(costmap: Costmap, footprint: FloatArray, pose: Pose2D) -> int:
    """The greatest cost under the outline of ``footprint`` (V, 2) in [m] at ``pose``.

    See :func:`outline_cost`.
    """
    return int(outline_cost(costmap.data, costmap.grid, footprint, pose.x, pose.y, pose.yaw))

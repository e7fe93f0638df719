"""The cost to go: the distance to the goal, dearer near walls, and the way there."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from navstack.costmap.costmap import LETHAL_OBSTACLE, Costmap
from navstack.jit import njit
from navstack.types import FloatArray, FloatMatrix, IntArray, Path, Pose2D

# of each cell (height, width) [m]; infinite: no way leads there
CostToGo = Callable[[Costmap, Pose2D], FloatArray]
_UPHILL = 4.0  # metres of cost per metre into what no way leads through
_NO_WAY = 1e5  # [m] far from the robot, where no way leads
_SMOOTHED = 1.0  # [cells] standard deviation over which directions are averaged


class CostToGoField(NamedTuple):
    """A cost-to-go field on square cells."""

    cost: FloatMatrix  # (height, width) [m], dearer metres near walls
    slope_x: FloatMatrix  # (height, width) of its descent along x, not of unit length
    slope_y: FloatMatrix
    origin_x: float  # [m]
    origin_y: float
    cell: float  # [m]


def ways_of(costmap: Costmap, cell: float) -> Costmap:
    """Every n-th cell of a costmap, about ``cell`` [m] apart."""
    every = max(1, round(cell / costmap.resolution))
    first = every // 2
    costs = np.ascontiguousarray(costmap.data[first::every, first::every])
    size = every * costmap.resolution
    return Costmap(costs, size, costmap.origin_x, costmap.origin_y)


def make_field(ways: Costmap, goal: Pose2D, cost_to_go: CostToGo) -> CostToGoField:
    """The field of a goal; where no way leads, it rises steeply from the nearest place with one."""
    metres = cost_to_go(ways, goal)
    down_x, down_y = _slopes(metres, ways.resolution)
    return CostToGoField(metres, down_x, down_y, ways.origin_x, ways.origin_y, ways.resolution)


def make_field_around(
    ways: Costmap, goal: Pose2D, cost_to_go: CostToGo, pose: Pose2D, reach: float
) -> CostToGoField:
    """As :func:`make_field`, but finished only within ``reach`` [m] of a pose along x and along y.

    Elsewhere its slopes are 0, and where no way leads it is ``_NO_WAY``.
    """
    metres = cost_to_go(ways, goal)
    column, row = ways.world_to_map(pose.x, pose.y)
    column = min(max(column, 0), ways.size_x - 1)
    row = min(max(row, 0), ways.size_y - 1)
    cells = math.ceil(reach / ways.resolution)
    rows = slice(max(row - cells, 0), row + cells + 1)
    columns = slice(max(column - cells, 0), column + cells + 1)
    near = (rows, columns)
    part = np.ascontiguousarray(metres[near])
    if np.isinf(part).all():
        return make_field(ways, goal, cost_to_go)
    down_x, down_y = np.zeros_like(metres), np.zeros_like(metres)
    down_x[near], down_y[near] = _slopes(part, ways.resolution)
    metres[near] = part
    metres[np.isinf(metres)] = _NO_WAY
    return CostToGoField(metres, down_x, down_y, ways.origin_x, ways.origin_y, ways.resolution)


def _slopes(metres: FloatArray, cell: float) -> tuple[FloatArray, FloatArray]:
    """Descent along x and along y of a cost to go (height, width) [m], finished in place."""
    unreached = np.isinf(metres)
    if unreached.all():
        metres[:] = 0.0
    elif unreached.any():
        nearest, away = _nearest_outside(unreached.tobytes(), unreached.shape)
        metres[unreached] = metres.reshape(-1)[nearest] + away * (cell * _UPHILL)
    down_y, down_x = (
        ndimage.gaussian_filter(np.clip(-each, -1.0, 1.0), _SMOOTHED)
        for each in np.gradient(metres)
    )
    return down_x, down_y


@lru_cache(maxsize=2)  # the same of all goals of a map that lie in one of its parts
def _nearest_outside(mask: bytes, shape: tuple[int, int]) -> tuple[IntArray, FloatArray]:
    """Of each cell of a mask: number of the nearest cell outside, and the distance [cells] to it.

    Args:
        mask: bool of each cell, row by row.
        shape: height and width of the grid.

    Returns:
        Two arrays (N,), in the order of the mask's N cells.
    """
    inside = np.frombuffer(mask, dtype=np.bool_).reshape(shape)
    away, (rows, columns) = ndimage.distance_transform_edt(inside, return_indices=True)
    return rows[inside] * shape[1] + columns[inside], away[inside]


def within(costmap: Costmap, plan: Path, width: float) -> Costmap:
    """A costmap that is free within ``width`` [m] of a plan only."""
    size = costmap.resolution
    reach = round(width / costmap.resolution)
    walled = np.full_like(costmap.data, LETHAL_OBSTACLE)
    places = np.floor((plan.poses[:, :2] - (costmap.origin_x, costmap.origin_y)) / size).astype(
        np.int64
    )
    for column, row in np.unique(places, axis=0).tolist():
        near = np.s_[
            max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1
        ]
        walled[near] = costmap.data[near]
    return Costmap(walled, size, costmap.origin_x, costmap.origin_y)


@njit(inline="always")
def corner_of(
    values: FloatArray,
    origin_x: float,
    origin_y: float,
    cell: float,
    x: float,
    y: float,
) -> tuple[int, int, float, float]:
    """The lower left of the four cells around a point, and its shares of the way up and right.

    Off the grid they are those of the nearest point on it.
    """
    height, width = values.shape
    u = (x - origin_x) / cell - 0.5
    v = (y - origin_y) / cell - 0.5
    column = min(max(int(u), 0), width - 2)
    row = min(max(int(v), 0), height - 2)
    return row, column, min(max(v - row, 0.0), 1.0), min(max(u - column, 0.0), 1.0)


@njit(inline="always")
def blend(
    values: FloatArray,
    row: int,
    column: int,
    up: float,
    right: float,
) -> float:
    """Bilinear interpolation between four cells."""
    low = values[row, column] * (1.0 - right) + values[row, column + 1] * right
    high = values[row + 1, column] * (1.0 - right) + values[row + 1, column + 1] * right
    return float(low * (1.0 - up) + high * up)


@njit(ahead=True)
def cost_at(field: CostToGoField, x: float, y: float) -> float:
    """Cost to go [m] from a point of the map frame."""
    row, column, up, right = corner_of(field.cost, field.origin_x, field.origin_y, field.cell, x, y)
    return float(blend(field.cost, row, column, up, right))

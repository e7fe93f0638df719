"""Distances to static obstacles.

They are signed, and come from the map and from what scans show besides.
"""

import math
from typing import NamedTuple

import numpy as np

from navstack.costmap.costmap import LETHAL_OBSTACLE, Costmap
from navstack.costmap.distances import squared_distances
from navstack.costmap.field_cache import SHARED_FROM, cached_array, content_key
from navstack.jit import njit
from navstack.types import (
    BoolArray,
    BoolMatrix,
    ByteMatrix,
    FixedFloat32Matrix,
    Float32Array,
    Float32Matrix,
    FloatArray,
    FloatMatrix,
)

FAR = 3.0  # [m] of clearance where nothing is near, and beyond what the scans show
OFF_MAP = -1.0  # [m] of clearance off the map: nobody knows what is there
_LOOKED_AT = 6.0  # [m] from the robot along x and y up to which what no map shows counts
_POOLED = 2  # cells of a costmap along each side of one here
_AROUND = 0.25  # [m] beside a person's body whose returns are the person's


class Clearance(NamedTuple):
    """Distances [m] to the nearest obstacle, negative inside of one.

    The lesser of two grids of square cells counts.
    """

    mapped: FixedFloat32Matrix  # (height, width) of the map
    # x, y of its lower left corner [m], and its cells' size [m]
    mapped_grid: tuple[float, float, float]
    seen: Float32Matrix  # (height, width) of what the map does not show; empty: nothing
    seen_grid: tuple[float, float, float]


def map_clearance(world: Costmap) -> Clearance:
    """The clearance on the map of a global costmap.

    It is FAR everywhere if that costmap has no map.
    """
    nothing = np.zeros((0, 0), dtype=np.float32)
    grid = (world.origin_x, world.origin_y, world.resolution)
    metres = nothing
    if world.floor is not None:
        metres = _kept_distances(world.floor >= LETHAL_OBSTACLE, grid[2])
    metres.flags.writeable = False
    return Clearance(metres, grid, nothing, grid)


def _kept_distances(lethal: BoolArray, cell: float) -> Float32Array:
    """:func:`signed_distances` of a map's cells, kept on disk where the map is large."""
    if lethal.size < SHARED_FROM:
        return signed_distances(lethal, cell)
    key = content_key("signed-distances-1", lethal, cell, FAR)
    return cached_array(key, lambda: signed_distances(lethal, cell))


def with_obstacles(
    mapped: Clearance,
    local: Costmap,
    place: tuple[float, float],
    people: FloatArray,
    margin: float,
) -> Clearance:
    """The map's clearance, and what a local costmap shows besides, up to ``_LOOKED_AT`` away.

    Args:
        mapped: of :func:`map_clearance`.
        local: around the robot.
        world: the global costmap.
        place: of the robot, x, y [m].
        people: (n, 3) x, y, radius [m] of tracked people, whose returns are no obstacles.
        margin: [m] about mapped obstacles within which what is shown is mapped.
    """
    (left, right), (low, high) = (
        _around(middle - origin, local.resolution, count)
        for middle, origin, count in zip(
            place, (local.origin_x, local.origin_y), (local.size_x, local.size_y), strict=True
        )
    )
    x = local.origin_x + left * local.resolution
    y = local.origin_y + low * local.resolution
    blocked = unmapped_blocks(
        np.ascontiguousarray(local.data[low:high, left:right]),
        (x, y, local.resolution),
        mapped,
        people,
        margin,
    )
    cell = _POOLED * local.resolution
    seen = np.zeros((0, 0), dtype=np.float32)
    if blocked.any():
        seen = signed_distances(blocked, cell)
    return mapped._replace(seen=seen, seen_grid=(x, y, cell))


def _around(middle: float, resolution: float, count: int) -> tuple[int, int]:
    """Begin and end of the cells within ``_LOOKED_AT`` of ``middle`` [m] from the grid's edge."""
    first, end = (math.floor((middle + side * _LOOKED_AT) / resolution) for side in (-1.0, 1.0))
    return min(max(first, 0), count), min(max(end, 0), count)


@njit(ahead=True)
def unmapped_blocks(
    costs: ByteMatrix,
    grid: tuple[float, float, float],
    mapped: Clearance,
    people: FloatMatrix,
    margin: float,
) -> BoolArray:
    """Which blocks (height, width) hold an obstacle, neither mapped nor a person's return.

    A cell counts as mapped within ``margin`` [m] of a mapped obstacle.
    """
    height = costs.shape[0] // _POOLED
    width = costs.shape[1] // _POOLED
    blocked = np.zeros((height, width), dtype=np.bool_)
    for row in range(height * _POOLED):
        for column in range(width * _POOLED):
            if costs[row, column] != LETHAL_OBSTACLE:
                continue
            x = grid[0] + (column + 0.5) * grid[2]
            y = grid[1] + (row + 0.5) * grid[2]
            if distance_at(mapped.mapped, mapped.mapped_grid, FAR, x, y) < margin:
                continue
            is_person = False
            for p in range(len(people)):
                is_person |= math.hypot(x - people[p, 0], y - people[p, 1]) < people[p, 2] + _AROUND
            if not is_person:
                blocked[row // _POOLED, column // _POOLED] = True
    return blocked


@njit(ahead=True)
def signed_distances(blocked: BoolMatrix, cell: float) -> Float32Array:
    """Distances [m] from cells' middles to the nearest blocked cell, negative inside.

    Inside they are to the nearest free cell. They are half a cell less than those between middles,
    and at most FAR.
    """
    most = int(math.ceil(FAR / cell)) + 1
    metres = np.empty(blocked.shape, dtype=np.float32)
    for sign in (1.0, -1.0):
        squared = squared_distances(blocked == (sign > 0.0), most * most)
        for row in range(blocked.shape[0]):
            for column in range(blocked.shape[1]):
                if blocked[row, column] == (sign < 0.0):
                    metres[row, column] = sign * min(
                        FAR, cell * (math.sqrt(np.float32(squared[row, column])) - 0.5)
                    )
    return metres


@njit(inline="always")
def distance_at(
    metres: Float32Array,
    grid: tuple[float, float, float],
    beyond: float,
    x: float,
    y: float,
) -> float:
    """The distance [m] that a grid has for a point of the map frame; ``beyond`` off it."""
    column = int((x - grid[0]) / grid[2])
    row = int((y - grid[1]) / grid[2])
    height, width = metres.shape
    if 0 <= row < height and 0 <= column < width:
        return float(metres[row, column])
    return beyond


@njit(inline="always")
def distance_off_map(clearance: Clearance) -> float:
    """The distance [m] that counts off the map; FAR where there is no map."""
    if len(clearance.mapped):
        return OFF_MAP
    return FAR


@njit()
def clearance_at(clearance: Clearance, x: float, y: float) -> float:
    """The clearance [m] of a point of the map frame."""
    off_map = distance_off_map(clearance)
    mapped = distance_at(clearance.mapped, clearance.mapped_grid, off_map, x, y)
    return min(mapped, distance_at(clearance.seen, clearance.seen_grid, FAR, x, y))

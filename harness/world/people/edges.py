"""The edges of the walkable area, which nobody crosses: a grid of signed distances."""

import math
from typing import NamedTuple

from navstack.jit import njit
from navstack.types import BoolArray, FloatArray


class Edges(NamedTuple):
    """The walkable area on a grid."""

    # (H, W) [m] of cell centres to the edge of the walkable area, negative outside
    distances: FloatArray
    walkable: BoolArray  # (H, W)
    # (5,) x, y [m] of the grid's corner in the map frame, cosine and sine of its yaw, cell [m]
    frame: FloatArray


@njit()
def keep_inside(
    x: float, y: float, vx: float, vy: float, dt: float, least: float, edges: Edges
) -> tuple[float, float, float, float]:
    """The state after ``dt`` [s] of somebody who keeps ``least`` [m] from the edge.

    Who runs into the edge slides along it; who is beyond it (pushed by the robot) only gets back.
    """
    nx, ny = x + dt * vx, y + dt * vy
    there = edge_distance(nx, ny, edges)
    if there >= least:
        return nx, ny, vx, vy
    here = edge_distance(x, y, edges)
    gx, gy = away_from_edge(x, y, edges)
    inward = vx * gx + vy * gy
    if inward < 0.0:
        vx, vy = vx - inward * gx, vy - inward * gy
    nx, ny = x + dt * vx, y + dt * vy
    if edge_distance(nx, ny, edges) >= min(least, here):
        return nx, ny, vx, vy
    return x, y, 0.0, 0.0


@njit()
def away_from_edge(x: float, y: float, edges: Edges) -> tuple[float, float]:
    """Direction (x, y), at most a unit vector, in which the distance to the edge grows.

    Shorter between two edges.
    """
    half = 0.5 * edges.frame[4]
    gx = edge_distance(x + half, y, edges) - edge_distance(x - half, y, edges)
    gy = edge_distance(x, y + half, edges) - edge_distance(x, y - half, edges)
    norm = max(math.hypot(gx, gy), edges.frame[4])
    return gx / norm, gy / norm


@njit()
def edge_distance(x: float, y: float, edges: Edges) -> float:
    """Distance [m] of a point to the edge of the walkable area, between cell centres bilinearly.

    Negative outside.
    """
    column, row = _grid(x, y, edges.frame)
    distances = edges.distances
    column = min(max(column - 0.5, 0.0), distances.shape[1] - 1.001)
    row = min(max(row - 0.5, 0.0), distances.shape[0] - 1.001)
    i, j = int(row), int(column)
    u, v = row - i, column - j
    low = (1.0 - v) * distances[i, j] + v * distances[i, j + 1]
    high = (1.0 - v) * distances[i + 1, j] + v * distances[i + 1, j + 1]
    return float((1.0 - u) * low + u * high)


@njit()
def _grid(x: float, y: float, frame: FloatArray) -> tuple[float, float]:
    dx, dy = x - frame[0], y - frame[1]
    return (frame[2] * dx + frame[3] * dy) / frame[4], (-frame[3] * dx + frame[2] * dy) / frame[4]


@njit()
def cell_of(x: float, y: float, edges: Edges) -> tuple[int, int]:
    """The cell (row, column) of a point, the nearest one of the grid where it is outside."""
    column, row = _grid(x, y, edges.frame)
    return (
        min(max(math.floor(row), 0), edges.walkable.shape[0] - 1),
        min(max(math.floor(column), 0), edges.walkable.shape[1] - 1),
    )

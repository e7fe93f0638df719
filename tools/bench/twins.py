"""The same sums in plain numpy, as one would write them first.

What kernels are checked and timed against.

They are vectorised where numpy allows it and short where it does not; none is tuned. Distances are
scipy's exact ones.
"""

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from navstack.geometry import points_relative_to
from navstack.types import BoolArray, ByteArray, FloatArray, IntArray, Pose2D

LETHAL, INSCRIBED = 254, 253


def unit(angles: npt.NDArray[np.floating]) -> FloatArray:
    """Unit vectors (n, 2) of angles (n,) [rad]."""
    return np.column_stack((np.cos(angles), np.sin(angles)))


def inflate(
    costs: ByteArray,
    resolution: float,
    inscribed: float,
    radius: float,
    scaling: float,
) -> ByteArray:
    """Costs (H, W) without unknown cells, raised around lethal ones by Jazzy's rule."""
    distance = ndimage.distance_transform_edt(costs != LETHAL)
    near = distance <= math.ceil(radius / resolution)
    metres = distance[near] * resolution
    falling = (INSCRIBED - 1) * np.exp(-scaling * (metres - inscribed))
    cost = np.where(
        metres == 0.0, LETHAL, np.where(metres <= inscribed, INSCRIBED, falling)
    ).astype(np.uint8)
    inflated = costs.copy()
    inflated[near] = np.maximum(cost, costs[near])
    return inflated


def clear_and_mark(
    grid: ByteArray,
    origin: FloatArray,
    resolution: float,
    sensor: FloatArray,
    points: FloatArray,
    longest: float,
) -> None:
    """Free the lines from the sensor (2,) through points (n, 2), then mark the near ones.

    In place; all in [m]. Lines end with the grid (``ObstacleLayer::raytraceFreespace``) and after
    ``longest``.
    """
    height, width = grid.shape
    far = origin + (width * resolution, height * resolution)
    x0, y0 = np.floor((sensor - origin) / resolution).astype(np.int64)
    ends = np.floor((_drawn_in(points, sensor, origin, far) - origin) / resolution).astype(np.int64)
    dx, dy = ends[:, 0] - x0, ends[:, 1] - y0
    longer, shorter = np.maximum(abs(dx), abs(dy)), np.minimum(abs(dx), abs(dy))
    length = (
        np.minimum(1.0, math.ceil(longest / resolution) / np.maximum(np.hypot(dx, dy), 1.0))
        * longer
    )
    steps = np.arange(longer.max() + 1)
    across = (longer[:, None] // 2 + steps * shorter[:, None]) // np.maximum(longer, 1)[:, None]
    along_x = (abs(dx) >= abs(dy))[:, None]
    x = x0 + np.where(along_x, steps, across) * np.sign(dx)[:, None]
    y = y0 + np.where(along_x, across, steps) * np.sign(dy)[:, None]
    on_line = steps <= length.astype(np.int64)[:, None]
    grid[y[on_line], x[on_line]] = 0
    inside = ((points >= origin) & (points < far)).all(axis=1) & (
        np.hypot(*(points - sensor).T) <= longest
    )
    marked = np.floor((points[inside] - origin) / resolution).astype(np.int64)
    grid[marked[:, 1], marked[:, 0]] = LETHAL


def _drawn_in(
    points: FloatArray,
    sensor: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """Points (n, 2) beyond a box, drawn onto its edge towards the sensor."""
    drawn = points.copy()
    beam = points - sensor
    for beyond, edge, inset in ((np.less, low, 0.0), (np.greater, high, 0.001)):
        for axis in (0, 1):
            out = beyond(drawn[:, axis], edge[axis])
            share = (edge[axis] - sensor[axis]) / beam[out, axis]
            drawn[out, 1 - axis] = sensor[1 - axis] + beam[out, 1 - axis] * share
            drawn[out, axis] = edge[axis] - inset
    return drawn


def shifted(grid: ByteArray, dx: int, dy: int) -> ByteArray:
    """A grid whose window has moved by so many cells; what is new is free."""
    moved: ByteArray = ndimage.shift(grid, (-dy, -dx), order=0)
    return moved


def manhattan(shape: tuple[int, int], seeds: IntArray) -> IntArray:
    """L1 distance (H, W) in cells to the nearest of the seeds (S, 2) as (x, y)."""
    is_other = np.ones(shape, dtype=np.bool_)
    is_other[seeds[:, 1], seeds[:, 0]] = False
    distance: IntArray = ndimage.distance_transform_cdt(is_other, metric="taxicab")
    return distance


def planar_wave(crossing: FloatArray, source: tuple[int, int]) -> FloatArray:
    """NavFn's converged potential (H, W) of cells that cost ``crossing`` to enter; inf: closed.

    All cells are updated at once until none changes. The source is (x, y), the border is closed.
    """
    potential = np.full(crossing.shape, np.inf)
    potential[source[1], source[0]] = 0.0
    cost = np.where(np.isinf(crossing), 1.0, crossing)[1:-1, 1:-1]
    is_closed = np.isinf(crossing)[1:-1, 1:-1]
    while True:
        beside = np.minimum(potential[1:-1, :-2], potential[1:-1, 2:])
        above = np.minimum(potential[:-2, 1:-1], potential[2:, 1:-1])
        low = np.minimum(beside, above)
        with np.errstate(invalid="ignore"):
            gap = np.abs(beside - above) / cost
        gap = np.where(np.isfinite(gap), np.minimum(gap, 1.0), 1.0)
        # NavFn's updateCell
        step = np.where(gap < 1.0, (-0.2301 * gap + 0.5307) * gap + 0.7040, 1.0)
        new = np.where(is_closed, np.inf, np.minimum(low + cost * step, potential[1:-1, 1:-1]))
        if np.array_equal(new, potential[1:-1, 1:-1]):
            return potential
        potential[1:-1, 1:-1] = new


def likelihoods(
    distances: FloatArray,
    origin: tuple[float, float],
    resolution: float,
    poses: FloatArray,
    ends: FloatArray,
    sigma: float,
    z_hit: float,
    z_rand: float,
    range_max: float,
    farthest: float,
) -> FloatArray:
    """One plus the sum of p^3 over the returns (N,), for particles (N, 3) in [m].

    Args:
        distances: (H, W) [m] to the nearest obstacle; cell i is centred at origin + i * resolution.
        origin: (x, y) [m].
        resolution: [m/cell].
        poses: x, y [m], yaw [rad] of the base.
        ends: (n, 2) [m] where beams end, base frame.
        sigma: [m].
        z_hit: [-].
        z_rand: [-].
        range_max: [m].
        farthest: [m] distance that counts off the map.
    """
    cos, sin = np.cos(poses[:, 2])[:, None], np.sin(poses[:, 2])[:, None]
    x = poses[:, :1] + cos * ends[:, 0] - sin * ends[:, 1]
    y = poses[:, 1:2] + sin * ends[:, 0] + cos * ends[:, 1]
    column = np.floor((x - origin[0]) / resolution + 0.5).astype(np.int64)
    row = np.floor((y - origin[1]) / resolution + 0.5).astype(np.int64)
    height, width = distances.shape
    on_map = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    distance = np.where(
        on_map, distances[row.clip(0, height - 1), column.clip(0, width - 1)], farthest
    )
    p = z_hit * np.exp(-(distance**2) / (2.0 * sigma**2)) + z_rand / range_max
    total: FloatArray = 1.0 + (p**3).sum(axis=1)
    return total


def move_differential(
    poses: FloatArray,
    motion: Sequence[float],
    alphas: Sequence[float],
    draws: FloatArray,
) -> None:
    """Move particles (N, 3) in place by turn, way [m] and turn (Thrun et al. 2005).

    Args:
        poses: x, y [m], yaw [rad].
        motion: first turn [rad] and way [m] ahead, second turn [rad]; turns of at most a quarter.
        alphas: alpha1 to alpha4.
        draws: (N, 3) standard normal numbers.
    """
    first, way, second = motion
    turn_from_turn, turn_from_way, way_from_way, way_from_turn = alphas
    first_std = math.sqrt(turn_from_turn * first**2 + turn_from_way * way**2)
    way_std = math.sqrt(way_from_way * way**2 + way_from_turn * (first**2 + second**2))
    second_std = math.sqrt(turn_from_turn * second**2 + turn_from_way * way**2)
    heading = poses[:, 2] + first - first_std * draws[:, 0]
    length = way - way_std * draws[:, 1]
    poses[:, 0] += length * np.cos(heading)
    poses[:, 1] += length * np.sin(heading)
    poses[:, 2] = heading + second - second_std * draws[:, 2]


def relax(
    given: FloatArray,
    w_data: float,
    w_smooth: float,
    tolerance: float,
    max_its: int,
) -> FloatArray:
    """Gauss-Seidel relaxation of positions (N, 2) in free space.

    Each depends on the one before, so numpy must loop.
    """
    now = given.copy()
    for _ in range(max_its - 1):
        before = now.copy()
        for i in range(1, len(now) - 1):
            now[i] += w_data * (given[i] - now[i]) + w_smooth * (
                now[i + 1] + now[i - 1] - 2.0 * now[i]
            )
        if np.abs(now - before).sum() < tolerance:
            break
    return now


def time_to_collision(
    points: FloatArray,
    polygon: FloatArray,
    enough: int,
    velocity: Sequence[float],
    horizon: float,
    step: float,
) -> float:
    """Time [s] until ``enough`` points (n, 2) lie in the polygon (V, 2) that drives; -1: never.

    The velocity is vx, vy [m/s] and yaw rate [rad/s] in the base frame and stays.
    """
    if _inside(points, polygon).sum() >= enough:
        return 0.0
    x = y = yaw = time = 0.0
    vx, vy, yaw_rate = velocity
    while time <= horizon:
        x += (vx * math.cos(yaw) - vy * math.sin(yaw)) * step
        y += (vx * math.sin(yaw) + vy * math.cos(yaw)) * step
        yaw += yaw_rate * step
        seen = points_relative_to(Pose2D(x, y, yaw), points)
        if _inside(seen, polygon).sum() >= enough:
            return time
        time += step
    return -1.0


def _inside(points: FloatArray, polygon: FloatArray) -> BoolArray:
    """Which points (n, 2) lie in a polygon (V, 2).

    A ray along +x crosses its edges an odd number of times.
    """
    a, b = np.roll(polygon, 1, axis=0), polygon
    x, y = points[:, :1], points[:, 1:]
    straddles = (a[:, 1] < y) != (b[:, 1] < y)
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1])
    inside: BoolArray = (straddles & (crossing > x)).sum(axis=1) % 2 == 1
    return inside


def cast(
    occupied: BoolArray,
    x: float,
    y: float,
    directions: FloatArray,
    reach: float,
) -> FloatArray:
    """How far (n,) rays from (x, y) along unit vectors (n, 2) go until an occupied cell.

    Each ray is cut at every line of the grid that it crosses; the middle of a piece says in which
    cell it lies.
    """
    lines = np.arange(-math.ceil(reach) - 1, math.ceil(reach) + 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        at_x = (math.floor(x) + lines - x) / directions[:, :1]
        at_y = (math.floor(y) + lines - y) / directions[:, 1:]
    cuts = np.concatenate((np.zeros((len(directions), 1)), at_x, at_y), axis=1)
    cuts = np.sort(np.where((cuts >= 0.0) & (cuts <= reach + 2.0), cuts, reach + 2.0), axis=1)
    middle = 0.5 * (cuts[:, :-1] + cuts[:, 1:])
    column = np.floor(x + middle * directions[:, :1]).astype(np.int64)
    row = np.floor(y + middle * directions[:, 1:]).astype(np.int64)
    height, width = occupied.shape
    on_grid = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    hit = (
        on_grid
        & occupied[row.clip(0, height - 1), column.clip(0, width - 1)]
        & (cuts[:, 1:] > cuts[:, :-1])
    )
    first = hit.argmax(axis=1)
    ranges = np.where(hit.any(axis=1), cuts[np.arange(len(cuts)), first], np.inf)
    return np.where(ranges <= reach, ranges, np.inf)

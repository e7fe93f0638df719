"""Inner loops of the critics that look at the path.

Its points (N,) are relative to the robot, along the map's axes.
"""

import math

import numpy as np

from navstack.control.mppi.rollouts import MppiRollouts
from navstack.costmap.costmap import (
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Grid,
)
from navstack.jit import njit
from navstack.types import (
    BoolArray,
    BoolVector,
    ByteMatrix,
    Float32Array,
    Float32Matrix,
    Float32Vector,
    IntArray,
)

_TABLE_FINENESS = 16  # places per point of the path
_ROUNDING = 0.999  # share of a gap between distances that single precision does not close


@njit(ahead=True)
def furthest_point(px: Float32Vector, py: Float32Vector, x: Float32Vector, y: Float32Vector) -> int:
    """The furthest of the path's points that is nearest to some trajectory's last position (B,).

    Each trajectory looks from the furthest point so far on (``findPathFurthestReachedPoint``).
    Points that the triangle inequality excludes are skipped.
    """
    longest = 0.0
    for i in range(1, len(px)):
        longest = max(longest, math.hypot(px[i] - px[i - 1], py[i] - py[i - 1]))
    furthest = 0
    for b in range(len(x)):
        least = np.float32(np.inf)
        j = nearest = furthest
        while j < len(px):
            dx = px[j] - x[b]
            dy = py[j] - y[b]
            squared = dx * dx + dy * dy
            if squared < least:
                least = squared
                nearest = j
                j += 1
            elif longest > 0.0:
                gap = math.sqrt(squared) - math.sqrt(least)
                j += max(1, int(_ROUNDING * gap / longest))
            else:
                break
        furthest = nearest
    return furthest


@njit(ahead=True)
def free_points(
    px: Float32Vector,
    py: Float32Vector,
    costs: ByteMatrix,
    grid: Grid,
    tracks_unknown: bool,
) -> BoolArray:
    """Which points (N - 1,), all but the last, are free for the centre (``findPathCosts``)."""
    height, width = costs.shape
    free = np.zeros(max(0, len(px) - 1), dtype=np.bool_)
    for i in range(len(free)):
        fx = (px[i] - grid[0]) / grid[2]
        fy = (py[i] - grid[1]) / grid[2]
        if fx >= 0.0 and fy >= 0.0 and fx < width and fy < height:
            cost = costs[int(fy), int(fx)]
            is_obstacle = cost == LETHAL_OBSTACLE or cost == INSCRIBED_INFLATED_OBSTACLE
            free[i] = not is_obstacle and (cost != NO_INFORMATION or tracks_unknown)
    return free


@njit(ahead=True)
def mean_misalignment(
    rollouts: MppiRollouts,
    step: int,
    path: tuple[Float32Vector, Float32Vector, Float32Vector],
    free: BoolVector,
    use_orientations: bool,
) -> Float32Array:
    """Mean distance (B,) [m] of every ``step``-th pose (T, B) to the path's point as far along.

    How far along is measured in length driven; poses whose point is not ``free`` do not count
    (``path_align_critic.cpp``).
    """
    x = rollouts.x
    y = rollouts.y
    yaw = rollouts.yaw
    px, py, pyaw = path
    steps, count = x.shape
    length = np.zeros(len(px), dtype=np.float32)
    for i in range(1, len(px)):
        dx = px[i] - px[i - 1]
        dy = py[i] - py[i - 1]
        length[i] = length[i - 1] + math.sqrt(dx * dx + dy * dy)
    middle, table, scale = nearest_table(length)
    driven = np.zeros(count, dtype=np.float32)
    total = np.zeros(count, dtype=np.float32)
    counted = np.zeros(count, dtype=np.int32)
    for t in range(step, steps, step):
        _add_distances(x[t], x[t - step], y[t], y[t - step], driven)
        for b in range(count):
            i = nearest_along(driven[b], middle, table, scale)
            if free[i]:
                dx = px[i] - x[t, b]
                dy = py[i] - y[t, b]
                squared = dx * dx + dy * dy
                if use_orientations:
                    turn = angle_between(pyaw[i], yaw[t, b])
                    squared += turn * turn
                total[b] += math.sqrt(squared)
                counted[b] += 1
    for b in range(count):
        if counted[b] > 0:
            total[b] /= np.float32(counted[b])
    return total


@njit()
def _add_distances(
    x: Float32Array,
    last_x: Float32Array,
    y: Float32Array,
    last_y: Float32Array,
    driven: Float32Array,
) -> None:
    for b in range(len(driven)):
        dx = x[b] - last_x[b]
        dy = y[b] - last_y[b]
        driven[b] += math.sqrt(dx * dx + dy * dy)


@njit()
def nearest_table(length: Float32Array) -> tuple[Float32Array, IntArray, np.float32]:
    """What :func:`nearest_along` needs of the points' lengths (N,) along the path."""
    # from where on a point is no longer the nearest
    middle = np.empty(len(length), dtype=np.float32)
    for i in range(len(length) - 1):
        middle[i] = np.float32(0.5) * (length[i] + length[i + 1])
    middle[-1] = np.float32(np.nan)  # nothing is beyond it, not even inf
    places = _TABLE_FINENESS * len(length)
    scale = np.float32(0.0)
    if length[-1] > scale:
        scale = np.float32(places / length[-1])
    table = np.empty(places + 2, dtype=np.int64)
    i = 0
    for place in range(len(table)):
        while middle[i] * scale < place:
            i += 1
        table[place] = i
    return middle, table, scale


@njit()
def nearest_along(
    driven: np.float32, middle: Float32Array, table: IntArray, scale: np.float32
) -> int:
    """The point whose length along the path is nearest to ``driven`` (``findClosestPathPt``)."""
    place = driven * scale
    entry = len(table) - 1  # nan: the last
    if place < np.float32(entry):
        entry = int(place)
    i = int(table[entry])
    while middle[i] <= driven:  # seldom: the table is fine
        i += 1
    return i


@njit()
def angle_between(start: np.float32, end: np.float32) -> np.float32:
    """The shortest angle from ``start`` to ``end``, in [-pi, pi]."""
    turn = end - start
    return np.float32(turn - 2.0 * math.pi * math.floor((turn + math.pi) / (2.0 * math.pi)))


@njit(ahead=True)
def bearing_errors(
    x: Float32Vector,
    y: Float32Vector,
    yaw: Float32Vector,
    target_x: float,
    target_y: float,
    mode: int,
    target_yaw: float,
) -> Float32Array:
    """Angles (B,) between last poses (B,) and the bearing of a point (``path_angle_critic.cpp``).

    ``mode`` 0: of the robot's front; 1: of its front or back; 2: of that end with which the path
    goes on at the point.
    """
    errors = np.empty(len(x), dtype=np.float32)
    for b in range(len(x)):
        bearing = np.float32(math.atan2(np.float32(target_y) - y[b], np.float32(target_x) - x[b]))
        backwards = (
            mode == 2 and abs(angle_between(np.float32(target_yaw), bearing)) >= 0.5 * math.pi
        )
        backwards = backwards or (
            mode == 1 and abs(angle_between(yaw[b], bearing)) >= 0.5 * math.pi
        )
        if backwards:
            bearing += np.float32(math.pi)
        errors[b] = abs(angle_between(yaw[b], bearing))
    return errors


@njit(ahead=True)
def mean_distance(
    x: Float32Matrix, y: Float32Matrix, goal_x: np.float32, goal_y: np.float32
) -> Float32Array:
    """Mean distance (B,) in [m] of the poses (T, B) to a point."""
    total = np.zeros(x.shape[1], dtype=np.float32)
    for t in range(len(x)):
        for b in range(x.shape[1]):
            dx = x[t, b] - goal_x
            dy = y[t, b] - goal_y
            total[b] += math.sqrt(dx * dx + dy * dy)
    return total / np.float32(len(x))

"""Dubins curves, the shortest ways of a car that drives forwards, and footprints along them.

Dubins, On curves of minimal length with a constraint on average curvature (1957); the words as
Shkel and Lumelsky, Classification of the Dubins set (2001), write them. Poses are (x, y, yaw).
"""

import math

import numpy as np

from navstack.costmap.costmap import LETHAL_OBSTACLE, NO_INFORMATION
from navstack.jit import njit
from navstack.planning.ompl_kernels import has_room, is_free
from navstack.types import BoolArray, ByteArray, FloatArray

# Left, straight, right as signs of curvature, for each word; every second one is the mirror image
# of the one before.
WORDS = np.array(
    ((1, 0, 1), (-1, 0, -1), (1, 0, -1), (-1, 0, 1), (-1, 1, -1), (1, -1, 1)), dtype=np.float64
)
SAME = 1e-9


@njit()
def _turn(angle: float) -> float:
    """The angle in [0, 2 pi); hardly less than a whole turn is none."""
    wrapped = angle - 2.0 * math.pi * math.floor(angle / (2.0 * math.pi))
    if wrapped > 2.0 * math.pi - SAME:
        return 0.0
    return wrapped


@njit()
def _segments(word: int, d: float, a: float, b: float) -> tuple[float, float, float]:
    """Lengths of a word's three segments for radius 1 (NaN: the word does not lead there).

    D, a, b as in the paper.

    Words come in pairs: the second one is the first one in a mirror, where angles count the other
    way round.
    """
    if word % 2 == 1:
        a = -a
        b = -b
    sa = math.sin(a)
    sb = math.sin(b)
    ca = math.cos(a)
    cb = math.cos(b)
    cab = math.cos(a - b)
    if word < 2:  # LSL
        p2 = 2.0 + d * d - 2.0 * cab + 2.0 * d * (sa - sb)
        theta = math.atan2(cb - ca, d + sa - sb)
        return _turn(theta - a), math.sqrt(max(p2, 0.0)), _turn(b - theta)
    if word < 4:  # LSR
        p2 = -2.0 + d * d + 2.0 * cab + 2.0 * d * (sa + sb)
        if p2 < 0.0:
            return math.nan, math.nan, math.nan
        p = math.sqrt(p2)
        theta = math.atan2(-ca - cb, d + sa + sb) - math.atan2(-2.0, p)
        return _turn(theta - a), p, _turn(theta - b)
    cosine = (6.0 - d * d + 2.0 * cab + 2.0 * d * (sa - sb)) / 8.0  # RLR
    if abs(cosine) > 1.0:
        return math.nan, math.nan, math.nan
    p = 2.0 * math.pi - math.acos(cosine)
    t = _turn(a - math.atan2(ca - cb, d - sa + sb) + 0.5 * p)
    return t, p, _turn(a - b - t + p)


@njit()
def shortest_word(
    start: FloatArray, end: FloatArray, radius: float
) -> tuple[int, float, float, float]:
    """The word of the shortest curve between poses (3,) and its three lengths, as ``radius``."""
    dx = end[0] - start[0]
    dy = end[1] - start[1]
    heading = math.atan2(dy, dx)
    d = math.hypot(dx, dy) / radius
    best = math.inf
    word = -1
    lengths = (0.0, 0.0, 0.0)
    for i in range(6):
        t, p, q = _segments(i, d, _turn(start[2] - heading), _turn(end[2] - heading))
        if t + p + q < best:
            best = t + p + q
            word = i
            lengths = (t, p, q)
    return word, lengths[0] * radius, lengths[1] * radius, lengths[2] * radius


@njit()
def curve(start: FloatArray, end: FloatArray, radius: float, step: float) -> FloatArray:
    """Poses (N, 3) along the shortest curve, at most ``step`` apart, both ends among them."""
    word, t, p, q = shortest_word(start, end, radius)
    total = t + p + q
    count = max(1, math.ceil(total / step))
    poses = np.empty((count + 1, 3))
    ends = (t, t + p, total)
    poses[0] = start
    x = start[0]
    y = start[1]
    yaw = start[2]
    at = 0.0
    piece = 0
    for i in range(1, count + 1):
        goal = total * i / count
        while True:
            stop = min(goal, ends[piece])
            length = stop - at
            turn = WORDS[word, piece] / radius
            if turn == 0.0:
                x = x + length * math.cos(yaw)
                y = y + length * math.sin(yaw)
            else:
                x += (math.sin(yaw + turn * length) - math.sin(yaw)) / turn
                y -= (math.cos(yaw + turn * length) - math.cos(yaw)) / turn
                yaw += turn * length
            at = stop
            if at >= goal or piece == 2:
                break
            piece += 1
        poses[i] = (x, y, yaw)
    poses[count] = end
    return poses


@njit()
def overlaps_cell(corners: FloatArray, column: int, row: int) -> bool:
    """Whether a convex polygon (N, 2) in [cells] and a cell's square meet (separating axes)."""
    x0 = corners[:, 0].min()
    y0 = corners[:, 1].min()
    if x0 > column + 1 or corners[:, 0].max() < column or y0 > row + 1 or corners[:, 1].max() < row:
        return False
    for i in range(len(corners)):
        j = (i + 1) % len(corners)
        nx = corners[j, 1] - corners[i, 1]
        ny = corners[i, 0] - corners[j, 0]
        lowest = highest = nx * corners[i, 0] + ny * corners[i, 1]
        for k in range(len(corners)):
            level = nx * corners[k, 0] + ny * corners[k, 1]
            lowest = min(lowest, level)
            highest = max(highest, level)
        low = nx * column + ny * row + min(nx, 0.0) + min(ny, 0.0)
        if low > highest or low + abs(nx) + abs(ny) < lowest:
            return False
    return True


@njit()
def stands_free(
    costs: ByteArray,
    blocked: BoolArray,
    footprint: FloatArray,
    reach: float,
    allow_unknown: bool,
    pose: FloatArray,
) -> bool:
    """Whether a convex footprint (N, 2) touches no obstacle's cell at a pose (3,).

    Lengths in [cells].

    ``reach`` is its circumscribed radius: a disc of it that has room, or a centre in contact,
    settles most poses.
    """
    x = pose[0]
    y = pose[1]
    if not is_free(costs, blocked, x, y):
        return False
    if has_room(costs, x, y, reach, allow_unknown):
        return True
    cos = math.cos(pose[2])
    sin = math.sin(pose[2])
    corners = np.empty_like(footprint)
    corners[:, 0] = x + cos * footprint[:, 0] - sin * footprint[:, 1]
    corners[:, 1] = y + sin * footprint[:, 0] + cos * footprint[:, 1]
    for row in range(max(0, math.floor(y - reach)), min(costs.shape[0], math.floor(y + reach) + 1)):
        for column in range(
            max(0, math.floor(x - reach)), min(costs.shape[1], math.floor(x + reach) + 1)
        ):
            cost = costs[row, column]
            if cost == LETHAL_OBSTACLE or (cost == NO_INFORMATION and not allow_unknown):
                if overlaps_cell(corners, column, row):
                    return False
    return True


@njit()
def is_curve_free(
    costs: ByteArray,
    blocked: BoolArray,
    footprint: FloatArray,
    reach: float,
    allow_unknown: bool,
    poses: FloatArray,
) -> bool:
    """Whether a footprint stands free at every pose (N, 3) of a curve."""
    for i in range(len(poses)):
        if not stands_free(costs, blocked, footprint, reach, allow_unknown, poses[i]):
            return False
    return True

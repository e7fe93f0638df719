"""Points on a path (N, 3) that is given in the base frame.

The carrot as Jazzy measures it, on a circle about the robot, and as Nav2 main does, along the path
(``controller_utils.cpp``); Jazzy's cusps.
"""

import math

from navstack.jit import njit
from navstack.types import FloatArray, FloatMatrix

SAME_HEADING = 1e-4  # [rad]
LEAST_CHORD_SQUARED = 0.001  # [m2] as upstream; a nearer point is straight ahead


@njit(ahead=True)
def lookahead_point(path: FloatMatrix, distance: float, beyond_end: bool) -> tuple[float, float]:
    """The point ``distance`` [m] along the path, as (x, y).

    On a path that is shorter: its end, or with ``beyond_end`` the point that its last direction
    leads to.
    """
    travelled = 0.0
    for i in range(1, len(path)):
        dx = path[i, 0] - path[i - 1, 0]
        dy = path[i, 1] - path[i - 1, 1]
        step = math.hypot(dx, dy)
        if travelled + step >= distance:
            share = 0.0
            if step > 0.0:
                share = (distance - travelled) / step
            return path[i - 1, 0] + share * dx, path[i - 1, 1] + share * dy
        travelled += step
    if not beyond_end:
        return path[-1, 0], path[-1, 1]
    return beyond(path, distance - travelled)


@njit(ahead=True)
def lookahead_point_on_circle(
    path: FloatMatrix, distance: float, beyond_end: bool
) -> tuple[float, float]:
    """The point (x, y) where the path leaves the circle of radius ``distance`` [m].

    Of a path that begins outside, its first pose; of one that stays inside as in
    :func:`lookahead_point`.
    """
    for i in range(len(path)):
        if math.hypot(path[i, 0], path[i, 1]) >= distance:
            before = max(i - 1, 0)
            return leave_circle(path[before, 0], path[before, 1], path[i, 0], path[i, 1], distance)
    if not beyond_end:
        return path[-1, 0], path[-1, 1]
    far_x, far_y = beyond(path, distance)
    last_x = path[-1, 0]
    last_y = path[-1, 1]
    if math.hypot(far_x, far_y) < math.hypot(last_x, last_y):  # the end lies far behind the robot
        far_x = 2.0 * last_x - far_x
        far_y = 2.0 * last_y - far_y
    return leave_circle(last_x, last_y, far_x, far_y, distance)


@njit()
def beyond(path: FloatArray, rest: float) -> tuple[float, float]:
    """The point ``rest`` [m] beyond the path's end, in its last direction."""
    x = path[-1, 0]
    y = path[-1, 1]
    direction = path[-1, 2]
    if len(path) > 1:
        direction = math.atan2(y - path[-2, 1], x - path[-2, 0])
    return x + rest * math.cos(direction), y + rest * math.sin(direction)


@njit()
def leave_circle(
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    radius: float,
) -> tuple[float, float]:
    """Where a segment leaves a circle about the origin; its end if it is a point."""
    dx = x1 - x0
    dy = y1 - y0
    length_squared = dx * dx + dy * dy
    if length_squared == 0.0:
        return x1, y1
    along = x0 * dx + y0 * dy
    inside = radius * radius - (x0 * x0 + y0 * y0)  # not negative
    share = (math.sqrt(along * along + length_squared * inside) - along) / length_squared
    return x0 + share * dx, y0 + share * dy


@njit()
def distance_to_cusp(path: FloatArray) -> float:
    """The straight distance in [m] to where the path turns back or turns on the spot.

    Inf if it does not.
    """
    for i in range(1, len(path) - 1):
        ax = path[i, 0] - path[i - 1, 0]
        ay = path[i, 1] - path[i - 1, 1]
        bx = path[i + 1, 0] - path[i, 0]
        by = path[i + 1, 1] - path[i, 1]
        turns = _turns_on_the_spot(path, i - 1) or _turns_on_the_spot(path, i)
        if ax * bx + ay * by < 0.0 or turns:
            return math.hypot(path[i, 0], path[i, 1])
    return math.inf


@njit()
def _turns_on_the_spot(path: FloatArray, i: int) -> bool:
    """Whether pose ``i`` and the next one differ in nothing but the heading."""
    if path[i, 0] != path[i + 1, 0] or path[i, 1] != path[i + 1, 1]:
        return False
    turn = abs(path[i + 1, 2] - path[i, 2]) % (2.0 * math.pi)
    return bool(min(turn, 2.0 * math.pi - turn) > SAME_HEADING)


@njit(ahead=True)
def path_length(path: FloatMatrix) -> float:
    """Length along the path in [m]."""
    length = 0.0
    for i in range(1, len(path)):
        length += math.hypot(path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1])
    return length


def arc_curvature(x: float, y: float) -> float:
    """Curvature in [1/m] of the arc that leaves along the x axis and meets (x, y)."""
    chord_squared = x * x + y * y
    if chord_squared > LEAST_CHORD_SQUARED:
        return 2.0 * y / chord_squared
    return 0.0

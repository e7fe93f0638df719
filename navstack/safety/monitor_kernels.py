"""The inner loops of the collision monitor: points inside a zone, now and along the way."""

import math

from navstack.jit import njit
from navstack.types import FloatArray, FloatMatrix

NO_COLLISION = -1.0
ROUNDING = 1e-6  # [m] more than any rounding below


@njit()
def is_inside(x: float, y: float, vertices: FloatArray) -> bool:
    """Whether a point lies in a polygon (V, 2).

    A ray along +x crosses its edges an odd number of times.

    Edges count as ``Polygon::isPointInside`` of nav2_collision_monitor counts them (Shimrat 1962,
    algorithm 112).
    """
    inside = False
    last = len(vertices) - 1
    for i in range(len(vertices)):
        x0, y0, x1, y1 = vertices[last, 0], vertices[last, 1], vertices[i, 0], vertices[i, 1]
        if (y <= y0) == (y > y1) and x0 + (y - y0) * (x1 - x0) / (y1 - y0) > x:
            inside = not inside
        last = i
    return inside


@njit()
def extent(vertices: FloatArray, radius: float) -> float:
    """A distance in [m] from the robot beyond which no point lies in its zone.

    See :func:`are_inside`.
    """
    farthest = radius
    for i in range(len(vertices)):
        farthest = max(farthest, math.hypot(vertices[i, 0], vertices[i, 1]))
    return farthest + ROUNDING


@njit()
def are_inside(
    points: FloatArray,
    count: int,
    x: float,
    y: float,
    yaw: float,
    vertices: FloatArray,
    radius: float,
    enough: int,
) -> bool:
    """Whether ``enough`` of the first ``count`` points (n, 2) lie in a robot's zone.

    The robot is at (x, y, yaw).
    The zone is a polygon (V, 2) in the robot's frame, or with a positive ``radius`` a circle about
    the robot.
    """
    found = 0
    cosine, sine = math.cos(yaw), math.sin(yaw)
    far_squared = extent(vertices, radius) ** 2
    for i in range(count):
        if found >= enough:
            break
        dx, dy = points[i, 0] - x, points[i, 1] - y
        if dx * dx + dy * dy > far_squared:
            continue
        px, py = dx * cosine + dy * sine, -dx * sine + dy * cosine
        if radius > 0.0:
            found += px * px + py * py < radius * radius
        else:
            found += is_inside(px, py, vertices)
    return found >= enough


@njit()
def within_reach(points: FloatArray, reach: float) -> tuple[FloatArray, int]:
    """The points (n, 2) within ``reach`` [m] of the origin, first in an array, and their number."""
    near = points.copy()
    count = 0
    for i in range(len(points)):
        if points[i, 0] ** 2 + points[i, 1] ** 2 <= reach * reach:
            near[count] = points[i]
            count += 1
    return near, count


@njit(ahead=True)
def collision_time(
    points: FloatMatrix,
    vertices: FloatMatrix,
    radius: float,
    enough: int,
    velocity_x: float,
    velocity_y: float,
    yaw_rate: float,
    horizon: float,
    time_step: float,
) -> float:
    """Time in [s] until the zone of a robot that keeps its velocity holds ``enough`` points (n, 2).

    The zone is looked at now and after every ``time_step`` [s] up to ``horizon`` [s]; the time is
    that *before* the step that ends in the collision. NO_COLLISION: none. See :func:`are_inside`.
    """
    travel = math.hypot(velocity_x, velocity_y) * (horizon + 2.0 * time_step)
    near, count = within_reach(points, extent(vertices, radius) + travel)
    if count < enough:
        return NO_COLLISION
    if are_inside(near, count, 0.0, 0.0, 0.0, vertices, radius, enough):
        return 0.0
    x = y = yaw = time = 0.0
    turn = yaw_rate * time_step
    cosine, sine = math.cos(turn), math.sin(turn)
    while time <= horizon:
        x += velocity_x * time_step
        y += velocity_y * time_step
        yaw += turn
        velocity_x, velocity_y = (
            velocity_x * cosine - velocity_y * sine,
            velocity_x * sine + velocity_y * cosine,
        )
        if are_inside(near, count, x, y, yaw, vertices, radius, enough):
            return time
        time += time_step
    return NO_COLLISION

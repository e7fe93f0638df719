"""Which obstacles a robot may touch: rectangles and convex polygons in the plane."""

import math

from navstack.jit import njit
from navstack.types import FloatArray, FloatMatrix, IntVector


@njit(ahead=True)
def may_touch(
    x: float,
    y: float,
    cos: float,
    sin: float,
    half_length: float,
    half_width: float,
    margin: float,
    corners: FloatMatrix,
    first: IntVector,
) -> bool:
    """Whether a rectangle may be nearer than ``margin`` [m] to one of some convex polygons.

    It is not where their shadows on a side's normal, of either, lie farther apart: the axes of the
    separating axis theorem (Gottschalk, Lin & Manocha 1996). Near corners the true distance may be
    greater.

    Args:
        x: centre of the rectangle [m].
        y: [m].
        cos: cosine of the yaw of its length.
        sin: sine of it.
        half_length: [m].
        half_width: [m].
        margin: [m].
        corners: (M, 2) of all polygons, [m], counter-clockwise.
        first: (k + 1,) where the corners of each polygon begin.
    """
    for polygon in range(len(first) - 1):
        if not _are_apart(
            x,
            y,
            cos,
            sin,
            half_length,
            half_width,
            margin,
            corners,
            first[polygon],
            first[polygon + 1],
        ):
            return True
    return False


@njit()
def _are_apart(
    x: float,
    y: float,
    cos: float,
    sin: float,
    half_length: float,
    half_width: float,
    margin: float,
    corners: FloatArray,
    begin: int,
    end: int,
) -> bool:
    """Whether an axis parts rectangle and polygon (corners ``begin`` to ``end``) by ``margin``."""
    low_along, high_along, low_across, high_across = math.inf, -math.inf, math.inf, -math.inf
    for k in range(begin, end):
        dx, dy = corners[k, 0] - x, corners[k, 1] - y
        along, across = cos * dx + sin * dy, cos * dy - sin * dx
        low_along, high_along = min(low_along, along), max(high_along, along)
        low_across, high_across = min(low_across, across), max(high_across, across)
    if (
        max(low_along, -high_along) > half_length + margin
        or max(low_across, -high_across) > half_width + margin
    ):
        return True
    before_x, before_y = corners[end - 1, 0], corners[end - 1, 1]
    for k in range(begin, end):
        ex, ey = corners[k, 0] - before_x, corners[k, 1] - before_y
        length = max(math.hypot(ex, ey), 1e-300)  # corners may repeat
        # Along the outward normal (ey, -ex) the polygon ends at its edge.
        gap = (ey * (x - before_x) - ex * (y - before_y)) / length
        gap -= (
            half_length * abs(ey * cos - ex * sin) / length
            + half_width * abs(-ey * sin - ex * cos) / length
        )
        if gap > margin:
            return True
        before_x, before_y = corners[k, 0], corners[k, 1]
    return False


@njit(ahead=True)
def find_near(
    x: float,
    y: float,
    radius: float,
    corners: FloatMatrix,
    first: IntVector,
    boxes: FloatMatrix,
    found: IntVector,
) -> tuple[int, float]:
    """Convex polygons within ``radius`` [m] of a point.

    Args:
        x: of the point [m].
        y: [m].
        radius: [m].
        corners: see :func:`may_touch`.
        first: see there.
        boxes: (k, 4) min x, min y, max x, max y of the polygons, [m].
        found: (k,) takes their numbers, ascending.

    Returns:
        How many they are, and the distance [m] of the nearest, 0 inside it; inf: there is none.
    """
    count, nearest = 0, math.inf
    for polygon in range(len(boxes)):
        dx = max(boxes[polygon, 0] - x, x - boxes[polygon, 2], 0.0)
        dy = max(boxes[polygon, 1] - y, y - boxes[polygon, 3], 0.0)
        if dx * dx + dy * dy > radius * radius:
            continue
        distance = _distance(x, y, corners, first[polygon], first[polygon + 1])
        if distance <= radius:
            found[count] = polygon
            count += 1
            nearest = min(nearest, distance)
    return count, nearest


@njit()
def _distance(x: float, y: float, corners: FloatArray, begin: int, end: int) -> float:
    """Distance [m] from a point to a convex polygon of corners ``begin`` to ``end``; 0 inside."""
    squared, is_inside = math.inf, True
    px, py = corners[end - 1, 0], corners[end - 1, 1]
    for k in range(begin, end):
        ex, ey = corners[k, 0] - px, corners[k, 1] - py
        rx, ry = x - px, y - py
        is_inside = is_inside and ex * ry - ey * rx >= 0.0
        # corners may repeat
        along = min(max((ex * rx + ey * ry) / max(ex * ex + ey * ey, 1e-300), 0.0), 1.0)
        squared = min(squared, (rx - along * ex) ** 2 + (ry - along * ey) ** 2)
        px, py = corners[k, 0], corners[k, 1]
    return 0.0 if is_inside else math.sqrt(squared)

"""Which obstacles a robot may touch: rectangles and convex polygons in the plane."""

import math

from navstack.jit import njit
from navstack.types import FloatArray, IntArray


@njit(
    cache=True,
    ahead="float64, float64, float64, float64, float64, float64, float64, float64[:, ::1], int64[::1]",
)
def may_touch(
    x: float,
    y: float,
    cos: float,
    sin: float,
    half_length: float,
    half_width: float,
    margin: float,
    corners: FloatArray,
    first: IntArray,
) -> bool:
    """Whether a rectangle may be nearer than ``margin`` [m] to one of some convex polygons.

    It is not where their shadows on a side's normal, of either, lie farther apart: the axes of the separating axis
    theorem (Gottschalk, Lin & Manocha 1996). Near corners the true distance may be greater.

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
        if not _are_apart(x, y, cos, sin, half_length, half_width, margin, corners, first[polygon], first[polygon + 1]):
            return True
    return False


@njit(cache=True)
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
    """Whether an axis shows that the rectangle keeps ``margin`` to the polygon of corners ``begin`` to ``end``."""
    low_along, high_along, low_across, high_across = math.inf, -math.inf, math.inf, -math.inf
    for k in range(begin, end):
        dx, dy = corners[k, 0] - x, corners[k, 1] - y
        along, across = cos * dx + sin * dy, cos * dy - sin * dx
        low_along, high_along = min(low_along, along), max(high_along, along)
        low_across, high_across = min(low_across, across), max(high_across, across)
    if max(low_along, -high_along) > half_length + margin or max(low_across, -high_across) > half_width + margin:
        return True
    before_x, before_y = corners[end - 1, 0], corners[end - 1, 1]
    for k in range(begin, end):
        ex, ey = corners[k, 0] - before_x, corners[k, 1] - before_y
        length = max(math.hypot(ex, ey), 1e-300)  # corners may repeat
        # Along the outward normal (ey, -ex) the polygon ends at its edge.
        gap = (ey * (x - before_x) - ex * (y - before_y)) / length
        gap -= half_length * abs(ey * cos - ex * sin) / length + half_width * abs(-ey * sin - ex * cos) / length
        if gap > margin:
            return True
        before_x, before_y = corners[k, 0], corners[k, 1]
    return False

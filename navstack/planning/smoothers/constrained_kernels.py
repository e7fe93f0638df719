"""The inner loops of :mod:`navstack.planning.smoothers.constrained_smoother`."""

import math

import numpy as np

from navstack.jit import njit
from navstack.types import BoolArray, ByteArray, FloatArray

TERMS = 6  # per point: second difference x, y; curvature; distance x, y; cost
STEP = 1e-6  # [m] of the differences that stand for derivatives
BAND = 6  # diagonals of the normal equations' upper half: a point meets its neighbours only


@njit(cache=True)
def curvature(ax: float, ay: float, bx: float, by: float, cx: float, cy: float) -> float:
    """Of the circle through three points [m], in [1/m]; signed, left is positive; 0 where two coincide (Menger)."""
    ux, uy, vx, vy, wx, wy = bx - ax, by - ay, cx - bx, cy - by, cx - ax, cy - ay
    product = math.sqrt((ux * ux + uy * uy) * (vx * vx + vy * vy) * (wx * wx + wy * wy))
    return 2.0 * (ux * vy - uy * vx) / product if product > 0.0 else 0.0


@njit(cache=True)
def highest_curvature(points: FloatArray) -> float:
    """The greatest absolute curvature [1/m] along a polyline (N, >= 2) in [m]; infinite where it turns back."""
    highest = 0.0
    for i in range(1, len(points) - 1):
        ax, ay, bx, by = points[i - 1, 0], points[i - 1, 1], points[i, 0], points[i, 1]
        cx, cy = points[i + 1, 0], points[i + 1, 1]
        if (bx - ax) * (cx - bx) + (by - ay) * (cy - by) < 0.0:
            return math.inf
        highest = max(highest, abs(curvature(ax, ay, bx, by, cx, cy)))
    return highest


@njit(cache=True)
def cost_between(costs: ByteArray, fx: float, fy: float) -> float:
    """The cost at (fx, fy) [cells], interpolated between the cells' centres; the map's rim goes on beyond it."""
    height, width = costs.shape
    x = min(max(fx - 0.5, 0.0), max(width - 1.001, 0.0))
    y = min(max(fy - 0.5, 0.0), max(height - 1.001, 0.0))
    i, j = int(x), int(y)
    s, t = x - i, y - j
    right, above = min(i + 1, width - 1), min(j + 1, height - 1)
    lower = (1.0 - s) * costs[j, i] + s * costs[j, right]
    upper = (1.0 - s) * costs[above, i] + s * costs[above, right]
    return float((1.0 - t) * lower + t * upper)


@njit(cache=True)
def residuals(
    near: FloatArray, given: FloatArray, grid: FloatArray, costs: ByteArray, weights: FloatArray, out: FloatArray
) -> None:
    """The roots of the weighted squares at the middle of three points, into ``out`` (TERMS,).

    Args:
        near: (3, 2) the points [m].
        given: (2,) where the middle one was.
        grid: (4,) the costmap's origin x, y and resolution [m], and the curvature allowed [1/m].
        costs: (height, width).
        weights: (4,) square roots of the weights of second difference, curvature, distance, cost.
        out: what is written.
    """
    for axis in range(2):
        out[axis] = weights[0] * (near[0, axis] - 2.0 * near[1, axis] + near[2, axis])
        out[3 + axis] = weights[2] * (near[1, axis] - given[axis])
    bend = abs(curvature(near[0, 0], near[0, 1], near[1, 0], near[1, 1], near[2, 0], near[2, 1]))
    out[2] = weights[1] * max(bend - grid[3], 0.0)
    out[5] = weights[3] * cost_between(costs, (near[1, 0] - grid[0]) / grid[2], (near[1, 1] - grid[1]) / grid[2])


@njit(cache=True)
def sum_of_squares(
    points: FloatArray, given: FloatArray, grid: FloatArray, costs: ByteArray, weights: FloatArray
) -> float:
    """Of all residuals of points (N, 2)."""
    total, out = 0.0, np.empty(TERMS)
    for i in range(1, len(points) - 1):
        residuals(points[i - 1 : i + 2], given[i], grid, costs, weights, out)
        total += (out * out).sum()
    return total


@njit(cache=True)
def normal_equations(
    points: FloatArray,
    given: FloatArray,
    grid: FloatArray,
    costs: ByteArray,
    weights: FloatArray,
    fixed: BoolArray,
    band: FloatArray,
    slope: FloatArray,
) -> None:
    """J'J in upper banded form (BAND, 2N) and J'r (2N,) of all residuals; points that are ``fixed`` (N,) do not move.

    Unknowns are x, y of each point in turn; derivatives are central differences.
    """
    band[:] = 0.0
    slope[:] = 0.0
    here, up, down, jacobian = np.empty(TERMS), np.empty(TERMS), np.empty(TERMS), np.empty((TERMS, 6))
    for i in range(1, len(points) - 1):
        near = points[i - 1 : i + 2].copy()
        residuals(near, given[i], grid, costs, weights, here)
        for k in range(6):
            value = near[k // 2, k % 2]
            near[k // 2, k % 2] = value + STEP
            residuals(near, given[i], grid, costs, weights, up)
            near[k // 2, k % 2] = value - STEP
            residuals(near, given[i], grid, costs, weights, down)
            near[k // 2, k % 2] = value
            is_fixed = fixed[i - 1 + k // 2]
            jacobian[:, k] = 0.0 if is_fixed else 1.0
            jacobian[:, k] *= (up - down) / (2.0 * STEP)
        first = 2 * (i - 1)
        for k in range(6):
            slope[first + k] += (jacobian[:, k] * here).sum()
            for m in range(k, 6):
                band[BAND - 1 + k - m, first + m] += (jacobian[:, k] * jacobian[:, m]).sum()

"""The descent along the gradient of NavFn's potential (calcPath, gradCell of nav2_navfn_planner/navfn.cpp)."""

import math

import numpy as np
from numba import njit

from navstack.planning.navfn_kernels import COST_NEUTRAL, POT_HIGH, round_half_away
from navstack.types import Float32Array

STALLED_STEPS = 200  # half-cell steps without a lower potential: the descent goes round in circles
GRID_STEPS = 20  # cells to follow along the grid after that
FAILED = -1  # no way on
EXHAUSTED = -2  # the buffer is too short for the path
STEP = np.float32(0.5)  # [cells] pathStep


@njit(cache=True)
def gradient(potential: Float32Array, width: int, n: int) -> tuple[float, float]:
    """Unit vector of steepest descent in a reached cell; (0, 0) where there is none (gradCell)."""
    dx = dy = np.float32(0.0)
    if n < width or n >= potential.size - width:
        return dx, dy
    centre = potential[n]
    if potential[n - 1] < POT_HIGH:
        dx = np.float32(dx + (potential[n - 1] - centre))
    if potential[n + 1] < POT_HIGH:
        dx = np.float32(dx + (centre - potential[n + 1]))
    if potential[n - width] < POT_HIGH:
        dy = np.float32(dy + (potential[n - width] - centre))
    if potential[n + width] < POT_HIGH:
        dy = np.float32(dy + (centre - potential[n + width]))
    norm = np.float32(math.hypot(dx, dy))
    if norm > 0.0:
        norm = np.float32(1.0 / np.float64(norm))
    return np.float32(norm * dx), np.float32(norm * dy)


@njit(cache=True)
def interpolated_gradient(potential: Float32Array, width: int, n: int, dx: float, dy: float) -> tuple[float, float]:
    """Gradient at the offset (dx, dy) from cell ``n``, bilinear between it and its three upper right neighbours."""
    x00, y00 = gradient(potential, width, n)
    x10, y10 = gradient(potential, width, n + 1)
    x01, y01 = gradient(potential, width, n + width)
    x11, y11 = gradient(potential, width, n + width + 1)
    rest_x, rest_y = 1.0 - np.float64(dx), 1.0 - np.float64(dy)
    x1 = np.float32(rest_x * x00 + np.float32(dx * x10))
    x2 = np.float32(rest_x * x01 + np.float32(dx * x11))
    y1 = np.float32(rest_x * y00 + np.float32(dx * y10))
    y2 = np.float32(rest_x * y01 + np.float32(dx * y11))
    return np.float32(rest_y * x1 + np.float32(dy * x2)), np.float32(rest_y * y1 + np.float32(dy * y2))


@njit(cache=True)
def all_reached(potential: Float32Array, width: int, n: int) -> bool:
    """Whether a cell and its eight neighbours have a potential."""
    for row in (n - width, n, n + width):
        if potential[row - 1] >= POT_HIGH or potential[row] >= POT_HIGH or potential[row + 1] >= POT_HIGH:
            return False
    return True


@njit(cache=True)
def lowest_neighbour(potential: Float32Array, width: int, n: int) -> int:
    """The neighbour of least potential among eight, or the cell itself.

    The least potential is truncated to a whole number after each comparison, as upstream's ``int minp`` does.
    """
    if potential[n] >= POT_HIGH:
        return n
    best, lowest = n, np.floor(potential[n])
    for row in (n - width, n, n + width):
        for m in (row - 1, row, row + 1):
            if m != n and potential[m] < lowest:
                best, lowest = m, np.floor(potential[m])
    return best


@njit(cache=True)
def advance(potential: Float32Array, width: int, n: int, dx: float, dy: float) -> tuple[int, float, float]:
    """Half a cell down the gradient from cell ``n`` and offset (dx, dy); cell -1 where the gradient is zero."""
    x, y = interpolated_gradient(potential, width, n, dx, dy)
    if x == 0.0 and y == 0.0:
        return -1, dx, dy
    scale = np.float32(STEP / np.float32(math.hypot(x, y)))
    dx, dy = np.float32(dx + np.float32(x * scale)), np.float32(dy + np.float32(y * scale))
    one = np.float32(1.0)
    if dx > one:
        n, dx = n + 1, np.float32(dx - one)
    if dx < -one:
        n, dx = n - 1, np.float32(dx + one)
    if dy > one:
        n, dy = n + width, np.float32(dy - one)
    if dy < -one:
        n, dy = n - width, np.float32(dy + one)
    return n, dx, dy


@njit(cache=True)
def step(potential: Float32Array, width: int, n: int, dx: float, dy: float, on_grid: bool) -> tuple[int, float, float]:
    """The next cell and offset: down the gradient, or to the lowest neighbour near unreached cells; cell -1: stuck."""
    if n <= width or n >= potential.size - width - 1:
        return -1, dx, dy
    if on_grid or not all_reached(potential, width, n):
        lowest = lowest_neighbour(potential, width, n)
        return (lowest if potential[lowest] < POT_HIGH else -1), np.float32(0.0), np.float32(0.0)
    return advance(potential, width, n, dx, dy)


@njit(cache=True)
def descend(potential: Float32Array, width: int, start: int, source: int, path: Float32Array) -> int:
    """Follow the gradient from cell ``start`` to the potential's ``source`` in half-cell steps (calcPath).

    Writes points in cells into ``path`` (N, 2) and returns how many, FAILED or EXHAUSTED. Upstream gives up after
    4 * max(width, height) points however long the way is, and where the gradient is zero or leads round in circles
    (A* leaves such places). Here the descent then goes back to the lowest point and on along the grid for a
    while: every reached cell has a lower neighbour.
    """
    n, dx, dy = start, np.float32(0.0), np.float32(0.0)
    lowest, lowest_n, lowest_i = np.inf, start, 0
    grid_until, stalled_i, i = 0, -1, 0
    while i < len(path):
        nearest = n + round_half_away(dx) + width * round_half_away(dy)
        value = potential[max(0, min(potential.size - 1, nearest))]
        if value < COST_NEUTRAL:
            path[i, 0], path[i, 1] = source % width, source // width
            return i + 1
        if value < lowest:
            lowest, lowest_n, lowest_i = value, max(0, min(potential.size - 1, nearest)), i
        path[i, 0], path[i, 1] = np.float32(n % width) + dx, np.float32(n // width) + dy
        oscillates = i >= 2 and path[i, 0] == path[i - 2, 0] and path[i, 1] == path[i - 2, 1]
        n, dx, dy = step(potential, width, n, dx, dy, oscillates or i < grid_until)
        i += 1
        if n < 0 or i - lowest_i > STALLED_STEPS:
            if lowest_i == stalled_i:  # no lower point since the last time
                return FAILED
            stalled_i, i = lowest_i, lowest_i + 1
            n, dx, dy = lowest_n, np.float32(0.0), np.float32(0.0)
            grid_until = i + GRID_STEPS
    return EXHAUSTED

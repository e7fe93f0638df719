"""Where NavFn's descent begins, and the descent along the gradient (navfn.cpp)."""

import math

import numpy as np

from navstack.costmap.costmap import Grid
from navstack.jit import njit
from navstack.planning.navfn_kernels import COST_NEUTRAL, POT_HIGH, round_half_away
from navstack.types import Float32Array, Float32Matrix, Float32Vector

STALLED_STEPS = 200  # half-cell steps without a lower potential: the descent goes round in circles
GRID_STEPS = 20  # cells to follow along the grid after that
FAILED = -1  # no way on
EXHAUSTED = -2  # the buffer is too short for the path
STEP = np.float32(0.5)  # [cells] pathStep


@njit(forceinline=True)
def length(x: float, y: float) -> float:
    """C's hypotf: the length of a vector of float32."""
    return np.float32(math.sqrt(np.float64(x) * np.float64(x) + np.float64(y) * np.float64(y)))


@njit(forceinline=True)
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
    norm = length(dx, dy)
    if norm > 0.0:
        norm = np.float32(1.0 / np.float64(norm))
    return np.float32(norm * dx), np.float32(norm * dy)


@njit(forceinline=True)
def take_corner(potential: Float32Array, width: int, n: int, i: int, corners: Float32Array) -> None:
    """The gradient of cell ``n`` plus the offset of corner ``i`` (right, above, both)."""
    n += (i & 1) + width * (i >> 1)
    corners[i, 0], corners[i, 1] = gradient(potential, width, n)


@njit(forceinline=True)
def take_corners(
    potential: Float32Array, width: int, n: int, held: int, corners: Float32Array
) -> None:
    """The gradients (4, 2) of a cell and its three upper right neighbours: right, above, both.

    ``corners`` are those of cell ``held`` until now: a cell beside it has two in common with it.
    """
    beside = 0  # bit of the corners' numbers by which the two cells' differ; 0: nothing in common
    if n == held + 1 or n == held - 1:
        beside = 1
    elif n == held + width or n == held - width:
        beside = 2
    new = beside if n > held else 0
    for i in range(4):
        if beside != 0 and i & beside != new:
            continue
        if beside != 0:  # the other one of the pair has been this one
            corners[i ^ beside, 0], corners[i ^ beside, 1] = corners[i, 0], corners[i, 1]
        take_corner(potential, width, n, i, corners)


@njit(forceinline=True)
def interpolated_gradient(corners: Float32Array, dx: float, dy: float) -> tuple[float, float]:
    """Gradient at the offset (dx, dy) from a cell, bilinear between its ``corners``."""
    rest_x = 1.0 - np.float64(dx)
    rest_y = 1.0 - np.float64(dy)
    x1 = np.float32(rest_x * corners[0, 0] + np.float32(dx * corners[1, 0]))
    x2 = np.float32(rest_x * corners[2, 0] + np.float32(dx * corners[3, 0]))
    y1 = np.float32(rest_x * corners[0, 1] + np.float32(dx * corners[1, 1]))
    y2 = np.float32(rest_x * corners[2, 1] + np.float32(dx * corners[3, 1]))
    return np.float32(rest_y * x1 + np.float32(dy * x2)), np.float32(
        rest_y * y1 + np.float32(dy * y2)
    )


@njit(forceinline=True)
def all_reached(potential: Float32Array, width: int, n: int) -> bool:
    """Whether a cell and its eight neighbours have a potential."""
    for row in (n - width, n, n + width):
        if (
            potential[row - 1] >= POT_HIGH
            or potential[row] >= POT_HIGH
            or potential[row + 1] >= POT_HIGH
        ):
            return False
    return True


@njit()
def lowest_neighbour(potential: Float32Array, width: int, n: int) -> int:
    """The neighbour of least potential among eight, or the cell itself.

    The least potential is truncated to a whole number after each comparison, as upstream's ``int
    minp`` does.
    """
    if potential[n] >= POT_HIGH:
        return n
    best = n
    lowest = np.floor(potential[n])
    for row in (n - width, n, n + width):
        for m in (row - 1, row, row + 1):
            if m != n and potential[m] < lowest:
                best = m
                lowest = np.floor(potential[m])
    return best


@njit(forceinline=True)
def advance(
    corners: Float32Array, width: int, n: int, dx: float, dy: float
) -> tuple[int, float, float]:
    """Half a cell down the gradient from cell ``n`` and offset (dx, dy).

    Cell -1 where the gradient is zero.
    """
    x, y = interpolated_gradient(corners, dx, dy)
    if x == 0.0 and y == 0.0:
        return -1, dx, dy
    scale = np.float32(STEP / length(x, y))
    dx = np.float32(dx + np.float32(x * scale))
    dy = np.float32(dy + np.float32(y * scale))
    one = np.float32(1.0)
    if dx > one:
        n = n + 1
        dx = np.float32(dx - one)
    if dx < -one:
        n = n - 1
        dx = np.float32(dx + one)
    if dy > one:
        n = n + width
        dy = np.float32(dy - one)
    if dy < -one:
        n = n - width
        dy = np.float32(dy + one)
    return n, dx, dy


@njit(forceinline=True)
def step(
    potential: Float32Array,
    width: int,
    n: int,
    dx: float,
    dy: float,
    on_grid: bool,
    held: int,
    corners: Float32Array,
) -> tuple[int, float, float, int]:
    """The next cell and offset: down the gradient, or to the lowest neighbour near unreached cells.

    Cell -1: stuck.

    ``corners`` (4, 2) are those of cell ``held``, which has been found to be among reached ones;
    the number of the cell that they are of then comes last.
    """
    if n <= width or n >= potential.size - width - 1:
        return -1, dx, dy, held
    if on_grid or (n != held and not all_reached(potential, width, n)):
        lowest = lowest_neighbour(potential, width, n)
        return (
            (lowest if potential[lowest] < POT_HIGH else -1),
            np.float32(0.0),
            np.float32(0.0),
            held,
        )
    if n != held:
        take_corners(potential, width, n, held, corners)
    m, dx, dy = advance(corners, width, n, dx, dy)
    return m, dx, dy, n


@njit(ahead=True)
def descend(
    potential: Float32Vector,
    width: int,
    start: int,
    source: int,
    gives_up: bool,
    path: Float32Matrix,
) -> int:
    """Follow the gradient from cell ``start`` to ``source`` in half-cell steps (calcPath).

    Writes points in cells into ``path`` (N, 2) and returns how many, FAILED or EXHAUSTED. Where the
    gradient is zero, upstream gives up (``gives_up``); where it leads round in circles, upstream
    goes on until its points are exhausted. A* leaves such places. Otherwise the descent goes back
    to the lowest point and on along the grid for a while: every reached cell has a lower neighbour.
    """
    n = start
    dx = np.float32(0.0)
    dy = np.float32(0.0)
    lowest = np.inf
    lowest_n = start
    lowest_i = 0
    grid_until = 0
    stalled_i = -1
    i = 0
    held = np.int64(-1)  # of a literal's type, numba would compile step once more
    corners = np.empty((4, 2), dtype=np.float32)  # most steps stay in their cell
    while i < len(path):
        nearest = n + round_half_away(dx) + width * round_half_away(dy)
        value = potential[max(0, min(potential.size - 1, nearest))]
        if value < COST_NEUTRAL:
            path[i, 0] = source % width
            path[i, 1] = source // width
            return i + 1
        if value < lowest:
            lowest = value
            lowest_n = max(0, min(potential.size - 1, nearest))
            lowest_i = i
        path[i, 0] = np.float32(n % width) + dx
        path[i, 1] = np.float32(n // width) + dy
        oscillates = i >= 2 and path[i, 0] == path[i - 2, 0] and path[i, 1] == path[i - 2, 1]
        n, dx, dy, held = step(
            potential, width, n, dx, dy, oscillates or i < grid_until, held, corners
        )
        i += 1
        if gives_up:
            if n < 0:
                return FAILED
        elif n < 0 or i - lowest_i > STALLED_STEPS:
            if lowest_i == stalled_i:  # no lower point since the last time
                return FAILED
            stalled_i = lowest_i
            i = lowest_i + 1
            n = lowest_n
            dx = np.float32(0.0)
            dy = np.float32(0.0)
            grid_until = i + GRID_STEPS
    return EXHAUSTED


@njit(ahead=True)
def nearest_reachable(
    potential: Float32Vector, width: int, goal: tuple[float, float], tolerance: float, grid: Grid
) -> tuple[float, float]:
    """The reached point [m] nearest to the goal, within the tolerance's square (makePlan).

    The goal itself where it is reached; NaN where nothing is.
    """
    (goal_x, goal_y) = goal
    (origin_x, origin_y, resolution) = grid
    if (
        potential_at(
            potential, width, (goal_x - origin_x) / resolution, (goal_y - origin_y) / resolution
        )
        < POT_HIGH
    ):
        return goal_x, goal_y
    best = np.inf
    best_x = np.nan
    best_y = np.nan
    y = goal_y - tolerance
    while y <= goal_y + tolerance:
        x = goal_x - tolerance
        while x <= goal_x + tolerance:
            squared = (x - goal_x) * (x - goal_x) + (y - goal_y) * (y - goal_y)
            value = potential_at(
                potential, width, (x - origin_x) / resolution, (y - origin_y) / resolution
            )
            if value < POT_HIGH and squared < best:
                best = squared
                best_x = x
                best_y = y
            x += resolution
        y += resolution
    return best_x, best_y


@njit()
def potential_at(potential: Float32Array, width: int, x: float, y: float) -> float:
    """Potential of the grid point nearest to a point in [cells]; POT_HIGH off the map."""
    if x < 0.0 or y < 0.0:
        return POT_HIGH
    column = round_half_away(x)
    row = round_half_away(y)
    if column >= width or row >= potential.size // width:
        return POT_HIGH
    return potential[row * width + column]

"""The inner loops of :mod:`navstack.planning.simple_smoother`."""

import math

import numpy as np

from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION, Grid
from navstack.jit import njit
from navstack.types import ByteArray, FloatArray, IntArray

SAME_PLACE = 1e-4  # [m] along each axis
SAME_HEADING = 1e-4  # [rad]

_u = np.uint64  # unsigned indices: numba then omits the treatment of negative ones


@njit()
def meets_obstacle(places: FloatArray, costs: ByteArray, grid: Grid, cells: IntArray) -> bool:
    """Whether the robot's centre means contact at one of the places (2, N) [m] but the ends.

    Off the map none does.

    ``cells`` (N,) is room: their numbers, worked out first, so that this compiles to vector
    instructions.
    """
    height, width = costs.shape
    flat = costs.reshape(-1)
    x = places[0]
    y = places[1]
    for i in range(_u(len(cells))):
        fx = (x[i] - grid[0]) / grid[2]
        fy = (y[i] - grid[1]) / grid[2]
        is_inside = (fx >= 0.0) & (fy >= 0.0) & (fx < width) & (fy < height)
        cells[i] = np.int64(fy) * width + np.int64(fx) if is_inside else -1
    for i in range(1, len(cells) - 1):
        if cells[i] >= 0 and INSCRIBED_INFLATED_OBSTACLE <= flat[_u(cells[i])] < NO_INFORMATION:
            return True
    return False


@njit(inline="always")
def _relax_one(
    given: FloatArray,
    old: FloatArray,
    new: FloatArray,
    i: int,
    x: float,
    y: float,
    weights: tuple[float, float],
) -> tuple[float, float, float, float]:
    """Move place ``i`` after the one before has come to (x, y).

    Returns where to, and how far along x and y.
    """
    at = _u(i)
    beyond = _u(i + 1)
    old_x = old[0, at]
    old_y = old[1, at]
    x = old_x + (
        weights[0] * (given[0, at] - old_x) + weights[1] * (old[0, beyond] + x - 2.0 * old_x)
    )
    y = old_y + (
        weights[0] * (given[1, at] - old_y) + weights[1] * (old[1, beyond] + y - 2.0 * old_y)
    )
    new[0, at] = x
    new[1, at] = y
    return x, y, abs(x - old_x), abs(y - old_y)


@njit()
def sweep_twice(
    given: FloatArray,
    old: FloatArray,
    once: FloatArray,
    twice: FloatArray,
    weights: tuple[float, float],
) -> tuple[float, float]:
    """Two iterations on places (2, N); the second follows the first two places behind.

    Each place waits for the one before; of the two iterations one computes while the other waits.

    Args:
        given: places to stay near.
        old: places before.
        once: those after one iteration; the ends are in place, here and in the next.
        twice: those after two.
        weights: of the given place and of the neighbours.

    Returns:
        How far all places move together in each iteration, along x and y.
    """
    count = old.shape[1]
    x = old[0, 0]
    y = old[1, 0]
    change = 0.0
    next_x = x
    next_y = y
    next_change = 0.0
    for i in range(1, count + 1):
        if i < count - 1:
            x, y, dx, dy = _relax_one(given, old, once, i, x, y, weights)
            change = change + dx + dy
        if i > 2:
            next_x, next_y, dx, dy = _relax_one(given, once, twice, i - 2, next_x, next_y, weights)
            next_change = next_change + dx + dy
    return change, next_change


@njit()
def relax(
    poses: FloatArray,
    weights: tuple[float, float],
    tolerance: float,
    max_its: int,
    costs: ByteArray,
    grid: Grid,
) -> bool:
    """Relax the positions of poses (N, >= 2) until they move less than ``tolerance`` [m] together.

    ``weights``: of the given place and of the neighbours.

    Returns:
        Whether they came to rest before ``max_its`` iterations and without meeting an obstacle; if
        not, the poses are those before the iteration that failed.
    """
    given = np.ascontiguousarray(poses[:, :2].T)
    last = given.copy()
    once = given.copy()
    twice = given.copy()
    cells = np.empty(len(poses), dtype=np.int64)
    iterations = 0
    at_rest = False
    failed = False
    while not (at_rest or failed):
        changes = sweep_twice(given, last, once, twice, weights)
        for change, places in zip(changes, (once, twice)):  # noqa: B905 - numba knows no strict
            iterations += 1
            failed = iterations >= max_its or meets_obstacle(places, costs, grid, cells)
            if failed:
                break
            poses[:, 0] = places[0]
            poses[:, 1] = places[1]
            at_rest = not change >= tolerance
            if at_rest:
                break
        last, twice = twice, last
    return at_rest


@njit()
def stretch_ends(poses: FloatArray) -> IntArray:
    """Indices of the poses (N, 3) where the path turns back or on the spot, and of the last."""
    ends = np.empty(2 * len(poses), dtype=np.int64)
    count = 0
    for i in range(1, len(poses) - 1):
        ax = poses[i, 0] - poses[i - 1, 0]
        ay = poses[i, 1] - poses[i - 1, 1]
        bx = poses[i + 1, 0] - poses[i, 0]
        by = poses[i + 1, 1] - poses[i, 1]
        turn = poses[i + 1, 2] - poses[i, 2]
        turn -= 2.0 * math.pi * math.floor((turn + math.pi) / (2.0 * math.pi))
        turns_back = ax * bx + ay * by < 0.0
        turns_on_the_spot = (
            abs(bx) < SAME_PLACE and abs(by) < SAME_PLACE and abs(turn) > SAME_HEADING
        )
        if turns_back or turns_on_the_spot:
            ends[count] = i
            count += 1
    ends[count] = len(poses) - 1
    return ends[: count + 1]


@njit()
def face_along(poses: FloatArray, backwards: bool) -> None:
    """Turn each pose (N, 3) but the last towards the next one, or away from it, in place.

    A pose at the place of the next one keeps its yaw.
    """
    for i in range(len(poses) - 1):
        dx = poses[i + 1, 0] - poses[i, 0]
        dy = poses[i + 1, 1] - poses[i, 1]
        if abs(dx) < SAME_PLACE and abs(dy) < SAME_PLACE:
            continue
        yaw = math.atan2(dy, dx)
        if backwards:
            yaw += math.pi if yaw <= 0.0 else -math.pi
        poses[i, 2] = yaw

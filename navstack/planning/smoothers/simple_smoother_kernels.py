"""The inner loops of :mod:`navstack.planning.smoothers.simple_smoother`."""

import math

import numpy as np
from numba import njit

from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION
from navstack.types import ByteArray, FloatArray, IntArray

SAME_PLACE = 1e-4  # [m] along each axis
SAME_HEADING = 1e-4  # [rad]


@njit(cache=True)
def is_obstacle(costs: ByteArray, fx: float, fy: float) -> bool:
    """Whether the robot's centre at (fx, fy) [cells] means contact; a place off the map counts as free."""
    height, width = costs.shape
    if not (fx >= 0.0 and fy >= 0.0 and fx < width and fy < height):
        return False
    cost = costs[int(fy), int(fx)]
    return bool(cost >= INSCRIBED_INFLATED_OBSTACLE and cost != NO_INFORMATION)


@njit(cache=True)
def relax(
    poses: FloatArray,
    w_data: float,
    w_smooth: float,
    tolerance: float,
    max_its: int,
    costs: ByteArray,
    origin_x: float,
    origin_y: float,
    resolution: float,
) -> bool:
    """Relax the positions of poses (N, >= 2), in place, until they move less than ``tolerance`` [m] together.

    Returns:
        Whether they came to rest before ``max_its`` iterations and without meeting an obstacle; if not, the poses are
        those before the iteration that failed.
    """
    count = len(poses)
    given_x, given_y = poses[:, 0].copy(), poses[:, 1].copy()
    moving_x, moving_y = given_x.copy(), given_y.copy()
    change = tolerance
    iterations = 0
    while change >= tolerance:
        iterations += 1
        if iterations >= max_its:
            return False
        change = 0.0
        last_x, last_y = moving_x[0], moving_y[0]
        for i in range(1, count - 1):
            x, y = moving_x[i], moving_y[i]
            last_x = x + (w_data * (given_x[i] - x) + w_smooth * (moving_x[i + 1] + last_x - 2.0 * x))
            last_y = y + (w_data * (given_y[i] - y) + w_smooth * (moving_y[i + 1] + last_y - 2.0 * y))
            change = change + abs(last_x - x) + abs(last_y - y)
            moving_x[i], moving_y[i] = last_x, last_y
            if is_obstacle(costs, (last_x - origin_x) / resolution, (last_y - origin_y) / resolution):
                return False
        poses[:, 0] = moving_x
        poses[:, 1] = moving_y
    return True


@njit(cache=True)
def stretch_ends(poses: FloatArray) -> IntArray:
    """Indices of the poses (N, 3) where the path turns back or turns on the spot, and of the last pose."""
    ends = np.empty(2 * len(poses), dtype=np.int64)
    count = 0
    for i in range(1, len(poses) - 1):
        ax, ay = poses[i, 0] - poses[i - 1, 0], poses[i, 1] - poses[i - 1, 1]
        bx, by = poses[i + 1, 0] - poses[i, 0], poses[i + 1, 1] - poses[i, 1]
        turn = poses[i + 1, 2] - poses[i, 2]
        turn -= 2.0 * math.pi * math.floor((turn + math.pi) / (2.0 * math.pi))
        turns_back = ax * bx + ay * by < 0.0
        turns_on_the_spot = abs(bx) < SAME_PLACE and abs(by) < SAME_PLACE and abs(turn) > SAME_HEADING
        if turns_back or turns_on_the_spot:
            ends[count] = i
            count += 1
    ends[count] = len(poses) - 1
    return ends[: count + 1]


@njit(cache=True)
def face_along(poses: FloatArray, backwards: bool) -> None:
    """Set the yaw of each pose (N, 3) but the last to the direction of the next one, or away from it, in place.

    A pose at the place of the next one keeps its yaw.
    """
    for i in range(len(poses) - 1):
        dx, dy = poses[i + 1, 0] - poses[i, 0], poses[i + 1, 1] - poses[i, 1]
        if abs(dx) < SAME_PLACE and abs(dy) < SAME_PLACE:
            continue
        yaw = math.atan2(dy, dx)
        if backwards:
            yaw += math.pi if yaw <= 0.0 else -math.pi
        poses[i, 2] = yaw

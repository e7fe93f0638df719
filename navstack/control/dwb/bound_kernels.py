"""Which trajectories can be the best at all, told without driving them: inner loops of :mod:`.choice_kernels`."""

import math

import numpy as np

from navstack.control.dwb.end_score import GOAL_ALIGNMENT, GOAL_DISTANCE
from navstack.jit import njit
from navstack.types import Float32Array, FloatArray, IntArray

Grid = tuple[float, float, float]  # [m] x and y of a costmap's origin, [m] size of a cell

ROUNDED_DOWN = 1.0 - 1e-5  # by more than sums in float32 lose


@njit(cache=True)
def promising(
    robot: FloatArray,
    commands: FloatArray,
    sim_time: float,
    limits: FloatArray,
    kinds: IntArray,
    numbers: FloatArray,
    scales: Float32Array,
    goals: IntArray,
    grid: Grid,
    most: np.float32,
) -> IntArray:
    """Indices (M,) of the commands (K, 3) whose trajectories may cost ``most`` or less.

    How far a trajectory leads at the utmost tells how near it can come to the goal's cells (by the square root of 2
    more cells than its length has, along a diagonal); the rest of its cost is not negative.
    """
    away = np.full(len(kinds), -math.inf)  # [cells] at least, from the robot to what a critic measures to
    for c in range(len(kinds)):
        if kinds[c] == GOAL_DISTANCE or kinds[c] == GOAL_ALIGNMENT:
            x, y = (robot[0] - grid[0]) / grid[2], (robot[1] - grid[1]) / grid[2]
            away[c] = abs(x - goals[c, 0]) + abs(y - goals[c, 1]) - 2.0 - math.sqrt(2.0) * abs(numbers[c]) / grid[2]
    found, count, bound = np.empty(len(commands), dtype=np.int64), 0, 0.0
    for k in range(len(commands)):
        if k == 0 or commands[k, 0] != commands[k - 1, 0]:
            gain = math.sqrt(2.0) * longest_way(robot[3], commands[k, 0], -limits[0, 1], sim_time) / grid[2]
            bound = 0.0
            for c in range(len(kinds)):
                bound += max(away[c] - gain, 0.0) * scales[c]
        if bound * ROUNDED_DOWN <= most:
            found[count] = k
            count += 1
    return found[:count]


@njit(cache=True)
def longest_way(speed: float, command: float, deceleration: float, time: float) -> float:
    """A length in [m] that no trajectory from ``speed`` to ``command`` [m/s] exceeds in ``time`` [s]."""
    if speed > command >= 0.0:
        return command * time + (speed - command) ** 2 / (2.0 * max(deceleration, 1e-9))
    return max(abs(speed), abs(command)) * time

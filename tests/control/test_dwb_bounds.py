"""What is left out of DWB's choice could not have been chosen."""

import math

import numpy as np
import pytest

from navstack.control.dwb.bound_kernels import longest_way, promising
from navstack.control.dwb.end_score import CELL_COST, GOAL_ALIGNMENT, GOAL_DISTANCE
from navstack.control.dwb.kernels import roll_out

TIME, ACCELERATION = 1.7, 2.5  # [s], [m/s2]
LIMITS = np.array(((ACCELERATION, -ACCELERATION), (0.0, 0.0), (3.5, -3.5)))
COMMANDS = np.array([(vx, 0.0, rate) for vx in np.linspace(-0.5, 2.0, 11) for rate in np.linspace(-1.5, 1.5, 7)])
AHEAD = (48, 3)  # cell of a goal


def driven(speed: float, steps: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y and yaw (K, T) of all commands from the origin."""
    x, y, yaw = np.zeros((3, len(COMMANDS), steps + 1))
    counts = np.full(len(COMMANDS), steps)
    start, velocity = np.array((0.0, 0.0, 0.4)), np.array((speed, 0.0, 0.3))
    roll_out(start, velocity, COMMANDS, LIMITS, counts, TIME, x, y, yaw, np.empty((len(COMMANDS), 3)))
    return x, y, yaw


@pytest.mark.parametrize("speed", [-0.4, 0.0, 0.7, 1.9])
@pytest.mark.parametrize("steps", [1, 3, 40])
def test_no_trajectory_is_longer_than_it_may_be(speed: float, steps: int) -> None:
    x, y, _ = driven(speed, steps)
    lengths = np.hypot(np.diff(x), np.diff(y)).sum(axis=1)
    bounds = np.array([longest_way(speed, vx, ACCELERATION, TIME) for vx in COMMANDS[:, 0]])
    assert (lengths <= bounds + 1e-9).all()
    assert (bounds <= max(2.0, abs(speed)) * TIME + 1e-9).all()


@pytest.mark.parametrize("ahead", [0.1, -0.8])
@pytest.mark.parametrize("goal", [AHEAD, (-20, 15), (0, 0), (-40, -41)])
def test_what_may_cost_no_more_than_the_best_is_kept_and_much_is_not(goal: tuple[int, int], ahead: float) -> None:
    cell, speed = 0.05, 1.2
    kinds, numbers = np.array((CELL_COST, GOAL_DISTANCE, GOAL_ALIGNMENT)), np.array((0.0, 0.0, ahead))
    scales = np.array((0.05, 0.3, 0.4), dtype=np.float32)
    x, y, yaw = (poses[:, -1] for poses in driven(speed, 40))
    costs = np.random.default_rng(1).uniform(0.0, 20.0, len(x)) * scales[0]
    for scale, nose in zip(scales[1:], (0.0, ahead), strict=True):
        column, row = np.floor((x + nose * np.cos(yaw)) / cell), np.floor((y + nose * np.sin(yaw)) / cell)
        costs += scale * (abs(column - goal[0]) + abs(row - goal[1]))
    robot, goals = np.array((0.0, 0.0, 0.4, speed, 0.0, 0.3)), np.array(((0, 0), goal, goal))
    for most in (costs.min(), np.median(costs), math.inf):
        kept = promising(
            robot, COMMANDS, TIME, LIMITS, kinds, numbers, scales, goals, (0.0, 0.0, cell), np.float32(most)
        )
        assert set(np.flatnonzero(costs <= most)) <= set(kept)
        if most == math.inf:
            assert len(kept) == len(COMMANDS)
        elif most == costs.min() and goal == AHEAD and ahead > 0.0:
            assert len(kept) < 0.7 * len(COMMANDS)

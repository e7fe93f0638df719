"""The inner loops of :mod:`.end_choice`: the best trajectory, from where trajectories end and what critics score."""

import math

import numpy as np
from numba import njit

from navstack.control.dwb.bound_kernels import Grid, promising
from navstack.control.dwb.end_kernels import end_poses
from navstack.control.dwb.end_score import (
    CELL_COST,
    GOAL_ALIGNMENT,
    GOAL_DISTANCE,
    PATH_ALIGNMENT,
    PATH_DISTANCE,
    SIGNS,
)
from navstack.control.dwb.kernels import CellArray, add_weighted, nearest, sine_cosine, step_counts
from navstack.control.dwb.velocity_samples import combine, project_velocity
from navstack.control.plan_handling import cells_of_points, densify
from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE
from navstack.types import ByteArray, Float32Array, FloatArray, IntArray

BORDER = 1e-6  # [cells] next to a cell's border the sine and cosine of the recurrence are not good enough


@njit(cache=True)
def best_command(
    robot: FloatArray,
    axes: FloatArray,
    counts: IntArray,
    speeds: FloatArray,
    times: FloatArray,
    limits: FloatArray,
    kinds: IntArray,
    numbers: FloatArray,
    scales: Float32Array,
    plan: FloatArray,
    goal_x: float,
    goal_y: float,
    costs: ByteArray,
    grid: Grid,
    guess: int,
    command: FloatArray,
    scores: FloatArray,
) -> tuple[int, np.float32]:
    """Index and total of the best sample, the first of equals.

    The index is -1 where no sample is legal or the plan is off the map.

    Args:
        robot: (6,) pose and velocity.
        axes: (3, 4) as :func:`~navstack.control.dwb.velocity_samples.combine` wants it, and so
        counts: (3,) and
        speeds: (3,).
        times: (4,) [s] of acceleration, [s] simulated, and the granularities [m] and [rad].
        limits: (3, 2) as :func:`~navstack.control.dwb.kernels.roll_out` wants it.
        kinds: (C,) of :mod:`.end_score`.
        numbers: (C,) that go with them.
        scales: (C,) their weights, none of them 0.
        plan: (N, 3) near the robot.
        goal_x: [m] where the whole plan ends.
        goal_y: [m]
        costs: (height, width) of the costmap.
        grid: where it lies.
        guess: index of a sample that is likely to be good.
        command: (3,) room for its vx, vy and yaw rate; written, for numba takes microseconds to return an array.
        scores: (C,) room for its raw scores.
    """
    commands = combine(robot[3:], axes, counts, speeds, times[0])
    seeds = cells_of_points(densify(plan, grid[2]), costs, grid[0], grid[1], grid[2])
    goals, are_known = goal_cells(robot, kinds, numbers, plan, seeds, goal_x, goal_y, costs, grid)
    best, total = -1, np.float32(math.inf)
    if len(commands) == 0 or not are_known:
        return best, total
    asked = np.array((min(max(guess, 0), len(commands) - 1),))
    for _ in range(2):  # the guess alone, then all that may be as good
        some = commands[asked]
        steps = step_counts(some, times[1], times[2], times[3])
        ends = end_poses(robot, some, steps, limits, times[1])
        cells = np.empty((len(kinds), 2, len(some)), dtype=np.int32)
        raw = score_ends(some, ends, kinds, numbers, goals, costs, grid, cells)
        first = int(np.searchsorted(asked, guess))
        best, total = choose(robot, some, steps, limits, times[1], kinds, scales, raw, cells, seeds, costs, grid, first)
        if best >= 0:
            command[:], scores[:] = some[best], raw[:, best]
            best = asked[best]
        asked = promising(robot, commands, times[1], limits, kinds, numbers, scales, goals, grid, total)
    return best, total


@njit(cache=True)
def choose(
    robot: FloatArray,
    commands: FloatArray,
    steps: IntArray,
    limits: FloatArray,
    sim_time: float,
    kinds: IntArray,
    scales: Float32Array,
    raw: FloatArray,
    cells: CellArray,
    seeds: IntArray,
    costs: ByteArray,
    grid: Grid,
    guess: int,
) -> tuple[int, np.float32]:
    """Index and total of the best trajectory, the first of equals; -1: none is legal.

    Each is examined only as long as it may win: first with what its end costs at least (``raw``), then with its
    distance to the plan, then whether all its poses are legal. Totals are rounded to float32 critic by critic, which
    keeps bounds bounds.
    """
    seeds_x, seeds_y = seeds[:, 0].astype(np.int32), seeds[:, 1].astype(np.int32)
    bounds = add_weighted(raw, scales)
    best, least = -1, np.float32(math.inf)
    for i in range(-1, len(commands)):
        k = guess if i < 0 else i
        if not 0 <= k < len(commands) or bounds[k] > least or bounds[k] == math.inf:
            continue
        total = np.float32(0.0)
        for c in range(len(kinds)):
            if kinds[c] == PATH_DISTANCE or kinds[c] == PATH_ALIGNMENT:
                raw[c, k] = nearest(cells[c, 0, k], cells[c, 1, k], seeds_x, seeds_y)
            total = np.float32(np.float64(total) + raw[c, k] * np.float64(scales[c]))
        if total > least or (total == least and k >= best):
            continue
        if is_legal(k, robot, commands, steps[k], limits, sim_time, kinds, costs, grid):
            best, least = k, total
    return best, least


@njit(cache=True)
def goal_cells(
    robot: FloatArray,
    kinds: IntArray,
    numbers: FloatArray,
    plan: FloatArray,
    seeds: IntArray,
    goal_x: float,
    goal_y: float,
    costs: ByteArray,
    grid: Grid,
) -> tuple[IntArray, bool]:
    """The cell (C, 2) as (mx, my) that each critic measures from, unless it needs none; whether all are on the map."""
    goals = np.zeros((len(kinds), 2), dtype=np.int64)
    bearing = math.atan2(goal_y - robot[1], goal_x - robot[0])
    for c in range(len(kinds)):
        if kinds[c] == GOAL_DISTANCE and len(seeds) > 0:
            goals[c, 0], goals[c, 1] = seeds[-1, 0], seeds[-1, 1]
        elif kinds[c] == GOAL_ALIGNMENT:
            moved = plan.copy()
            moved[-1, 0] += numbers[c] * math.cos(bearing)
            moved[-1, 1] += numbers[c] * math.sin(bearing)
            cells = cells_of_points(densify(moved, grid[2]), costs, grid[0], grid[1], grid[2])
            if len(cells) == 0:
                return goals, False
            goals[c, 0], goals[c, 1] = cells[-1, 0], cells[-1, 1]
    return goals, len(seeds) > 0


@njit(cache=True)
def score_ends(
    commands: FloatArray,
    ends: FloatArray,
    kinds: IntArray,
    numbers: FloatArray,
    goals: IntArray,
    costs: ByteArray,
    grid: Grid,
    cells: CellArray,
) -> FloatArray:
    """Raw scores (C, K) of the ends, 0 for distances to the plan; inf: the end is illegal.

    The cells (C, 2, K) that critics look at are written, those of equal points once.
    """
    raw = np.zeros((len(kinds), len(commands)))
    for c in range(len(kinds)):
        if kinds[c] == SIGNS:
            signs = int(numbers[c])
            for k in range(len(commands)):
                if signs_of(commands[k, 0], commands[k, 1], commands[k, 2]) & signs:
                    raw[c, k] = math.inf
            continue
        known = -1
        for other in range(c):
            if kinds[other] != SIGNS and numbers[other] == numbers[c]:
                known = other
        if known >= 0:
            for k in range(len(commands)):
                cells[c, 0, k], cells[c, 1, k] = cells[known, 0, k], cells[known, 1, k]
        else:
            locate(ends, numbers[c], costs.shape[1], costs.shape[0], grid, cells[c])
        score_cells(kinds[c], cells[c], goals[c], costs, raw[c])
    return raw


@njit(cache=True)
def signs_of(vx: float, vy: float, yaw_rate: float) -> int:
    """The signs of a command, as the bits of :data:`.end_score.SIGNS`."""
    forwards = (vx < 0.0) + 2 * (vx > 0.0)
    sideways = (vy < 0.0) + 2 * (vy > 0.0)
    turning = (yaw_rate < 0.0) + 2 * (yaw_rate > 0.0)
    return forwards + 4 * sideways + 16 * turning


@njit(cache=True)
def score_cells(kind: int, cells: CellArray, goal: IntArray, costs: ByteArray, raw: FloatArray) -> None:
    """Write the scores (K,) of the cells (2, K): their cost, their distance to ``goal``, or 0 for one to the plan."""
    mx, my = cells[0], cells[1]
    goal_x, goal_y = np.int32(goal[0]), np.int32(goal[1])
    for k in range(len(raw)):
        score = 0.0
        if mx[k] < 0:
            score = math.inf
        elif kind == CELL_COST:
            cost = costs[my[k], mx[k]]
            score = float(cost) if cost < INSCRIBED_INFLATED_OBSTACLE else math.inf
        elif kind == GOAL_DISTANCE or kind == GOAL_ALIGNMENT:
            score = float(abs(mx[k] - goal_x) + abs(my[k] - goal_y))
        raw[k] = score


@njit(cache=True)
def locate(ends: FloatArray, ahead: float, width: int, height: int, grid: Grid, cells: CellArray) -> None:
    """Write the cells (2, K) of the points ``ahead`` [m] of the ends; -1 off the map.

    Next to a cell's border the ends' sine and cosine are made exact first.
    """
    for _ in range(2):
        near_border = 0
        for k in range(ends.shape[1]):
            fx = (ends[0, k] + ahead * ends[4, k] - grid[0]) / grid[2]
            fy = (ends[1, k] + ahead * ends[3, k] - grid[1]) / grid[2]
            rest_x, rest_y = fx - math.floor(fx), fy - math.floor(fy)
            near_border += min(rest_x, rest_y) < BORDER or max(rest_x, rest_y) > 1.0 - BORDER
            inside = fx >= 0.0 and fy >= 0.0 and fx < width and fy < height
            cells[0, k] = np.int32(fx) if inside else np.int32(-1)
            cells[1, k] = np.int32(fy) if inside else np.int32(-1)
        if near_border == 0 or ahead == 0.0:
            break
        for k in range(ends.shape[1]):
            ends[3, k], ends[4, k] = math.sin(ends[2, k]), math.cos(ends[2, k])


@njit(cache=True)
def is_legal(
    k: int,
    robot: FloatArray,
    commands: FloatArray,
    steps: int,
    limits: FloatArray,
    sim_time: float,
    kinds: IntArray,
    costs: ByteArray,
    grid: Grid,
) -> bool:
    """Whether all poses of trajectory ``k``, whose end is legal, are legal to all critics.

    Drives it as :func:`~navstack.control.dwb.kernels.roll_out` does.
    """
    height, width = costs.shape
    stays = avoids = False
    for kind in kinds:
        avoids |= kind == CELL_COST
        stays |= kind == CELL_COST or kind == PATH_DISTANCE or kind == GOAL_DISTANCE
    dt = sim_time / steps
    x, y, vx, rate = robot[0], robot[1], robot[3], robot[5]
    sine, cosine = math.sin(robot[2]), math.cos(robot[2])
    turn_sine, turn_cosine, turned_at = 0.0, 1.0, 0.0
    for _ in range(steps if stays else 0):
        fx, fy = (x - grid[0]) / grid[2], (y - grid[1]) / grid[2]
        if not (fx >= 0.0 and fy >= 0.0 and fx < width and fy < height):
            return False
        if avoids and costs[int(fy), int(fx)] >= INSCRIBED_INFLATED_OBSTACLE:
            return False
        vx = project_velocity(vx, limits[0, 0], limits[0, 1], dt, commands[k, 0])
        rate = project_velocity(rate, limits[2, 0], limits[2, 1], dt, commands[k, 2])
        x += vx * cosine * dt
        y += vx * sine * dt
        if rate != turned_at:
            turn_sine, turn_cosine = sine_cosine(rate * dt)
            turned_at = rate
        sine, cosine = sine * turn_cosine + cosine * turn_sine, cosine * turn_cosine - sine * turn_sine
    return True

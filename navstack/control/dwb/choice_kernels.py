"""The inner loops of :mod:`.end_choice`: the best trajectory, from where trajectories end and what critics score."""

import math

import numpy as np

from navstack.control.dwb.bound_kernels import Grid, promising
from navstack.control.dwb.end_kernels import end_poses
from navstack.control.dwb.end_score import CELL_COST, GOAL_DISTANCE, OUTLINE_COST, PATH_ALIGNMENT, PATH_DISTANCE
from navstack.control.dwb.end_score_kernels import goal_cells, score_ends
from navstack.control.dwb.kernels import CellArray, add_weighted, nearest, sine_cosine, step_counts
from navstack.control.dwb.velocity_samples import combine, project_velocity
from navstack.control.footprint_cost import outline_cost
from navstack.control.plan_handling import cells_of_points, densify
from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE
from navstack.jit import njit
from navstack.types import ByteArray, Float32Array, FloatArray, IntArray


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
    footprint: FloatArray,
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
        footprint: (V, 2) [m] outline of the robot.
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
    asked = np.empty(1, dtype=np.int64)
    asked[0] = min(max(guess, 0), len(commands) - 1)
    for _ in range(2):  # the guess alone, then all that may be as good
        some = rows(commands, asked)
        steps = step_counts(some, times[1], times[2], times[3])
        ends = end_poses(robot, some, steps, limits, times[1])
        cells = np.empty((len(kinds), 2, len(some)), dtype=np.int32)
        raw = score_ends(some, ends, kinds, numbers, goals, costs, grid, cells)
        first = count_below(asked, guess)
        best, total = choose(
            robot, some, steps, limits, times[1], kinds, scales, ends, raw, cells, seeds, costs, grid, footprint, first
        )
        if best >= 0:
            for i in range(3):
                command[i] = some[best, i]
            for c in range(len(kinds)):
                scores[c] = raw[c, best]
            best = asked[best]
        asked = promising(robot, commands, times[1], limits, kinds, numbers, scales, goals, grid, total)
    return best, total


@njit(cache=True)
def rows(commands: FloatArray, asked: IntArray) -> FloatArray:
    """The rows ``asked`` (N,) of ``commands`` (K, 3); numba compiles the loop in a tenth of the time of an index."""
    some = np.empty((len(asked), 3))
    for k in range(len(asked)):
        for i in range(3):
            some[k, i] = commands[asked[k], i]
    return some


@njit(cache=True)
def count_below(ascending: IntArray, number: int) -> int:
    """How many of some ascending numbers lie below one."""
    count = 0
    while count < len(ascending) and ascending[count] < number:
        count += 1
    return count


@njit(cache=True)
def choose(
    robot: FloatArray,
    commands: FloatArray,
    steps: IntArray,
    limits: FloatArray,
    sim_time: float,
    kinds: IntArray,
    scales: Float32Array,
    ends: FloatArray,
    raw: FloatArray,
    cells: CellArray,
    seeds: IntArray,
    costs: ByteArray,
    grid: Grid,
    footprint: FloatArray,
    guess: int,
) -> tuple[int, np.float32]:
    """Index and total of the best trajectory, the first of equals; -1: none is legal.

    Each is examined only as long as it may win: first with what its end (``ends``) costs at least (``raw``), then with
    its distance to the plan and the cost under its outline, then whether all its poses are legal. Totals are rounded to
    float32 critic by critic, which keeps bounds bounds.
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
            elif kinds[c] == OUTLINE_COST:
                raw[c, k] = outline_score(ends[0, k], ends[1, k], ends[2, k], footprint, costs, grid)
            total = np.float32(np.float64(total) + raw[c, k] * np.float64(scales[c]))
        if total == math.inf or total > least or (total == least and k >= best):
            continue
        if is_legal(k, robot, commands, steps[k], limits, sim_time, kinds, costs, grid, footprint):
            best, least = k, total
    return best, least


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
    footprint: FloatArray,
) -> bool:
    """Whether all poses of trajectory ``k``, whose end is legal, are legal to all critics.

    Drives it as :func:`~navstack.control.dwb.kernels.roll_out` does.
    """
    height, width = costs.shape
    stays = avoids = fits = False
    for kind in kinds:
        avoids |= kind == CELL_COST
        fits |= kind == OUTLINE_COST
        stays |= kind == CELL_COST or kind == OUTLINE_COST or kind == PATH_DISTANCE or kind == GOAL_DISTANCE
    dt = sim_time / steps
    x, y, yaw, vx, rate = robot[0], robot[1], robot[2], robot[3], robot[5]
    sine, cosine = math.sin(robot[2]), math.cos(robot[2])
    turn_sine, turn_cosine, turned_at = 0.0, 1.0, 0.0
    for _ in range(steps if stays else 0):
        fx, fy = (x - grid[0]) / grid[2], (y - grid[1]) / grid[2]
        if not (fx >= 0.0 and fy >= 0.0 and fx < width and fy < height):
            return False
        if avoids and costs[int(fy), int(fx)] >= INSCRIBED_INFLATED_OBSTACLE:
            return False
        if fits and outline_score(x, y, yaw, footprint, costs, grid) == math.inf:
            return False
        vx = project_velocity(vx, limits[0, 0], limits[0, 1], dt, commands[k, 0])
        rate = project_velocity(rate, limits[2, 0], limits[2, 1], dt, commands[k, 2])
        x += vx * cosine * dt
        y += vx * sine * dt
        yaw += rate * dt
        if rate != turned_at:
            turn_sine, turn_cosine = sine_cosine(rate * dt)
            turned_at = rate
        sine, cosine = sine * turn_cosine + cosine * turn_sine, cosine * turn_cosine - sine * turn_sine
    return True


@njit(cache=True)
def outline_score(x: float, y: float, yaw: float, footprint: FloatArray, costs: ByteArray, grid: Grid) -> float:
    """The greatest cost 0..253 under the outline at a pose; inf where it is illegal or the pose is off the map."""
    fx, fy = (x - grid[0]) / grid[2], (y - grid[1]) / grid[2]
    if not (fx >= 0.0 and fy >= 0.0 and fx < costs.shape[1] and fy < costs.shape[0]):
        return math.inf
    cost = outline_cost(costs, grid[0], grid[1], grid[2], footprint, x, y, yaw)
    return float(cost) if cost < LETHAL_OBSTACLE else math.inf

"""The inner loops of :mod:`.scoring`.

The best trajectory, from where trajectories end and what critics score.
"""

import math
from typing import NamedTuple

import numpy as np

from navstack.control.dwb.end_kernels import end_poses
from navstack.control.dwb.end_score import (
    CELL_COST,
    GOAL_DISTANCE,
    OUTLINE_COST,
    PATH_ALIGNMENT,
    PATH_DISTANCE,
)
from navstack.control.dwb.end_score_kernels import Surface, Terms, goal_cells, score_ends
from navstack.control.dwb.kernels import CellArray, add_weighted, nearest, sine_cosine, step_counts
from navstack.control.dwb.velocity_samples import combine, project_velocity
from navstack.control.footprint_cost import outline_cost
from navstack.control.plan_handling import cells_of_points, densify
from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE
from navstack.jit import njit
from navstack.types import FloatArray, IntArray


class Sampling(NamedTuple):
    """How trajectories are made."""

    axes: FloatArray  # (3, 4) as velocity_samples.combine wants it, and so
    counts: IntArray  # (3,) and
    speeds: FloatArray  # (3,)
    # (4,) [s] of acceleration, [s] simulated, and the granularities [m] and [rad]
    times: FloatArray
    limits: FloatArray  # (3, 2) as kernels.roll_out wants it


class Drive(NamedTuple):
    """Trajectories before they are driven."""

    robot: FloatArray  # (6,) pose and velocity
    commands: FloatArray  # (K, 3)
    steps: IntArray  # (K,)
    limits: FloatArray  # (3, 2)
    sim_time: float  # [s]


@njit(
    ahead="float64[::1], NamedTuple((float64[:, ::1], int64[::1], float64[::1], float64[::1], float64[:, ::1]), "
    "Sampling), NamedTuple((int64[::1], float64[::1], float32[::1]), Terms), float64[:, ::1], "
    "float64[:, ::1], UniTuple(float64, 2), NamedTuple((uint8[:, ::1], UniTuple(float64, 3), "
    "float64[:, ::1]), Surface), int64, float64[::1]"
)
def best_command(
    robot: FloatArray,
    sampling: Sampling,
    terms: Terms,
    given: FloatArray,
    plan: FloatArray,
    goal: tuple[float, float],
    surface: Surface,
    guess: int,
    command: FloatArray,
) -> tuple[int, np.float32]:
    """Index and total of the best sample, the first of equals.

    The index is -1 where no sample is legal or the plan is off the map.

    Args:
        robot: (6,) pose and velocity.
        sampling: how trajectories are made.
        terms: what the critics score.
        given: (G, K) raw costs of critics whose score is not known in short.
        plan: (N, 3) near the robot.
        goal: [m] x and y where the whole plan ends.
        surface: costmap and outline.
        guess: index of a sample that is likely to be good.
        command: (3,) room for its vx, vy and yaw rate; written, for numba takes microseconds to
            return an array.
    """
    times = sampling.times
    commands = combine(robot[3:], sampling.axes, sampling.counts, sampling.speeds, times[0])
    grid = surface.grid
    seeds = cells_of_points(densify(plan, grid[2]), surface.costs, grid)
    goals, are_known = goal_cells(robot, terms, plan, seeds, goal, surface)
    if len(commands) == 0 or not are_known:
        return -1, np.float32(math.inf)
    drive = Drive(
        robot,
        commands,
        step_counts(commands, times[1], times[2], times[3]),
        sampling.limits,
        times[1],
    )
    ends = end_poses(robot, commands, drive.steps, drive.limits, drive.sim_time)
    cells = np.empty((len(terms.kinds), 2, len(commands)), dtype=np.int32)
    raw = score_ends(ends, terms, given, goals, surface, cells)
    best, total = choose(drive, terms, ends, raw, cells, seeds, surface, guess)
    if best >= 0:
        for i in range(3):
            command[i] = commands[best, i]
    return best, total


@njit()
def choose(
    drive: Drive,
    terms: Terms,
    ends: FloatArray,
    raw: FloatArray,
    cells: CellArray,
    seeds: IntArray,
    surface: Surface,
    guess: int,
) -> tuple[int, np.float32]:
    """Index and total of the best trajectory, the first of equals; -1: none is legal.

    Each is examined only as long as it may win: first with what its end (``ends``) costs at least
    (``raw``), then with its distance to the plan and the cost under its outline, then whether all
    its poses are legal. Totals are rounded to float32 critic by critic, which keeps bounds bounds.
    """
    kinds, scales = terms.kinds, terms.scales
    seeds_x, seeds_y = seeds[:, 0].astype(np.int32), seeds[:, 1].astype(np.int32)
    bounds = add_weighted(raw, scales)
    best, least = -1, np.float32(math.inf)
    for i in range(-1, len(bounds)):
        k = guess if i < 0 else i
        if not 0 <= k < len(bounds) or bounds[k] > least or bounds[k] == math.inf:
            continue
        total = np.float32(0.0)
        for c in range(len(kinds)):
            if kinds[c] == PATH_DISTANCE or kinds[c] == PATH_ALIGNMENT:
                raw[c, k] = nearest(cells[c, 0, k], cells[c, 1, k], seeds_x, seeds_y)
            elif kinds[c] == OUTLINE_COST:
                raw[c, k] = outline_score(ends[0, k], ends[1, k], ends[2, k], surface)
            total = np.float32(np.float64(total) + raw[c, k] * np.float64(scales[c]))
        if total == math.inf or total > least or (total == least and k >= best):
            continue
        if is_legal(drive, k, kinds, surface):
            best, least = k, total
    return best, least


@njit()
def is_legal(drive: Drive, k: int, kinds: IntArray, surface: Surface) -> bool:
    """Whether all poses of trajectory ``k``, whose end is legal, are legal to all critics.

    Drives it as :func:`~navstack.control.dwb.kernels.roll_out` does.
    """
    costs, grid, robot, limits = surface.costs, surface.grid, drive.robot, drive.limits
    height, width = costs.shape
    stays = avoids = fits = False
    for kind in kinds:
        avoids |= kind == CELL_COST
        fits |= kind == OUTLINE_COST
        stays |= (
            kind == CELL_COST
            or kind == OUTLINE_COST
            or kind == PATH_DISTANCE
            or kind == GOAL_DISTANCE
        )
    dt = drive.sim_time / drive.steps[k]
    x, y, yaw, vx, rate = robot[0], robot[1], robot[2], robot[3], robot[5]
    sine, cosine = math.sin(robot[2]), math.cos(robot[2])
    turn_sine, turn_cosine, turned_at = 0.0, 1.0, 0.0
    for _ in range(drive.steps[k] if stays else 0):
        fx, fy = (x - grid[0]) / grid[2], (y - grid[1]) / grid[2]
        if not (fx >= 0.0 and fy >= 0.0 and fx < width and fy < height):
            return False
        if avoids and costs[int(fy), int(fx)] >= INSCRIBED_INFLATED_OBSTACLE:
            return False
        if fits and outline_score(x, y, yaw, surface) == math.inf:
            return False
        vx = project_velocity(vx, limits[0, 0], limits[0, 1], dt, drive.commands[k, 0])
        rate = project_velocity(rate, limits[2, 0], limits[2, 1], dt, drive.commands[k, 2])
        x += vx * cosine * dt
        y += vx * sine * dt
        yaw += rate * dt
        if rate != turned_at:
            turn_sine, turn_cosine = sine_cosine(rate * dt)
            turned_at = rate
        sine, cosine = (
            sine * turn_cosine + cosine * turn_sine,
            cosine * turn_cosine - sine * turn_sine,
        )
    return True


@njit()
def outline_score(x: float, y: float, yaw: float, surface: Surface) -> float:
    """The greatest cost 0..253 under the outline at a pose.

    Inf where it is illegal or the pose is off the map.
    """
    costs, grid = surface.costs, surface.grid
    fx, fy = (x - grid[0]) / grid[2], (y - grid[1]) / grid[2]
    if not (fx >= 0.0 and fy >= 0.0 and fx < costs.shape[1] and fy < costs.shape[0]):
        return math.inf
    cost = outline_cost(costs, grid, surface.footprint, x, y, yaw)
    return float(cost) if cost < LETHAL_OBSTACLE else math.inf

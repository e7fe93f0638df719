"""One cycle of DWB in plain numpy.

All trajectories, and Nav2's five critics that score on grids.
"""

import math

import numpy as np

from navstack.costmap.costmap import Costmap
from navstack.params.dwb import DwbParams
from navstack.types import FloatArray, IntArray, RobotState
from tools.bench.twins import INSCRIBED, manhattan


def axis_samples(
    current: float,
    least: float,
    most: float,
    reach: tuple[float, float],
    count: int,
) -> list[float]:
    """Velocities of an axis by repeated addition, and 0 where they pass it.

    ``reach``: most that it can change.
    """
    low, high = max(least, current - reach[0]), min(most, current + reach[1])
    increment = (high - low) / (max(2, count) - 1) or 1.0
    samples, value = [], low
    while value <= high + 1e-5:
        samples.append(value)
        if value < 0.0 < value + increment:
            samples.append(0.0)
        value += increment
    return samples


def commands_of(p: DwbParams, state: RobotState) -> FloatArray:
    """Every reachable velocity (K, 3) but standstill, for a robot that does not move sideways."""
    t = p.sim_time
    xs = axis_samples(
        state.twist.linear_x,
        p.min_vel_x,
        p.max_vel_x,
        (-p.decel_lim_x * t, p.acc_lim_x * t),
        p.vx_samples,
    )
    most = p.max_vel_theta
    yaw_rates = axis_samples(
        state.twist.angular_z,
        -most,
        most,
        (-p.decel_lim_theta * t, p.acc_lim_theta * t),
        p.vtheta_samples,
    )
    commands = np.array([(x, 0.0, yaw_rate) for x in xs for yaw_rate in yaw_rates])
    moving: FloatArray = commands[(commands != 0.0).any(axis=1)]
    return moving


def roll_out(p: DwbParams, state: RobotState, commands: FloatArray) -> tuple[FloatArray, IntArray]:
    """Poses (K, T, 3) of all trajectories and their numbers of steps (K,).

    The last pose is repeated to the end.
    """
    way = np.abs(commands[:, 0]) * p.sim_time / p.linear_granularity
    turn = np.abs(commands[:, 2]) * p.sim_time / p.angular_granularity
    steps = np.maximum(1, np.ceil(np.maximum(way, turn))).astype(np.int64)
    dt = p.sim_time / steps
    v, w = (
        np.full(len(commands), state.twist.linear_x),
        np.full(len(commands), state.twist.angular_z),
    )
    poses = np.empty((len(commands), steps.max() + 2, 3))
    poses[:, 0] = state.pose.as_array()
    for k in range(1, poses.shape[1]):
        v = towards(v, commands[:, 0], p.acc_lim_x * dt, p.decel_lim_x * dt)
        w = towards(w, commands[:, 2], p.acc_lim_theta * dt, p.decel_lim_theta * dt)
        yaw = poses[:, k - 1, 2]
        motion = np.column_stack((v * np.cos(yaw), v * np.sin(yaw), w)) * dt[:, None]
        poses[:, k] = poses[:, k - 1] + np.where((k <= steps)[:, None], motion, 0.0)
    return poses, steps


def towards(
    now: FloatArray,
    wanted: FloatArray,
    faster: FloatArray,
    slower: FloatArray,
) -> FloatArray:
    """Velocities (K,) after a step; ``slower`` is negative."""
    return np.where(
        now < wanted, np.minimum(wanted, now + faster), np.maximum(wanted, now + slower)
    )


def cells_of(points: FloatArray, costmap: Costmap) -> IntArray:
    """Cells (..., 2) as (x, y) of points (..., 2) [m]."""
    cells = np.floor((points - (costmap.origin_x, costmap.origin_y)) / costmap.resolution)
    return cells.astype(np.int64)


def on_plan(plan: FloatArray, costmap: Costmap) -> IntArray:
    """Cells (S, 2) of a plan (N, 3), no more than two cells apart, all on the map."""
    cells = cells_of(plan[:, :2], costmap)
    return cells[np.concatenate(((True,), (np.diff(cells, axis=0) != 0).any(axis=1)))]


def best_command(
    p: DwbParams,
    state: RobotState,
    near: FloatArray,
    goal: FloatArray,
    costmap: Costmap,
) -> FloatArray:
    """The velocity (3,) with the least weighted sum; see :func:`totals`."""
    best: FloatArray = commands_of(p, state)[totals(p, state, near, goal, costmap).argmin()]
    return best


def totals(
    p: DwbParams,
    state: RobotState,
    near: FloatArray,
    goal: FloatArray,
    costmap: Costmap,
) -> FloatArray:
    """Weighted sums (K,) of BaseObstacle, PathDist, GoalDist, PathAlign and GoalAlign.

    Inf: illegal.

    For a robot that has not come to its goal and has not turned back: the others of Nav2's usual
    critics are 0 then. Every pose stays on the map. ``near`` (N, 3) is the plan near the robot,
    ``goal`` its last pose.
    """
    commands = commands_of(p, state)
    poses, steps = roll_out(p, state, commands)
    cells = cells_of(poses[:, :, :2], costmap)
    costs = costmap.data[cells[:, :, 1], cells[:, :, 0]]
    last = np.arange(len(steps)), steps
    illegal = (costs >= INSCRIBED).any(axis=1)
    score = np.where(illegal, np.inf, costs[last] * p.BaseObstacle.scale)
    path = on_plan(near, costmap)
    bearing = math.atan2(goal[1] - state.pose.y, goal[0] - state.pose.x)
    for params, is_goal, is_nose in (
        (p.GoalAlign, True, True),
        (p.PathAlign, False, True),
        (p.PathDist, False, False),
        (p.GoalDist, True, False),
    ):
        ahead = getattr(params, "forward_point_distance", 0.0) if is_nose else 0.0
        seeds = path
        if is_goal:
            end = near[-1, :2] + ahead * np.array((math.cos(bearing), math.sin(bearing)))
            seeds = cells_of(end[None], costmap)
        grid = manhattan(costmap.data.shape, seeds)
        ends = poses[last]
        scored = cells_of(
            ends[:, :2] + ahead * np.column_stack((np.cos(ends[:, 2]), np.sin(ends[:, 2]))), costmap
        )
        score = score + grid[scored[:, 1], scored[:, 0]] * params.scale * costmap.resolution * 0.5
    return score

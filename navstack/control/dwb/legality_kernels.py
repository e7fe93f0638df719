"""Which critic rejects which trajectory, without scores: the inner loops behind what a decision tells of itself."""

import math

import numpy as np
import numpy.typing as npt

from navstack.control.dwb.bound_kernels import Grid
from navstack.control.dwb.end_kernels import BUFFER_SIZE, TILE, YAW, X, Y, by_falling_steps, start_tile, step_tile
from navstack.control.dwb.end_score import CELL_COST, GOAL_DISTANCE, PATH_DISTANCE, SIGNS
from navstack.control.dwb.end_score_kernels import signs_of
from navstack.control.dwb.kernels import OFF_MAP, cell_index, step_counts
from navstack.control.dwb.velocity_samples import combine
from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE
from navstack.jit import njit
from navstack.types import ByteArray, FloatArray, IntArray

CellNumbers = npt.NDArray[np.uint32]

SLACK = 1e-6  # [m] for rounding


@njit(cache=True)
def count_rejections(
    robot: FloatArray,
    axes: FloatArray,
    counts: IntArray,
    speeds: FloatArray,
    times: FloatArray,
    limits: FloatArray,
    kinds: IntArray,
    numbers: FloatArray,
    costs: ByteArray,
    grid: Grid,
) -> IntArray:
    """Trajectories (C + 1,) that each critic is the first to reject, and those that none does.

    The arguments are those of :func:`~navstack.control.dwb.choice_kernels.best_command`; the plan is on the map, and no
    critic looks at outlines.
    """
    commands = combine(robot[3:], axes, counts, speeds, times[0])
    steps = step_counts(commands, times[1], times[2], times[3])
    first = np.empty(len(commands), dtype=np.int64)  # critic that objects
    reach = np.empty(len(commands))  # [m] that no pose is farther away
    for k in range(len(commands)):
        first[k] = first_sign(commands[k], kinds, numbers)
        reach[k] = max(abs(robot[3]), abs(commands[k, 0])) * times[1] + SLACK
    ahead = 0.0  # [m] from a pose to the farthest point that is looked at
    for c in range(len(kinds)):
        if kinds[c] > GOAL_DISTANCE:
            ahead = max(ahead, abs(numbers[c]))
    farthest = reach.max() if len(reach) > 0 else 0.0
    free, known = clearances(robot[0], robot[1], farthest, costs, grid)
    doubtful = np.flatnonzero((reach >= free) | (reach + ahead >= known))
    if len(doubtful) > 0:
        first[doubtful] = first_objections(
            robot,
            commands[doubtful],
            steps[doubtful],
            limits,
            times[1],
            kinds,
            numbers,
            costs,
            grid,
            first[doubtful],
            reach[doubtful],
            free,
            farthest + ahead >= known,
        )
    return np.bincount(first, minlength=len(kinds) + 1)


@njit(cache=True)
def clearances(x: float, y: float, most: float, costs: ByteArray, grid: Grid) -> tuple[float, float]:
    """[m] around a point without obstacles and without the map's border, at least; and without the border alone.

    The first is looked for up to ``most``.
    """
    height, width = costs.shape
    center = cell_index(x, y, width, height, grid[0], grid[1], grid[2])
    if center == OFF_MAP:
        return 0.0, 0.0
    mx, my = center % width, center // width
    border = min(mx, width - 1 - mx, my, height - 1 - my)
    rings = 0  # that are free
    while rings <= border and (rings - 1) * grid[2] <= most:
        worst = 0
        for i in range(-rings, rings + 1):
            worst = max(worst, costs[my - rings, mx + i], costs[my + rings, mx + i])
            worst = max(worst, costs[my + i, mx - rings], costs[my + i, mx + rings])
        if worst >= INSCRIBED_INFLATED_OBSTACLE:
            break
        rings += 1
    return (rings - 1) * grid[2] - SLACK, border * grid[2] - SLACK


@njit(cache=True)
def first_sign(command: FloatArray, kinds: IntArray, numbers: FloatArray) -> int:
    """The first critic that forbids the signs of the command; C: none does."""
    signs = signs_of(command[0], command[1], command[2])
    for c in range(len(kinds)):
        if kinds[c] == SIGNS and signs & int(numbers[c]):
            return c
    return len(kinds)


@njit(cache=True)
def first_objections(
    robot: FloatArray,
    commands: FloatArray,
    steps: IntArray,
    limits: FloatArray,
    sim_time: float,
    kinds: IntArray,
    numbers: FloatArray,
    costs: ByteArray,
    grid: Grid,
    first: IntArray,
    reach: FloatArray,
    free: float,
    noses_leave: bool,
) -> IntArray:
    """The first critic (K,) that rejects each trajectory, which is driven for that; C: none does.

    ``first`` (K,): the first for the signs of its command. ``reach`` (K,): [m] that no pose is farther from the robot.
    ``free``: as :func:`clearances` has it. ``noses_leave``: whether points ahead of last poses may be off the map.
    """
    height, width = costs.shape
    avoiding, staying = _first_of_kinds(kinds)
    flat = costs.ravel()
    cells = np.empty(TILE, dtype=np.uint32)  # unsigned indices are looked up faster
    b = np.empty(BUFFER_SIZE)
    order = by_falling_steps(steps)
    for begin in range(0, len(commands), TILE):
        active = min(TILE, len(commands) - begin)
        start_tile(b, robot, commands, steps, order, begin, limits, sim_time)
        stride = 0.0  # [m] of any step
        for k in order[begin : begin + active]:
            stride = max(stride, reach[k] / steps[k])
        changes = (True, True)
        for t in range(steps[order[begin]] + 1):
            if t > 0:
                changes = step_tile(b, active, changes)
            if t * stride >= free:
                locate_tile(b, active, width, height, grid, cells)
                look_up(cells, order[begin : begin + active], flat, avoiding, staying, first)
            while active > 0 and steps[order[begin + active - 1]] == t:
                active -= 1
                if noses_leave:
                    k, x, y, yaw = order[begin + active], b[X + active], b[Y + active], b[YAW + active]
                    first[k] = _off_map_nose(first[k], x, y, yaw, kinds, numbers, width, height, grid)
    return first


@njit(cache=True)
def locate_tile(b: FloatArray, active: int, width: int, height: int, grid: Grid, cells: CellNumbers) -> None:
    """Write the flat cell indices of the first ``active`` trajectories of a buffer; outside the number of cells."""
    for i in range(active):  # without branches, so that it uses vector instructions
        fx = (b[X + i] - grid[0]) / grid[2]
        fy = (b[Y + i] - grid[1]) / grid[2]
        inside = (fx >= 0.0) & (fy >= 0.0) & (fx < width) & (fy < height)
        cells[i] = np.uint32(np.int32(np.floor(fy) * width + np.floor(fx)) if inside else np.int32(width * height))


@njit(cache=True)
def look_up(
    cells: CellNumbers, numbers: IntArray, flat: ByteArray, avoiding: int, staying: int, first: IntArray
) -> None:
    """Note in ``first`` (K,) which critic minds the ``cells`` of the trajectories ``numbers`` (n,).

    ``flat``: the costs. ``avoiding`` and ``staying``: as :func:`_first_of_kinds` has them.
    """
    for i in range(len(numbers)):
        if cells[i] == len(flat):
            first[numbers[i]] = min(first[numbers[i]], staying)
        elif flat[cells[i]] >= INSCRIBED_INFLATED_OBSTACLE:
            first[numbers[i]] = min(first[numbers[i]], avoiding)


@njit(cache=True)
def _first_of_kinds(kinds: IntArray) -> tuple[int, int]:
    """The first critics that mind obstacles and leaving the map; C where there is none."""
    avoiding = staying = len(kinds)
    for c in range(len(kinds) - 1, -1, -1):
        if kinds[c] == CELL_COST:
            avoiding = staying = c
        elif kinds[c] == PATH_DISTANCE or kinds[c] == GOAL_DISTANCE:
            staying = c
    return avoiding, staying


@njit(cache=True)
def _off_map_nose(
    first: int,
    x: float,
    y: float,
    yaw: float,
    kinds: IntArray,
    numbers: FloatArray,
    width: int,
    height: int,
    grid: Grid,
) -> int:
    """The first critic before ``first`` for which the point ahead of the last pose is off the map; else ``first``."""
    for c in range(first):
        if kinds[c] > GOAL_DISTANCE:
            nose_x, nose_y = x + numbers[c] * math.cos(yaw), y + numbers[c] * math.sin(yaw)
            if cell_index(nose_x, nose_y, width, height, grid[0], grid[1], grid[2]) == OFF_MAP:
                return c
    return first

"""What the shipped critics score: the same kernels for the search and for records."""

import math
from typing import NamedTuple

import numpy as np

from navstack.control.dwb.kernels import CellArray
from navstack.control.footprint_cost import outline_cost
from navstack.control.plan_handling import cells_of_points, densify
from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, Grid
from navstack.jit import njit
from navstack.types import ByteMatrix, FloatArray, FloatMatrix, FloatVector, IntArray

# [cells] next to a cell's border the sine and cosine of the recurrence are not good enough
BORDER = 1e-6

NOTHING = -1  # kind of a measure that is 0 for every trajectory
# Kinds of measures. Up to GOAL_DISTANCE every pose of a trajectory must be on the map, for costs
# also off obstacles.
CELL_COST = 0  # cost of the cell under the pose
OUTLINE_COST = 1  # greatest cost under the outline
PATH_DISTANCE = 2  # [cells] from the pose to the plan
GOAL_DISTANCE = 3  # [cells] to where the plan ends or leaves the known map
PATH_ALIGNMENT = 4  # [cells] from the robot's nose to the plan
# [cells] from the nose to the plan's end, which is moved as far along the bearing of the goal
GOAL_ALIGNMENT = 5

# How the scores of the poses become one.
LAST, SUM, PRODUCT = range(3)
AGGREGATION_TYPES = ("last", "sum", "product")


class Measure(NamedTuple):
    """What a critic scores."""

    kind: int
    aggregation: int = LAST
    nose: float = 0.0  # [m] from the pose to the scored point


NO_MEASURE = Measure(NOTHING)


class Situation(NamedTuple):
    """What the measures look at in one cycle."""

    robot: FloatVector  # (6,) pose and velocity
    plan: FloatMatrix  # (N, 3) near the robot
    goal: tuple[float, float]  # [m] where the whole plan ends
    costs: ByteMatrix  # (height, width)
    grid: Grid
    footprint: FloatMatrix  # (V, 2) [m]


@njit()
def plan_cells(plan: FloatArray, situation: Situation) -> CellArray:
    """The cells (2, S) of a plan (N, 3) as mx and my, as far as the map is known."""
    points = densify(plan, situation.grid[2])
    cells = cells_of_points(points, situation.costs, situation.grid)
    found = np.empty((2, len(cells)), dtype=np.int32)
    for s in range(len(cells)):
        found[0, s] = cells[s, 0]
        found[1, s] = cells[s, 1]
    return found


@njit()
def seeds_of(kind: int, nose: float, path: CellArray, situation: Situation) -> CellArray:
    """The cells (2, S) from which a measure counts distances, given the plan's, ``path``."""
    if kind == GOAL_DISTANCE:
        return path[:, -1:].copy()
    if kind != GOAL_ALIGNMENT:
        return path
    goal = situation.goal
    robot = situation.robot
    plan = situation.plan.copy()
    bearing = math.atan2(goal[1] - robot[1], goal[0] - robot[0])
    plan[-1, 0] += nose * math.cos(bearing)
    plan[-1, 1] += nose * math.sin(bearing)
    return plan_cells(plan, situation)[:, -1:].copy()


@njit()
def locate(poses: FloatArray, ahead: float, situation: Situation, cells: CellArray) -> None:
    """Write the cells (2, M), mx and my, of the points ``ahead`` [m] of poses (5, M).

    -1 off the map. The sine and cosine of the poses may be a little off: next to a cell's border
    they are made exact first.
    """
    height, width = situation.costs.shape
    grid = situation.grid
    for _ in range(2):
        near_border = 0
        for k in range(poses.shape[1]):
            fx = (poses[0, k] + ahead * poses[4, k] - grid[0]) / grid[2]
            fy = (poses[1, k] + ahead * poses[3, k] - grid[1]) / grid[2]
            rest_x = fx - math.floor(fx)
            rest_y = fy - math.floor(fy)
            near_border += min(rest_x, rest_y) < BORDER or max(rest_x, rest_y) > 1.0 - BORDER
            inside = fx >= 0.0 and fy >= 0.0 and fx < width and fy < height
            cells[0, k] = np.int32(fx) if inside else np.int32(-1)
            cells[1, k] = np.int32(fy) if inside else np.int32(-1)
        if near_border == 0 or ahead == 0.0:
            break
        for k in range(poses.shape[1]):
            poses[3, k], poses[4, k] = math.sin(poses[2, k]), math.cos(poses[2, k])


@njit()
def read_map(
    kind: int,
    poses: FloatArray,
    cells: CellArray,
    situation: Situation,
    scores: FloatArray,
) -> None:
    """Write the costs of poses (5, M) whose scored points are in cells (2, M).

    0 where the kind is a distance; inf: the pose is illegal.
    """
    costs = situation.costs
    for k in range(len(scores)):
        scores[k] = 0.0
        if cells[0, k] < 0:
            scores[k] = math.inf
        elif kind == CELL_COST:
            cost = costs[cells[1, k], cells[0, k]]
            scores[k] = cost
            if cost >= INSCRIBED_INFLATED_OBSTACLE:
                scores[k] = math.inf
        elif kind == OUTLINE_COST:
            scores[k] = outline_score(poses[0, k], poses[1, k], poses[2, k], situation)


@njit()
def outline_score(x: float, y: float, yaw: float, situation: Situation) -> float:
    """The greatest cost 0..253 under the outline at a pose; inf: illegal."""
    cost = outline_cost(situation.costs, situation.grid, situation.footprint, x, y, yaw)
    if cost >= LETHAL_OBSTACLE:
        return math.inf
    return float(cost)


@njit()
def add_distances(cells: CellArray, seeds: CellArray, scores: FloatArray) -> None:
    """Add to scores (M,) the distances in [cells] from cells (2, M) to the nearest seed (2, S).

    These are Manhattan distances, as ``MapGrid`` holds them: its wave front ignores obstacles.
    """
    for k in range(len(scores)):
        least = np.int32(2147483647)
        for s in range(seeds.shape[1]):
            far = abs(seeds[0, s] - cells[0, k]) + abs(seeds[1, s] - cells[1, k])
            least = min(least, np.int32(far))
        scores[k] += least


@njit()
def trajectory_score(
    measure: Measure, poses: FloatArray, seeds: CellArray, situation: Situation
) -> float:
    """The score of a trajectory with poses (5, T); inf: it is illegal.

    Without seeds the pose's distance is infinite, and the nose's is that of an unreachable cell.
    """
    is_cost = measure.kind < PATH_DISTANCE
    minds_all = measure.kind <= GOAL_DISTANCE
    if measure.aggregation == LAST and not minds_all:
        poses = poses[:, -1:]
    cells = np.empty((2, poses.shape[1]), dtype=np.int32)
    scores = np.empty(poses.shape[1])
    locate(poses, measure.nose, situation, cells)
    read_map(measure.kind, poses, cells, situation, scores)
    if scores.max() == math.inf:
        return math.inf
    if measure.aggregation == LAST:
        cells = cells[:, -1:]
        scores = scores[-1:]
    if not is_cost and seeds.shape[1] > 0:
        add_distances(cells, seeds, scores)
    elif minds_all and not is_cost:
        return math.inf
    elif not is_cost:
        scores[:] = situation.costs.size + 1.0
    if measure.aggregation == PRODUCT:
        return float(scores.prod())
    return float(scores.sum())


@njit()
def trajectory_scores(
    measure: Measure,
    x: FloatArray,
    y: FloatArray,
    yaw: FloatArray,
    lengths: IntArray,
    situation: Situation,
) -> FloatArray:
    """The scores (K,) of trajectories, each the first of ``lengths`` (K,) poses of a row (K, T)."""
    path = plan_cells(situation.plan, situation)
    seeds = seeds_of(measure.kind, measure.nose, path, situation)
    scores = np.empty(len(x))
    poses = np.empty((5, x.shape[1]))
    for k in range(len(x)):
        for t in range(lengths[k]):
            poses[0, t] = x[k, t]
            poses[1, t] = y[k, t]
            poses[2, t] = yaw[k, t]
            poses[3, t] = math.sin(yaw[k, t])
            poses[4, t] = math.cos(yaw[k, t])
        scores[k] = trajectory_score(measure, poses[:, : lengths[k]], seeds, situation)
    return scores

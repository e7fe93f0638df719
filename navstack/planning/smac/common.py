"""What the three planners of nav2_smac_planner have in common."""

import math

import numpy as np

from navstack.costmap.costmap import Costmap
from navstack.errors import PlannerTimedOutError, PlanningError
from navstack.params.smac import (
    Smac2DParams,
    SmacHybridParams,
    SmacLatticeParams,
    SmacSmootherParams,
)
from navstack.planning.endpoints import goal_occupied, no_path
from navstack.planning.simple_smoother import SimpleSmoother
from navstack.types import BoolArray, FloatArray, Path, Pose2D

FEWEST = 10  # poses of a path that is smoothed


def searched(
    costmap: Costmap, params: Smac2DParams | SmacHybridParams | SmacLatticeParams
) -> Costmap:
    """The costmap over which a path is searched, of larger cells where that is wanted."""
    if not isinstance(params, SmacLatticeParams) and params.downsample_costmap:
        costmap = downsampled(costmap, params.downsampling_factor)
    return costmap


def require_free_goal(goal: Pose2D, costmap: Costmap, tolerance: float, blocked: BoolArray) -> None:
    """Check that the goal can be reached itself where nothing beside it will do.

    Raises:
        GoalOccupiedError: it is blocked, and the tolerance [m] 0.
    """
    if tolerance < 1e-3 and blocked[costmap.cost_at(goal.x, goal.y)]:
        raise goal_occupied(goal, costmap)


def downsampled(costmap: Costmap, factor: int) -> Costmap:
    """A costmap of larger cells, each with the highest cost below (``costmap_downsampler.cpp``)."""
    if factor == 1:
        return costmap
    height, width = costmap.data.shape
    rows = math.ceil(height / factor)
    columns = math.ceil(width / factor)
    padded = np.zeros((rows * factor, columns * factor), dtype=np.uint8)
    padded[:height, :width] = costmap.data
    data = np.ascontiguousarray(padded.reshape(rows, factor, columns, factor).max(axis=(1, 3)))
    return Costmap(data, costmap.resolution * factor, costmap.origin_x, costmap.origin_y)


def in_cells(pose: Pose2D, costmap: Costmap) -> FloatArray:
    """A pose (3,) in [cells, cells, rad] from the costmap's corner.

    What rounds to the last cell's end lies in it.
    """
    x = (pose.x - costmap.origin_x) / costmap.resolution
    y = (pose.y - costmap.origin_y) / costmap.resolution
    beyond = np.nextafter((costmap.size_x, costmap.size_y), 0.0)
    return np.array((min(x, beyond[0]), min(y, beyond[1]), pose.yaw))


def in_metres(poses: FloatArray, costmap: Costmap) -> FloatArray:
    """Poses (n, 3) back from cells, with headings of (-pi, pi]."""
    result = poses.copy()
    result[:, :2] = poses[:, :2] * costmap.resolution + (costmap.origin_x, costmap.origin_y)
    result[:, 2] = -((-poses[:, 2] + math.pi) % (2.0 * math.pi) - math.pi)
    return result


def smoothed(poses: FloatArray, costmap: Costmap, params: SmacSmootherParams) -> FloatArray:
    """A path whose poses are pulled towards each other; short ones stay as they are."""
    if len(poses) < FEWEST:
        return poses
    return SimpleSmoother(params.as_simple).smooth(Path(poses, 0.0), costmap).poses


def no_way(start: Pose2D, goal: Pose2D, iterations: int, most: int) -> PlanningError:
    """The error that a search ended without a path after so many iterations of at most ``most``."""
    if iterations < most:
        return no_path(start, goal)
    return PlannerTimedOutError(
        f"no path from ({start.x:g}, {start.y:g}) m to ({goal.x:g}, {goal.y:g}) m within "
        f"{iterations} iterations; check whether max_iterations or max_planning_time is too low"
    )

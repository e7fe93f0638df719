"""Checks of start and goal that every planner makes, and the poses of a path."""

import math
from collections.abc import Callable

import numpy as np

from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, Costmap
from navstack.errors import (
    GoalOccupiedError,
    GoalOutsideMapError,
    NoPathFoundError,
    StartOutsideMapError,
)
from navstack.types import FloatArray, IntArray, Pose2D

STRAIGHT = 1e-6  # [rad] changes of heading up to this are rounding
NEAREST_FREE_RADIUS = 5.0  # [m] per axis, how far an error message looks for a free cell


def require_on_map(start: Pose2D, goal: Pose2D, costmap: Costmap) -> None:
    """Check that both poses lie on the costmap.

    Raises:
        StartOutsideMapError, GoalOutsideMapError: one does not.
    """
    for name, pose, error in (
        ("start", start, StartOutsideMapError),
        ("goal", goal, GoalOutsideMapError),
    ):
        finite = math.isfinite(pose.x) and math.isfinite(pose.y)
        if not finite or not costmap.contains(*costmap.world_to_map(pose.x, pose.y)):
            right = costmap.origin_x + costmap.size_x * costmap.resolution
            top = costmap.origin_y + costmap.size_y * costmap.resolution
            raise error(
                f"{name} ({pose.x:g}, {pose.y:g}) m lies outside the costmap; give a point within "
                f"x {costmap.origin_x:g} to {right:g} m, y {costmap.origin_y:g} to {top:g} m"
            )


def occupied(name: str, pose: Pose2D, costmap: Costmap) -> str:
    """The message that a pose lies in an occupied cell, and how far the nearest free one is."""
    distance = nearest_free_distance(pose, costmap)
    hint = f"no free cell within {NEAREST_FREE_RADIUS:g} m"
    if distance < math.inf:
        hint = f"nearest free cell is {distance:.2f} m away"
    return f"{name} ({pose.x:g}, {pose.y:g}) m lies in an occupied cell; {hint}"


def goal_occupied(goal: Pose2D, costmap: Costmap) -> GoalOccupiedError:
    """The error for a goal in an obstacle."""
    return GoalOccupiedError(occupied("goal", goal, costmap))


def no_path(start: Pose2D, goal: Pose2D, tolerance: float | None = None) -> NoPathFoundError:
    """The error that nothing connects start and goal, nor places within ``tolerance`` [m]."""
    near = ""
    if tolerance is not None:
        near = f"within {tolerance:g} m of "
    return NoPathFoundError(
        f"no path from ({start.x:g}, {start.y:g}) m to {near}({goal.x:g}, {goal.y:g}) m; "
        f"check whether obstacles or their inflation close the way"
    )


def to_cells(poses: FloatArray, costmap: Costmap) -> FloatArray:
    """Poses (N, 3) with their places in [cells] from the map's lower left corner."""
    cells = poses.copy()
    cells[:, :2] = (poses[:, :2] - (costmap.origin_x, costmap.origin_y)) / costmap.resolution
    return cells


def place_in_cells(pose: Pose2D, costmap: Costmap) -> tuple[float, float]:
    """A point in [cells] from the map's lower left corner."""
    x = pose.x - costmap.origin_x
    y = pose.y - costmap.origin_y
    return x / costmap.resolution, y / costmap.resolution


def nearest_free_distance(pose: Pose2D, costmap: Costmap) -> float:
    """Distance to the nearest cell centre of cost below 253 within a 10 m square, in [m].

    Inf: none.
    """
    mx, my = costmap.world_to_map(pose.x, pose.y)
    reach = math.ceil(NEAREST_FREE_RADIUS / costmap.resolution)
    x0 = max(0, mx - reach)
    y0 = max(0, my - reach)
    window = costmap.data[y0 : my + reach + 1, x0 : mx + reach + 1]
    rows, columns = np.nonzero(window < INSCRIBED_INFLATED_OBSTACLE)
    if not len(rows):
        return math.inf
    x = costmap.origin_x + (x0 + columns + 0.5) * costmap.resolution - pose.x
    y = costmap.origin_y + (y0 + rows + 0.5) * costmap.resolution - pose.y
    return float(np.sqrt((x * x + y * y).min()))


def single_pose(start: Pose2D, goal: Pose2D, use_final_approach_orientation: bool) -> FloatArray:
    """The plan where start and goal are one point, or one cell.

    Turn to the goal's heading, or stay as the robot stands.
    """
    yaw = goal.yaw
    if use_final_approach_orientation:
        yaw = start.yaw
    return np.array([[start.x, start.y, yaw]])


def in_one_cell(start: Pose2D, goal: Pose2D, costmap: Costmap) -> bool:
    """Whether start and goal lie in the same cell."""
    return costmap.world_to_map(start.x, start.y) == costmap.world_to_map(goal.x, goal.y)


def face_along_last_step(poses: FloatArray, start_yaw: float) -> None:
    """Turn the last pose along the final approach, in place (use_final_approach_orientation)."""
    if len(poses) == 1:
        poses[0, 2] = start_yaw
        return
    step = poses[-1, :2] - poses[-2, :2]
    if len(poses) > 2 and np.all(np.abs(step) < 1e-4):  # two equal last poses
        step = poses[-1, :2] - poses[-3, :2]
    poses[-1, 2] = math.atan2(step[1], step[0])


def way_back(last: int, first: int, width: int, parent: Callable[[int], int]) -> IntArray:
    """The cells (N, 2) as column, row from ``first`` to ``last``, each the parent of the next."""
    chain = [last]
    while chain[-1] != first:
        chain.append(parent(chain[-1]))
    cells = np.array(chain[::-1])
    return np.stack((cells % width, cells // width), axis=1)


def dense_poses(points: FloatArray, goal_yaw: float, costmap: Costmap) -> FloatArray:
    """Poses (M, 3), looking along a polyline (N, 2) in [cells], at most one cell apart.

    Each corner is kept.
    """
    places = [points[:1]]
    for start, end in zip(points[:-1], points[1:], strict=True):
        steps = max(1, math.ceil(math.hypot(*(end - start))))
        places.append(start + (end - start) * (np.arange(1, steps + 1) / steps)[:, None])
    dense = np.vstack(places)
    poses = np.empty((len(dense), 3))
    poses[:, :2] = (costmap.origin_x, costmap.origin_y) + dense * costmap.resolution
    step = np.diff(poses[:, :2], axis=0)
    poses[:-1, 2] = np.arctan2(step[:, 1], step[:, 0])
    poses[-1, 2] = goal_yaw
    return poses


def corners(points: FloatArray) -> FloatArray:
    """The points (M, 2) between the ends of a polyline (N, >= 2) at which its heading changes."""
    step = np.diff(points[:, :2], axis=0)
    turn = np.diff(np.unwrap(np.arctan2(step[:, 1], step[:, 0])))
    return points[1:-1, :2][np.abs(turn) > STRAIGHT]

"""The part of the plan that the controller follows, seen from the robot (``path_handler.cpp``)."""

import math

import numpy as np

from navstack.costmap.costmap import Costmap
from navstack.errors import InvalidPathError
from navstack.jit import njit
from navstack.types import FloatArray, FloatMatrix, Path, Pose2D


class PathWindow:
    """Cuts the plan from the pose nearest to the robot to the edge of the local costmap.

    Passed poses are forgotten. Plan and costmap share the map frame.
    """

    def __init__(
        self, search_distance: float | None, fewest_poses: int, keeps_two: bool = False
    ) -> None:
        """Make the window.

        Args:
            search_distance: along the plan, in [m], in which the nearest pose is looked for; None:
                half the costmap's width; negative: the whole plan.
            fewest_poses: of a plan that can be followed.
            keeps_two: the last pose keeps the one before it, so that the plan has a direction.
        """
        self._search_distance = search_distance
        self._fewest_poses = fewest_poses
        self._keeps_two = keeps_two
        self._begin = 0

    def reset(self) -> None:
        """A new plan: nothing of it has been passed."""
        self._begin = 0

    def seen_from(self, pose: Pose2D, plan: Path, costmap: Costmap) -> FloatArray:
        """The poses (N, 3) of ``plan`` near the robot, in the base frame.

        Raises:
            InvalidPathError: the plan is too short, or leaves the costmap at once.
        """
        if len(plan) - self._begin < self._fewest_poses:
            raise InvalidPathError(
                f"the plan has {len(plan) - self._begin} poses left; "
                f"this controller needs {self._fewest_poses}"
            )
        search = self._search_distance
        if search is None:
            search = costmap.size_x * costmap.resolution / 2.0
        if search < 0.0:
            search = math.inf
        extent = max(costmap.size_x, costmap.size_y) * costmap.resolution / 2.0
        self._begin, end = window_bounds(
            plan.poses, self._begin, pose.x, pose.y, search, extent, self._keeps_two
        )
        if self._begin == end:
            raise InvalidPathError(
                f"the plan is farther than {extent:.2f} m from the robot "
                f"at ({pose.x:.2f}, {pose.y:.2f}); plan again from where it is"
            )
        window: FloatArray = in_base_frame(plan.poses[self._begin : end], pose.x, pose.y, pose.yaw)
        return window


@njit()
def nearest_pose(
    poses: FloatArray,
    first: int,
    x: float,
    y: float,
    search_distance: float,
) -> tuple[int, int]:
    """The pose (of N, >= 1) nearest to (x, y), and the first pose that was not looked at.

    Of equally near ones the last, so that a turn on the spot is passed at once
    (``geometry_utils::min_by``).

    The search goes from pose ``first`` for ``search_distance`` [m] along the plan.
    """
    nearest = first
    least = math.hypot(poses[first, 0] - x, poses[first, 1] - y)
    travelled = 0.0
    stop = first + 1
    while stop < len(poses):
        travelled += math.hypot(
            poses[stop, 0] - poses[stop - 1, 0], poses[stop, 1] - poses[stop - 1, 1]
        )
        if travelled > search_distance:
            break
        distance = math.hypot(poses[stop, 0] - x, poses[stop, 1] - y)
        if distance <= least:
            nearest = stop
            least = distance
        stop += 1
    return nearest, stop


@njit(ahead=True)
def window_bounds(
    poses: FloatMatrix,
    first: int,
    x: float,
    y: float,
    search_distance: float,
    extent: float,
    keeps_two: bool,
) -> tuple[int, int]:
    """Begin and end of the poses (N, >= 2) to follow.

    From the pose nearest to (x, y) among those within ``search_distance`` [m] along the plan from
    pose ``first``, to the first one farther than ``extent`` [m] along the straight line.
    ``keeps_two``: the last pose keeps the one before it.
    """
    nearest, stop = nearest_pose(poses, first, x, y, search_distance)
    if keeps_two and nearest == stop - 1 and nearest > first:
        nearest -= 1
    end = nearest
    while end < len(poses) and not math.hypot(poses[end, 0] - x, poses[end, 1] - y) > extent:
        end += 1
    return nearest, end


@njit(ahead=True)
def in_base_frame(poses: FloatMatrix, x: float, y: float, yaw: float) -> FloatArray:
    """Poses (N, 3) of the map frame, seen from a robot at (x, y, yaw); yaws in [-pi, pi)."""
    cosine = math.cos(yaw)
    sine = math.sin(yaw)
    seen = np.empty((len(poses), 3))
    for i in range(len(poses)):
        dx = poses[i, 0] - x
        dy = poses[i, 1] - y
        turn = poses[i, 2] - yaw
        seen[i, 0] = cosine * dx + sine * dy
        seen[i, 1] = cosine * dy - sine * dx
        seen[i, 2] = turn - 2.0 * math.pi * math.floor((turn + math.pi) / (2.0 * math.pi))
    return seen

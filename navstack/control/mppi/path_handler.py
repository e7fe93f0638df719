"""The part of the plan that the critics see (``path_handler.cpp``)."""

import math

from navstack.control.path_window import nearest_pose
from navstack.control.plan_handling import require_poses
from navstack.costmap.costmap import Costmap
from navstack.errors import InvalidPathError
from navstack.geometry import shortest_angular_distance
from navstack.jit import njit
from navstack.params.mppi import MppiParams
from navstack.types import FloatArray, FloatMatrix, Path, Pose2D


class PathHandler:
    """Cuts the plan from the pose nearest to the robot to ``prune_distance`` ahead.

    What lies behind is forgotten.

    Plan and costmap share the map frame. With ``enforce_path_inversion`` the plan ends at its next
    cusp until the robot has got there.
    """

    def __init__(self, params: MppiParams) -> None:
        self._params = params
        self.reset()

    def reset(self) -> None:
        """A new plan: nothing of it has been passed."""
        self._begin = 0
        self._end: int | None = None  # one behind the last pose to show; None: not looked for

    def near(self, plan: Path, pose: Pose2D, costmap: Costmap) -> FloatArray:
        """The poses (N, 3) of ``plan`` ahead of the robot, in the map frame.

        Raises:
            InvalidPathError: the plan is empty, or leaves the costmap at once.
        """
        require_poses(plan)
        params = self._params
        if self._end is None:
            self._end = self._next_end(plan)
        search = params.max_robot_pose_search_dist
        if search is None:
            search = 0.5 * max(costmap.size_x, costmap.size_y) * costmap.resolution
        self._begin, end = window(
            plan.poses[: self._end], self._begin, pose.x, pose.y, search, params.prune_distance
        )
        width = costmap.size_x * costmap.resolution
        height = costmap.size_y * costmap.resolution
        grid = (costmap.origin_x, costmap.origin_y, width, height)
        seen = plan.poses[self._begin : on_grid(plan.poses, self._begin, end, grid)]
        if len(seen) == 0:
            raise InvalidPathError(
                "the plan is off the local costmap where it is nearest to the robot "
                f"at ({pose.x:.2f}, {pose.y:.2f}); plan again from where it is"
            )
        self._pass_cusp(plan, pose)
        return seen

    def _next_end(self, plan: Path) -> int:
        if not self._params.enforce_path_inversion:
            return len(plan)
        return int(first_cusp(plan.poses, self._begin))

    def _pass_cusp(self, plan: Path, pose: Pose2D) -> None:
        """Show what comes behind the cusp from the next cycle on, if the robot is there."""
        if self._end is None or self._end == len(plan):
            return
        x, y, yaw = (float(value) for value in plan.poses[self._end - 1])
        is_near = math.hypot(pose.x - x, pose.y - y) <= self._params.inversion_xy_tolerance
        if (
            is_near
            and abs(shortest_angular_distance(pose.yaw, yaw))
            <= self._params.inversion_yaw_tolerance
        ):
            self._begin = self._end
            self._end = self._next_end(plan)


@njit(ahead=True)
def window(
    poses: FloatMatrix,
    first: int,
    x: float,
    y: float,
    search_distance: float,
    prune_distance: float,
) -> tuple[int, int]:
    """Begin and end of the poses (of N, >= 1): the nearest, and up to ``prune_distance`` [m] ahead.

    The nearest is looked for up to ``search_distance`` [m] along the plan from pose ``first``.
    """
    nearest = nearest_pose(poses, first, x, y, search_distance)[0]
    ahead = 0.0
    end = nearest + 1
    while end < len(poses):
        ahead += math.hypot(poses[end, 0] - poses[end - 1, 0], poses[end, 1] - poses[end - 1, 1])
        if ahead > prune_distance:
            break
        end += 1
    return nearest, end


@njit(ahead=True)
def on_grid(
    poses: FloatMatrix, begin: int, end: int, grid: tuple[float, float, float, float]
) -> int:
    """The first pose from ``begin`` on that is off the grid, or ``end``.

    The grid is its origin's x and y, its width and its height, all in [m].
    """
    origin_x, origin_y, width, height = grid
    for i in range(begin, end):
        x = poses[i, 0] - origin_x
        y = poses[i, 1] - origin_y
        if not (x >= 0.0 and y >= 0.0 and x < width and y < height):
            return i
    return end


@njit()
def first_cusp(poses: FloatArray, begin: int) -> int:
    """One behind the pose where the motion turns round (``findFirstPathInversion``)."""
    for i in range(begin + 1, len(poses) - 1):
        before_x = poses[i, 0] - poses[i - 1, 0]
        before_y = poses[i, 1] - poses[i - 1, 1]
        after_x = poses[i + 1, 0] - poses[i, 0]
        after_y = poses[i + 1, 1] - poses[i, 1]
        if before_x * after_x + before_y * after_y < 0.0:
            return i + 1
    return len(poses)

"""The part of the global plan that a local planner looks at, and the cells it covers."""

import math

import numpy as np

from navstack.costmap.costmap import NO_INFORMATION, Costmap, Grid
from navstack.errors import InvalidPathError
from navstack.jit import njit
from navstack.types import ByteArray, FloatArray, FloatMatrix, IntArray, Path, Pose2D

LONGEST_GAP = 2.0  # [cells] between points that is not filled up


def require_poses(plan: Path) -> None:
    """Refuse a plan that says nothing.

    Raises:
        InvalidPathError: the plan is empty.
    """
    if len(plan) == 0:
        raise InvalidPathError("the plan has no poses; ask the planner for another one")


class PlanWindow:
    """Cuts the plan to the robot's vicinity, after ``transformGlobalPlan`` of Nav2 Jazzy.

    Plan and costmap share the map frame, so nothing is transformed. What has been passed is
    forgotten when ``prune_plan`` is set; a new plan starts afresh.
    """

    def __init__(
        self,
        prune_plan: bool,
        prune_distance: float,
        forward_distance: float,
        shorten: bool,
    ) -> None:
        """Distances in [m]; a negative ``forward_distance`` keeps everything ahead."""
        self._prune_plan = prune_plan
        self._prune_distance = prune_distance
        self._forward_distance = forward_distance
        if forward_distance < 0.0:
            self._forward_distance = math.inf
        self._shorten = shorten
        self._begin = 0

    def reset(self) -> None:
        """A new plan: nothing of it has been passed."""
        self._begin = 0

    def near(self, plan: Path, pose: Pose2D, costmap: Costmap) -> FloatArray:
        """The poses (N, 3) of ``plan`` near the robot; a view.

        Raises:
            InvalidPathError: the plan is empty, or none of it is near the robot.
        """
        require_poses(plan)
        poses = plan.poses
        behind = ahead = max(costmap.data.shape) * costmap.resolution / 2.0
        if self._prune_plan:
            behind = min(behind, self._prune_distance)
        if self._shorten:
            ahead = min(ahead, self._forward_distance)
        begin, end = window_bounds(
            poses, self._begin, pose.x, pose.y, behind, ahead, self._forward_distance
        )
        if self._prune_plan:
            self._begin = begin
        if begin == end:
            raise InvalidPathError(
                f"none of the plan's {len(poses)} poses lies within {behind:.2f} m of the robot at "
                f"({pose.x:.2f}, {pose.y:.2f}); plan again from where it is"
            )
        near: FloatArray = poses[begin:end]
        return near


@njit(ahead=True)
def window_bounds(
    poses: FloatMatrix,
    first: int,
    x: float,
    y: float,
    behind: float,
    ahead: float,
    search_length: float,
) -> tuple[int, int]:
    """Begin and end of the poses (N, 3) that matter.

    From the first one nearer than ``behind`` to the first after it that is farther than ``ahead``,
    both in [m] along the straight line; the search for the begin stops after ``search_length`` [m]
    along the plan.
    """
    count = len(poses)
    stop = count
    travelled = 0.0
    for i in range(first, count - 1):
        travelled += math.hypot(poses[i, 0] - poses[i + 1, 0], poses[i, 1] - poses[i + 1, 1])
        if travelled > search_length:
            stop = i + 1
            break
    begin = first
    while begin < stop and not math.hypot(x - poses[begin, 0], y - poses[begin, 1]) < behind:
        begin += 1
    end = begin
    while end < count and not math.hypot(poses[end, 0] - x, poses[end, 1] - y) > ahead:
        end += 1
    return begin, end


@njit()
def densify(poses: FloatArray, resolution: float) -> FloatArray:
    """Points (M, 2) along poses (N, >= 2), filled up where a gap exceeds two cells.

    ``nav_2d_utils::adjustPlanResolution``, which spaces the new points by slightly more than
    ``resolution`` [m].
    """
    allowed = resolution * resolution * LONGEST_GAP**2  # [m2]
    steps = np.empty(len(poses), dtype=np.int64)  # pieces that the gap before each pose is cut into
    total = 0
    for i in range(len(poses)):
        steps[i] = 1
        total += 1
        if i == 0:
            continue
        dx = poses[i, 0] - poses[i - 1, 0]
        dy = poses[i, 1] - poses[i - 1, 1]
        squared = dx * dx + dy * dy
        if squared > allowed:
            gap = math.sqrt(squared) - math.sqrt(allowed)
            steps[i] = max(1, int(gap / resolution) - 1)
            total += steps[i] - 1
    points = np.empty((total, 2))
    m = 0
    for i in range(len(poses)):
        for j in range(1, steps[i]):
            points[m, 0] = poses[i - 1, 0] + j * ((poses[i, 0] - poses[i - 1, 0]) / steps[i])
            points[m, 1] = poses[i - 1, 1] + j * ((poses[i, 1] - poses[i - 1, 1]) / steps[i])
            m += 1
        points[m, 0] = poses[i, 0]
        points[m, 1] = poses[i, 1]
        m += 1
    return points


@njit()
def cells_of_points(points: FloatArray, costs: ByteArray, grid: Grid) -> IntArray:
    """The cells (S, 2), as (mx, my), of the first stretch of points (M, 2) on known cells.

    Points before the map are skipped; the first one off it or in an unknown cell ends the stretch
    (``path_dist.cpp``). Consecutive points in one cell give it once.
    """
    height, width = costs.shape
    cells = np.empty((len(points), 2), dtype=np.int64)
    count = 0
    for i in range(len(points)):
        fx = (points[i, 0] - grid[0]) / grid[2]
        fy = (points[i, 1] - grid[1]) / grid[2]
        known = False
        if fx >= 0.0 and fy >= 0.0 and fx < width and fy < height:
            known = costs[int(fy), int(fx)] != NO_INFORMATION
        if known:
            if count == 0 or cells[count - 1, 0] != int(fx) or cells[count - 1, 1] != int(fy):
                cells[count, 0] = int(fx)
                cells[count, 1] = int(fy)
                count += 1
        elif count > 0:
            break
    return cells[:count]

"""Lazy Theta*: nav2_theta_star_planner of Jazzy (Nash, Koenig, Tovey, "Lazy Theta*", AAAI 2010)."""

import heapq
import math

import numpy as np

from navstack.costmap.costmap import (
    FREE_SPACE,
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Costmap,
)
from navstack.errors import PlanningError
from navstack.jit import njit
from navstack.params.planners import ThetaStarParams
from navstack.planning.endpoints import (
    dense_poses,
    face_along_last_step,
    goal_occupied,
    in_one_cell,
    no_path,
    occupied,
    require_on_map,
    single_pose,
    to_cells,
    way_back,
)
from navstack.planning.ompl_kernels import blocked_table
from navstack.planning.planner import Planner
from navstack.types import BoolArray, ByteArray, FloatArray, IntArray, Path, Pose2D

STEPS = np.array(
    ((0, 1), (0, -1), (1, 0), (-1, 0), (1, -1), (-1, 1), (1, 1), (-1, -1)), dtype=np.int64
)
# a cell counts as LOWEST + SHARE * cost, of HIGHEST
LOWEST = 26.0
SHARE = 0.9
HIGHEST = 252.0


class ThetaStarPlanner(Planner):
    """A path of straight lines between cells' centres, short and cheap as the weights say."""

    def __init__(self, params: ThetaStarParams) -> None:
        self._params = params
        costs = np.arange(256)
        self._is_open: BoolArray = ~blocked_table(
            INSCRIBED_INFLATED_OBSTACLE - 1, params.allow_unknown
        )
        level = np.where(costs == NO_INFORMATION, LETHAL_OBSTACLE - 1.0, LOWEST + SHARE * costs)
        self._crossing: FloatArray = params.w_traversal_cost * (level / HIGHEST) ** 2
        self._last_start: tuple[int, int] | None = None  # cell of the plan before

    def reset(self, rng: np.random.Generator) -> None:
        """Forget the plan before; ``rng`` is not used."""
        self._last_start = None

    def plan(
        self,
        start: Pose2D,
        goal: Pose2D,
        costmap: Costmap,
        stamp: float = 0.0,
    ) -> Path:
        """A path from ``start`` to ``goal``, each pose looking along it; see :class:`Planner`.

        Raises:
            PlanningError: a pose outside the map or in an obstacle, or no path.
        """
        params = self._params
        require_on_map(start, goal, costmap)
        if costmap.cost_at(goal.x, goal.y) == LETHAL_OBSTACLE:
            raise goal_occupied(goal, costmap)
        if in_one_cell(start, goal, costmap):
            return Path(single_pose(start, goal, params.use_final_approach_orientation), stamp)
        costmap = self._with_start_freed(start, costmap)
        for name, pose in (("start", start), ("goal", goal)):
            if not self._is_open[costmap.cost_at(pose.x, pose.y)]:
                raise PlanningError(occupied(name, pose, costmap))
        ends = (costmap.world_to_map(start.x, start.y), costmap.world_to_map(goal.x, goal.y))
        weights = (params.w_euc_cost, min(params.w_heuristic_cost, params.w_euc_cost, 1.0))
        parents = search_lines(
            costmap.data,
            self._is_open,
            self._crossing,
            ends[0],
            ends[1],
            params.how_many_corners,
            weights,
        )
        if len(parents) == 0:
            raise no_path(start, goal)
        first, last = (row * costmap.size_x + column for column, row in ends)
        cells = way_back(last, first, costmap.size_x, lambda n: int(parents[n]))
        points = cells.astype(np.float64) + 0.5
        points[[0, -1]] = to_cells(np.stack((start.as_array(), goal.as_array())), costmap)[:, :2]
        poses = dense_poses(points, goal.yaw, costmap)
        poses[-1] = goal.as_array()
        if params.use_final_approach_orientation:
            face_along_last_step(poses, start.yaw)
        return Path(poses, stamp)

    def _with_start_freed(self, start: Pose2D, costmap: Costmap) -> Costmap:
        """The costmap with the start of the plan before free, as upstream (``clearStart``).

        So a robot that stands in an obstacle finds a way out at the second attempt from there.
        """
        last = self._last_start
        self._last_start = costmap.world_to_map(start.x, start.y)
        if last is None or not costmap.contains(*last):
            return costmap
        column, row = last
        if costmap.data[row, column] == FREE_SPACE:
            return costmap
        data = costmap.data.copy()
        data[row, column] = FREE_SPACE
        return Costmap(data, costmap.resolution, costmap.origin_x, costmap.origin_y)


@njit()
def line_of_sight(
    costs: ByteArray,
    is_open: BoolArray,
    crossing: FloatArray,
    x: int,
    y: int,
    end_x: int,
    end_y: int,
) -> float:
    """What crossing the cells from one to another costs, the last one left out.

    Inf: one of them is closed.

    Bresenham's line; where it goes diagonally, both cells beside it must be open, too.
    """
    dx = abs(end_x - x)
    dy = abs(end_y - y)
    step_x = 1 if x < end_x else -1
    step_y = 1 if y < end_y else -1
    total = 0.0
    error = dx - dy
    while x != end_x or y != end_y:
        if not is_open[costs[y, x]]:
            return math.inf
        total += crossing[costs[y, x]]
        twice = 2 * error
        aside = twice > -dy
        up = twice <= dx
        if aside and up and not (is_open[costs[y, x + step_x]] and is_open[costs[y + step_y, x]]):
            return math.inf
        if aside:
            x = x + step_x
            error = error - dy
        if up or not aside:
            y = y + step_y
            error = error + dx
    return total


@njit()
def search_lines(
    costs: ByteArray,
    is_open: BoolArray,
    crossing: FloatArray,
    start: tuple[int, int],
    goal: tuple[int, int],
    corners: int,
    weights: tuple[float, float],
) -> IntArray:
    """The cell (height * width,) from which a line leads to each cell on the path; empty: none.

    Args:
        costs: (height, width).
        is_open: (256,) whether a cost may be crossed.
        crossing: (256,) what crossing a cell of a cost adds.
        start: where from.
        goal: where to.
        corners: neighbours of a cell, 4 or 8.
        weights: of the length of a way, and of the straight way to the goal.
    """
    height, width = costs.shape
    first = start[1] * width + start[0]
    last = goal[1] * width + goal[0]
    travelled = np.full(costs.size, np.inf)
    parents = np.empty(costs.size, dtype=np.int64)
    is_done = np.zeros(costs.size, dtype=np.bool_)
    travelled[first] = crossing[costs[start[1], start[0]]]
    parents[first] = first
    heap = [(0.0, first)]
    while len(heap) > 0:
        _, n = heapq.heappop(heap)
        if is_done[n]:
            continue
        is_done[n] = True
        if n == last:
            return parents
        x = n % width
        y = n // width
        maybe = parents[parents[n]]
        u = maybe % width
        v = maybe // width
        length = weights[0] * math.hypot(x - u, y - v)
        if travelled[maybe] + length < travelled[n]:  # else crossing the cells does not pay
            total = travelled[maybe] + length + line_of_sight(costs, is_open, crossing, x, y, u, v)
            if total < travelled[n]:
                travelled[n] = total
                parents[n] = maybe
        for k in range(corners):
            u = x + STEPS[k, 0]
            v = y + STEPS[k, 1]
            if not (0 <= u < width and 0 <= v < height) or not is_open[costs[v, u]]:
                continue
            m = v * width + u
            step = weights[0] * math.hypot(STEPS[k, 0], STEPS[k, 1])
            total = travelled[n] + step + crossing[costs[v, u]]
            if not is_done[m] and total < travelled[m]:
                travelled[m] = total
                parents[m] = n
                heapq.heappush(heap, (total + weights[1] * math.hypot(goal[0] - u, goal[1] - v), m))
    return parents[:0]

"""A* on the grid: SmacPlanner2D of nav2_smac_planner."""

import math

import numpy as np

from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, Costmap
from navstack.params.smac import Smac2DParams
from navstack.planning.endpoints import (
    face_along_last_step,
    in_one_cell,
    require_on_map,
    single_pose,
)
from navstack.planning.ompl_kernels import blocked_table
from navstack.planning.planner import Planner
from navstack.planning.smac.common import (
    in_cells,
    in_metres,
    no_way,
    require_free_goal,
    searched,
    smoothed,
)
from navstack.planning.smac.grid_kernels import SearchLimits, search_grid, trace_back
from navstack.types import FloatArray, Path, Pose2D


class Smac2D(Planner):
    """Eight neighbours, steps that cost more in inflated cells, then Smac's smoother.

    Where Jazzy differs: the heuristic is the way on eight directions, not the straight line, so
    that fewer cells are looked at and the way is as short; there is no limit of time.
    """

    def __init__(self, params: Smac2DParams) -> None:
        self._params = params
        self._blocked = blocked_table(INSCRIBED_INFLATED_OBSTACLE - 1, params.allow_unknown)

    def plan(
        self,
        start: Pose2D,
        goal: Pose2D,
        costmap: Costmap,
        stamp: float = 0.0,
    ) -> Path:
        """A path from ``start`` to ``goal``, each pose looking at the next one.

        See :class:`Planner`.

        Raises:
            PlanningError: a pose outside the map, an occupied goal with tolerance 0, or no path.
        """
        params = self._params
        require_on_map(start, goal, costmap)
        ground = searched(costmap, params)
        if in_one_cell(start, goal, ground):
            return Path(single_pose(start, goal, params.use_final_approach_orientation), stamp)
        require_free_goal(goal, ground, params.tolerance, self._blocked)
        poses = self._search(start, goal, ground)
        if params.smooth_path:
            poses = smoothed(poses, ground, params.smoother)
        if params.use_final_approach_orientation:
            face_along_last_step(poses, start.yaw)
        return Path(poses, stamp)

    def _search(self, start: Pose2D, goal: Pose2D, costmap: Costmap) -> FloatArray:
        """The path (n, 3): start, the cells' centres between, and the goal or the cell near it."""
        first = in_cells(start, costmap)
        last = in_cells(goal, costmap)
        begin = (int(first[0]), int(first[1]))
        end = (int(last[0]), int(last[1]))
        travelled = np.full(costmap.data.size, np.inf, dtype=np.float32)
        came_by = np.empty(costmap.data.size, dtype=np.uint8)
        params = self._params
        width = costmap.size_x
        limits = SearchLimits(
            params.tolerance / costmap.resolution,
            params.max_iterations,
            params.max_on_approach_iterations,
        )
        reached, iterations = search_grid(
            costmap.data,
            self._blocked,
            begin,
            end,
            params.cost_travel_multiplier,
            limits,
            travelled,
            came_by,
        )
        if reached < 0:
            raise no_way(start, goal, iterations, params.max_iterations)
        cells = trace_back(reached, begin[1] * width + begin[0], width, came_by) + 0.5
        places = np.vstack((first[:2], cells[1:-1], cells[-1]))
        if reached == end[1] * width + end[0]:
            places[-1] = last[:2]
        steps = np.diff(places, axis=0)
        last_yaw = 0.0
        if math.isfinite(goal.yaw):
            last_yaw = goal.yaw
        yaws = np.append(np.arctan2(steps[:, 1], steps[:, 0]), last_yaw)
        return in_metres(np.column_stack((places, yaws)), costmap)

"""Keep the robot's nose near the plan (PathAlign) and drive it to the plan's end (GoalAlign)."""

import math

import numpy as np

from navstack.control.dwb.critics.map_grid import MapGridCritic
from navstack.control.dwb.end_score import GOAL_ALIGNMENT, PATH_ALIGNMENT
from navstack.control.dwb.kernels import CellArray
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import Scene, cells_of
from navstack.control.plan_handling import plan_cells
from navstack.params.dwb import AlignParams, DwbParams
from navstack.types import IntArray


class _AlignCritic(MapGridCritic):
    """Scores a point ahead of the robot.

    With "last" only the last pose is looked at (``alignment_util.cpp``).
    """

    def __init__(self, params: AlignParams, dwb: DwbParams) -> None:
        super().__init__(params.scale, params.aggregation_type, params.forward_point_distance)

    def scored_cells(self, rollouts: Rollouts, scene: Scene, only_last: bool) -> CellArray:
        """The cells of the nose."""
        seen = np.s_[:, -1:] if only_last else np.s_[:, :]
        x, y, yaw = rollouts.x[seen], rollouts.y[seen], rollouts.yaw[seen]
        return cells_of(x + self._ahead * np.cos(yaw), y + self._ahead * np.sin(yaw), scene.costmap)


class PathAlignCritic(_AlignCritic):
    """After ``path_align.cpp``: distance of the nose to the plan."""

    kind = PATH_ALIGNMENT

    def seeds(self, scene: Scene) -> IntArray:
        """All cells of the plan near the robot."""
        return scene.path_cells

    def scale(self, scene: Scene) -> float:
        """0 near the goal, where aligning the nose would destabilise."""
        dx, dy = scene.pose.x - scene.goal.x, scene.pose.y - scene.goal.y
        near = dx * dx + dy * dy <= self._ahead * self._ahead
        return 0.0 if near else super().scale(scene)


class GoalAlignCritic(_AlignCritic):
    """After ``goal_align.cpp``: distance of the nose to where it will be at the plan's end."""

    kind = GOAL_ALIGNMENT

    def seeds(self, scene: Scene) -> IntArray:
        """The end of the plan, moved ahead along the bearing of the goal."""
        bearing = math.atan2(scene.goal.y - scene.pose.y, scene.goal.x - scene.pose.x)
        plan = scene.plan.copy()
        plan[-1, 0] += self._ahead * math.cos(bearing)
        plan[-1, 1] += self._ahead * math.sin(bearing)
        return plan_cells(plan, scene.costmap)[-1:]

"""Keep the robot's centre near the plan (PathDist) and drive it to the plan's end (GoalDist)."""

import numpy as np

from navstack.control.dwb.critics.map_grid import MapGridCritic
from navstack.control.dwb.end_score import GOAL_DISTANCE, PATH_DISTANCE
from navstack.control.dwb.kernels import CellArray
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import Scene
from navstack.params.dwb import DistParams, DwbParams
from navstack.types import FloatArray, IntArray


class _DistCritic(MapGridCritic):
    """Scores the poses themselves.

    Every pose must be on the map and reachable (``stop_on_failure``).
    """

    def __init__(self, params: DistParams, dwb: DwbParams) -> None:
        super().__init__(params.scale, params.aggregation_type, 0.0)

    def scored_cells(self, rollouts: Rollouts, scene: Scene, only_last: bool) -> CellArray:
        """The poses' own cells."""
        return np.ascontiguousarray(scene.cells[:, -1:]) if only_last else scene.cells

    def raw_costs(self, rollouts: Rollouts, scene: Scene) -> FloatArray:
        """As the base says; inf if any pose leaves the map, or no part of the plan is on it."""
        if len(self.seeds(scene)) == 0:
            return np.full(len(rollouts.x), np.inf)
        costs = super().raw_costs(rollouts, scene)
        costs[scene.leaves_map] = np.inf
        return costs


class PathDistCritic(_DistCritic):
    """After ``path_dist.cpp``: distance to the plan."""

    kind = PATH_DISTANCE

    def seeds(self, scene: Scene) -> IntArray:
        """All cells of the plan near the robot."""
        return scene.path_cells


class GoalDistCritic(_DistCritic):
    """After ``goal_dist.cpp``: distance to where the plan leaves the known map, or ends."""

    kind = GOAL_DISTANCE

    def seeds(self, scene: Scene) -> IntArray:
        """The last of the plan's cells."""
        return scene.path_cells[-1:]

"""Distance of the trajectories' poses to some cells, in cells.

The base of the Dist and Align critics.
"""

from abc import abstractmethod

import numpy as np

from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.end_score import EndScore
from navstack.control.dwb.kernels import CellArray, nearest_seed
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import Scene
from navstack.errors import UnknownNameError
from navstack.types import FloatArray, IntArray

AGGREGATION_TYPES = ("last", "sum", "product")
SCALE_PER_METRE = 0.5  # by which scales are multiplied, besides the metres of a cell


class MapGridCritic(Critic):
    """After ``map_grid.cpp``: the Manhattan distance to the nearest seed cell, which ignores obstacles.

    Nav2 fills a grid with these distances; here they are computed for the cells that are asked for, with the same
    result.
    """

    kind: int  # of its score of the last pose, see end_score.py

    def __init__(self, scale: float, aggregation_type: str, ahead: float) -> None:
        """``ahead`` [m] of the pose lies the scored point.

        Raises:
            UnknownNameError: the ``aggregation_type`` does not exist.
        """
        super().__init__(scale)
        self._aggregation = aggregation_type.lower()
        if self._aggregation not in AGGREGATION_TYPES:
            raise UnknownNameError("aggregation_type", aggregation_type, AGGREGATION_TYPES)
        self._ahead = ahead
        self._end_score = EndScore(self.kind, ahead) if self._aggregation == "last" else None

    @abstractmethod
    def seeds(self, scene: Scene) -> IntArray:
        """The cells (S, 2) as (mx, my) at distance 0; none if the plan is off the map."""

    @abstractmethod
    def scored_cells(self, rollouts: Rollouts, scene: Scene, only_last: bool) -> CellArray:
        """Flat indices (K, T), or (K, 1) of the last poses only; -1 off the map."""

    def end_score(self, scene: Scene) -> EndScore | None:
        """The last pose's distance."""
        return self._end_score

    def scale(self, scene: Scene) -> float:
        """Half a cell's size per cell, so that the weight does not depend on the resolution."""
        return scene.costmap.resolution * SCALE_PER_METRE * self._scale

    def distances(self, cells: CellArray, scene: Scene) -> FloatArray:
        """Distance [cells] of flat cell indices to the nearest seed; inf off the map.

        Without seeds it is the score of an unreachable cell, one more than there are cells in the
        map.
        """
        seeds = self.seeds(scene)
        if len(seeds) == 0:
            return np.where(cells < 0, np.inf, scene.costmap.data.size + 1.0)
        flat = nearest_seed(cells.ravel(), scene.costmap.size_x, seeds)
        return flat.reshape(cells.shape)

    def raw_costs(self, rollouts: Rollouts, scene: Scene) -> FloatArray:
        """The last pose's distance [cells], or the sum or product over all poses."""
        only_last = self._aggregation == "last"
        distances = self.distances(self.scored_cells(rollouts, scene, only_last), scene)
        if only_last:
            return distances[:, 0]
        if self._aggregation == "sum":
            total: FloatArray = np.where(rollouts.is_pose, distances, 0.0).sum(axis=1)
            return total
        illegal = np.isinf(distances).any(axis=1)
        product = np.where(rollouts.is_pose & np.isfinite(distances), distances, 1.0).prod(axis=1)
        return np.where(illegal, np.inf, product)

"""Cost of the costmap under the robot's centre."""

import numpy as np

from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.end_score import CELL_COST, EndScore
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import Scene
from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION
from navstack.params.dwb import DwbParams, ObstacleParams
from navstack.types import FloatArray

_LAST_COST = EndScore(CELL_COST)


class BaseObstacleCritic(Critic):
    """After ``base_obstacle.cpp``: illegal wherever the centre meets an inscribed, lethal or unknown cell."""

    def __init__(self, params: ObstacleParams, dwb: DwbParams) -> None:
        super().__init__(params.scale)
        self._sum_scores = params.sum_scores

    def raw_costs(self, rollouts: Rollouts, scene: Scene) -> FloatArray:
        """The cost 0..252 under the last pose, or the sum over all poses."""
        costs = np.where(
            scene.cells < 0, NO_INFORMATION, scene.costmap.data.reshape(-1)[scene.cells]
        )
        is_illegal = (costs >= INSCRIBED_INFLATED_OBSTACLE).any(axis=1)
        total = (
            np.where(rollouts.is_pose, costs, 0).sum(axis=1) if self._sum_scores else costs[:, -1]
        )
        return np.where(is_illegal, np.inf, total)

    def end_score(self, scene: Scene) -> EndScore | None:
        """The last pose's cost."""
        return None if self._sum_scores else _LAST_COST

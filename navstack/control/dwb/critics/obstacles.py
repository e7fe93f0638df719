"""Cost of the costmap under the centre (BaseObstacle) and the outline (ObstacleFootprint)."""

from navstack.control.dwb.critics.pose_critic import PoseCritic
from navstack.control.dwb.pose_score import AGGREGATION_TYPES, CELL_COST, OUTLINE_COST
from navstack.control.dwb.scene import DwbScene
from navstack.params.dwb import DwbParams, ObstacleParams


class BaseObstacleCritic(PoseCritic):
    """After ``base_obstacle.cpp``.

    Illegal wherever the centre meets an inscribed, lethal or unknown cell.
    """

    kind = CELL_COST

    def __init__(self, params: ObstacleParams, dwb: DwbParams) -> None:
        super().__init__(params.scale, AGGREGATION_TYPES[params.sum_scores])


class ObstacleFootprintCritic(BaseObstacleCritic):
    """After ``obstacle_footprint.cpp``.

    Illegal wherever the outline meets a lethal or unknown cell or leaves the map. Dearer than
    BaseObstacle: it walks the outline of every pose of all trajectories that may win.
    """

    kind = OUTLINE_COST

    def scale(self, scene: DwbScene) -> float:
        """Per metre of a cell, as Nav2 has it."""
        return scene.costmap.resolution * self._scale

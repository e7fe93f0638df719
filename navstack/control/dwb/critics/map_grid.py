"""The base of the Dist and Align critics: distance of the poses to some cells, in cells."""

from navstack.control.dwb.critics.pose_critic import PoseCritic
from navstack.control.dwb.scene import DwbScene
from navstack.params.dwb import AlignParams, DistParams, DwbParams

SCALE_PER_METRE = 0.5  # by which scales are multiplied, besides the metres of a cell


class MapGridCritic(PoseCritic):
    """After ``map_grid.cpp``: the Manhattan distance to the nearest seed cell.

    Obstacles do not count. Nav2 fills a grid with these distances; here they are computed for the
    cells that are asked for.
    """

    def __init__(self, params: DistParams | AlignParams, dwb: DwbParams) -> None:
        nose = getattr(params, "forward_point_distance", 0.0)  # [m]
        super().__init__(params.scale, params.aggregation_type, nose)

    def scale(self, scene: DwbScene) -> float:
        """Half a cell's size per cell, so that the weight does not depend on the resolution."""
        return scene.costmap.resolution * SCALE_PER_METRE * self._scale

"""Cost of the costmap under the outline of the robot."""

import math

import numpy as np

from navstack.control.dwb.choice_kernels import outline_score
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.end_score import OUTLINE_COST, EndScore
from navstack.control.dwb.end_score_kernels import Surface
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import Scene
from navstack.jit import njit
from navstack.params.dwb import DwbParams, ObstacleParams
from navstack.types import FloatArray, IntArray


class ObstacleFootprintCritic(Critic):
    """After ``obstacle_footprint.cpp``.

    Illegal wherever the outline meets a lethal or unknown cell or leaves the map.

    Dearer than BaseObstacle: it walks the outline of every pose of all trajectories that may win.
    """

    def __init__(self, params: ObstacleParams, dwb: DwbParams) -> None:
        super().__init__(params.scale)
        self._sum_scores = params.sum_scores

    def scale(self, scene: Scene) -> float:
        """Per metre of a cell, as Nav2 has it."""
        return scene.costmap.resolution * self._scale

    def raw_costs(self, rollouts: Rollouts, scene: Scene) -> FloatArray:
        """The greatest cost 0..253 under the last outline, or the sum over all poses."""
        r, surface = rollouts, Surface(scene.costmap.data, scene.costmap.grid, scene.footprint)
        result: FloatArray = outline_costs(r.x, r.y, r.yaw, r.lengths, surface, self._sum_scores)
        return result

    def end_score(self, scene: Scene) -> EndScore | None:
        """The cost under the last outline."""
        return None if self._sum_scores else EndScore(OUTLINE_COST)


@njit()
def outline_costs(
    x: FloatArray,
    y: FloatArray,
    yaw: FloatArray,
    lengths: IntArray,
    surface: Surface,
    sum_scores: bool,
) -> FloatArray:
    """Greatest cost (K,) under the outline at the last of the poses (K, T), or its sum over all.

    Inf if illegal.
    """
    result = np.empty(len(x))
    for k in range(len(x)):
        total, last = 0.0, 0.0
        for t in range(lengths[k]):
            last = outline_score(x[k, t], y[k, t], yaw[k, t], surface)
            total += last
            if total == math.inf:
                break
        result[k] = total if sum_scores else last
    return result

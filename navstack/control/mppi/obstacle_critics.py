"""The critics that look at the costmap."""

import math

import numpy as np

from navstack.control.mppi.body import CollisionBody, make_body
from navstack.control.mppi.critic import CriticScores, MppiCritic
from navstack.control.mppi.obstacle_kernels import cost_scores, obstacle_scores
from navstack.control.mppi.rollouts import MppiRollouts
from navstack.control.mppi.scene import MppiScene
from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE
from navstack.geometry import footprint_radii
from navstack.params.mppi import MppiParams
from navstack.types import FloatArray

_HIGHEST = 254.0  # cost by which CostCritic's weight is divided


class _ObstacleCritic(MppiCritic):
    """What both critics know of the robot's body and of the costmap's inflation."""

    def __init__(self, name: str, params: MppiParams, footprint: FloatArray) -> None:
        super().__init__(name, params)
        self._costs = params.local_costs
        self._footprint = footprint
        self._layer = self._costs.inflation(self._own.inflation_layer_name)
        self._body: CollisionBody | None = None

    def body_on(self, scene: MppiScene) -> CollisionBody:
        """The robot's body in cells of the costmap, made once."""
        if self._body is None:
            outline = self._own.consider_footprint
            self._body = make_body(
                self._footprint, outline, self._costs, self._layer, scene.grid[2]
            )
        return self._body


class MppiCostCritic(_ObstacleCritic):
    """The costs under the trajectory.

    A collision makes it all but impossible (``cost_critic.cpp``).
    """

    def __init__(self, name: str, params: MppiParams, footprint: FloatArray) -> None:
        super().__init__(name, params, footprint)
        self.weight /= _HIGHEST

    def score(self, rollouts: MppiRollouts, scene: MppiScene) -> CriticScores:
        """See the base class."""
        own = self._own
        raw, hits = cost_scores(
            rollouts,
            own.trajectory_point_step,
            scene.costs,
            scene.grid,
            self.body_on(scene),
            own.consider_footprint and scene.has_unknown,
            own.near_collision_cost,
            np.float32(own.critical_cost),
            np.float32(own.collision_cost),
            not scene.goal_distance < own.near_goal_distance,
        )
        looked_at = max(len(rollouts.x) // own.trajectory_point_step, 1)
        return CriticScores(raw / np.float32(looked_at), int(hits.sum()))


class MppiObstaclesCritic(_ObstacleCritic):
    """The distances to obstacles, as the inflated costmap tells them (``obstacles_critic.cpp``)."""

    def __init__(self, name: str, params: MppiParams, footprint: FloatArray) -> None:
        super().__init__(name, params, footprint)
        self._inscribed_radius = footprint_radii(footprint)[0]
        self._distances = np.zeros(256)
        if self._layer is not None and self._layer.cost_scaling_factor > 0.0:
            costs = np.arange(256.0).clip(1.0)
            self._distances = self._inscribed_radius - (
                np.log(costs / INSCRIBED_INFLATED_OBSTACLE) / self._layer.cost_scaling_factor
            )

    def score(self, rollouts: MppiRollouts, scene: MppiScene) -> CriticScores:
        """See the base class; the raw score holds its two weights."""
        own = self._own
        layer = self._layer
        reach = math.inf  # no distances
        if layer is not None and layer.inflation_radius > 0.0 and layer.cost_scaling_factor > 0.0:
            reach = layer.inflation_radius
            if scene.goal_distance < own.near_goal_distance:
                reach = -math.inf
        near, repulsion, hits = obstacle_scores(
            rollouts,
            scene.costs,
            scene.grid,
            self.body_on(scene),
            self._distances,
            self._inscribed_radius,
            own.collision_margin_distance,
            reach,
        )
        near[hits] = own.collision_cost
        repulsion = (repulsion - repulsion.min()) / np.float32(len(rollouts.x))
        raw = np.float32(own.critical_weight) * near + np.float32(own.repulsion_weight) * repulsion
        return CriticScores(raw, int(hits.sum()))

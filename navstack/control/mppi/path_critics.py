"""The critics that look at path and goal."""

import math

import numpy as np

from navstack.control.mppi.critic import CriticScores, MppiCritic
from navstack.control.mppi.path_kernels import bearing_errors, mean_distance, mean_misalignment
from navstack.control.mppi.rollouts import MppiRollouts
from navstack.control.mppi.scene import MppiScene
from navstack.geometry import shortest_angular_distance
from navstack.params.mppi import MppiParams
from navstack.params.mppi_critics import AS_THE_PATH, EITHER, FORWARD

_MOST_IGNORED = 2  # path points in obstacles that never make the path a blocked one


class MppiGoalCritic(MppiCritic):
    """The mean distance to the goal, near it (``goal_critic.cpp``)."""

    def score(self, rollouts: MppiRollouts, scene: MppiScene) -> CriticScores | None:
        """See the base class."""
        if not scene.goal_distance < self._own.threshold_to_consider:
            return None
        return CriticScores(
            mean_distance(
                rollouts.x, rollouts.y, np.float32(scene.goal[0]), np.float32(scene.goal[1])
            )
        )


class MppiGoalAngleCritic(MppiCritic):
    """The mean angle to the path's last yaw, near the goal (``goal_angle_critic.cpp``)."""

    def score(self, rollouts: MppiRollouts, scene: MppiScene) -> CriticScores | None:
        """See the base class."""
        if not scene.goal_distance < self._own.threshold_to_consider:
            return None
        turns = (scene.path_yaw[-1] - rollouts.yaw).astype(np.float64)
        turns -= 2.0 * math.pi * np.floor((turns + math.pi) / (2.0 * math.pi))
        sizes = np.abs(turns.astype(np.float32))
        if self._own.symmetric_yaw_tolerance:
            sizes = np.minimum(sizes, np.float32(math.pi) - sizes)
        return CriticScores(sizes.sum(axis=0) / np.float32(len(sizes)))


class MppiPathAlignCritic(MppiCritic):
    """The mean distance to the path's point as far along, as long as the path is free.

    After ``path_align_critic.cpp``.
    """

    def score(self, rollouts: MppiRollouts, scene: MppiScene) -> CriticScores | None:
        """See the base class."""
        own = self._own
        if scene.goal_distance < own.threshold_to_consider:
            return None
        reached = scene.furthest(rollouts)
        if reached < max(1, own.offset_from_furthest):
            return None
        blocked = reached - np.count_nonzero(scene.free[:reached])
        if blocked > max(_MOST_IGNORED, own.max_path_occupancy_ratio * reached):
            return None
        path = (scene.path_x[:reached], scene.path_y[:reached], scene.path_yaw[:reached])
        free = scene.free[:reached]
        step = own.trajectory_point_step
        return CriticScores(
            mean_misalignment(rollouts, step, path, free, own.use_path_orientations)
        )


class MppiPathAngleCritic(MppiCritic):
    """The last pose's bearing to a point ahead, where the robot looks away from it.

    After ``path_angle_critic.cpp``.
    """

    def __init__(self, name: str, params: MppiParams) -> None:
        super().__init__(name, params)
        reverses = abs(params.vx_min) >= 1e-6 and params.vx_min < 0.0
        self._mode = self._own.mode
        if self._mode == EITHER and not reverses:
            self._mode = FORWARD

    def score(self, rollouts: MppiRollouts, scene: MppiScene) -> CriticScores | None:
        """See the base class."""
        if scene.goal_distance < self._own.threshold_to_consider:
            return None
        i = min(scene.furthest(rollouts) + self._own.offset_from_furthest, len(scene.path_x) - 1)
        x = float(scene.path_x[i])
        y = float(scene.path_y[i])
        yaw = float(scene.path_yaw[i])
        if self._error_now(scene.yaw, math.atan2(y, x), yaw) < self._own.max_angle_to_furthest:
            return None
        return CriticScores(
            bearing_errors(rollouts.x[-1], rollouts.y[-1], rollouts.yaw[-1], x, y, self._mode, yaw)
        )

    def _error_now(self, heading: float, bearing: float, path_yaw: float) -> float:
        """The angle in [rad] between the robot and the point."""
        error = abs(shortest_angular_distance(bearing, heading))
        if self._mode == EITHER:
            return min(error, math.pi - error)
        is_behind = abs(shortest_angular_distance(bearing, path_yaw)) > 0.5 * math.pi
        if self._mode == AS_THE_PATH and is_behind:
            return math.pi - error
        return error


class MppiPathFollowCritic(MppiCritic):
    """The last pose's distance to the first free point ahead (``path_follow_critic.cpp``)."""

    def score(self, rollouts: MppiRollouts, scene: MppiScene) -> CriticScores | None:
        """See the base class."""
        last = len(scene.path_x) - 1
        if last < 1 or scene.goal_distance < self._own.threshold_to_consider:
            return None
        i = min(scene.furthest(rollouts) + self._own.offset_from_furthest, last)
        while i < last - 1 and not scene.free[i]:
            i += 1
        x = scene.path_x[i]
        y = scene.path_y[i]
        return CriticScores(mean_distance(rollouts.x[-1:], rollouts.y[-1:], x, y))

"""What the critics know of the situation in which trajectories are scored."""

import math
from functools import cached_property

import numpy as np

from navstack.control.mppi.path_kernels import free_points, furthest_point
from navstack.control.mppi.rollouts import MppiRollouts
from navstack.costmap.costmap import NO_INFORMATION, Costmap
from navstack.types import BoolArray, Float32Array, FloatArray, Pose2D, RobotState, Track


class MppiScene:
    """One control cycle, seen from the robot.

    Positions are relative to its own, along the axes of the map frame.
    """

    def __init__(
        self,
        state: RobotState,
        path: FloatArray,
        goal: Pose2D,
        costmap: Costmap,
        tracks_unknown: bool,
        tracks: tuple[Track, ...] = (),
    ) -> None:
        """Make the scene.

        Args:
            state: of the robot.
            path: the plan ahead of it (N, 3), map frame.
            goal: the whole plan's last pose, map frame.
            costmap: local, in the map frame.
            tracks_unknown: unknown cells of it are no obstacles.
            tracks: of what moves about, map frame.
        """
        self.pose = pose = state.pose
        self.tracks = tracks
        self.stamp = state.stamp
        self.velocity = state.twist
        self.yaw = pose.yaw  # [rad] in the map frame
        self.path_x: Float32Array = (path[:, 0] - pose.x).astype(np.float32)  # [m]
        self.path_y: Float32Array = (path[:, 1] - pose.y).astype(np.float32)  # [m]
        self.path_yaw: Float32Array = path[:, 2].astype(np.float32)  # [rad] in the map frame
        self.goal = (goal.x - pose.x, goal.y - pose.y)  # [m]
        self.goal_distance = math.hypot(*self.goal)  # [m]
        self.costs = costmap.data
        self.grid = (costmap.origin_x - pose.x, costmap.origin_y - pose.y, costmap.resolution)
        self._tracks_unknown = tracks_unknown
        self._furthest: int | None = None

    @cached_property
    def has_unknown(self) -> bool:
        """Whether the costmap has unknown cells."""
        return bool(self.costs.max() == NO_INFORMATION)

    @cached_property
    def free(self) -> BoolArray:
        """Which of the path's points (N - 1,), the last one left out, are not in an obstacle."""
        return free_points(self.path_x, self.path_y, self.costs, self.grid, self._tracks_unknown)

    def furthest(self, rollouts: MppiRollouts) -> int:
        """The furthest of the path's points that the cycle's first trajectories reach."""
        if self._furthest is None:
            self._furthest = int(
                furthest_point(self.path_x, self.path_y, rollouts.x[-1], rollouts.y[-1])
            )
        return self._furthest

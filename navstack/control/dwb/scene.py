"""What the critics know of the situation in which trajectories are scored."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from navstack.control.dwb.pose_score import Situation
from navstack.control.dwb.rollouts import Rollouts
from navstack.costmap.costmap import Costmap
from navstack.types import FloatArray, Pose2D, Track, Twist2D


@dataclass(eq=False)
class DwbScene:
    """One control cycle; everything in the map frame."""

    pose: Pose2D
    velocity: Twist2D  # measured, base frame
    stamp: float  # [s]
    goal: Pose2D  # the last pose of the whole plan
    plan: FloatArray  # (N, 3) the plan near the robot
    costmap: Costmap
    footprint: FloatArray  # (V, 2) [m] padded polygon in the base frame
    tracks: tuple[Track, ...] = ()  # of what moves about
    rollouts: Rollouts | None = field(init=False, default=None)  # of this scene, once there are any

    @cached_property
    def situation(self) -> Situation:
        """The same for kernels."""
        pose = self.pose
        velocity = self.velocity
        costmap = self.costmap
        robot = (pose.x, pose.y, pose.yaw, velocity.linear_x, velocity.linear_y, velocity.angular_z)
        return Situation(
            np.array(robot, dtype=np.float64),
            self.plan,
            (self.goal.x, self.goal.y),
            costmap.data,
            costmap.grid,
            self.footprint,
        )

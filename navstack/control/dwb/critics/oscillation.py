"""Forbid turning back before the robot has got somewhere."""

import math

import numpy as np

from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.pose_score import NO_MEASURE, Measure
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import DwbScene
from navstack.params.dwb import DwbParams, OscillationParams
from navstack.types import FloatArray, Pose2D, Twist2D


class _CommandTrend:
    """Signs of the commands of one axis; one change of sign makes the new sign binding."""

    def __init__(self) -> None:
        self._sign = 0.0
        self.forbidden = 0  # signs: 1 for the negative, 2 for the positive one, 3 for both

    def update(self, velocity: float) -> bool:
        """Hear a command; answer whether the sign has just flipped."""
        if velocity == 0.0:
            return False
        flipped = velocity * self._sign < 0.0
        if flipped:
            self.forbidden |= 1 if velocity > 0.0 else 2
        self._sign = math.copysign(1.0, velocity)
        return flipped


class OscillationCritic(Critic):
    """After ``oscillation.cpp``.

    The restriction ends by distance, angle or time from where it was last imposed.
    """

    def __init__(self, params: OscillationParams, dwb: DwbParams) -> None:
        super().__init__(params.scale)
        self._params = params
        self._imposed_pose = Pose2D()
        self._imposed_at = 0.0  # [s]
        self._forbidden = (0, 0, 0)  # signs per axis in this cycle
        self.reset()

    def reset(self) -> None:
        """No restriction."""
        self._trends = [_CommandTrend() for _ in range(3)]  # x, y, yaw rate

    def prepare(self, scene: DwbScene) -> None:
        """See which directions are forbidden."""
        x, y, theta = self._trends
        self._forbidden = x.forbidden, y.forbidden, theta.forbidden

    def raw_costs(self, rollouts: Rollouts, scene: DwbScene) -> FloatArray:
        """0, or inf for a forbidden direction."""
        costs = np.zeros(len(rollouts.commands))
        for axis, signs in enumerate(self._forbidden):
            velocities = rollouts.commands[:, axis]
            if signs & 1:
                costs[velocities < 0.0] = np.inf
            if signs & 2:
                costs[velocities > 0.0] = np.inf
        return costs

    def measure(self, scene: DwbScene) -> Measure | None:
        """Nothing, while no direction is forbidden."""
        if any(self._forbidden):
            return None
        return NO_MEASURE

    def debrief(self, scene: DwbScene, command: Twist2D) -> None:
        """Follow the commands' signs, sideways and turning only while hardly driving forward."""
        x, y, theta = self._trends
        flipped = x.update(command.linear_x)
        threshold = self._params.x_only_threshold
        if threshold < 0.0 or abs(command.linear_x) <= threshold:
            flipped |= y.update(command.linear_y)
            flipped |= theta.update(command.angular_z)
        if flipped:
            self._imposed_pose = scene.pose
            self._imposed_at = scene.stamp
        if (x.forbidden or y.forbidden or theta.forbidden) and self._has_got_somewhere(scene):
            self.reset()

    def _has_got_somewhere(self, scene: DwbScene) -> bool:
        p = self._params
        origin = self._imposed_pose
        squared = (scene.pose.x - origin.x) ** 2 + (scene.pose.y - origin.y) ** 2
        far = p.oscillation_reset_dist >= 0.0 and squared > p.oscillation_reset_dist**2
        turn = abs(scene.pose.yaw - origin.yaw)  # not wrapped, as in Nav2
        turned = p.oscillation_reset_angle >= 0.0 and turn > p.oscillation_reset_angle
        waited = (
            p.oscillation_reset_time >= 0.0
            and scene.stamp - self._imposed_at > p.oscillation_reset_time
        )
        return far or turned or waited

"""The critics that look at velocities."""

import math

import numpy as np

from navstack.control.mppi.critic import CriticScores, MppiCritic
from navstack.control.mppi.motion_kernels import sum_outside
from navstack.control.mppi.rollouts import MppiRollouts
from navstack.control.mppi.scene import MppiScene
from navstack.params.mppi import MppiParams
from navstack.types import Float32Array


class MppiConstraintCritic(MppiCritic):
    """Speeds beyond the limits, times their durations (``constraint_critic.cpp``).

    An Ackermann's tight curves, too.

    The limits are those of the parameters, whatever a speed filter says, and ``vy_max`` widens them
    for every robot.
    """

    def __init__(self, name: str, params: MppiParams) -> None:
        super().__init__(name, params)
        self._most = np.float32(math.hypot(params.vx_max, params.vy_max))
        self._least = np.float32(
            math.copysign(math.hypot(params.vx_min, params.vy_max), params.vx_min or -1.0)
        )
        self._radius = 0.0
        if params.motion_model == "Ackermann":
            self._radius = params.AckermannConstraints.min_turning_r
        self._dt = np.float32(params.model_dt)

    def score(self, rollouts: MppiRollouts, scene: MppiScene) -> CriticScores:
        """See the base class."""
        steps = len(rollouts.x)
        speeds = rollouts.v
        if rollouts.vy is not None:
            speeds = np.copysign(np.hypot(rollouts.v, rollouts.vy), rollouts.v)
        outside = sum_outside(speeds, steps, self._least, self._most)
        if self._radius > 0.0:
            outside += sum_too_tight(
                rollouts.v[:steps], rollouts.w[:steps], np.float32(self._radius)
            )
        return CriticScores(outside * self._dt)


class MppiPreferForwardCritic(MppiCritic):
    """The way driven backwards, except near the goal (``prefer_forward_critic.cpp``)."""

    def __init__(self, name: str, params: MppiParams) -> None:
        super().__init__(name, params)
        self._dt = np.float32(params.model_dt)

    def score(self, rollouts: MppiRollouts, scene: MppiScene) -> CriticScores | None:
        """See the base class."""
        if scene.goal_distance < self._own.threshold_to_consider:
            return None
        return CriticScores(
            sum_outside(rollouts.v, len(rollouts.x), np.float32(0.0), np.float32(np.inf)) * self._dt
        )


class MppiTwirlingCritic(MppiCritic):
    """The mean yaw rate, except within the goal checker's tolerance (``twirling_critic.cpp``)."""

    def __init__(self, name: str, params: MppiParams, xy_goal_tolerance: float) -> None:
        super().__init__(name, params)
        self._xy_goal_tolerance = xy_goal_tolerance

    def score(self, rollouts: MppiRollouts, scene: MppiScene) -> CriticScores | None:
        """See the base class."""
        if scene.goal_distance < self._xy_goal_tolerance:
            return None
        rates = rollouts.w[: len(rollouts.x)]
        return CriticScores(np.abs(rates).sum(axis=0) / np.float32(len(rates)))


class MppiVelocityDeadbandCritic(MppiCritic):
    """Speeds below those that the drive turns into motion, times their durations.

    After ``velocity_deadband_critic.cpp``.
    """

    def __init__(self, name: str, params: MppiParams) -> None:
        super().__init__(name, params)
        v, vy, w = (np.float32(abs(speed)) for speed in self._own.deadband_velocities)
        self._least = (v, w, vy)  # in the order of the controls
        self._dt = np.float32(params.model_dt)

    def score(self, rollouts: MppiRollouts, scene: MppiScene) -> CriticScores:
        """See the base class."""
        steps = len(rollouts.x)
        below = [
            np.maximum(least - np.abs(speeds[:steps]), np.float32(0.0)).sum(axis=0)
            for speeds, least in zip(rollouts.controls, self._least, strict=False)
        ]
        return CriticScores(sum(below[1:], start=below[0]) * self._dt)


def sum_too_tight(v: Float32Array, w: Float32Array, radius: np.float32) -> Float32Array:
    """By how much the radii of the curves (T, B) are below ``radius`` [m], in all (B,)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        tight = np.maximum(radius - np.abs(v) / np.abs(w), np.float32(0.0))
    tight[w == 0.0] = 0.0  # straight on is no curve; Nav2 divides by zero where it stands, too
    total: Float32Array = tight.sum(axis=0)
    return total

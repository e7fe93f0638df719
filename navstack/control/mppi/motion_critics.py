"""The critics that look at velocities."""

import math

import numpy as np

from navstack.control.mppi.critic import Critic, Scores
from navstack.control.mppi.motion_kernels import mean_size, sum_below, sum_outside, sum_too_tight
from navstack.control.mppi.rollouts import Rollouts
from navstack.control.mppi.scene import Scene
from navstack.params.mppi import MppiParams


class ConstraintCritic(Critic):
    """Speeds beyond the limits, times their durations (``constraint_critic.cpp``); an Ackermann's tight curves, too.

    The limits are those of the parameters, whatever a speed filter says, and ``vy_max`` widens them for every robot.
    """

    def __init__(self, name: str, params: MppiParams) -> None:
        super().__init__(name, params)
        self._most = np.float32(math.hypot(params.vx_max, params.vy_max))
        self._least = np.float32(math.copysign(math.hypot(params.vx_min, params.vy_max), params.vx_min or -1.0))
        self._radius = params.AckermannConstraints.min_turning_r if params.motion_model == "Ackermann" else 0.0
        self._dt = np.float32(params.model_dt)

    def score(self, rollouts: Rollouts, scene: Scene) -> Scores:
        """See the base class."""
        steps = len(rollouts.x)
        speeds = rollouts.v if rollouts.vy is None else np.copysign(np.hypot(rollouts.v, rollouts.vy), rollouts.v)
        outside = sum_outside(speeds, steps, self._least, self._most)
        if self._radius > 0.0:
            outside += sum_too_tight(rollouts.v, rollouts.w, steps, np.float32(self._radius))
        return Scores(outside * self._dt)


class PreferForwardCritic(Critic):
    """The way driven backwards, except near the goal (``prefer_forward_critic.cpp``)."""

    def __init__(self, name: str, params: MppiParams) -> None:
        super().__init__(name, params)
        self._dt = np.float32(params.model_dt)

    def score(self, rollouts: Rollouts, scene: Scene) -> Scores | None:
        """See the base class."""
        if scene.goal_distance < self._own.threshold_to_consider:
            return None
        return Scores(sum_outside(rollouts.v, len(rollouts.x), np.float32(0.0), np.float32(np.inf)) * self._dt)


class TwirlingCritic(Critic):
    """The mean yaw rate, except within the goal checker's tolerance (``twirling_critic.cpp``)."""

    def __init__(self, name: str, params: MppiParams, xy_goal_tolerance: float) -> None:
        super().__init__(name, params)
        self._xy_goal_tolerance = xy_goal_tolerance

    def score(self, rollouts: Rollouts, scene: Scene) -> Scores | None:
        """See the base class."""
        if scene.goal_distance < self._xy_goal_tolerance:
            return None
        return Scores(mean_size(rollouts.w, len(rollouts.x)))


class VelocityDeadbandCritic(Critic):
    """Speeds below those that the drive turns into motion, times their durations (``velocity_deadband_critic.cpp``)."""

    def __init__(self, name: str, params: MppiParams) -> None:
        super().__init__(name, params)
        self._v, self._vy, self._w = (np.float32(abs(speed)) for speed in self._own.deadband_velocities)
        self._dt = np.float32(params.model_dt)

    def score(self, rollouts: Rollouts, scene: Scene) -> Scores:
        """See the base class."""
        steps = len(rollouts.x)
        below = sum_below(rollouts.v, steps, self._v) + sum_below(rollouts.w, steps, self._w)
        if rollouts.vy is not None:
            below += sum_below(rollouts.vy, steps, self._vy)
        return Scores(below * self._dt)

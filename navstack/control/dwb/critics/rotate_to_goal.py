"""Stop, then turn on the spot, once the goal is within its tolerance."""

import math

import numpy as np

from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.pose_score import NO_MEASURE, Measure
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import DwbScene
from navstack.params.dwb import DwbParams, RotateToGoalParams
from navstack.types import FloatArray


class RotateToGoalCritic(Critic):
    """After ``rotate_to_goal.cpp``.

    Far from the goal it scores nothing. Near the goal only slower samples are legal, and after a
    stop only turns. Entering the tolerance and having stopped are remembered until the next plan.
    Jazzy looks at the goal's distance alone; with a finite ``path_length_tolerance`` the plan must
    be that short too, as in Nav2 main.
    """

    def __init__(self, params: RotateToGoalParams, dwb: DwbParams) -> None:
        super().__init__(params.scale)
        self._params = params
        self._goal_tolerance = dwb.xy_goal_tolerance
        self._stopped_speed = dwb.trans_stopped_velocity
        self._path_length_tolerance = dwb.path_length_tolerance
        self.reset()

    def reset(self) -> None:
        """Neither near the goal nor stopped there."""
        self._in_window = False
        self._rotating = False

    def prepare(self, scene: DwbScene) -> None:
        """See how near the goal is and how fast the robot is."""
        dx = scene.pose.x - scene.goal.x
        dy = scene.pose.y - scene.goal.y
        near = dx * dx + dy * dy <= self._goal_tolerance**2
        self._in_window = self._in_window or (near and self._plan_is_short(scene.plan))
        self._speed_squared = scene.velocity.linear_x**2 + scene.velocity.linear_y**2
        stopped = self._speed_squared <= self._stopped_speed**2
        self._rotating = self._rotating or (self._in_window and stopped)

    def raw_costs(self, rollouts: Rollouts, scene: DwbScene) -> FloatArray:
        """The heading error in [rad], plus the weighted squared speed while slowing down."""
        vx = rollouts.commands[:, 0]
        vy = rollouts.commands[:, 1]
        if not self._in_window:
            return np.zeros(len(vx))
        speed_squared = vx * vx + vy * vy
        if self._rotating:
            return np.where(speed_squared > 0.0, np.inf, self._heading_errors(rollouts, scene))
        costs = speed_squared * self._params.slowing_factor + self._heading_errors(rollouts, scene)
        return np.where(speed_squared >= self._speed_squared, np.inf, costs)

    def measure(self, scene: DwbScene) -> Measure | None:
        """Nothing, far from the goal."""
        if self._in_window:
            return None
        return NO_MEASURE

    def _heading_errors(self, rollouts: Rollouts, scene: DwbScene) -> FloatArray:
        ends = rollouts.yaw[:, -1]
        if self._params.lookahead_time >= 0.0:
            ends = rollouts.yaw_at(self._params.lookahead_time)
        errors: FloatArray = np.abs((scene.goal.yaw - ends + math.pi) % (2.0 * math.pi) - math.pi)
        return errors

    def _plan_is_short(self, plan: FloatArray) -> bool:
        if math.isinf(self._path_length_tolerance):
            return True
        return float(np.hypot(*np.diff(plan[:, :2], axis=0).T).sum()) <= self._path_length_tolerance

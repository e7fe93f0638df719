"""Prefer driving forward to driving backwards, strafing and turning."""

import numpy as np

from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import DwbScene
from navstack.params.dwb import DwbParams, PreferForwardParams
from navstack.types import FloatArray


class PreferForwardCritic(Critic):
    """After ``prefer_forward.cpp``."""

    def __init__(self, params: PreferForwardParams, dwb: DwbParams) -> None:
        super().__init__(params.scale)
        self._params = params

    def raw_costs(self, rollouts: Rollouts, scene: DwbScene) -> FloatArray:
        """The penalty for backward and slow sideways motions, else the weighted yaw rate."""
        p = self._params
        vx = rollouts.commands[:, 0]
        yaw_rate = np.abs(rollouts.commands[:, 2])
        strafes = (vx < p.strafe_x) & (yaw_rate < p.strafe_theta)
        return np.where((vx < 0.0) | strafes, p.penalty, yaw_rate * p.theta_scale)

"""Prefer not to turn."""

import numpy as np

from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import DwbScene
from navstack.params.dwb import DwbParams, TwirlingParams
from navstack.types import FloatArray


class TwirlingCritic(Critic):
    """After ``twirling.cpp``."""

    def __init__(self, params: TwirlingParams, dwb: DwbParams) -> None:
        super().__init__(params.scale)

    def raw_costs(self, rollouts: Rollouts, scene: DwbScene) -> FloatArray:
        """The absolute yaw rate in [rad/s]."""
        costs: FloatArray = np.abs(rollouts.commands[:, 2])
        return costs

"""What touching people is expected to cost: this project's own critic."""

import numpy as np

from navstack.control.contact_risk import ContactPricing, body_of, expected_contacts
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import DwbScene
from navstack.params.dwb import DwbParams
from navstack.params.expected_contact import DwbContactParams
from navstack.types import FloatArray


class ExpectedContactCritic(Critic):
    """Expected dollars of the contacts with tracked people within the simulated time."""

    wants_tracks = True

    def __init__(self, params: DwbContactParams, dwb: DwbParams) -> None:
        super().__init__(params.scale)
        self._pricing = ContactPricing(params)

    def raw_costs(self, rollouts: Rollouts, scene: DwbScene) -> FloatArray:
        """The expected cost of each trajectory [USD]."""
        people = self._pricing.people(scene.tracks, scene.pose, scene.stamp)
        if not len(people):
            return np.zeros(len(rollouts.commands))
        r = rollouts
        poses = (r.x, r.y, r.yaw, r.lengths, r.sim_time / r.steps)
        speeds = np.ascontiguousarray(r.commands[:, :1])
        turns = np.ascontiguousarray(r.commands[:, 2:])
        prices = (self._pricing.rates, self._pricing.contact_usd)
        return expected_contacts(*poses, speeds, turns, people, body_of(scene.footprint), *prices)

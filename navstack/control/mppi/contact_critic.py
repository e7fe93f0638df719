"""What touching people is expected to cost: this project's own critic."""

import numpy as np

from navstack.control.contact_risk import ContactPricing, body_of, expected_contacts
from navstack.control.mppi.critic import CriticScores, MppiCritic
from navstack.control.mppi.rollouts import MppiRollouts
from navstack.control.mppi.scene import MppiScene
from navstack.params.mppi import MppiParams
from navstack.types import Float32Array, FloatArray


class MppiExpectedContactCritic(MppiCritic):
    """Expected dollars of the contacts with tracked people within the horizon."""

    wants_tracks = True

    def __init__(self, name: str, params: MppiParams, footprint: FloatArray) -> None:
        super().__init__(name, params)
        self._pricing = ContactPricing(self._own)
        self._body = body_of(footprint)
        self._every = self._own.trajectory_point_step
        self._dt = params.model_dt

    def score(self, rollouts: MppiRollouts, scene: MppiScene) -> CriticScores | None:
        """See the base class."""
        people = self._pricing.people(scene.tracks, scene.pose, scene.stamp)
        if not len(people):
            return None
        people[:, :2] -= (scene.pose.x, scene.pose.y)  # trajectories are relative to the robot
        people[:, :2] += self._dt * people[:, 2:4]  # and begin a step from now
        x, y, yaw, v, w = (
            self._rows(each)
            for each in (rollouts.x, rollouts.y, rollouts.yaw, rollouts.v, rollouts.w)
        )
        lengths = np.full(len(x), x.shape[1])
        steps = np.full(len(x), self._every * self._dt)
        prices = (self._pricing.rates, self._pricing.contact_usd)
        costs = expected_contacts(x, y, yaw, lengths, steps, v, w, people, self._body, *prices)
        return CriticScores(costs.astype(np.float32))

    def _rows(self, columns: Float32Array) -> FloatArray:
        """Every n-th pose of each trajectory as a row."""
        return np.ascontiguousarray(columns[:: self._every].T, dtype=np.float64)

"""What touching people is expected to cost: this project's own critic."""

import math

import numpy as np

from navstack.control.contact_risk import ContactPricing, body_of, expected_contacts
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import DwbScene
from navstack.params.dwb import DwbParams
from navstack.params.expected_contact import DwbContactParams
from navstack.types import FloatArray, IntArray

STANDS = 1e-6  # [m/s], [rad/s] what samples of zero come to
LOOK = 0.1  # [s] at most between two looks at people, of a robot that stands


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
        body, prices = body_of(scene.footprint), (self._pricing.rates, self._pricing.contact_usd)
        costs = expected_contacts(*poses, speeds, turns, people, body, *prices)
        standing = np.abs(r.commands).max(axis=1) < STANDS
        if standing.any():
            costs[standing] = expected_contacts(*_held(r), people, body, *prices)
        return costs


Held = tuple[FloatArray, FloatArray, FloatArray, IntArray, FloatArray, FloatArray, FloatArray]


def _held(rollouts: Rollouts) -> Held:
    """A robot that stands, as :func:`expected_contacts` takes it.

    DWB's own trajectory of it has too few poses to see who comes.
    """
    periods = max(1, math.ceil(rollouts.sim_time / LOOK))
    x, y, yaw = (
        np.full((1, periods + 1), each[0, 0]) for each in (rollouts.x, rollouts.y, rollouts.yaw)
    )
    step, stopped = np.array([rollouts.sim_time / periods]), np.zeros((1, 1))
    return x, y, yaw, np.array([periods + 1]), step, stopped, stopped

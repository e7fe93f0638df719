"""Which motions are compared in a cycle, and which of them is chosen."""

import math

import numpy as np

from navstack.control.expected_cost import motions as library
from navstack.control.expected_cost.motion_cost import MotionScene, price_all
from navstack.control.expected_cost.rollout import MotionLimits
from navstack.params.expected_cost import ExpectedCostParams
from navstack.types import FloatArray

# of what was chosen last, among people and in an empty street
_VARIATIONS = 40
_FEW_VARIATIONS = 6
# the best of all, and variations of each
_REFINED = 6
_REFINEMENTS = 16
_STANDS = 0.05  # [m/s] up to which the robot stands


class MotionSearch:
    """A few motions in an empty street, many among people, and variations of the best.

    The motion under way is kept unless another one is clearly cheaper.
    """

    def __init__(self, params: ExpectedCostParams, limits: MotionLimits) -> None:
        self._params = params
        self.set_limits(limits)

    def seed(self, rng: np.random.Generator) -> None:
        """Draw variations from ``rng`` from now on."""
        self._rng = rng

    def set_limits(self, limits: MotionLimits) -> None:
        """Make the motions of these limits."""
        self._limits = limits
        self._few = library.few(limits.max_speed)
        self._many = library.many(limits.max_speed, limits.max_reverse_speed, limits.max_yaw_rate)

    def choose(
        self, scene: MotionScene, under_way: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """All motions (M, FIELDS) that were compared, and the best of them.

        Args:
            scene: what they are held against.
            under_way: what is left of the motion (FIELDS,) that was chosen last; None: nothing.
        """
        last = self._few[:0]
        if under_way is not None:
            last = under_way[None]
        motions = np.concatenate((last, self._few))
        costs = np.empty(len(motions))
        risks = np.empty(len(motions))
        best = price_all(motions, scene, math.inf, costs, risks)
        to_switch = self._switch_usd(float(risks[0]))
        just_waits = not self._params.evades_at_rest and abs(scene.start[3]) < _STANDS
        if just_waits or risks[best] <= self._params.alarm_usd:
            motions, costs = self._vary(motions, costs, 1, _FEW_VARIATIONS, scene)
        else:
            more = np.concatenate((self._varied(last, _VARIATIONS), self._many))
            motions, costs = self._price_more(motions, costs, more, float(costs[best]), scene)
            motions, costs = self._vary(motions, costs, _REFINED, _REFINEMENTS, scene)
        chosen = int(np.argmin(costs))
        if len(last) and costs[chosen] > costs[0] - to_switch:
            chosen = 0
        return motions, motions[chosen]

    def _vary(
        self,
        motions: FloatArray,
        costs: FloatArray,
        best: int,
        count: int,
        scene: MotionScene,
    ) -> tuple[FloatArray, FloatArray]:
        """Compare variations of the best motions, too; returns all motions and their costs."""
        order = np.argsort(costs, kind="stable")[:best]
        return self._price_more(
            motions, costs, self._varied(motions[order], count), float(costs[order[0]]), scene
        )

    def _price_more(
        self,
        motions: FloatArray,
        costs: FloatArray,
        more: FloatArray,
        bound: float,
        scene: MotionScene,
    ) -> tuple[FloatArray, FloatArray]:
        """Price more motions, which have to cost less than ``bound`` [USD].

        Returns all motions and their costs.
        """
        priced = np.empty(len(more))
        risks = np.empty(len(more))
        price_all(more, scene, bound, priced, risks)
        return np.concatenate((motions, more)), np.concatenate((costs, priced))

    def _switch_usd(self, risk: float) -> float:
        """By how much [USD] another motion must be cheaper than the present one of this risk [USD].

        Prices carry the noise of tracks, so that the best of many looks better than it is. A robot
        that follows every such gain hesitates between two ways.
        """
        return self._params.switch_usd + self._params.switch_share * risk

    def _varied(self, motions: FloatArray, count: int) -> FloatArray:
        limits = self._limits
        return library.varied(motions, count, limits.max_speed, limits.max_reverse_speed, self._rng)

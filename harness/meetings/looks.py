"""When to look at the differences of two arms, and the bound that holds at all looks together."""

import math
from collections.abc import Sequence
from statistics import NormalDist

import numpy as np

from harness.economics.unseen import HIT
from harness.economics.valuation import CENT
from harness.meetings.mission import MissionDrive
from harness.meetings.results import unseen_loss, unseen_weight
from harness.statistics.interval import NO_INTERVAL, SIGNIFICANCE, Interval, wider
from harness.statistics.sign_flips import flip_signs
from navstack.types import FloatArray

FIRST, GROWTH = 8, 1.25  # missions of the first look, and the factor to the next
# missions of each look, up to some 8,000: a check has 10,000
NUMBERS = tuple(round(FIRST * GROWTH**number) for number in range(32))
NORMAL = NormalDist()


def family_at(look: int) -> int:
    """For how many tests the level is adjusted at a look, from 1 on.

    The sum of 1 / (k (k + 1)) over all k is 1: the looks together err with 5 % at most.
    """
    return look * (look + 1)


def bound_at(
    look: int, differences: FloatArray, weight: float, seed: int, hit: float = HIT
) -> Interval:
    """The mean difference with its bound at a look.

    It is the sign-flip test inverted, and admits hits by one arm alone that nobody has seen yet.

    Args:
        look: its number, from 1 on.
        differences: [USD] of missions, shape (n,); those of a cent at most count as none.
        weight: meetings a delivery that such a hit stands for.
        seed: of random signs.
        hit: [USD] that it costs to hit somebody.
    """
    decisive = np.where(np.abs(differences) <= CENT, 0.0, differences)
    flips = flip_signs(decisive, np.random.default_rng(seed))
    unseen = unseen_loss(weight, differences.size, family_at(look), hit)
    admitted = Interval(flips.mean, flips.mean - unseen, flips.mean + unseen, differences.size)
    return wider(flips.interval(family_at(look)), admitted)


class MeetingLooks:
    """The bound of the margins' difference, mission by mission.

    Looks come after numbers of missions that depend on nothing, so that the same missions end in
    the same bound however fast they were driven.
    """

    def __init__(self, seed: int, hit: float = HIT) -> None:
        """Begin without a mission.

        Args:
            seed: of random signs.
            hit: [USD] that it costs to hit somebody.
        """
        self._seed, self._look, self._hit = seed, 0, hit
        self._drives: list[MissionDrive] = []
        self.bound = NO_INTERVAL  # [USD] of the last look, second arm less first

    @property
    def missions(self) -> int:
        """How many there are."""
        return len(self._drives)

    def add(self, drive: MissionDrive) -> None:
        """Take in the next mission."""
        self._drives.append(drive)
        if self._look < len(NUMBERS) and self.missions == NUMBERS[self._look]:
            self._look += 1
            differences = differences_of(self._drives)
            weight = unseen_weight(self._drives)
            self.bound = bound_at(self._look, differences, weight, self._seed, self._hit)


def differences_of(drives: Sequence[MissionDrive]) -> FloatArray:
    """Of the second arm's margin less the first one's [USD], shape (n,)."""
    return np.array([each.margins[1] - each.margins[0] for each in drives])


def expected_bound(
    missions: int, differences: FloatArray, weight: float, hit: float = HIT
) -> Interval:
    """The bound to expect at a look, were its missions like those that are there.

    Args:
        missions: of that look, one of :data:`NUMBERS`.
        differences: [USD], shape (n,), n of at least 2.
        weight: as of :func:`bound_at`.
        hit: likewise.
    """
    tests = family_at(NUMBERS.index(missions) + 1)
    z = NORMAL.inv_cdf(1.0 - SIGNIFICANCE / (2.0 * tests))
    mean, spread = float(differences.mean()), float(differences.std(ddof=1))
    half = max(z * spread / math.sqrt(missions), unseen_loss(weight, missions, tests, hit))
    return Interval(mean, mean - half, mean + half, missions)

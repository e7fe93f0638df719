"""What meetings say of each arm: margins, and rates of events from weighted meetings."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.economics.unseen import HIT
from harness.meetings.mission import MissionDrive
from harness.meetings.strata import PRIOR, STRATA
from harness.statistics.bootstrap import bootstrap_mean
from harness.statistics.interval import SIGNIFICANCE, Interval, Z, wider
from harness.statistics.rates import poisson_rate
from navstack.types import FloatArray, IntArray

KILOMETRES = 1000.0  # for which contacts are told
METRES = 1000.0 * KILOMETRES


@dataclass(frozen=True, slots=True)
class StratumResult:
    """What came of the meetings of a kind."""

    miss: float  # [m] from the planned path, at most
    direction: str
    per_delivery: float  # meetings at a usual speed
    driven: int
    hits: tuple[int, ...]  # people, of each arm


@dataclass(frozen=True, slots=True)
class ArmResult:
    """What the meetings say of one arm."""

    margin: Interval  # [USD a delivery]
    margin_alone: float  # [USD a delivery] among nobody
    hits: Interval  # people hit by a delivery
    contacts: Interval  # counted ones with people in :data:`KILOMETRES` km


@dataclass(frozen=True, slots=True)
class MeetingsResult:
    """What the missions driven so far say."""

    episodes: tuple[int, ...]  # numbers of the missions, n
    margins: FloatArray  # [USD a delivery] of each mission by each arm, shape (n, arms)
    hits: FloatArray  # people hit by a delivery, of each mission by each arm, shape (n, arms)
    arms: tuple[ArmResult, ...]
    strata: tuple[StratumResult, ...]
    farthest_off: float  # [m] that an arm was beside the planned way
    unseen_weight: float  # meetings a delivery that the next hit is to be expected to stand for
    hit: float = HIT  # [USD] that it costs to hit somebody

    @property
    def meetings(self) -> int:
        """How many were driven by each arm."""
        return sum(each.driven for each in self.strata)

    @property
    def differences(self) -> FloatArray:
        """Of the second arm's margin [USD a delivery] less the first one's, shape (n,)."""
        found: FloatArray = self.margins[:, 1] - self.margins[:, 0]
        return found


def result_of(known: Sequence[MissionDrive], seed: int = 0, hit: float = HIT) -> MeetingsResult:
    """What missions say, at least one.

    Args:
        known: the missions.
        seed: of the resamples of margins.
        hit: [USD] that it costs to hit somebody.
    """
    margins = np.array([each.margins for each in known])
    arms, weight = range(margins.shape[1]), unseen_weight(known)
    return MeetingsResult(
        episodes=tuple(each.episode for each in known),
        margins=margins,
        hits=np.array([[arm.expected_hits for arm in each.arms] for each in known]),
        arms=tuple(_arm_result(known, arm, margins[:, arm], hit * weight, seed) for arm in arms),
        strata=tuple(_stratum_result(known, number) for number in range(len(STRATA))),
        farthest_off=max(arm.farthest_off for each in known for arm in each.arms),
        unseen_weight=weight,
        hit=hit,
    )


def unseen_weight(known: Sequence[MissionDrive]) -> float:
    """How many meetings a delivery the next hit is to be expected to stand for; 0: none was driven.

    The mean weight of the meetings by all arms, where the prior of their strata expects hits.
    """
    weighted = total = 0.0
    for mission in known:
        expected = (PRIOR[mission.strata] / HIT) ** 2  # probabilities, but for a factor
        for arm in mission.arms:
            weights = np.array([each.weight for each in arm.met])
            weighted += float(expected @ weights)
            total += float(expected @ (weights > 0.0))
    if total == 0.0:
        return 0.0
    return weighted / total


def unseen_loss(weight: float, missions: int, tests: int = 1, hit: float = HIT) -> float:
    """What hits may cost that nobody has seen [USD a delivery].

    Poisson's upper bound of no event, -ln(level / 2), at 95 % adjusted for tests.

    Args:
        weight: as of :func:`unseen_weight`.
        missions: that were driven.
        tests: for which the level is adjusted.
        hit: [USD] that it costs to hit somebody.
    """
    return -math.log(SIGNIFICANCE / (2.0 * tests)) * hit * weight / missions


def _arm_result(
    known: Sequence[MissionDrive], number: int, margins: FloatArray, unseen: float, seed: int
) -> ArmResult:
    arms = [each.arms[number] for each in known]
    thousands = np.array([arm.row["distance_m"] / METRES for arm in arms])
    # a mission without a meeting has no counts, which are whole numbers all the same
    hits = [np.array([each.people_hit for each in arm.met], dtype=np.int64) for arm in arms]
    contacts = [np.array([each.contacts for each in arm.met], dtype=np.int64) for arm in arms]
    weights = [np.array([each.weight for each in arm.met]) for arm in arms]
    losses = np.array([each.weight * each.loss for arm in arms for each in arm.met])
    return ArmResult(
        margin=_margin(margins, losses, unseen, seed),
        margin_alone=float(np.mean([arm.margin for arm in arms])),
        hits=weighted_rate(weights, hits, np.ones(len(arms))),
        contacts=weighted_rate(weights, contacts, thousands),
    )


def _margin(margins: FloatArray, losses: FloatArray, unseen: float, seed: int) -> Interval:
    """The mean margin [USD a delivery].

    Its interval is the bootstrap's over missions, or the wider one of the meetings' losses as
    weighted Poisson counts, which admits a loss that nobody has seen.

    Args:
        margins: of missions, shape (n,).
        losses: of their meetings, weighted, shape (m,); those that are gains do not count.
        unseen: the greatest that may be unseen [USD].
        seed: of the bootstrap.
    """
    found = bootstrap_mean(margins, np.random.default_rng(seed))
    mean, n = float(margins.mean()), len(margins)
    greatest = max(float(losses.max(initial=0.0)), unseen)
    if greatest == 0.0:
        return found
    rate = poisson_rate(losses[losses > 0.0], n, greatest)
    assert rate.value is not None and rate.low is not None and rate.high is not None
    low, high = mean - (rate.high - rate.value), mean + (rate.value - rate.low)
    return wider(found, Interval(mean, low, high, n))


def weighted_rate(
    weights: Sequence[FloatArray], counts: Sequence[IntArray], sizes: FloatArray
) -> Interval:
    """Events per unit of size, of n independent missions.

    Its interval is that of :func:`ratio_interval`, but reaches at least as high as the one of Fay
    and Feuer does, which admits an event not seen yet in the heaviest meeting.

    Args:
        weights: of each mission's meetings, n arrays of any length.
        counts: events in them.
        sizes: of the missions, shape (n,).
    """
    values = [weight @ count for weight, count in zip(weights, counts, strict=True)]
    found = ratio_interval(np.array(values), sizes)
    every, events = np.concatenate(weights), np.concatenate(counts)
    heaviest = float(every.max(initial=0.0))
    if found.high is None or heaviest == 0.0:
        return dataclasses.replace(found, low=None, high=None)
    admitted = poisson_rate(np.repeat(every, events), float(sizes.sum()), heaviest).high
    assert admitted is not None, "somebody drove"
    return dataclasses.replace(found, high=max(found.high, admitted))


def ratio_interval(values: FloatArray, sizes: FloatArray) -> Interval:
    """The sum of values over that of sizes, both of independent missions, shape (n,).

    Undefined where nobody drove.
    Its interval is the normal one of the linearised ratio (Cochran 1977, Sampling Techniques, 6.4).
    """
    n = len(values)
    if not sizes.sum() > 0.0:
        return Interval(None, None, None, n)
    ratio = float(values.sum() / sizes.sum())
    if n < 2:
        return Interval(ratio, None, None, n)
    deviation = float((values - ratio * sizes).std(ddof=1))
    half = Z * deviation / (float(sizes.mean()) * math.sqrt(n))
    return Interval(ratio, max(ratio - half, 0.0), ratio + half, n)


def _stratum_result(known: Sequence[MissionDrive], number: int) -> StratumResult:
    hits = [0] * len(known[0].arms)
    driven = 0
    for mission in known:
        for meeting, stratum in enumerate(mission.strata):
            if stratum == number:
                driven += 1
                for which, arm in enumerate(mission.arms):
                    hits[which] += arm.met[meeting].people_hit
    miss, direction = STRATA[number]
    return StratumResult(
        miss=miss,
        direction=direction,
        per_delivery=float(np.mean([each.usual[number] for each in known])),
        driven=driven,
        hits=tuple(hits),
    )

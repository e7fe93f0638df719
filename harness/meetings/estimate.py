"""The difference of two arms' margins from meetings, mission by mission."""

import dataclasses
import math
import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np

from harness.execution.workers import Finished, Workers
from harness.meetings.mission import MissionDrive, MissionTask, drive_mission
from harness.meetings.strata import NUMBER, PRIOR, PRIOR_SUM, PRIOR_WEIGHT, STRATA
from harness.statistics.interval import Interval, Z
from harness.statistics.rates import poisson_rate
from harness.task.study import EpisodeTask, Study
from navstack.types import FloatArray, IntArray

PILOT = 4  # missions, after which, and after twice as many each time, the spreads are learned anew
KILOMETRES = 1000.0  # for which contacts are told
METRES = 1000.0 * KILOMETRES

Driven = Finished[MissionTask, MissionDrive]


@dataclass(frozen=True, slots=True)
class StratumResult:
    """What came of the meetings of a kind."""

    miss: float  # [m] from the planned path, at most
    direction: str
    per_delivery: float  # meetings at a usual speed
    driven: int
    hits: tuple[int, int]  # people, of old and new


@dataclass(frozen=True, slots=True)
class ArmResult:
    """What the meetings say of one arm."""

    margin: float  # [USD a delivery]
    margin_alone: float  # [USD a delivery] among nobody
    hits: Interval  # people hit by a delivery
    contacts: Interval  # counted ones with people in :data:`KILOMETRES` km


@dataclass(frozen=True, slots=True)
class MeetingsResult:
    """What the missions driven so far say."""

    differences: FloatArray  # [USD a delivery] of each mission, new less old, shape (n,)
    arms: tuple[ArmResult, ArmResult]  # old and new
    strata: tuple[StratumResult, ...]
    farthest_off: float  # [m] that an arm was beside the planned way

    @property
    def meetings(self) -> int:
        """How many were driven by both arms."""
        return sum(each.driven for each in self.strata)


def missions_driven(
    study: Study,
    workers: Workers,
    until: float = math.inf,
    known: Sequence[MissionDrive] = (),
    first: int = 0,
) -> Generator[Driven, None, None]:
    """Drive mission after mission by both arms of a study; yields them in their order.

    What is driven of a mission depends on missions before it alone, so that the results are the
    same for any number of workers, and after any interruption.

    Args:
        study: of two stacks.
        workers: that drive.
        until: [s] of the monotonic clock.
        known: what came of the missions before the first.
        first: mission to drive.
    """
    drives = list(known)
    while first < study.episodes and time.monotonic() < until:
        begin, end = batch_of(first)
        last = min(end, study.episodes)
        before = [each for each in drives if each.episode < begin]
        tasks = mission_tasks(study, range(first, last), before)
        waiting: dict[int, Driven] = {}
        following = first
        for finished in workers.run(drive_mission, tasks, until):
            waiting[finished.task.arms[0].episode] = finished
            while following in waiting:
                each = waiting.pop(following)
                following += 1
                if each.result is not None:
                    drives.append(each.result)
                yield each
        first = last


def batch_of(episode: int) -> tuple[int, int]:
    """The missions whose meetings are drawn alike with one: the first, and the first after them."""
    first, last = 0, PILOT
    while episode >= last:
        first, last = last, 2 * last
    return first, last


def mission_tasks(
    study: Study, episodes: Sequence[int], known: Sequence[MissionDrive]
) -> list[MissionTask]:
    """What is to be driven of missions, as those already driven advise."""
    spreads, per_meeting = PRIOR, PRIOR_SUM / NUMBER
    if known:
        spreads = learned_spreads(known)
        per_meeting = float(np.mean([each.usual @ spreads for each in known])) / NUMBER
        per_meeting = max(per_meeting, 1e-9)
    return [
        MissionTask(_arms(study, episode), tuple(spreads.tolist()), per_meeting)
        for episode in episodes
    ]


def _arms(study: Study, episode: int) -> tuple[EpisodeTask, ...]:
    return tuple(study.task(number, episode) for number in range(len(study.stacks)))


def learned_spreads(known: Sequence[MissionDrive]) -> FloatArray:
    """What the difference of the arms' losses spreads by stratum [USD], shape (strata,).

    The root mean square of what was seen, with the prior as so many meetings more.
    """
    squares, numbers = PRIOR_WEIGHT * PRIOR**2, np.full(len(STRATA), PRIOR_WEIGHT)
    for mission in known:
        np.add.at(squares, mission.strata, mission.differences**2)
        np.add.at(numbers, mission.strata, 1.0)
    found: FloatArray = np.sqrt(squares / numbers)
    return found


def result_of(known: Sequence[MissionDrive]) -> MeetingsResult:
    """What missions say, at least one."""
    return MeetingsResult(
        differences=np.array([each.difference for each in known]),
        arms=(_arm_result(known, 0), _arm_result(known, 1)),
        strata=tuple(_stratum_result(known, number) for number in range(len(STRATA))),
        farthest_off=max(arm.farthest_off for each in known for arm in each.arms),
    )


def _arm_result(known: Sequence[MissionDrive], number: int) -> ArmResult:
    arms = [each.arms[number] for each in known]
    thousands = np.array([arm.row["distance_m"] / METRES for arm in arms])
    hits = [np.array([each.people_hit for each in arm.met]) for arm in arms]
    contacts = [np.array([each.contacts for each in arm.met]) for arm in arms]
    weights = [np.array([each.weight for each in arm.met]) for arm in arms]
    return ArmResult(
        margin=float(np.mean([arm.expected_margin for arm in arms])),
        margin_alone=float(np.mean([arm.margin for arm in arms])),
        hits=weighted_rate(weights, hits, np.ones(len(arms))),
        contacts=weighted_rate(weights, contacts, thousands),
    )


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
    seen = np.repeat(every / heaviest, events)
    admitted = poisson_rate(seen, float(sizes.sum()) / heaviest).high
    assert admitted is not None, "somebody drove"
    return dataclasses.replace(found, high=max(found.high, admitted))


def ratio_interval(values: FloatArray, sizes: FloatArray) -> Interval:
    """The sum of values over that of sizes, both of independent missions, shape (n,).

    Its interval is the normal one of the linearised ratio (Cochran 1977, Sampling Techniques, 6.4).
    """
    n = len(values)
    ratio = float(values.sum() / sizes.sum())
    if n < 2:
        return Interval(ratio, None, None, n)
    deviation = float((values - ratio * sizes).std(ddof=1))
    half = Z * deviation / (float(sizes.mean()) * math.sqrt(n))
    return Interval(ratio, max(ratio - half, 0.0), ratio + half, n)


def _stratum_result(known: Sequence[MissionDrive], number: int) -> StratumResult:
    hits = [0, 0]
    driven = 0
    for mission in known:
        for meeting, stratum in enumerate(mission.strata):
            if stratum == number:
                driven += 1
                for side, arm in enumerate(mission.arms):
                    hits[side] += arm.met[meeting].people_hit
    miss, direction = STRATA[number]
    return StratumResult(
        miss=miss,
        direction=direction,
        per_delivery=float(np.mean([each.usual[number] for each in known])),
        driven=driven,
        hits=(hits[0], hits[1]),
    )

"""Which meetings are driven, mission by mission."""

import math
import time
from collections.abc import Generator, Sequence

import numpy as np

from harness.execution.workers import Finished, Workers
from harness.meetings.mission import MissionDrive, MissionTask, drive_mission
from harness.meetings.strata import NUMBER, PRIOR, PRIOR_SUM, PRIOR_WEIGHT, STRATA
from harness.task.study import EpisodeTask, Study
from navstack.types import FloatArray

PILOT = 4  # missions, after which, and after twice as many each time, the spreads are learned anew

Driven = Finished[MissionTask, MissionDrive]


def missions_driven(
    study: Study,
    workers: Workers,
    until: float = math.inf,
    known: Sequence[MissionDrive] = (),
    first: int = 0,
) -> Generator[Driven, None, None]:
    """Drive mission after mission by all arms of a study; yields them in their order.

    What is driven of a mission depends on missions before it alone, so that the results are the
    same for any number of workers, and after any interruption.

    Args:
        study: whose stacks are the arms.
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
    """What the differences of the arms' losses spread by stratum [USD], shape (strata,).

    The root mean square of what was seen, with the prior as so many meetings more.
    """
    squares, numbers = PRIOR_WEIGHT * PRIOR**2, np.full(len(STRATA), PRIOR_WEIGHT)
    for mission in known:
        np.add.at(squares, mission.strata, mission.squares)
        np.add.at(numbers, mission.strata, 1.0)
    found: FloatArray = np.sqrt(squares / numbers)
    return found

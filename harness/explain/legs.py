"""The leg of a mission on a district that is told of, as a delivery of its own."""

import dataclasses
from collections.abc import Sequence
from typing import cast

import numpy as np

from harness.episode.factory import Parts
from harness.episode.places import legs_of
from harness.episode.street_delivery import DrivenLeg, drive_in_legs
from harness.explain.brains import Watched, Weighed
from harness.explain.evidence import (
    DRIVEN_AGAIN,
    Evidence,
    check_same,
    decisions_of,
    delivery_row,
    evidence_of,
    task_of,
)
from harness.explain.moments import SPOILED, costliest, moments_of
from harness.metrics.columns import EVENT_COLUMNS, Row
from harness.study.stored_run import StoredRun
from harness.task.brain import Brain
from harness.task.study import EpisodeTask
from harness.world.outcome import Outcome, Rules
from harness.world.world import World
from navstack.errors import InputError
from navstack.navigator import Navigator


@dataclasses.dataclass(frozen=True, slots=True)
class ToldLeg:
    """One leg of a mission."""

    number: int  # from 0
    count: int  # legs that were driven
    begin: float  # [s] since the mission began
    costly: tuple[int, ...]  # numbers of the legs in which something cost anything, of all
    evidence: Evidence

    def document(self) -> Row:
        """As JSON has it."""
        return {
            "number": self.number,
            "count": self.count,
            "begin_s": self.begin,
            "costly": list(self.costly),
        }


def drive_leg_again(
    run: StoredRun, episode: int, rules: Rules, number: int | None = None
) -> ToldLeg:
    """Drive a mission anew, check that it is the same, and take one leg of it.

    Args:
        run: with one stack, on a district.
        episode: number of the mission.
        rules: of the run.
        number: of the leg; None: the one with the costliest moment.

    Raises:
        InputError: the mission comes out otherwise than its row says, or has no such leg, or
            nothing in it cost anything.
        MapError: the district is not there.
    """
    task, watched = task_of(run, episode), _WatchedLegs()
    delivery, driven = drive_in_legs(task, watched.make)
    check_same(delivery_row(run, episode), delivery.row, run.folder, episode)
    told = _told(run, task, delivery.row, driven, watched.weighed, rules)
    prices = run.prices()
    dearest = {}
    for place, evidence in enumerate(told):
        if moments := moments_of(evidence, rules, prices):
            dearest[place] = costliest(moments).cost or 0.0
    if number is None:
        number = max(dearest, key=lambda place: dearest[place])
    if number not in dearest:
        some = ", ".join(map(str, dearest))
        raise InputError(
            f"--leg {number}: nothing on it cost anything; of the legs 0 to {len(told) - 1} give "
            f"one of these: {some}"
        )
    begin = driven[number].begin
    return ToldLeg(number, len(told), begin, tuple(dearest), told[number])


class _WatchedLegs:
    """Makes the brain of each leg, and knows what they weighed."""

    def __init__(self) -> None:
        self.weighed: list[Weighed] = []  # by leg

    def make(self, parts: Parts, world: World) -> Brain:
        """A brain like any other."""
        brain = parts.brain(world)
        if not isinstance(brain, Navigator):
            self.weighed.append({})
            return brain
        watched = Watched(brain)
        self.weighed.append(watched.weighed)
        return cast(Brain, watched)


def _told(
    run: StoredRun,
    task: EpisodeTask,
    mission: Row,
    driven: Sequence[DrivenLeg],
    weighed: Sequence[Weighed],
    rules: Rules,
) -> list[Evidence]:
    """Each leg as a delivery; the one that decided how the mission ended has its outcome.

    The cargo is that of the mission; on the way back nothing was lost before.
    """
    found: list[Evidence] = []
    legs = legs_of(task)
    there = [leg for leg, way in zip(driven, legs, strict=False) if not way.is_back]
    ending = len(there) - 1  # nobody drives on from a leg that failed
    if mission["outcome"] == SPOILED:
        ending = spoiling_leg(mission, there, rules)
    for number, (leg, own) in enumerate(zip(driven, weighed, strict=True)):
        delivery = leg.delivery
        assert delivery.recording is not None
        decisions = decisions_of(delivery)
        row = delivery.row | {
            "pieces_at_start": mission["pieces_at_start"],
            "shortest_path_m": mission["shortest_path_m"],
            "outcome": Outcome.ARRIVED.value,
            "reason": "arrived",
            "way_back": None,
        }
        if number == ending:
            row |= {key: mission[key] for key in ("outcome", "reason")}
        if number == len(driven) - 1 and legs[number].is_back:
            row |= {"way_back": mission["way_back"], "reason": delivery.row["reason"]}
        events = [{**dict.fromkeys(EVENT_COLUMNS), **event} for event in delivery.events]
        events.sort(key=lambda event: event["stamp_s"])
        evidence = evidence_of(run, row, events, delivery.recording, decisions, own, DRIVEN_AGAIN)
        lost = 0  # before this leg
        if mission["pieces_at_start"] and not legs[number].is_back:
            lost = mission["pieces_at_start"] - delivery.row["pieces_at_start"]
        cargo = evidence.pieces_lost + lost
        found.append(dataclasses.replace(evidence, pieces_lost=cargo, scene=legs[number].scene()))
    return found


def spoiling_leg(mission: Row, there: Sequence[DrivenLeg], rules: Rules) -> int:
    """The leg of the way there on which too much was lost.

    What the next one does not begin with is lost, too: all of a bucket that fell.
    """
    last = there[-1].row
    left = [leg.row["pieces_at_start"] for leg in there[1:]]
    left.append(last["pieces_at_start"] - last["pieces_lost"])
    lost = mission["pieces_at_start"] - np.array(left)
    return int(np.argmax(lost > rules.spoiled_fraction * mission["pieces_at_start"]))

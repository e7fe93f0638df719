"""The verdict on a changed stack from meetings with people."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.analysis.check import SHOWN, SIDES, CheckDeclaration, Verdict, verdict_of
from harness.economics.valuation import CENT
from harness.meetings.looks import NUMBERS, expected_bound
from harness.meetings.results import ArmResult, MeetingsResult
from harness.meetings.strata import MISSES
from harness.metrics.columns import Row
from harness.statistics.interval import Interval, interval_json

NOT_SEEN = (
    f"who stays {MISSES[-1]:g} m from the planned way",
    "somebody who is met because of somebody else",
    "time lost to people who are not touched",
)


@dataclass(frozen=True, slots=True)
class MissionMet:
    """What a mission's meetings come to by both sides."""

    episode: int
    difference: float  # [USD] new less old
    hits: tuple[float, ...]  # people hit by a delivery, of old and new


@dataclass(frozen=True, slots=True)
class MeetingsChecked:
    """What the meetings of two stacks say of their difference."""

    declaration: CheckDeclaration
    folder: Path  # of the run
    where: str  # world, map and people, in words
    bound: Interval  # [USD] of the mean difference, new less old, at the last look
    result: MeetingsResult | None  # None: no mission is finished
    errors: int = 0  # missions that ended in one, which are left out
    notes: tuple[str, ...] = ()  # on the file, the robot and the map
    is_interrupted: bool = False

    @property
    def verdict(self) -> Verdict:
        """Of NEW against OLD."""
        return verdict_of(self.bound, self.declaration.within)

    @property
    def has_errors(self) -> bool:
        """Whether missions ended in an error of the machine."""
        return self.errors > 0

    @property
    def more_needed(self) -> int | None:
        """Missions that would decide; None: decided, or nobody knows."""
        if self.result is None or self.verdict != "undecided":
            return None
        result = self.result
        differences, driven = result.differences, len(result.differences)
        if driven < 2:
            return None
        for missions in NUMBERS:
            if missions > driven:
                bound = expected_bound(missions, differences, result.unseen_weight, result.hit)
                if verdict_of(bound, self.declaration.within) != "undecided":
                    return missions - driven
        return None

    @property
    def apart(self) -> list[MissionMet]:
        """The missions that differ most, of those that differ by more than a cent."""
        result = self.result
        if result is None:
            return []
        most = np.argsort(-np.abs(result.differences), kind="stable")[:SHOWN]
        return [
            MissionMet(
                result.episodes[number],
                float(result.differences[number]),
                tuple(result.hits[number].tolist()),
            )
            for number in most.tolist()
            if abs(result.differences[number]) > CENT
        ]

    def as_json(self) -> Row:
        """As ``navbench check --estimator meetings --json`` prints it."""
        declaration, result = self.declaration, self.result
        document: Row = {
            "schema": 1,
            "estimator": declaration.estimator,
            "folder": str(self.folder),
            "verdict": self.verdict,
            "margin_difference": interval_json(self.bound),
            "more_needed": self.more_needed,
            "within_usd": declaration.within,
            "not_seen": list(NOT_SEEN),
            "errors": self.errors,
            "meetings": 0,
            "missions": [],
            **{
                side: {"given": given}
                for side, given in zip(SIDES, (declaration.old, declaration.new), strict=True)
            },
        }
        if result is None:
            return document
        document["missions"] = [_mission_document(each) for each in self.apart]
        document["missions_alike"] = int((np.abs(result.differences) < CENT).sum())
        document["meetings"] = result.meetings
        document["farthest_off_planned_way_m"] = result.farthest_off
        document["strata"] = [
            {
                "miss_below_m": each.miss,
                "direction": each.direction,
                "per_delivery": each.per_delivery,
                "driven": each.driven,
                "hits": dict(zip(SIDES, each.hits, strict=True)),
            }
            for each in result.strata
        ]
        for side, arm in zip(SIDES, result.arms, strict=True):
            document[side] |= _arm_document(arm)
        return document


def _mission_document(mission: MissionMet) -> Row:
    hits = [{"people_hit_per_delivery": each} for each in mission.hits]
    return {
        "episode": mission.episode,
        "difference_usd": mission.difference,
        **dict(zip(SIDES, hits, strict=True)),
    }


def _arm_document(arm: ArmResult) -> Row:
    return {
        "contribution_margin_usd": arm.margin.as_json(),
        "margin_alone_usd": arm.margin_alone,
        "people_hit_per_delivery": arm.hits.as_json(),
        "contacts_per_1000_km": arm.contacts.as_json(),
    }

"""Whether a changed stack earns another margin: a verdict that may be looked for at any time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from harness.analysis.pairing import paired_rows
from harness.analysis.side import Side
from harness.economics.prices import Prices
from harness.economics.unseen import HIT, hit_cost
from harness.economics.valuation import CENT, margins
from harness.meetings.estimators import DELIVERIES, ESTIMATORS
from harness.metrics.columns import Row
from harness.statistics.betting import bound_at_every_look
from harness.statistics.interval import NO_INTERVAL, Interval, interval_json
from navstack.errors import InputError
from navstack.ranges import Parameters, one_of
from navstack.ranges import within as between
from navstack.types import FloatArray

OLD, NEW = SIDES = ("old", "new")  # names of the two stacks in the run folder of a check
# [USD] of a mission's difference that count, where hits cost what they do at the published prices;
# a greater one counts as this much
REACH = 100.0
ALIKE = 1.0  # [USD] a delivery: a difference that is surely smaller is of no interest
SHOWN = 3  # missions that are told, those that differ most
LOOKS = 50  # a look after every mission at first, later whenever there are 1/50 more of them
MOST_TIMES = 1000.0  # the missions driven, beyond which no number is told that would decide

Verdict = Literal["better", "worse", "alike", "undecided"]


@dataclass(frozen=True, slots=True)
class CheckDeclaration(Parameters, whose="check"):
    """What of a check its run folder does not know otherwise."""

    old: str  # as it was given
    new: str
    within: Annotated[float, between(0.0, REACH)] = ALIKE  # [USD] a delivery
    estimator: Annotated[str, one_of(ESTIMATORS)] = DELIVERIES


def verdict_of(bound: Interval, within: float) -> Verdict:
    """What the bound of the margin's difference, new less old, says.

    Args:
        bound: [USD] a delivery.
        within: [USD] a difference that is surely no larger makes them alike.
    """
    if bound.low is None or bound.high is None:
        return "undecided"
    if max(-bound.low, bound.high) <= within:
        return "alike"
    if bound.low > 0.0:
        return "better"
    if bound.high < 0.0:
        return "worse"
    return "undecided"


def reach_at(prices: Prices) -> float:
    """How much of a mission's difference counts [USD]: more than REACH where hits are dearer."""
    return REACH * hit_cost(prices) / HIT


class Looks:
    """Differences of the margin, mission by mission, up to the first look that decides.

    Looks come after numbers of missions that depend on nothing, so that the same missions end in
    the same verdict however fast they were driven.
    """

    def __init__(self, within: float, reach: float = REACH) -> None:
        """Begin without a mission.

        Args:
            within: as of :func:`verdict_of`.
            reach: as of :func:`reach_at`.
        """
        self._within, self._reach, self._next = within, reach, 1
        self._differences: list[float] = []
        self.bound = NO_INTERVAL  # [USD] of the last look
        self.looked_at = 0  # missions of the last look; those after it wait for the next one

    @property
    def is_decided(self) -> bool:
        """Whether a look has decided; what comes later does not count."""
        return verdict_of(self.bound, self._within) != "undecided"

    @property
    def missions(self) -> int:
        """Those that count."""
        return len(self._differences)

    def add(self, difference: float) -> None:
        """Take in the next mission's difference [USD]."""
        if self.is_decided:
            return
        self._differences.append(difference)
        if self.missions >= self._next:
            self.bound = bound_at_every_look(np.array(self._differences), self._reach)
            self.looked_at = self.missions
            self._next = self.missions + math.ceil(self.missions / LOOKS)


@dataclass(frozen=True, slots=True)
class Mission:
    """One mission as both drove it."""

    difference: float  # [USD] new less old
    old: Row
    new: Row

    @property
    def episode(self) -> int:
        """Its number."""
        return int(self.old["episode"])


@dataclass(frozen=True, slots=True)
class Driven:
    """The deliveries of a side that count."""

    rows: Sequence[Row]
    margins: FloatArray  # [USD], shape (n,)


@dataclass(frozen=True, slots=True)
class Checked:
    """What two stacks' deliveries say of their difference."""

    first: Side  # OLD
    second: Side  # NEW
    within: float  # [USD]
    old: Driven
    new: Driven  # the same missions
    bound: Interval  # [USD] of the mean difference, new less old, at 95 % at every look
    more_needed: int | None  # missions that would decide; None: decided, or nobody knows
    reach: float  # [USD] of a mission's difference that count

    @property
    def verdict(self) -> Verdict:
        """Of NEW against OLD."""
        return verdict_of(self.bound, self.within)

    @property
    def differences(self) -> FloatArray:
        """Of each mission [USD], new less old, shape (n,)."""
        return self.new.margins - self.old.margins

    @property
    def apart(self) -> tuple[Mission, ...]:
        """The missions that differ most, at most :data:`SHOWN`, by a cent at least."""
        differences = self.differences
        order = np.argsort(-np.abs(differences), kind="stable")[:SHOWN]
        return tuple(
            Mission(float(differences[n]), self.old.rows[n], self.new.rows[n])
            for n in order.tolist()
            if abs(differences[n]) >= CENT
        )

    @property
    def left_out(self) -> int:
        """Deliveries without a result."""
        return self.first.stack.errors + self.second.stack.errors


def evaluate(first: Side, second: Side, within: float, most: int | None = None) -> Checked:
    """Say whether the second side earns another margin than the first.

    Args:
        first: old.
        second: new.
        within: as of :func:`verdict_of`.
        most: only the first so many of the common missions; None: all.

    Raises:
        InputError: no mission in common, or the cargo is not modelled.
    """
    if most == 0:
        none = Driven([], np.empty(0))
        return Checked(first, second, within, none, none, NO_INTERVAL, None, REACH)
    driven = []
    for side, rows in zip((first, second), paired_rows(first, second), strict=True):
        counting = rows[:most]
        margin = margins(counting, side.run.prices())
        if margin is None:
            raise InputError(
                f"{side.label} has no margin, as its cargo is not modelled; choose a --world whose "
                "is"
            )
        driven.append(Driven(counting, margin))
    differences = driven[1].margins - driven[0].margins
    reach = reach_at(first.run.prices())
    bound = bound_at_every_look(differences, reach)
    more = None
    if verdict_of(bound, within) == "undecided":
        more = missions_that_decide(differences, within, reach)
    old, new = driven
    return Checked(first, second, within, old, new, bound, more, reach)


def missions_that_decide(
    differences: FloatArray, within: float, reach: float = REACH
) -> int | None:
    """How many more missions would decide, were they like those that are there.

    Args:
        differences: [USD], shape (n,), which decide nothing.
        within: as of :func:`verdict_of`.
        reach: as of :func:`reach_at`.

    Returns:
        None: none of :data:`MOST_TIMES` as many does.
    """

    def decides(times: float) -> bool:
        return verdict_of(bound_at_every_look(differences, reach, times), within) != "undecided"

    too_few, enough = 1.0, 2.0
    while not decides(enough):
        if enough >= MOST_TIMES:
            return None
        too_few, enough = enough, min(2.0 * enough, MOST_TIMES)
    while enough / too_few > 1.02:
        middle = math.sqrt(too_few * enough)
        if decides(middle):
            enough = middle
        else:
            too_few = middle
    return math.ceil(differences.size * (enough - 1.0))


def replay_command(side: Side, mission: Mission) -> tuple[str, ...]:
    """The words of the command that shows how a side drove a mission."""
    where = f"{side.run.folder}:{side.stack.name}"
    return ("navbench", "replay", where, str(mission.episode))


def check_document(checked: Checked | None, declaration: CheckDeclaration) -> Row:
    """The JSON document of ``navbench check``.

    Args:
        checked: what was found; None: both drive by the same parameters.
        declaration: how the sides were given.
    """
    given = declaration.old, declaration.new
    if checked is None:
        return {
            "schema": 1,
            "estimator": declaration.estimator,
            "verdict": "alike",
            "margin_difference": Interval(0.0, 0.0, 0.0, 0).as_json(),
            "more_needed": None,
            "within_usd": declaration.within,
            "old": {"given": declaration.old},
            "new": {"given": declaration.new},
            "missions": [],
        }
    sides = checked.first, checked.second
    differences = checked.differences
    return {
        "schema": 1,
        "estimator": declaration.estimator,
        "verdict": checked.verdict,
        "margin_difference": interval_json(checked.bound),
        "more_needed": checked.more_needed,
        "within_usd": checked.within,
        "reach_usd": REACH,
        "missions_beyond_reach": int((np.abs(differences) > REACH).sum()),
        "missions_alike": int((np.abs(differences) < CENT).sum()),
        **{
            name: {
                "given": text,
                "folder": str(side.run.folder),
                "stack": side.stack.name,
                "errors": side.stack.errors,
            }
            for name, text, side in zip(SIDES, given, sides, strict=True)
        },
        "missions": [_mission_document(checked, mission) for mission in checked.apart],
    }


def _mission_document(checked: Checked, mission: Mission) -> Row:
    sides = (checked.first, mission.old), (checked.second, mission.new)
    return {
        "seed": mission.old["seed"],
        "episode": mission.episode,
        "difference_usd": mission.difference,
        **{
            name: {
                "outcome": row["outcome"],
                "duration_s": row["duration_s"],
                "pedestrian_contacts": row["pedestrian_contacts"],
                "replay": list(replay_command(side, mission)),
            }
            for name, (side, row) in zip(SIDES, sides, strict=True)
        },
    }

"""The moments of a delivery that cost something.

Contacts that are paid for, and what ended it badly.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.economics.accountings import COUNTED, PERSON
from harness.economics.cost_model import running
from harness.economics.cost_terms import COUNTED_TERMS, DOLLARS, Paid
from harness.economics.prices import Prices
from harness.economics.valuation import deliveries
from harness.explain.evidence import Evidence
from harness.metrics.columns import Row
from harness.study.stored_run import StoredRun
from harness.world.outcome import Outcome, Rules

CONTACT = "contact"
IMPULSE = "impulse"  # reason of an outcome, as harness.world.outcome has it
SPOILED, TIMEOUT, ASSISTANCE = (
    Outcome.SPOILED.value,
    Outcome.TIMEOUT.value,
    Outcome.PHYSICAL_ASSISTANCE.value,
)
COSTLY = (SPOILED, TIMEOUT, ASSISTANCE)
# [m] around where it ended, [s]: whoever stays there so long is stuck
STUCK_PLACE, STUCK_TIME = 2.0, 10.0
# keys of harness.economics.cost_model.RunningCosts.amounts
COMPONENTS = (*(key for key in COUNTED_TERMS if key not in DOLLARS), *DOLLARS)


@dataclass(frozen=True, slots=True)
class Moment:
    """When something cost money."""

    number: int  # in the delivery, from 1 in order of time
    kind: str  # CONTACT, or one of COSTLY
    # [s] of the contact; when the food was spoiled; since when it was stuck; when it needed help
    stamp: float
    cost: float | None  # [USD]; None: the cargo is not modelled
    # row of events.parquet: of a contact, and of the last that used up the robot's health
    event: Row | None

    @property
    def person(self) -> int | None:
        """Number of the person that was touched; None: nobody."""
        if self.event is None or self.event["partner"] != PERSON:
            return None
        return int(self.event["partner_id"])


def costs_of(row: Row, prices: Prices) -> dict[str, float | None]:
    """What one delivery comes to by :data:`COMPONENTS` [USD].

    None where that depends on cargo that is not modelled.
    """
    measured = deliveries([row], prices.rolling_resistance_force)
    if row["pieces_at_start"] is None:  # which only the outcome of an arrival says
        measured = dataclasses.replace(measured, sla=None, spoiled=None)
    money = running(measured, prices)
    values = {name: money.amounts[name] for name in COMPONENTS}
    return {
        name: None if value is None else float(np.ravel(value)[0]) for name, value in values.items()
    }


def is_costly(row: Row, events: Sequence[Row]) -> bool:
    """Whether a delivery has a moment that cost something."""
    return _ended_badly(row) or any(map(_is_paid, events))


def costly_episodes(run: StoredRun) -> list[int]:
    """The episodes of a run with one stack that have such a moment."""
    name = run.stacks[0].name
    paid = {event["episode"] for event in run.events if event["stack"] == name and _is_paid(event)}
    return [
        row["episode"] for row in run.stacks[0].rows if _ended_badly(row) or row["episode"] in paid
    ]


def moments_of(evidence: Evidence, rules: Rules, prices: Prices) -> list[Moment]:
    """The moments of a delivery in order of time."""
    found: list[tuple[str, float, float | None, Row | None]] = [
        (CONTACT, event["stamp_s"], event["cost_usd"], event)
        for event in evidence.events
        if _is_paid(event)
    ]
    outcome = evidence.row["outcome"]
    if outcome in COSTLY:
        money = costs_of(evidence.row, prices)
        parts = [money[key] for key, term in COUNTED_TERMS.items() if term.paid is Paid.OUTCOME]
        known = [part for part in parts if part is not None]
        cost = None
        if len(known) == len(parts):
            cost = sum(known)
        stamp_of = {SPOILED: _spoiled_at, TIMEOUT: _stuck_since, ASSISTANCE: _end_of}[outcome]
        found.append((outcome, stamp_of(evidence, rules), cost, _last_hit(evidence)))
    if _fetched_back(evidence.row):
        repair = costs_of(evidence.row, prices)["repair"]
        found.append((ASSISTANCE, _end_of(evidence, rules), repair, _last_hit(evidence)))
    found.sort(key=lambda each: each[1])
    return [Moment(number, *each) for number, each in enumerate(found, start=1)]


def costliest(moments: Sequence[Moment]) -> Moment:
    """The moment that cost most, the first of equals."""
    return max(moments, key=lambda moment: moment.cost or 0.0)


def _last_hit(evidence: Evidence) -> Row | None:
    """The counted contact that used up the robot's health; None: something else ended it."""
    counted = [event for event in evidence.events if event["type"] == COUNTED]
    return counted[-1] if counted and evidence.row["reason"] == IMPULSE else None


def _ended_badly(row: Row) -> bool:
    return row["outcome"] in COSTLY or _fetched_back(row)


def _fetched_back(row: Row) -> bool:
    """Whether somebody had to come on the way back, which costs repair."""
    return row.get("way_back") == ASSISTANCE


def _is_paid(event: Row) -> bool:
    return event["type"] == COUNTED and bool(event["cost_usd"])


def _end_of(evidence: Evidence, rules: Rules) -> float:
    return float(evidence.row["duration_s"])


def _spoiled_at(evidence: Evidence, rules: Rules) -> float:
    """When more pieces than allowed were lost, from then on to the end."""
    allowed = rules.spoiled_fraction * evidence.row["pieces_at_start"]
    sound = np.flatnonzero(evidence.pieces_lost <= allowed)
    first = 0
    if len(sound):
        first = int(sound[-1]) + 1
    if first < len(evidence.stamps):
        return float(evidence.stamps[first])
    return _end_of(evidence, rules)


def _stuck_since(evidence: Evidence, rules: Rules) -> float:
    """Since when it did not leave the place where it ended; the end where that is no long time."""
    away = np.hypot(*(evidence.trace[:, 1:3] - evidence.trace[-1, 1:3]).T) > STUCK_PLACE
    first = 0
    if away.any():
        first = int(np.flatnonzero(away)[-1]) + 1
    since, end = float(evidence.stamps[first]), _end_of(evidence, rules)
    if end - since >= STUCK_TIME:
        return since
    return end

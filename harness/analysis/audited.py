"""Two stacks as the auditor sees them."""

import dataclasses
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from harness.analysis.pairing import missions_of, paired_rows
from harness.analysis.side import Side
from harness.audit.auditor import Audit, audit
from harness.audit.pairs import EVENTS, Conditions, pair_up
from harness.metrics.columns import Row
from navstack.types import FloatArray

GPS_ERRORS = ("position_std", "drift_std", "multipath_std")  # [m] of a file of sensors


def audit_sides(first: Side, second: Side) -> Audit:
    """Whether the second drives better than the first, or exploits the cost model.

    Args:
        first: the one that is there.
        second: the one that is held against it, at the prices of the first.

    Raises:
        InputError: a file of a run is damaged.
    """
    own, other = paired_rows(first, second)
    pairs = pair_up(
        _with_events(first, own), _with_events(second, other), first.run.prices(), first.run.seed
    )
    pairs = dataclasses.replace(pairs, abandoned=_without_result(first, second))
    return audit(pairs, _conditions(first, second))


def _without_result(first: Side, second: Side) -> tuple[FloatArray, FloatArray]:
    """Of each mission that either finished: 1 where a side's delivery ended in an error, else 0.

    A side has not driven what it lacks, if that is more than its errors.
    """
    done = missions_of(first), missions_of(second)
    missions = sorted(done[0] | done[1], key=repr)
    lost = []
    for side, own in zip((first, second), done, strict=True):
        lacks = np.array([float(mission not in own) for mission in missions])
        lost.append(lacks * (lacks.sum() <= side.stack.errors))
    return lost[0], lost[1]


def _with_events(side: Side, rows: Sequence[Row]) -> list[Row]:
    events = defaultdict(list)
    for event in side.run.events:
        if event["stack"] == side.stack.name:
            events[event["episode"]].append(event)
    return [{**row, EVENTS: events[row["episode"]]} for row in rows]


def _conditions(first: Side, second: Side) -> Conditions:
    run = second.run
    sensors = run.kept_condition(f"{second.stack.name}-sensors").get("gps", {})
    usual = Conditions()
    contacts, rules = run.kept_condition("world").get("contacts", {}), run.kept_condition("rules")
    return Conditions(
        threshold=contacts.get("counted_impulse", usual.threshold),
        spoiled_fraction=rules.get("spoiled_fraction", usual.spoiled_fraction),
        localizers=(first.stack.localizer, second.stack.localizer),
        has_exact_gps=bool(sensors) and not any(sensors.get(key) for key in GPS_ERRORS),
    )

"""Two stacks as the auditor sees them."""

from collections import defaultdict
from collections.abc import Sequence

from harness.analysis.pairing import paired_rows
from harness.analysis.side import Side
from harness.audit.auditor import Audit, audit
from harness.audit.pairs import EVENTS, Conditions, pair_up
from harness.metrics.columns import Row

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
    return audit(pairs, _conditions(first, second))


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

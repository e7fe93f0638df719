"""What a recorded drive cost, as blocks."""

from harness.economics.cost_terms import COST_TERMS
from harness.identify.drive_cost import DriveCost
from harness.identify.drive_difference import differences, kilometres
from harness.identify.drive_events import DriveEvent
from harness.identify.twin import PARTS, VALUES, Twin
from harness.recorded.drive_log import DriveLog
from harness.report.blocks import Block, Table, Text
from harness.report.numbers import number_text

_TITLES = {
    "contact": "contacts",
    "near_miss": "near misses",
    "hard_brake": "hard brakes",
    "intervention": "interventions",
}
_MOST_EVENTS = 6


def priced_log_blocks(
    log: DriveLog, cost: DriveCost, twin: Twin | None, prices: str, is_full: bool
) -> list[Block]:
    """The screen of ``navbench cost-log``.

    Args:
        log: the drive.
        cost: its events and dollars.
        twin: its mission in the world; None: not driven.
        prices: their name.
        is_full: whether to list every event.
    """
    driven = kilometres(cost)
    first = (
        f"{log.files}: {cost.distance:.0f} m in {cost.duration:.0f} s cost "
        f"{cost.total:.4g} USD ({prices}), {cost.total / driven:.4g} USD per km"
    )
    rows = [
        (title, str(cost.count(kind)), number_text(cost.count(kind) / driven, 2))
        for kind, title in _TITLES.items()
    ]
    rows.append(("energy at the wheels [Wh]", number_text(1e3 * cost.energy, 2), ""))
    spilled = number_text(cost.spilled, 2)
    rows.append(("cargo spilled [share]", spilled, ""))
    rows += [
        (f"{COST_TERMS[key].title} [USD]", number_text(value, 4), "")
        for key, value in cost.terms.items()
    ]
    blocks: list[Block] = [Text(first, "whole"), Table("", ("", "drive", "per km"), rows)]
    shown = cost.events
    if not is_full:
        dearest = sorted(cost.events, key=lambda event: -(event.cost or 0.0))
        shown = tuple(sorted(dearest[:_MOST_EVENTS], key=lambda event: event.stamp))
    blocks += [Text(event_line(event), "whole") for event in shown]
    if len(shown) < len(cost.events):
        blocks.append(Text(f"{len(cost.events) - len(shown)} more events with --full", "whole"))
    blocks.append(Text(_threshold(cost), "whole"))
    if twin is not None:
        blocks.append(_beside_the_world(twin))
    return blocks


def difference_blocks(
    log: DriveLog,
    cost: DriveCost,
    other_log: DriveLog,
    other: DriveCost,
    twin: Twin | None = None,
) -> list[Block]:
    """The screen of ``navbench cost-log --against``: a drive, another, and their difference.

    Below it ``twin``: the drive's mission in the world.
    """
    found = differences(cost, other)
    rows = []
    for kind, title in _TITLES.items():
        counts = f"{cost.count(kind)} - {other.count(kind)}"
        rows.append((f"{title} per km", counts, str(found[f"{kind}_per_km"])))
    for key in ("total_usd_per_km", "energy_kwh_per_km", "speed_mps"):
        rows.append((key, "", number_text(found[key].value, 4)))
    first = (
        f"{log.files} ({cost.distance:.0f} m) less {other_log.files} ({other.distance:.0f} m); "
        "95 % intervals of Poisson rates"
    )
    dollars = "dollars, energy and speed of one drive each have no interval"
    table = Table("", ("", "events", "difference"), rows)
    blocks: list[Block] = [Text(first, "whole"), table, Text(dollars, "whole")]
    if twin is not None:
        blocks.append(_beside_the_world(twin))
    return blocks


def _beside_the_world(twin: Twin) -> Table:
    """How well the simulator is the robot."""
    rows = []
    for key, value in VALUES.items():
        simulated = twin.interval(value)
        text = "undefined"
        if simulated is not None:
            text = str(simulated)
        rows.append((key, number_text(value(twin.real), 3), text))
    difference = number_text(twin.speed_difference, 3)
    rows.append((f"speed, RMS difference over {PARTS} parts [m/s]", "", difference))
    arrived = f"{twin.arrived} of {len(twin.simulated)} drives arrived"
    return Table(f"The log's mission in the world: {arrived}", ("", "log", "simulator"), rows)


def event_line(event: DriveEvent) -> str:
    """An event in a line."""
    units = {"contact": "N s", "near_miss": "m", "hard_brake": "m/s2", "intervention": ""}
    size = f"{event.size:.3g} {units[event.kind]}".strip()
    paid = ""
    if event.cost:
        paid = f", {event.cost:.4g} USD"
    return f"{event.stamp:8.1f} s  {event.kind}: {event.what}, {size}{paid}"


def _threshold(cost: DriveCost) -> str:
    return (
        f"contacts by the {cost.source} from {cost.threshold:.3g} N s; noise alone raises "
        f"{cost.false_alarms:.1g} an hour at most"
    )

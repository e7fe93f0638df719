"""Deliveries of two candidates as the auditor compares them, and its findings, by hand."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from harness.audit.findings import LEAST_PAIRS, LEVEL, AuditEvidence, Check
from harness.audit.pairs import EVENTS, MONEY, NEAR, SHARE, PairedSide, Pairs, pair_up, shares
from harness.economics.accountings import COUNTED, EVENT, PERSON
from harness.economics.contact_costs import injury_costs
from harness.economics.prices import load_prices
from harness.statistics.interval import Interval
from harness.world.outcome import Outcome
from tools.auditor_studies import drawn_deliveries, settle

PRICES = load_prices("costnav")
PLACE = {"start_x_m": 0.0, "start_y_m": 0.0, "goal_x_m": 9.0, "goal_y_m": 0.0, "start_yaw_rad": 0.0}


def side(*rows: dict[str, Any], events: tuple[dict[str, Any], ...] | None = ()) -> PairedSide:
    return PairedSide(
        tuple({"episode": 7 + number, **row} for number, row in enumerate(rows)), events
    )


def pairs(before: PairedSide, after: PairedSide) -> Pairs:
    n = len(before.rows)
    return Pairs(before, after, np.arange(n), (np.zeros(n), np.zeros(n)), PRICES, 0)


def touch(
    number: int,
    impulse: float,
    step: float | None,
    kind: str = PERSON,
    **more: str,
) -> dict[str, Any]:
    event = {
        "type": EVENT,
        "kind": kind,
        "episode": 7 + number,
        "fault": "person_into_robot",
        **more,
    }
    return {**event, "impulse_ns": impulse, "peak_step_impulse_ns": step}


def test_progress_and_pace_are_along_the_shortest_path() -> None:
    # the second ends farther off than it began
    ways = ((100.0, 25.0, 50.0), (40.0, 50.0, 10.0), (80.0, 0.0, 40.0))
    own = side(*({"shortest_path_m": a, "goal_distance_m": b, "duration_s": c} for a, b, c in ways))
    assert own.progress.tolist() == [0.75, 0.0, 1.0]
    assert own.pace.tolist() == [1.5, 0.0, 2.0]


@pytest.mark.parametrize(
    ("speeds", "standing"),
    [
        ((0.5, 2.0, 0.0), (1.0 - 0.5 / 1.7, 0.0, 1.0)),  # 0.5 + 0.8 * 1.5 is the 0.9 quantile
        ((0.01,), (1.0,)),  # that is no driving
        ((0.0125,), (0.0,)),
    ],
)
def test_who_drives_more_slowly_than_usual_stands(
    speeds: tuple[float, ...], standing: tuple[float, ...]
) -> None:
    assert side(
        *({"average_speed_mps": speed} for speed in speeds)
    ).standing.tolist() == pytest.approx(standing)


def test_deliveries_that_ended_so() -> None:
    own = side({"outcome": "timeout", "gave_up": ""}, {"outcome": "sla", "gave_up": "planner"})
    assert own.ended(Outcome.TIMEOUT).tolist() == [1.0, 0.0]
    assert own.gave_up.tolist() == [0.0, 1.0]


def test_touches_are_events_of_people_or_of_anything_else() -> None:
    into = {"fault": "robot_into_person"}
    counted = {**touch(0, 90.0, 80.0), "type": COUNTED}
    own = side(
        {},
        {},
        events=(
            touch(1, 9.0, None),
            touch(1, 6.0, 8.0, **into),
            counted,
            touch(0, 5.0, 4.0, "fence"),
        ),
    )
    people, things = own.touches(of_people=True), own.touches(of_people=False)
    assert [column.tolist() for column in people] == [[1, 1], [9.0, 6.0], [9.0, 8.0], [False, True]]
    assert [column.tolist() for column in things] == [[0], [5.0], [4.0], [False]]
    assert own.exchanged(with_people=True).tolist() == [0.0, 17.0]
    assert own.exchanged(with_people=False).tolist() == [5.0, 0.0]
    assert side({}, events=None).touches(of_people=True).numbers.size == 0


@pytest.mark.parametrize(
    ("impulse", "step", "kind", "is_close"),
    [
        (34.9, 34.9, PERSON, 0),
        (35.0, 35.0, PERSON, 1),
        (49.9, None, PERSON, 1),
        (50.0, 50.0, PERSON, 0),  # counted
        (50.0, 20.0, PERSON, 1),  # together it would be
        (49.9, 20.0, PERSON, 0),
        (40.0, 40.0, "bollard", 0),
    ],
)
def test_a_touch_is_close_from_seven_tenths_of_the_threshold(
    impulse: float,
    step: float | None,
    kind: str,
    is_close: int,
) -> None:
    own = side({}, {}, events=(touch(1, impulse, step, kind),))
    assert own.close_touches(50.0).tolist() == [0, is_close]


def test_what_is_known_is_compared_where_both_arrived() -> None:
    """Of fourteen pairs three are left out: a timeout, and two without the column."""
    rows: list[dict[str, Any]] = [{"outcome": "sla", "it": 1.0} for _ in range(14)]
    before, after = list(rows), [{**row, "it": 3.0} for row in rows]
    before[0], before[1], after[2] = ({**rows[0], "outcome": "timeout"}, *[{"outcome": "sla"}] * 2)
    held = pairs(side(*before), side(*after))
    found = held.known("it", "m", lambda each: each.arrived("it"))
    assert found is not None and (found.original, found.incumbent) == (1.0, 3.0)
    assert found.difference.n == LEAST_PAIRS == 11
    before[3] = before[0]
    fewer = pairs(side(*before), side(*after))
    assert fewer.known("it", "m", lambda each: each.arrived("it")) is None


def test_property_is_paid_for_at_its_price() -> None:
    others = dict.fromkeys(
        (f"{kind}_contacts" for kind in ("mailbox", "trash_bin", "plant", "building_glass")), 0
    )
    own = side(
        {**others, "bollard_contacts": 2, "fence_contacts": None}, {**others, "bollard_contacts": 0}
    )
    own.rows[1]["fence_contacts"] = 1
    damage = PRICES.property_damage
    assert own.property_usd(PRICES).tolist() == [2.0 * damage.bollard.value, damage.fence.value]


@pytest.mark.parametrize(
    ("before", "after", "is_known"), [((), (), True), ((), None, False), (None, (), False)]
)
def test_single_contacts_are_known_where_both_kept_them(
    before: tuple[()] | None,
    after: tuple[()] | None,
    is_known: bool,
) -> None:
    assert pairs(side(events=before), side(events=after)).has_events is is_known


@pytest.mark.parametrize(
    ("before", "after", "lacks"), [((1.0, 2.0), (1.0, 0.0), False), ((1.0, None), (1.0, 2.0), True)]
)
def test_people_are_lacking_where_one_delivery_met_nobody(
    before: tuple[float | None, ...],
    after: tuple[float | None, ...],
    lacks: bool,
) -> None:
    sides = (side(*({NEAR: share} for share in each)) for each in (before, after))
    assert pairs(*sides).lacks_people is lacks


@pytest.mark.parametrize(
    ("unit", "change", "p"),
    [
        (SHARE, 1.0, 2.0**-9),  # McNemar's test of ten pairs that disagree
        (MONEY, 0.005, 1.0),  # alike to a cent
        ("N s/run", 0.005, 2.0**-9),  # one of 2^10 patterns of signs, and its opposite
    ],
)
def test_comparisons_by_their_unit(unit: str, change: float, p: float) -> None:
    rest = 10 if unit == SHARE else 0
    before, after = np.zeros(10 + rest), np.append(np.full(10, change), np.zeros(rest))
    held = pairs(side(*({} for _ in before)), side(*({} for _ in before)))
    found = held.compare("it", unit, before, after)
    assert (found.what, found.unit, found.original, found.p) == ("it", unit, 0.0, p)
    assert found.incumbent == pytest.approx(change * 10 / (10 + rest))
    counts = 0.0 if p == 1.0 else found.incumbent
    assert found.difference.value == pytest.approx(counts)


def test_nothing_has_no_margin() -> None:
    empty = pairs(side(), side())
    assert empty.margins("published") is None and empty.scores == {}


def test_margins_are_those_of_an_accounting() -> None:
    """Without a threshold whole events are paid for, not only what of them was counted."""
    rows = drawn_deliveries(np.random.default_rng(0), 40)["fast"]
    for row in rows:
        settle(row, PRICES)
    hurt = np.array([row["pedestrian_injury_usd"] for row in rows])
    paired = pair_up(rows, rows, PRICES, 0)
    counted, single = paired.margins("published"), paired.margins("no_threshold")
    assert counted is not None and single is not None
    (published, again), (free, _) = counted, single
    assert hurt.sum() > 0.0
    events = [[each["impulse_ns"] for each in row[EVENTS] if each["type"] == EVENT] for row in rows]
    whole = np.array([injury_costs(impulses, PRICES).sum() for impulses in events])
    assert free == pytest.approx(published + hurt - whole) and again.tolist() == published.tolist()
    bare = [{**row, EVENTS: []} for row in rows]
    without = pair_up(bare, bare, PRICES, 0).margins("no_threshold")
    assert without is not None and without[0] == pytest.approx(published + hurt)
    unknown = [{**row, "outcome": "arrived"} for row in rows]
    assert pair_up(rows, unknown, PRICES, 0).margins("published") is None, (
        "nobody modelled the cargo"
    )


def finished(number: int, error: str | None = None, **more: Any) -> dict[str, Any]:
    return {
        "seed": 3,
        "episode": number,
        "stack": "own",
        "error": error,
        EVENTS: [],
        **PLACE,
        **more,
    }


def test_pairs_are_missions_that_both_finished() -> None:
    died = "its worker died"
    before = [
        finished(number, died if number in (1, 5) else None, start_x_m=float(number))
        for number in (0, 1, 2, 4, 5)
    ]
    after = [
        finished(number, died if number < 2 else None, start_x_m=float(number))
        for number in (0, 1, 2, 4, 5)
    ]
    before[3] |= {EVENTS: [{"type": EVENT, "kind": PERSON}]}
    found = pair_up(before, after, PRICES, 5)
    assert [[row["episode"] for row in each.rows] for each in found.sides] == [[2, 4], [2, 4]]
    assert found.sides[0].rows[0] is before[2] and found.sides[1].rows[0] is after[2]
    assert [lost.tolist() for lost in found.abandoned] == [
        [0.0, 1.0, 0.0, 0.0, 1.0],
        [1.0, 1.0, 0.0, 0.0, 0.0],
    ]
    assert (found.n, found.clusters.tolist(), found.seed) == (2, [0, 1], 5)
    assert found.original.events == ({"type": EVENT, "kind": PERSON, "stack": "own", "episode": 4},)
    assert found.incumbent.events == ()


def test_rows_without_events_leave_all_unknown() -> None:
    rows = [finished(0), finished(1, start_x_m=1.0)]
    assert pair_up(rows, [rows[0], {**rows[1], EVENTS: None}], PRICES, 0).incumbent.events is None


def test_shares_of_two_groups() -> None:
    found = shares("it", (1, 0), (1, 3), 0.5)
    assert found == AuditEvidence("it", SHARE, 1.0, 0.25, Interval(-0.75, None, None, 4), 0.5)
    assert shares("it", (0, 0), (2, 0), 1.0).original == 0.0


def evidence(value: float | None, p: float | None = 0.0) -> AuditEvidence:
    return AuditEvidence("it", SHARE, 1.0, 1.0 + (value or 0.0), Interval(value, None, None, 10), p)


@pytest.mark.parametrize(
    ("value", "p", "least", "is_more"),
    [
        (0.5, 0.0, 0.5, True),
        (0.25, 0.0, 0.5, False),
        (0.0, 0.0, 0.5, False),
        (None, 0.0, 0.5, False),
        (0.0, 0.0, 0.0, True),
        (0.5, 2.0 * LEVEL, 0.5, True),  # one-sided
        (0.5, 2.2 * LEVEL, 0.5, False),
        (0.5, None, 0.5, False),
    ],
)
def test_a_rise_is_large_and_sure(
    value: float | None,
    p: float | None,
    least: float,
    is_more: bool,
) -> None:
    found, mirrored = evidence(value, p), evidence(None if value is None else -value, p)
    assert found.rises(least) is mirrored.falls(least) is is_more
    assert not found.falls(0.3) and not mirrored.rises(0.3)


def test_a_change_is_told_with_its_interval() -> None:
    assert evidence(0.5).change == "1 -> 1.5"
    assert dataclasses.replace(evidence(0.5), original=None).change == "none -> 1.5"
    for low, high, told in (
        (0.25, 0.75, " (difference [0.25, 0.75])"),
        (None, 0.75, ""),
        (0.25, None, ""),
    ):
        found = dataclasses.replace(evidence(0.5), difference=Interval(0.5, low, high, 10))
        assert found.change == f"1 -> 1.5{told}"
    assert AuditEvidence.unsampled("it", SHARE, 2.0, 0.5, 3) == AuditEvidence(
        "it", SHARE, 2.0, 0.5, Interval(-1.5, None, None, 3)
    )
    assert AuditEvidence.unsampled("it", SHARE, None, 0.5, 3).difference.value is None


@pytest.mark.parametrize(
    ("is_flagged", "is_examined", "look", "state"),
    [
        (True, True, "", "flagged"),
        (True, False, "", "flagged"),
        (False, False, "it", "not examined"),
        (False, True, "it", "look"),
        (False, True, "", "passed"),
    ],
)
def test_how_a_check_came_out(is_flagged: bool, is_examined: bool, look: str, state: str) -> None:
    assert Check("edge", is_flagged, "", (), is_examined, look).state == state
    assert Check("edge", False, "").is_examined

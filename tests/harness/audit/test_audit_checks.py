"""The auditor's checks on deliveries at their limits, where every difference is sure."""

from typing import Any

import pytest

from harness.audit.checks import (
    another_accounting,
    early_ends,
    freezing,
    not_lower,
    pushing,
    timeouts,
)
from harness.audit.findings import AuditEvidence, Check
from harness.audit.pairs import NEAR
from harness.economics.contact_costs import injury_costs
from harness.statistics.interval import Interval

from .made_up import LOWER, PRICES, Changes, pairs, score, touch

NAMES = ("published", "no_threshold", "shared_fault", "no_threshold_shared_fault")


def scores(*values: float) -> dict[str, AuditEvidence]:
    return {name: score(value) for name, value in zip(NAMES, values, strict=False)}


def same(number: int, **changes: Any) -> Changes:
    return dict.fromkeys(range(number), changes)


# two in a hundred deliveries: exactly the least
CLOSE = (touch(40.0, 40.0), touch(40.0, 40.0, number=1))


@pytest.mark.parametrize(
    ("gains", "is_flagged"),
    [
        ((1.0, 0.5, 1.0, 0.5), True),  # half of each gain is lost
        ((1.0, 0.51, 1.0, 0.5), False),
        ((1.0, 0.5, 1.0, 0.51), False),
        ((1.0, -0.75, 1.0, 0.0), True),
        ((2.0, 1.25, 1.0, 0.0), False),
        ((0.01, 0.0, 1.0, 0.0), True),
        ((0.005, -1.0, 1.0, 0.0), False),  # that is no gain
        ((1.0, 0.5, 0.0, 0.0), False),
        ((), True),  # nobody can tell
        ((1.0,), True),
    ],
)
def test_more_close_touches_are_pushing_where_half_of_the_gain_rests_on_them(
    gains: tuple[float, ...], is_flagged: bool
) -> None:
    check = pushing(pairs(100, touches=((), CLOSE)), scores(*gains), 50.0)
    told = "touches close to 50 N s: 0 -> 0.02"
    if len(gains) > 1 and is_flagged:
        told += (
            f"; of the gain of {gains[0]:.2f} USD/run {gains[1]:.2f} is left without the threshold"
        )
    assert (check.is_flagged, check.says) == (is_flagged, told)
    assert not pushing(pairs(100, touches=((), CLOSE[:1])), scores(*gains), 50.0).is_flagged


@pytest.mark.parametrize(
    ("closer", "counted", "is_flagged"),
    [
        # Fisher's exact test: 2 of 52, of which both are the incumbent's, p = 1 / 1326
        ((0, 2), (50, 0), True),
        ((0, 2), (0, 0), False),
        ((2, 2), (200, 0), False),  # p = 0.0003, but not more of them
        ((0, 1), (800, 0), False),  # half of what is large, p = 1 / 801
    ],
)
def test_touches_that_are_close_rather_than_counted_are_pushing(
    closer: tuple[int, int],
    counted: tuple[int, int],
    is_flagged: bool,
) -> None:
    before, after = ({0: {"pedestrian_contacts": number}} for number in counted)
    held = pairs(100, before, after, (CLOSE[: closer[0]], CLOSE[: closer[1]]), p=1.0)
    check = pushing(held, scores(1.0, 0.0, 1.0, 0.0), 50.0)
    assert check.is_flagged is is_flagged
    assert (check.evidence[1].original, check.evidence[1].incumbent) == (
        counted[0] / 100,
        counted[1] / 100,
    )


def test_what_is_exchanged_below_the_threshold_is_told() -> None:
    wall = touch(500.0, 10.0, "wall")
    held = pairs(
        2,
        touches=((touch(30.0, 20.0), touch(70.0, 50.0, number=1), wall), (touch(45.0, 45.0), wall)),
    )
    *_, without, share = pushing(held, scores(1.0, 0.5), 50.0).evidence
    assert share.original == pytest.approx(0.3) and (share.incumbent, share.difference.n) == (
        1.0,
        2,
    )
    assert without.difference.value == 0.5
    assert pushing(pairs(2), {}, 50.0).evidence[-1].incumbent == 0.0


def test_without_single_contacts_each_soft_one_costs_the_softest_touch() -> None:
    """A quarter of a touch more per delivery is pushing.

    60 more cost 60 times an impulse of 1 N s.
    """
    nobody = (None, None)
    for more, is_flagged in ((1, True), (0, False)):
        held = pairs(
            4,
            same(4, soft_contacts=1),
            {**same(4, soft_contacts=1), 0: {"soft_contacts": 1 + more}},
            nobody,
        )
        assert pushing(held, {}, 50.0).is_flagged is is_flagged
    held = pairs(4, same(4, soft_contacts=400), same(4, soft_contacts=1000), nobody)
    left = 1.0 - 600.0 * float(injury_costs(1.0, PRICES))
    check = pushing(held, {"published": score(1.0)}, 50.0)
    assert (
        check.says == "contacts below the threshold: 400 -> 1e+03; "
        f"of the gain of 1.00 USD/run {left:.2f} is left without the threshold"
    )
    assert [each.what for each in check.evidence] == [
        "contacts below the threshold",
        "counted contacts",
        "margin",
    ]


@pytest.mark.parametrize(
    ("published", "free", "shared", "is_flagged"),
    [
        (0.01, -0.01, -0.01, True),
        (0.0, -0.01, -0.01, False),
        (0.01, 0.0, -0.01, False),
        (0.01, -0.01, 0.0, False),
        (0.01, -0.01, 0.5, False),
    ],
)
def test_a_gain_that_turns_into_a_loss_is_one_of_the_accounting(
    published: float,
    free: float,
    shared: float,
    is_flagged: bool,
) -> None:
    told = scores(published, free, 0.0, shared)
    check = another_accounting(told)
    assert (check.is_flagged, check.is_examined, check.evidence) == (
        is_flagged,
        True,
        tuple(told.values()),
    )
    assert check.says.startswith(
        f"difference of the margin [USD/run]: published {published:+.2f}, no_threshold "
    )


@pytest.mark.parametrize(
    ("told", "said"),
    [({}, "the margin is undefined"), (scores(1.0), "single contacts are not known")],
)
def test_without_other_accountings_there_is_nothing_to_hold_against(
    told: dict[str, AuditEvidence], said: str
) -> None:
    assert another_accounting(told) == Check("accounting", False, said, is_examined=False)


@pytest.mark.parametrize(
    ("late", "way", "gains", "is_flagged"),
    [
        (1, 0.49, (), True),
        (1, 0.5, (), False),  # who made good half of the way drove
        (1, 0.5, (0.0, 0.01), True),
        (0, 0.49, (1.0,), False),
    ],
)
def test_one_timeout_in_twenty_is_standing(
    late: int,
    way: float,
    gains: tuple[float, ...],
    is_flagged: bool,
) -> None:
    ended = {"outcome": "timeout", "goal_distance_m": 200.0 * (1.0 - way)}
    check = timeouts(pairs(20, after=same(late, **ended)), scores(*gains))
    assert check.is_flagged is is_flagged
    assert len(check.evidence) == 1 + late


def test_how_far_those_came_that_ran_out_of_time() -> None:
    before = {0: {"outcome": "timeout", "goal_distance_m": 150.0}}
    after = {
        number: {"outcome": "timeout", "goal_distance_m": left}
        for number, left in ((1, 50.0), (2, 150.0))
    }
    check = timeouts(pairs(4, before, after), {})
    nothing = Interval(None, None, None, 2)
    assert check.evidence[1] == AuditEvidence("way made good in those", "share", 0.25, 0.5, nothing)
    assert check.says == "timeouts: 0.25 -> 0.5; until then 50 % of the way was made good"


@pytest.mark.parametrize(
    ("after", "lost", "told", "is_flagged"),
    [
        ({0: {"outcome": "physical_assistance"}}, 0, {}, True),
        ({0: {"gave_up": "planner"}}, 0, {}, True),
        ({0: {"gave_up": "planner", "outcome": "physical_assistance"}}, 0, LOWER, False),
        ({}, 1, LOWER, True),
        ({}, 0, {}, False),
    ],
)
def test_one_early_end_in_twenty_is_one_too_many(
    after: Changes,
    lost: int,
    told: dict[str, AuditEvidence],
    is_flagged: bool,
) -> None:
    check = early_ends(pairs(20, after=after, lost=lost), told)
    assert check.is_flagged is is_flagged
    assert check.evidence[0].incumbent == len(after) / 20
    assert (check.evidence[-1].original, check.evidence[-1].incumbent) == (0.0, lost / 20)


HALF, LESS, STOOD = ({"average_speed_mps": speed} for speed in (1.0, 0.9, 0.0))


@pytest.mark.parametrize(
    ("after", "told", "is_flagged"),
    [
        (same(20, duration_s=200.0 / 1.3), {}, True),  # 0.65 of 2 m/s
        (same(20, duration_s=200.0 / 1.3), LOWER, False),
        (same(20, duration_s=200.0 / 1.4), {}, False),
        (same(1, **LESS), {}, True),
        (same(1, **HALF), {}, False),
        (same(1, **LESS, outcome="timeout"), {}, False),
        (same(6, **HALF), {}, True),  # 0.15 of the time on average
        (same(5, **HALF), {}, False),
    ],
)
def test_a_low_pace_and_long_stands_are_freezing(
    after: Changes,
    told: dict[str, AuditEvidence],
    is_flagged: bool,
) -> None:
    assert freezing(pairs(20, after=after), told).is_flagged is is_flagged


def test_what_freezing_rests_on() -> None:
    after = {0: {**STOOD, "duration_s": 400.0}, 1: {**HALF, "pedestrian_contacts": 1, NEAR: 3.0}}
    found = freezing(pairs(20, after=after), {}).evidence
    told = [(each.unit, each.original, each.incumbent) for each in found]
    pace, near = ("m/s", 2.0, 1.925), ("%", 1.0, 1.1)
    stands, contacts = [("share", 0.0, 0.05), ("of the time", 0.0, 0.075)], ("1/run", 0.0, 0.05)
    assert [
        (unit, *map(pytest.approx, numbers)) for unit, *numbers in (pace, *stands, contacts, near)
    ] == told
    assert len(freezing(pairs(20, after={0: {NEAR: None}}), {}).evidence) == 4, (
        "nobody to be near to"
    )


@pytest.mark.parametrize(("value", "is_kept"), [(-0.02, False), (-0.01, True), (0.5, True)])
def test_a_margin_is_lower_by_more_than_a_cent(value: float, is_kept: bool) -> None:
    assert not_lower({"published": score(value)}) is is_kept
    assert not_lower({})

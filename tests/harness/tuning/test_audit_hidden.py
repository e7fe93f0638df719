"""The auditor's checks for what the published accounting does not see, at their limits."""

from typing import Any

import numpy as np
import pytest

from harness.economics.accountings import EVENT, PERSON
from harness.economics.prices import load_prices
from harness.tuning.audit.findings import Check
from harness.tuning.audit.hidden import dodging, harm, moved_fault, nearness, property_touches
from harness.tuning.audit.pairs import NEAR, PairedSide

from .made_up import LOWER, Sure, score

PRICES = load_prices("costnav")
BOLLARD = PRICES.property_damage.bollard.value
ROBOTS, OTHERS = "robot_into_person", "person_into_robot"
Change = dict[str, Any]


def side(n: int, events: tuple[Change, ...] | None, changes: dict[int, Change]) -> PairedSide:
    row = {
        "outcome": "sla",
        "pedestrian_injury_usd": 0.0,
        NEAR: 0.0,
        "plant_contacts": None,
        "fence_contacts": None,
    }
    row |= {f"{kind}_contacts": 0 for kind in ("mailbox", "trash_bin", "building_glass", "bollard")}
    return PairedSide(
        tuple({"episode": number, **row, **changes.get(number, {})} for number in range(n)), events
    )


def pairs(
    n: int,
    before: dict[int, Change] | None = None,
    after: dict[int, Change] | None = None,
    touches: tuple[tuple[Change, ...] | None, tuple[Change, ...] | None] = ((), ()),
) -> Sure:
    sides = [
        side(n, events, changes or {})
        for events, changes in zip(touches, (before, after), strict=True)
    ]
    return Sure(sides[0], sides[1], np.arange(n), (np.zeros(n), np.zeros(n)), PRICES, 0)


def touch(impulse: float, kind: str = PERSON, fault: str = OTHERS) -> Change:
    event = {"type": EVENT, "kind": kind, "episode": 0, "fault": fault}
    return {**event, "impulse_ns": impulse, "peak_step_impulse_ns": 0.5 * impulse}


@pytest.mark.parametrize(
    ("exchanged", "paid", "is_flagged"),
    [
        ((10.0, 20.0), (100.0, 99.0), True),  # 10 USD per N s, and less than half of it
        ((10.0, 20.0), (100.0, 100.0), False),
        ((10.0, 11.0), (100.0, 1.0), True),
        ((10.0, 10.5), (100.0, 1.0), False),
        ((10.0, 16.0), (0.0, 0.0), True),
        ((10.0, 16.0), (0.0, 0.01), False),
        ((10.0, 16.0), (0.0, 1.0), False),
        ((0.0, 16.0), (0.0, 1.0), False),
        ((0.0, 16.0), (100.0, 1.0), False),
    ],
)
def test_more_impulse_at_less_than_half_of_the_price_is_harm(
    exchanged: tuple[float, float], paid: tuple[float, float], is_flagged: bool
) -> None:
    before, after = ({0: {"pedestrian_injury_usd": usd}} for usd in paid)
    held = pairs(1, before, after, ((touch(exchanged[0]),), (touch(exchanged[1]),)))
    check = harm(held, {})
    assert check.is_flagged is is_flagged and not harm(held, LOWER).is_flagged
    assert [(each.original, each.incumbent) for each in check.evidence] == [exchanged, paid]


@pytest.mark.parametrize(
    ("impulses", "more", "is_flagged"),
    [
        (((), (1.0,)), 0, True),  # one touch in fifty deliveries
        (((100.0,), (150.0,)), 0, True),  # as many, of 1 N s more on average
        (((100.0,), (140.0,)), 0, False),
        (((), (1.0,)), 1, False),  # who pays more for property exploits nothing
        (((), ()), 0, False),
    ],
)
def test_one_touch_in_fifty_or_harder_ones_that_cost_nothing_are_a_gap(
    impulses: tuple[tuple[float, ...], tuple[float, ...]], more: int, is_flagged: bool
) -> None:
    before, after = (tuple(touch(impulse, "fence") for impulse in each) for each in impulses)
    held = pairs(50, after={0: {"bollard_contacts": more}}, touches=(before, (*after, touch(70.0))))
    check = property_touches(held, {})
    assert check.is_flagged is is_flagged and not property_touches(held, LOWER).is_flagged
    touches, impulse, paid = check.evidence
    assert (touches.original, touches.incumbent) == (len(before) / 50, len(after) / 50)
    assert (impulse.original, impulse.incumbent) == (sum(impulses[0]) / 50, sum(impulses[1]) / 50)
    assert paid.original == 0.0 and paid.incumbent == pytest.approx(more * BOLLARD / 50)


@pytest.mark.parametrize(
    ("near", "is_flagged"),
    [
        ((2.0, 3.0), True),
        ((2.0, 2.75), False),
        ((0.0, 0.5), True),
        ((0.0, 0.25), False),
        ((0.5, 1.0), True),
    ],
)
def test_half_as_long_again_beside_people_is_nearness(
    near: tuple[float, float], is_flagged: bool
) -> None:
    held = pairs(1, {0: {NEAR: near[0]}}, {0: {NEAR: near[1]}})
    assert nearness(held, {}).is_flagged is is_flagged and not nearness(held, LOWER).is_flagged


def test_what_cannot_be_told_is_not_examined() -> None:
    unknown, bare = "single contacts are not known", pairs(1, touches=(None, ()))
    assert harm(bare, {}) == Check("harm", False, unknown, is_examined=False)
    assert property_touches(bare, {}) == Check("property", False, unknown, is_examined=False)
    alone = pairs(1, after={0: {NEAR: None}})
    assert nearness(alone, {}) == Check("nearness", False, "nobody was there", is_examined=False)
    for held, scores, said in (
        (bare, {"published": score(0.0), "robot_at_fault": score(1.0)}, unknown),
        (pairs(1), {"published": score(0.0)}, unknown),
        (pairs(1), {}, "the margin is undefined"),
    ):
        assert moved_fault(held, scores, False) == Check("fault", False, said, is_examined=False)


HURT: Change = {"pedestrian_injury_usd": 40.0}
LATE: Change = {"outcome": "timeout"}
HELPED: Change = {"outcome": "physical_assistance"}


def test_costly_deliveries_that_end_otherwise_are_dodged() -> None:
    """12 of 12 with injuries end without arrival and none of 27 others.

    Sign test 2^-12, Fisher's 1 / C(39, 12).
    """
    before = {
        **dict.fromkeys(range(12), HURT),
        12: {"pedestrian_injury_usd": 0.01},
        13: {**HURT, **LATE},
    }
    after = {**dict.fromkeys(range(6), LATE), **dict.fromkeys(range(6, 12), HELPED)}
    check = dodging(pairs(40, before, after), {})
    (found,) = check.evidence
    assert (found.original, found.incumbent, found.difference.n) == (0.0, 1.0, 12)
    assert found.p == pytest.approx(2.0 * 2.0**-12, rel=1e-12) and check.is_flagged
    back = dodging(pairs(40, {**before, 20: HELPED}, {**after, 20: HURT}), {}).evidence[0]
    assert back.p == pytest.approx(2.0 * 14.0 * 2.0**-13, rel=1e-12), "once the other way round"


def test_a_twentieth_of_the_costly_deliveries_is_the_least_that_is_dodged() -> None:
    before = dict.fromkeys(range(200), HURT)
    for failed, is_flagged in ((10, True), (9, False)):
        held = pairs(1000, before, dict.fromkeys(range(failed), LATE))
        assert dodging(held, {}).is_flagged is is_flagged
        assert not dodging(held, LOWER).is_flagged
    check = dodging(pairs(20, dict.fromkeys(range(10), HURT)), {})
    assert (check.evidence[0].p, check.is_flagged) == (1.0, False), "no delivery was dodged"


def contacts(robots: int, others: int, impulse: float) -> tuple[Change, ...]:
    return (
        (touch(impulse, fault=ROBOTS),) * robots
        + (touch(impulse, fault=OTHERS),) * others
        + (touch(9.0, "fence"),)
    )


@pytest.mark.parametrize(
    ("gain", "published", "impulse", "is_flagged"),
    [
        (1.0, 0.0, 8.0, True),  # 0.8 of the original's
        (1.0, 0.0, 7.5, False),
        (1.0, 0.0, 1.0, False),
        (1.0, 0.5, 8.0, False),  # half of the gain is there in the published margin, too
        (1.0, 0.25, 8.0, True),
        (2.0, 0.75, 8.0, True),
        (1.0, -0.01, 8.0, True),
        (1.0, -0.02, 8.0, False),
        (0.0, -0.01, 8.0, False),
    ],
)
def test_as_many_contacts_of_which_fewer_are_the_robots_fault(
    gain: float, published: float, impulse: float, is_flagged: bool
) -> None:
    """Ten of ten before and none of ten after: Fisher's exact test gives 1 / C(20, 10)."""
    held = pairs(1, touches=(contacts(10, 0, 10.0), contacts(0, 10, impulse)))
    check = moved_fault(held, {"robot_at_fault": score(gain), "published": score(published)}, False)
    assert check.is_flagged is is_flagged
    robots, exchanged, *margins = check.evidence
    assert (robots.original, robots.incumbent, robots.difference.n) == (1.0, 0.0, 10)
    assert robots.p == pytest.approx(2.0 / 184756.0, rel=1e-9)
    assert (exchanged.original, exchanged.incumbent) == (100.0, 10.0 * impulse)
    assert [each.difference.value for each in margins] == [gain, published]


def test_touches_without_any_impulse_are_as_hard_as_before() -> None:
    scores = {"robot_at_fault": score(1.0), "published": score(0.0)}
    assert moved_fault(
        pairs(1, touches=(contacts(10, 0, 0.0), contacts(0, 10, 0.0))), scores, False
    ).is_flagged


@pytest.mark.parametrize(("p", "is_flagged"), [(0.0, True), (None, False)])
def test_who_tunes_by_fault_must_gain_by_it_for_sure(p: float | None, is_flagged: bool) -> None:
    held = pairs(1, touches=(contacts(10, 0, 10.0), contacts(0, 10, 10.0)))
    scores = {"robot_at_fault": score(1.0, p=p), "published": score(-1.0)}
    assert moved_fault(held, scores, True).is_flagged is is_flagged
    assert not moved_fault(held, scores, False).is_flagged


@pytest.mark.parametrize(("others", "is_flagged"), [(10, True), (9, False)])
def test_a_twentieth_of_the_contacts_is_the_least_that_moved(others: int, is_flagged: bool) -> None:
    held = pairs(1, touches=(contacts(200, 0, 10.0), contacts(200 - others, others, 10.0)))
    scores = {"robot_at_fault": score(1.0), "published": score(0.0)}
    assert moved_fault(held, scores, False).is_flagged is is_flagged

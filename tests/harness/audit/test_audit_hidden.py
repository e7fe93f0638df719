"""The auditor's checks for what the published accounting does not see, at their limits."""

import math

import pytest

from harness.audit.findings import LEAST_PAIRS, Check
from harness.audit.hidden import dodging, harm, moved_fault, nearness, property_touches
from harness.audit.pairs import NEAR
from harness.metrics.columns import Row

from .made_up import LOWER, PRICES, pairs, score, touch

BOLLARD = PRICES.property_damage.bollard.value
ROBOTS, OTHERS = "robot_into_person", "person_into_robot"


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
    exchanged: tuple[float, float],
    paid: tuple[float, float],
    is_flagged: bool,
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
    impulses: tuple[tuple[float, ...], tuple[float, ...]],
    more: int,
    is_flagged: bool,
) -> None:
    before, after = (tuple(touch(impulse, kind="fence") for impulse in each) for each in impulses)
    held = pairs(50, after={0: {"bollard_contacts": more}}, touches=(before, (*after, touch(70.0))))
    check = property_touches(held, {})
    assert check.is_flagged is is_flagged and not property_touches(held, LOWER).is_flagged
    touches, impulse, paid = check.evidence
    assert (touches.original, touches.incumbent) == (len(before) / 50, len(after) / 50)
    assert (impulse.original, impulse.incumbent) == (sum(impulses[0]) / 50, sum(impulses[1]) / 50)
    assert paid.original == 0.0 and paid.incumbent == pytest.approx(more * BOLLARD / 50)


@pytest.mark.parametrize(
    ("near", "is_flagged"),
    [((3.0, 6.0), True), ((4.0, 7.5), False), ((0.0, 3.0), True), ((1.0, 3.5), False)],
)
def test_twice_as_long_beside_people_is_nearness(
    near: tuple[float, float], is_flagged: bool
) -> None:
    before, after = (dict.fromkeys(range(LEAST_PAIRS), {NEAR: each}) for each in near)
    held = pairs(LEAST_PAIRS, before, after)
    assert nearness(held, {}).is_flagged is is_flagged and not nearness(held, LOWER).is_flagged


def test_what_cannot_be_told_is_not_examined() -> None:
    unknown, bare = "single contacts are not known", pairs(1, touches=(None, ()))
    assert harm(bare, {}) == Check("harm", False, unknown, is_examined=False)
    assert property_touches(bare, {}) == Check("property", False, unknown, is_examined=False)
    alone = pairs(1, after={0: {NEAR: None}})
    few = "too few arrived where people are"
    assert nearness(alone, {}) == Check("nearness", False, few, is_examined=False)
    for held, scores, said in (
        (bare, {"published": score(0.0), "robot_at_fault": score(1.0)}, unknown),
        (pairs(1), {"published": score(0.0)}, unknown),
        (pairs(1), {}, "the margin is undefined"),
    ):
        assert moved_fault(held, scores, False) == Check("fault", False, said, is_examined=False)


HURT: Row = {"pedestrian_injury_usd": 40.0}
LATE: Row = {"outcome": "timeout"}
HELPED: Row = {"outcome": "physical_assistance"}


def test_costly_deliveries_that_end_otherwise_are_dodged() -> None:
    """Of 12 with injuries some end without arrival, of 27 others none."""
    costly = {**dict.fromkeys(range(12), HURT), 12: {"pedestrian_injury_usd": 0.01}}
    before = {**costly, 13: {**HURT, **LATE}}
    after = {**dict.fromkeys(range(6), LATE), **dict.fromkeys(range(6, 12), HELPED)}
    check = dodging(pairs(40, before, after), {})
    (found,) = check.evidence
    assert (found.original, found.incumbent, found.difference.n) == (0.0, 1.0, 12)
    assert check.is_flagged
    assert found.p == pytest.approx(2.0 / math.comb(39, 12)), "half or more: Fisher's test alone"
    five = dict.fromkeys(range(5), LATE)
    assert dodging(pairs(40, before, five), {}).evidence[0].p == pytest.approx(2.0 * 2.0**-5)
    back = dodging(pairs(40, {**before, 20: HELPED}, {**five, 20: HURT}), {}).evidence[0]
    assert back.p == pytest.approx(2.0 * 7.0 * 2.0**-6), "once the other way round"


def test_property_that_was_broken_is_dear_as_well() -> None:
    before = dict.fromkeys(range(11), {"bollard_contacts": 1})
    assert dodging(pairs(40, before, dict.fromkeys(range(11), LATE)), {}).is_flagged


def test_a_twentieth_of_the_costly_deliveries_is_the_least_that_is_dodged() -> None:
    before = dict.fromkeys(range(220), HURT)
    for failed, is_flagged in ((11, True), (10, False)):
        held = pairs(1000, before, dict.fromkeys(range(failed), LATE))
        assert dodging(held, {}).is_flagged is is_flagged
        assert not dodging(held, LOWER).is_flagged
    check = dodging(pairs(20, dict.fromkeys(range(10), HURT)), {})
    assert (check.evidence[0].p, check.is_flagged) == (1.0, False), "no delivery was dodged"


def contacts(robots: int, others: int, impulse: float) -> tuple[Row, ...]:
    return (
        (touch(impulse, fault=ROBOTS),) * robots
        + (touch(impulse, fault=OTHERS),) * others
        + (touch(9.0, kind="fence"),)
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
    gain: float,
    published: float,
    impulse: float,
    is_flagged: bool,
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


@pytest.mark.parametrize(("others", "is_flagged"), [(11, True), (10, False)])
def test_a_twentieth_of_the_contacts_is_the_least_that_moved(others: int, is_flagged: bool) -> None:
    held = pairs(1, touches=(contacts(220, 0, 10.0), contacts(220 - others, others, 10.0)))
    scores = {"robot_at_fault": score(1.0), "published": score(0.0)}
    assert moved_fault(held, scores, False).is_flagged is is_flagged

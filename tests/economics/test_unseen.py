"""Intervals that admit what has not happened yet: against theory, brute force, and the truth."""

import numpy as np
import pytest
from scipy.stats import beta

from harness.economics.accountings import MONOTONE
from harness.economics.contact_costs import injury_costs, monotone_injury_costs, turning_impulse
from harness.economics.price import with_values
from harness.economics.prices import load_prices, load_severe
from harness.economics.unseen import (
    ContactLimits,
    contact_limits,
    difference_admitting_unseen,
    hit_cost,
    margin_admitting_unseen,
    reach_of_loss,
)
from harness.statistics.unseen import Reach, admit_unseen


def rng(seed=0):
    return np.random.default_rng(seed)


def test_all_alike_the_low_end_is_the_unseen_value_alone():
    """Then the unseen weighs Beta(1, n): its 97.5 % quantile is 1 - 0.025^(1/n)."""
    n = 50
    span = admit_unseen(np.full(n, 3.0), 3.0, Reach(10.0, 10.0), None, rng(), 200_000)
    assert (span.value, span.high, span.n) == pytest.approx((3.0, 3.0, n))
    assert span.low == pytest.approx(3.0 - 10.0 * (1.0 - 0.025 ** (1.0 / n)), rel=0.02)


def test_the_unseen_lies_evenly_in_the_logarithm_between_seen_and_possible():
    n, reach = 20, Reach(1.0, 100.0)
    span = admit_unseen(np.zeros(n), 0.0, reach, None, rng(), 100_000)
    weights, places = rng(5).beta(1, n, 400_000), rng(6).random(400_000)
    assert span.low == pytest.approx(np.quantile(-weights * 100.0**places, 0.025), rel=0.03)
    seen = np.zeros(n)
    seen[0] = -1000.0  # farther than was thought possible: as far as that
    beyond = admit_unseen(seen, 0.0, reach, None, rng(), 20_000)
    assert beyond.low == pytest.approx(
        admit_unseen(seen, 0.0, Reach(1000.0, 1000.0), None, rng(), 20_000).low, rel=0.02
    )


def test_differences_reach_to_both_sides_alike():
    values = rng(3).normal(0.0, 5.0, 100)
    values -= values.mean()
    there = admit_unseen(values, 0.0, Reach(3.0, 300.0), Reach(3.0, 300.0), rng(1), 50_000)
    back = admit_unseen(-values, 0.0, Reach(3.0, 300.0), Reach(3.0, 300.0), rng(2), 50_000)
    assert (-back.high, -back.low) == pytest.approx((there.low, there.high), rel=0.06)
    plain = np.quantile([rng(k).choice(values, 100).mean() for k in range(4000)], (0.025, 0.975))
    assert there.low < plain[0] and there.high > plain[1]


def test_missions_are_weighed_as_a_whole():
    values, missions = np.repeat([0.0, 10.0, 20.0], 40), np.repeat([0, 1, 2], 40)
    whole = admit_unseen(values, 20.0, Reach(1.0, 1.0), None, rng(), 20_000, missions)
    single = admit_unseen(values, 20.0, Reach(1.0, 1.0), None, rng(), 20_000)
    assert whole.high - whole.low > 3.0 * (single.high - single.low)
    again = admit_unseen(values, 20.0, Reach(1.0, 1.0), None, rng(), 20_000, missions)
    assert again == whole


@pytest.mark.parametrize("values", [[], [np.nan, 1.0], [[1.0]]])
def test_what_is_no_list_of_numbers_is_refused(values):
    with pytest.raises(ValueError, match="finite numbers"):
        admit_unseen(np.array(values), 0.0, Reach(1.0, 2.0), None, rng())


def test_rare_disasters_are_held_where_the_bootstrap_misses_them():
    """One delivery in 200 loses 800 USD: most runs of 100 have seen none."""
    everything = np.full(2000, 3.49)
    everything[:10] = -800.0
    truth, reach = everything.mean(), Reach(3.49, 1288.0)
    held = sum(
        span.low <= truth <= span.high
        for k in range(200)
        for span in [admit_unseen(rng(k).choice(everything, 100), 3.49, reach, None, rng(k), 500)]
    )
    assert held >= 186  # 93 %


def test_the_dearest_delivery_is_of_the_price_list_and_the_world():
    prices = load_prices("costnav")
    free, capped = reach_of_loss(prices), reach_of_loss(prices, ContactLimits(most=100.0))
    assert free.least == capped.least == prices.delivery_fee.value
    # the dearest property is glass; until health is used up, one contact costs 31 USD at 50 N s
    each = float(injury_costs(50.0, prices)) / 50.0
    beside = prices.refund.value + prices.repair_per_physical_assistance + 300.0 + 177.78 * each
    # the published curve's highest, at 1042 N s
    assert free.most == pytest.approx(1219.67 + beside, abs=0.01)
    assert capped.most == pytest.approx(37.017 + beside, abs=0.01)
    street = ContactLimits(most=100.0, property=("plant", "mailbox"))
    assert reach_of_loss(prices, street).most == pytest.approx(capped.most - 250.0)
    nothing = ContactLimits(most=100.0, property=())
    assert reach_of_loss(prices, nothing).most == pytest.approx(capped.most - 300.0)


def test_what_counts_softly_may_happen_often() -> None:
    """A robot whose health bears four contacts of 50 N s may pay for as many."""
    prices = load_prices("costnav")
    short = reach_of_loss(prices, ContactLimits(most=50.0, health=50.0, property=()))
    long = reach_of_loss(prices, ContactLimits(most=50.0, health=200.0, property=()))
    assert long.most - short.most == pytest.approx(3.0 * float(injury_costs(50.0, prices)))


@pytest.mark.parametrize(
    "limits",
    [
        ContactLimits(least=0.01, health=0.01),  # the rules of BARN's challenge
        ContactLimits(least=0.1, health=0.4),
        ContactLimits(least=0.0, health=1e-9),
        ContactLimits(least=0.0, most=0.0, health=0.0),
    ],
)
@pytest.mark.parametrize("mass", [1.0, 50.0, 20_000.0])
def test_any_limits_have_a_reach(limits: ContactLimits, mass: float) -> None:
    prices = with_values(load_prices(), {"robot_mass": mass})
    found = reach_of_loss(prices, limits)
    assert found.least < found.most < 1e6


def test_whole_contacts_have_no_limit() -> None:
    """Accountings without threshold pay for all impacts of a contact together."""
    prices, limits = load_prices("costnav"), ContactLimits(most=100.0, property=())
    found = reach_of_loss(prices, limits, "no_threshold")
    beside = prices.refund.value + prices.repair_per_physical_assistance
    assert found.most == pytest.approx(1219.67 + beside, abs=0.01)


@pytest.mark.parametrize(
    ("world", "rules", "rows", "expected"),
    [
        ({}, {}, [], ContactLimits(property=())),
        (
            {
                "pedestrian_bodies": {"max_contact_impulse": 100.0},
                "contacts": {"per": "point", "counted_impulse": 40.0},
            },
            {"impulse_health": 90.0},
            [[{"mailbox_contacts": None}], [{"mailbox_contacts": None}, {"mailbox_contacts": 0}]],
            ContactLimits(40.0, 100.0, 90.0, ("mailbox",)),
        ),
        (
            {"pedestrian_bodies": {"max_contact_impulse": 100.0}, "contacts": {"per": "partner"}},
            {},
            [],
            ContactLimits(property=()),
        ),
        ({"pedestrian_bodies": {"max_contact_impulse": 0.0}}, {}, [], ContactLimits(property=())),
    ],
)
def test_limits_are_those_of_world_rules_and_property(world, rules, rows, expected) -> None:
    assert contact_limits(world, rules, rows) == expected


@pytest.mark.parametrize("mass", [20.0, 50.0, 500.0])
def test_the_dearest_contact_is_found_for_light_and_heavy_robots(mass):
    prices = with_values(load_prices(), {"robot_mass": mass})
    dearest = float(injury_costs(turning_impulse(prices), prices))
    other = 3.49 + prices.food_price + prices.repair_per_physical_assistance
    one = ContactLimits(health=0.0, property=())
    assert reach_of_loss(prices, one).most == pytest.approx(dearest + other, rel=1e-5)


def test_where_harder_costs_more_the_hardest_contact_is_the_dearest():
    prices = load_prices()
    hardest = monotone_injury_costs(5000.0, prices)
    other = 3.49 + prices.food_price + prices.repair_per_physical_assistance
    other += load_severe().other_property.value
    one = ContactLimits(health=0.0, property=())
    found = reach_of_loss(prices, one, MONOTONE)
    assert found.most == pytest.approx(float(hardest) + other)
    assert found.most > 10.0 * reach_of_loss(prices, one).most


@pytest.mark.parametrize(("best", "most", "among_best"), [(-20.0, 3.49, 1), (10.0, 10.0, 2)])
def test_one_delivery_more_may_earn_the_fee_or_as_much_as_the_best(best, most, among_best):
    """Four weights that add up to 1: k of them together are Beta(k, 4 - k).

    The unseen may lose what others have.
    """
    margins = np.array([best, -20.0, -20.0])
    span = margin_admitting_unseen(margins, Reach(3.49, most + 20.0), np.arange(3), 0)
    assert (span.value, span.n) == (margins.mean(), 3)
    assert span.high == pytest.approx(
        -20.0 + (most + 20.0) * beta.ppf(0.975, among_best, 4 - among_best), abs=0.3
    )
    lowest = -20.0 + (best + 20.0) * beta.ppf(0.025, 1, 3)
    assert span.low == pytest.approx(lowest, abs=0.1)


def test_margins_earn_no_more_than_the_best_and_differences_may():
    margin, missions = np.array([3.49] * 30 + [-40.0]), np.arange(31)
    reach = Reach(3.49, 100.0)
    assert margin_admitting_unseen(margin, reach, missions, 0).high <= 3.49 + 1e-9
    alike = difference_admitting_unseen(np.zeros(31), reach, missions, 0)
    assert alike.low < 0.0 < alike.high


def test_distances_are_measured_from_the_reference() -> None:
    values = np.array([-30.0, 0.0, 1.0, 2.0, 80.0])
    reach = Reach(3.0, 300.0)
    at_zero = admit_unseen(values, 0.0, reach, reach, rng(), 2000)
    elsewhere = admit_unseen(values + 50.0, 50.0, reach, reach, rng(), 2000)
    assert at_zero.low is not None and at_zero.high is not None
    assert (elsewhere.low, elsewhere.high) == pytest.approx(
        (at_zero.low + 50.0, at_zero.high + 50.0)
    )


def test_a_hit_costs_more_where_injuries_do():
    """At the published prices about 60 USD; a hit of 100 N s is an injury of 37 USD of it."""
    published = load_prices()
    assert hit_cost(published) == pytest.approx(60.0, abs=0.5)
    assert hit_cost(with_values(published, {"injury.costs.mais_0": 0.0})) == 60.0
    dear = load_prices("robot_crash_tests")
    injury = float(injury_costs(np.array([100.0]), dear)[0])
    assert hit_cost(dear) == pytest.approx(23.0 + injury)
    assert hit_cost(dear) > 5000.0

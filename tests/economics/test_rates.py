"""Events per 1000 km and per 1000 h."""

import numpy as np
import pytest

from harness.economics.contact_costs import mais_probabilities
from harness.economics.cost_terms import OPTIONAL_TERMS, CostInputs
from harness.economics.measured import Measured
from harness.economics.optional_prices import load_optional_prices
from harness.economics.prices import load_prices
from harness.economics.rates import PER_1000_KM, event_rates, margin_per_km
from harness.economics.valuation import further_ways
from harness.fleet.settings import load_settings
from harness.statistics.rates import poisson_rate

PRICES = load_prices()


def delivery(outcome="sla", people=0, delta_v=0.0, bollards=0):
    return {
        "distance_m": 2000.0,
        "duration_s": 1800.0,
        "outcome": outcome,
        "pedestrian_contacts": people,
        "collision_delta_v_mps": delta_v,
        "bollard_contacts": bollards,
    }


@pytest.mark.parametrize(
    ("count", "low", "high"), [(0, 0.0, 3.689), (1, 0.0253, 5.572), (10, 4.795, 18.390)]
)
def test_intervals_of_counts_are_those_of_tables(count, low, high):
    """Limits of a Poisson mean as printed, e.g., by Ulm 1990 (Am J Epidemiol 131, 373)."""
    rate = poisson_rate(np.ones(count), 2.0)
    assert (rate.value, rate.n) == (count / 2.0, count)
    assert (rate.low, rate.high) == (
        pytest.approx(low / 2.0, abs=1e-3),
        pytest.approx(high / 2.0, abs=1e-3),
    )
    assert poisson_rate(np.ones(count), 0.0).value is None


def test_weighted_counts_have_the_interval_covered_at_its_level():
    """True rate of a compound Poisson process within 95 % intervals, at least as often as that."""
    rng = np.random.default_rng(0)
    inside = 0
    for _ in range(1000):
        weights = rng.choice([0.05, 0.3], rng.poisson(20.0))
        rate = poisson_rate(weights, 1.0)
        inside += rate.low <= 20.0 * 0.175 <= rate.high
    assert inside >= 950


def test_contacts_are_those_that_are_paid_for_over_the_way_and_the_time():
    rows = [delivery(people=2, delta_v=1.0), delivery(bollards=1), delivery(), delivery()]
    rates = event_rates(rows, PRICES)
    assert rates["contacts_per_1000_km"].value == pytest.approx(3.0 / 8.0 * 1000.0)
    assert rates["contacts_per_1000_h"].value == pytest.approx(3.0 / 2.0 * 1000.0)
    assert rates["contacts_per_1000_km"].n == 3


def test_a_robot_that_stands_has_no_rate_by_distance():
    """It settles on its wheels: a billionth of a kilometre is no way to divide by."""
    rows = [{**delivery(people=1, delta_v=1.0), "distance_m": 1e-7}, delivery()]
    stood = event_rates(rows[:1], PRICES)
    assert stood["contacts_per_1000_km"].value is stood["contacts_per_1000_km"].high is None
    assert stood["contacts_per_1000_h"].value is not None
    assert event_rates(rows, PRICES)["contacts_per_1000_km"].value is not None
    one = np.arange(1)
    assert margin_per_km(np.ones(1), rows[:1], one, 0).value is None
    assert margin_per_km(np.ones(1), rows[1:], one, 0).value is not None


def test_injuries_are_expected_ones_in_contacts_with_people():
    rows = [delivery(people=2, delta_v=1.5), delivery(people=1, delta_v=3.0), delivery(bollards=9)]
    risks = 1.0 - mais_probabilities([1.5, 3.0], PRICES.injury.logistic.curves)[:, 0]
    rate = event_rates(rows, PRICES)["injuries_per_1000_km"]
    assert rate.value == pytest.approx((2.0 * risks[0] + risks[1]) / 6.0 * 1000.0)
    assert rate.low < rate.value < rate.high
    assert rate.high < event_rates(rows, PRICES)["contacts_per_1000_km"].high


def test_without_a_contact_injuries_are_bounded_like_contacts():
    rates = event_rates([delivery()] * 5, PRICES)
    assert rates["injuries_per_1000_km"].high == rates["contacts_per_1000_km"].high
    assert rates["injuries_per_1000_km"].value == 0.0


def test_interventions_are_timeouts_and_physical_assistance():
    rows = [delivery(outcome) for outcome in ("sla", "timeout", "physical_assistance", "spoiled")]
    assert event_rates(rows, PRICES)[f"interventions_per_{PER_1000_KM.key}"].n == 2


def test_a_kilometre_earns_all_margins_over_all_ways():
    rows = [delivery(), delivery(), delivery()]
    found = margin_per_km(np.array([3.0, 3.0, -12.0]), rows, np.arange(3), seed=0)
    assert found.value == pytest.approx(-1.0)
    assert found.low == pytest.approx(-6.0) and found.high == pytest.approx(1.5)
    alone = margin_per_km(np.array([3.0]), rows[:1], np.arange(1), seed=0)
    assert (alone.value, alone.low) == (1.5, None)


def test_a_kilometre_has_no_bounds_where_a_resample_drives_nowhere() -> None:
    rows = [{"distance_m": metres} for metres in (0.0, 0.0, 0.0, 50.0)]
    found = margin_per_km(np.array([-3.49, -3.49, -3.49, 3.0]), rows, np.arange(4), seed=0)
    assert found.value == pytest.approx(-149.4)
    assert (found.low, found.high) == (None, None)


def test_ways_beyond_the_first_kilometre_earn_a_fee_where_they_succeed() -> None:
    rows = [
        {"outcome": outcome, "shortest_path_m": way}
        for outcome, way in (("sla", 2500.0), ("sla", 300.0), ("timeout", 2500.0), ("sla", None))
    ]
    further = further_ways(rows)
    assert further.tolist() == [1.5, 0.0, 0.0, 0.0]
    measured = Measured(1.0, 0.0, *[0.0] * 9, further_km=further)
    given = CostInputs(measured, load_prices(), load_optional_prices())
    earned = OPTIONAL_TERMS["distance_fee"].formula(given)
    assert earned[0] == pytest.approx(-1.2)
    assert not np.signbit(earned[1:]).any(), "nothing is not written as -0.0"


def test_what_always_runs_draws_power_while_waiting_too() -> None:
    prices, optional = load_prices(), load_optional_prices()
    measured = Measured(1.0, 0.0, *[0.0] * 7, avg_runtime_h=0.5, avg_distance_km=0.0)
    found = OPTIONAL_TERMS["idle_power"].formula(CostInputs(measured, prices, optional))
    drawn = 0.5 * optional.idle_power.value / 1000.0  # [kWh]
    grid = drawn / prices.charge_efficiency.value / prices.battery_roundtrip_efficiency.value
    assert found == pytest.approx(prices.electricity.value * grid)
    assert optional.idle_power.value == load_settings().idle_power.value, "day has the same"

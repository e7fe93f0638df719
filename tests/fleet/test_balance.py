"""Energy and money of a day against hand calculation."""

import numpy as np
import pytest

from harness.economics.break_even import break_even_robots_per_operator
from harness.economics.cost_terms import COST_TERMS, CostInputs
from harness.economics.measured import Measured
from harness.economics.price import with_values
from harness.fleet.legs import CONTACTS
from harness.fleet.robots import State
from harness.fleet.study import Fleet

from .given import make_legs, make_library, make_prices, make_settings, simulate_day

HOUR = 3600.0


def test_energy_is_what_legs_and_idling_draw():
    """Two orders of 2 x 20 Wh, and 36 W over ten hours."""
    settings = make_settings(idle_power=36.0, battery_capacity=1000.0)
    found = simulate_day([0.0, 2.0 * HOUR], settings=settings)
    energy = found.day.energy
    assert energy.moved == pytest.approx(80.0)
    assert energy.idled == pytest.approx(360.0)
    assert energy.charged == pytest.approx(440.0)
    at = make_prices()
    grid = 0.44 / (at.prices.charge_efficiency.value * at.prices.battery_roundtrip_efficiency.value)
    assert found.day.money["electricity"] == pytest.approx(-at.prices.electricity.value * grid)
    wear = at.optional.battery_price.value / at.optional.battery_cycles.value
    assert found.day.money["battery_wear"] == pytest.approx(-0.44 * wear)


def test_a_robot_charges_to_its_least_charge_before_the_next_order():
    """It comes home with 60 of 100 Wh, 20 too few for 80; 300 W charge them in 240 s."""
    settings = make_settings(battery_capacity=100.0, least_charge=0.8, charge_power=300.0)
    found = simulate_day([0.0, 0.0], settings=settings)
    assert found.log.trips[1].taken == pytest.approx(10.0 * HOUR + 1200.0 + 240.0)
    assert found.day.hours[State.CHARGING] == pytest.approx((240.0 + 480.0) / HOUR)


def test_an_empty_battery_needs_a_field_worker():
    """30 Wh last for one leg and a half: the order is delivered, the robot fetched."""
    settings = make_settings(battery_capacity=30.0)
    found = simulate_day([0.0], settings=settings)
    assert found.log.ran_empty == 1 and found.log.failures == 0
    assert found.log.trips[0].end.value == "in_time"
    assert found.day.energy.moved == pytest.approx(30.0)
    assert found.day.hours[State.BACK] == pytest.approx(300.0 / HOUR)
    assert found.day.distance == pytest.approx(1.0)


def test_a_day_earns_fees_less_every_cost():
    """Four orders in time: 4 x 3.49, an operator and a field worker for 10 h, a robot's day."""
    found = simulate_day(np.arange(4) * HOUR)
    at = make_prices()
    wages = 2 * 10.0 * at.optional.operator_wage.value
    energy = found.day.money["electricity"] + found.day.money["battery_wear"]
    assert found.day.profit == pytest.approx(4 * 3.49 - wages - 1.0 + energy)


def test_contacts_and_outcomes_cost_what_a_delivery_pays():
    """A contact with a bollard, 5 USD of injuries and spoiled food, there and back."""
    contacts = np.zeros((1, len(CONTACTS)))
    contacts[0, CONTACTS.index("pedestrian_injury_usd_per_run")] = 5.0
    contacts[0, CONTACTS.index("bollard_contacts")] = 1.0
    library = make_library(make_legs(contacts=contacts, is_spoiled=True))
    money = simulate_day([0.0], library).day.money
    prices = make_prices().prices
    assert money["revenue"] == 0.0
    assert money["pedestrian_safety"] == pytest.approx(-10.0)
    assert money["property_damage"] == pytest.approx(-2 * prices.property_damage.bollard.value)
    assert money["service_compensation"] == pytest.approx(-prices.food_price)


def test_late_orders_are_refunded_as_timeouts():
    prices = make_prices().prices
    late = simulate_day([0.0], settings=make_settings(promised_time=5.0)).day
    assert late.money["revenue"] == 0.0
    assert late.money["service_compensation"] == pytest.approx(-prices.delivery_fee.value)


def test_break_even_is_the_shift_over_what_a_robot_earns():
    """3.48 USD and five deliveries a shift of 10 h at 24 USD: 14 robots (13.8)."""
    assert break_even_robots_per_operator(5 * 3.48, 240.0) == pytest.approx(13.793, abs=1e-3)
    assert break_even_robots_per_operator(0.0, 240.0) is None


def test_a_fleet_of_so_many_robots_per_operator_earns_nothing():
    """At the operators' wage that the robots' earnings pay, the profit is zero."""
    settings = make_settings(robots=12, operators=2, orders_per_day=120, patience=600)
    library = make_library(make_legs(people=0.0))
    study = Fleet(settings, make_prices(on_site_time=0.0), 0).study(library, 3, 2)
    found = study.break_even.value
    days = study.days
    wages = -sum(day.money["operators"] for day in days)
    earned = sum(day.profit for day in days) + wages
    per_operator = wages / (2 * len(days))
    assert found == pytest.approx(per_operator / (earned / (12 * len(days))))


def test_an_operators_shift_costs_twelve_dollars_at_five_deliveries():
    at = make_prices()
    prices = with_values(at.prices, {"deliveries_per_day": 5.0})
    nothing = Measured(1.0, 0.0, *[0.0] * 9)
    given = CostInputs(nothing, prices, at.optional)
    assert COST_TERMS["operator_shift"].formula(given) == pytest.approx(12.0)

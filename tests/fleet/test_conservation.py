"""Every order, watt-hour, minute and dollar of a day is accounted for."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.fleet.legs import CONTACTS
from harness.fleet.robots import State
from harness.fleet.simulation import End

from .given import make_legs, make_library, make_prices, make_settings, simulate_day

RELAXED = settings(max_examples=40, deadline=None)


def random_legs(rng, people):
    count = int(rng.integers(1, 12))
    ends = rng.integers(0, 5, count)
    return make_legs(
        count,
        people,
        seconds=rng.uniform(30.0, 900.0, count),
        energy=rng.uniform(0.0, 40.0, count),
        progress=rng.uniform(0.1, 1.0, count),
        distance=rng.uniform(0.1, 1.5, count),
        contacts=rng.uniform(0.0, 2.0, (count, len(CONTACTS))),
        is_spoiled=ends == 1,
        is_late=ends == 2,
        is_failed=ends == 3,
    )


@RELAXED
@given(
    seed=st.integers(0, 10_000),
    robots=st.integers(1, 8),
    staff=st.integers(1, 3),
    capacity=st.floats(20.0, 800.0),
    idle=st.floats(0.0, 60.0),
    calls=st.floats(0.0, 3.0),
)
def test_nothing_is_lost(seed, robots, staff, capacity, idle, calls):
    rng = np.random.default_rng(seed)
    library = make_library(random_legs(rng, 5.0), random_legs(rng, 40.0))
    fleet = make_settings(
        robots=robots,
        operators=staff,
        battery_capacity=capacity,
        idle_power=idle,
        loading_time=2.0,
        handover_time=1.0,
        help_variation=1.0,
    )
    at = make_prices(remote_assistance_rate=calls)
    placed = np.sort(rng.uniform(0.0, 36_000.0, int(rng.integers(0, 60))))
    found = simulate_day(placed, library, fleet, at, seed)
    check_orders(found, len(placed))
    check_time(found)
    check_energy(found, capacity)
    check_money(found, at)


def check_orders(found, placed):
    trips = found.log.trips
    assert len(trips) == placed == sum(found.day.orders.values())
    for trip in trips:
        is_delivered = trip.end in (End.IN_TIME, End.LATE, End.SPOILED)
        assert is_delivered == (trip.delivered >= trip.placed)
        assert (trip.end is End.LOST) == np.isnan(trip.taken)
    assert len(found.day.customer_waits) == found.day.delivered


def check_time(found):
    for robot in found.robots:
        spans = robot.spans
        for before, after in zip(spans, spans[1:], strict=False):
            assert after.start == before.end
        assert spans[0].start == 36_000.0 and spans[-1].end >= 72_000.0
    assert found.day.hours[State.HELPED] == pytest.approx(found.day.helped_hours)
    assert found.day.hours[State.WAITING] == pytest.approx(found.day.robot_waits.sum() / 60.0)
    assert found.day.hours[State.STRANDED] == pytest.approx(found.day.field_waits.sum() / 60.0)


def check_energy(found, capacity):
    energy = found.day.energy
    assert energy.charged == pytest.approx(energy.moved + energy.idled)
    for robot in found.robots:
        assert robot.level == capacity
    if not found.log.ran_empty:
        assert energy.moved == pytest.approx(driven(found, lambda legs: legs.energy))


def check_money(found, at):
    day, prices = found.day, at.prices
    assert sum(day.money.values()) == pytest.approx(day.profit)
    counts = day.orders
    assert day.money["revenue"] == pytest.approx(counts[End.IN_TIME] * prices.delivery_fee.value)
    assert day.money["service_compensation"] == pytest.approx(
        -counts[End.SPOILED] * prices.food_price
        - (counts[End.LATE] + counts[End.FAILED]) * prices.delivery_fee.value
    )
    place = CONTACTS.index("pedestrian_injury_usd_per_run")
    assert day.money["pedestrian_safety"] == pytest.approx(
        -driven(found, lambda legs: legs.contacts[:, place])
    )
    assert day.distance == pytest.approx(driven(found, lambda legs: legs.distance))
    repair = found.log.failures * prices.repair_per_physical_assistance
    assert day.money["repair"] == pytest.approx(-repair)


def driven(found, column):
    """Sum over all driven legs, one after the other; none is driven twice."""
    seen, total = set(), 0.0
    for group, first, last in found.log.driven:
        numbers = found.orders.groups[group].numbers
        for place in range(first, last):
            assert (group, place) not in seen
            seen.add((group, place))
            total += column(found.library.groups[group])[numbers[place]]
    return total

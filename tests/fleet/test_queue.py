"""Robots that wait for operators, against queueing theory."""

from math import factorial

import numpy as np
import pytest
from scipy.stats import t

from harness.fleet.robots import State

from .given import make_legs, make_library, make_prices, make_settings, simulate_day


def erlang_c(servers, load):
    """Probability that a customer of an M/M/c queue waits (Erlang 1917)."""
    full = load**servers / factorial(servers) * servers / (servers - load)
    return full / (sum(load**k / factorial(k) for k in range(servers)) + full)


@pytest.mark.parametrize(("operators", "load", "days"), [(1, 0.6, 40), (3, 2.4, 16)])
def test_robots_wait_for_operators_as_erlang_c_says(operators, load, days):
    """Each way has two legs that end in a call; the queue is one of a Jackson network.

    What a robot meets on arrival is then distributed as in the M/M/c queue of the same load.
    """
    service = 2.0  # [min]
    rate = load / service  # calls [1/min]
    hours = 24.0
    at = make_prices(remote_assistance_time=service / 60.0)
    settings = make_settings(
        robots=100, operators=operators, help_variation=1.0, open_hour=0.0, close_hour=hours
    )
    library = make_library(make_legs(is_late=True, energy=0.0))
    means = []
    for seed in range(days):
        rng = np.random.default_rng(seed)
        count = rng.poisson(rate / 2.0 * hours * 60.0)
        placed = np.sort(rng.uniform(0.0, hours * 3600.0, count))
        waits = simulate_day(placed, library, settings, at, seed).day.robot_waits
        assert len(waits) == 2 * count
        means.append(waits.mean())
    expected = erlang_c(operators, load) / (operators / service - rate)
    error = np.std(means, ddof=1) / np.sqrt(len(means))
    assert abs(np.mean(means) - expected) < t.ppf(0.9995, len(means) - 1) * error
    assert error < 0.1 * expected


def test_a_queue_without_chance_is_that_of_a_hand():
    """Three robots call after 600 s at once; one operator needs 120 s for each."""
    at = make_prices(remote_assistance_time=2.0 / 60.0)
    library = make_library(make_legs(is_late=True))
    settings = make_settings(robots=3)
    found = simulate_day([0.0, 0.0, 0.0], library, settings, at)
    # there: 0, 2 and 4 min; back, each arrives 2 min after the one before it
    assert sorted(found.day.robot_waits) == pytest.approx([0.0, 0.0, 0.0, 0.0, 2.0, 4.0])
    assert found.day.helped_hours == pytest.approx(6 * 2.0 / 60.0)
    assert found.day.hours[State.WAITING] == pytest.approx(6.0 / 60.0)
    assert found.day.hours[State.HELPED] == pytest.approx(12.0 / 60.0)


def test_a_failed_leg_ends_the_order_and_takes_a_field_worker():
    library = make_library(make_legs(is_failed=True))
    found = simulate_day([0.0, 0.0], library, make_settings(robots=2), make_prices())
    assert found.log.failures == 2
    assert found.day.orders[next(end for end in found.day.orders if end.value == "failed")] == 2
    assert sorted(found.day.field_waits) == pytest.approx([0.0, 60.0])  # on_site_time is 1 h
    assert found.day.hours[State.BACK] == 0.0


def test_an_order_is_lost_when_no_robot_takes_it_in_time():
    """One robot needs 20 min an order: the third waits 40 min, longer than its 30."""
    found = simulate_day([0.0, 0.0, 0.0])
    assert [trip.end.value for trip in found.log.trips] == ["in_time", "in_time", "lost"]
    assert found.day.customer_waits.tolist() == pytest.approx([10.0, 30.0])

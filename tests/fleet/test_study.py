"""Many days: determinism, intervals, hours, sizes."""

import dataclasses

import numpy as np
import pytest

from harness.fleet.day_metrics import PROFIT
from harness.fleet.legs import notes_on
from harness.fleet.orders import draw_orders, order_times
from harness.fleet.result import simulate, simulated_days
from harness.fleet.settings import HourlyCurve, checked, load_settings
from harness.fleet.study import Fleet, differences, paying_size, require_moving
from navstack.errors import InputError, ParameterError, UnknownNameError

from .given import make_legs, make_library, make_prices, make_settings


def mixed(count=30, seed=0, people=20.0):
    rng = np.random.default_rng(seed)
    return make_legs(
        count,
        people,
        seconds=rng.uniform(300.0, 900.0, count),
        is_failed=rng.random(count) < 0.1,
        is_late=rng.random(count) < 0.2,
    )


def fleet_of(seed=0, **values):
    settings = make_settings(**{"robots": 4, "orders_per_day": 40, "help_variation": 1, **values})
    return Fleet(settings, make_prices(remote_assistance_rate=0.8), seed)


def test_the_same_seed_gives_the_same_days():
    library = make_library(mixed())
    first, again = (fleet_of().study(library, 3, 2) for _ in range(2))
    other = fleet_of(seed=1).study(library, 3, 2)
    assert first.estimates == again.estimates
    assert [day.money for day in first.days] == [day.money for day in again.days]
    assert first.estimates != other.estimates


def test_what_a_day_without_orders_has_not_is_not_known():
    """Of three days one has a delivery; the others idle all the same."""
    none = fleet_of(orders_per_day=0, idle_power=36).study(make_library(), 2, 0).estimates
    few = fleet_of(orders_per_day=0.5, seed=2, idle_power=36).study(make_library(), 3, 0)
    delivered = [day for day in few.days if day.delivered]
    assert 0 < len(delivered) < len(few.days)
    for key in ("robot_hours_per_delivery_h", "distance_per_delivery_km", "energy_per_km_wh"):
        assert none[key].mean.value is None
    energy = np.mean([day.energy.charged / day.distance for day in delivered])
    assert few.estimates["energy_per_km_wh"].mean.value == pytest.approx(energy)
    assert few.estimates["distance_per_delivery_km"].mean.value == pytest.approx(2.0)


def test_libraries_that_are_alike_differ_in_nothing():
    found = [fleet_of().study(make_library(mixed()), 3, 3) for _ in range(2)]
    gain = differences(*found)[PROFIT]
    assert (gain.mean.value, gain.mean.low, gain.mean.high) == (0.0, 0.0, 0.0)
    assert (gain.day_low, gain.day_high) == (0.0, 0.0)


def test_a_library_without_failures_is_worth_more():
    with_failures = mixed()
    safe = dataclasses.replace(with_failures, is_failed=np.zeros(30, dtype=bool))
    studies = [fleet_of().study(make_library(legs), 5, 5) for legs in (with_failures, safe)]
    assert differences(*studies)[PROFIT].mean.low > 0.0


def test_intervals_hold_what_legs_leave_open():
    """Few legs of which some cost 1000 USD leave more open than many."""

    def width(count):
        contacts = make_legs(count).contacts.copy()
        contacts[::5, 0] = 1000.0
        library = make_library(make_legs(count, contacts=contacts))
        mean = fleet_of().study(library, 3, 30).estimates[PROFIT].mean
        return mean.high - mean.low

    assert width(10) > 2.0 * width(1000)


@pytest.mark.parametrize("seed", range(8))
def test_an_interval_holds_its_mean_however_few_the_days(seed):
    study = fleet_of(seed=seed).study(make_library(mixed(12, seed)), 1, 4)
    means = {key: estimate.mean for key, estimate in study.estimates.items()}
    bounded = {key: mean for key, mean in means.items() if mean.low is not None}
    assert PROFIT in bounded
    for key, mean in bounded.items():
        assert mean.value is None or mean.low <= mean.value <= mean.high, key


def test_missions_are_resampled_whole():
    legs = make_legs(6, seconds=np.arange(6.0) + 1.0, clusters=np.array([0, 1, 2, 0, 1, 2]))
    again = legs.resampled(np.random.default_rng(1))
    for mission, seconds in zip(again.clusters, again.seconds, strict=True):
        assert seconds in (mission + 1.0, mission + 4.0)
    counts = np.unique(again.seconds, return_counts=True)
    twins = dict(zip(*counts, strict=True))
    assert all(twins.get(first) == twins.get(first + 3.0) for first in (1.0, 2.0, 3.0))


def test_the_hours_decide_what_a_day_earns():
    """Legs among many people fail; orders at noon meet them, orders in the evening do not."""
    library = make_library(make_legs(people=0.0), make_legs(people=40.0, is_failed=True))
    people = HourlyCurve("noon", tuple(float(10 <= hour < 14) for hour in range(24)))
    profits = []
    for busy in (range(10, 14), range(14, 20)):
        demand = HourlyCurve("busy", tuple(float(hour in busy) for hour in range(24)))
        settings = make_settings(robots=20, orders_per_day=30)
        settings = dataclasses.replace(settings, demand_by_hour=demand, people_by_hour=people)
        days = Fleet(settings, make_prices(), 0).days(library, range(3))
        profits.append(np.mean([day.profit for day in days]))
    assert profits[0] < profits[1] - 50.0


def test_orders_come_at_the_rate_of_their_hour():
    settings = load_settings()
    times = [order_times(settings, np.random.default_rng(seed)) for seed in range(50)]
    hours = np.bincount((np.concatenate(times) // 3600.0).astype(int), minlength=24) / 50.0
    shares = settings.demand_by_hour.shares.copy()
    shares[:10] = shares[22:] = 0.0
    expected = 300.0 * shares / shares.sum()
    assert hours[:10].sum() == hours[22:].sum() == 0.0
    assert np.abs(hours - expected)[10:22].max() < 4.0 * np.sqrt(expected.max() / 50.0)


def test_ways_are_as_long_as_asked_for_on_average():
    legs = make_legs(3, progress=np.array([0.1, 0.2, 0.3]))
    settings = make_settings(way=1.1)
    orders = draw_orders(make_library(legs), settings, make_prices().optional, np.zeros(4000), (0,))
    (group,) = orders.groups
    assert legs.progress[group.numbers].sum() / 8000.0 == pytest.approx(1.1, rel=0.01)


def test_more_robots_than_orders_need_do_not_pay():
    library = make_library(make_legs())
    fleet = fleet_of(orders_per_day=150, field_workers=1)
    points = fleet.curve(library, [(2, 1), (8, 1), (200, 1)], days=2)
    assert [point.robots for point in points] == [2, 8, 200]
    assert points[1].profit > points[0].profit and points[1].profit > points[2].profit
    assert paying_size(points) is None, "not even eight earn their days"
    rich = [dataclasses.replace(point, profit=point.profit + 100.0) for point in points]
    assert paying_size(rich) is rich[1]


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"robots": 2.5}, "whole number"),
        ({"operators": 0}, "city.yaml with operators=0: operators 0 must be .* 1 to 10000"),
        ({"robots": -3}, "whole number, 1 to 10000"),
        ({"open_hour": 21, "close_hour": 20}, "must be before"),
        ({"open_hour": 0, "close_hour": 6}, "nobody orders from open_hour 0 to close_hour 6"),
        ({"charge_power": 10, "idle_power": 40}, "never charged"),
        ({"least_charge": 1.5}, "outside 0..1"),
    ],
)
def test_settings_that_do_not_go_together_are_refused(values, told):
    with pytest.raises(ParameterError, match=told):
        load_settings("city", values)


def test_an_unknown_setting_is_refused():
    with pytest.raises(UnknownNameError, match="robots"):
        load_settings("city", {"robotz": 3})


def test_a_curve_needs_every_hour():
    curve = HourlyCurve("short", (1.0, 2.0))
    settings = dataclasses.replace(load_settings(), demand_by_hour=curve)
    with pytest.raises(ParameterError, match="has 2 hours; give 24"):
        checked(settings, "test")


def test_each_simulated_day_is_told_for_progress():
    heard, settings = [], make_settings(robots=2, orders_per_day=5)
    library = make_library(mixed(), mixed(seed=1, people=40.0))
    found = simulate([library], ["x"], settings, make_prices(), 0, 4, 3, lambda: heard.append(1))
    assert len(heard) == simulated_days(settings, 4, 3) and len(found.libraries) == 1


def test_more_legs_a_day_than_memory_holds_are_refused():
    settings = make_settings(orders_per_day=1e6, way=50.0)
    with pytest.raises(InputError, match="at most 2000000 a day can be simulated"):
        require_moving(make_library(), settings)


def test_a_way_that_is_set_is_as_long_as_it_says_also_at_its_usual_length():
    """The file has a range, from which ways are drawn."""
    usual = load_settings()
    assert usual.way.low is not None
    for length in (usual.way.value, 2.0):
        way = load_settings(values={"way": length}).way
        assert (way.value, way.low, way.high) == (length, None, None)


def test_what_legs_cannot_tell_is_told():
    way = make_settings(way=1.0).way
    lossless = make_library(make_legs(20))
    (note,) = notes_on(lossless, way)
    assert note.startswith("none of the 20 legs of") and "no loss that nobody has seen" in note
    late = make_library(make_legs(20, is_late=True))
    assert notes_on(late, way) == []
    (note,) = notes_on(late, dataclasses.replace(way, low=0.3, high=1.9))
    assert "is 1 km long; ways that are shorter, down to 0.3 km, count as one" in note

"""Legs and fleets made up for hand calculation."""

import dataclasses

import numpy as np

from harness.economics.optional_prices import load_optional_prices
from harness.economics.price import with_values
from harness.economics.prices import load_prices
from harness.fleet.ledger import FleetPrices, settle
from harness.fleet.legs import CONTACTS, Legs, Library
from harness.fleet.orders import draw_orders
from harness.fleet.settings import HourlyCurve, checked, load_settings
from harness.fleet.simulation import FleetDay

PLAIN = {  # a fleet of one robot that does nothing but drive
    "robots": 1,
    "operators": 1,
    "field_workers": 1,
    "way": 1.0,
    "crossings_per_km": 0.0,
    "crossing_wait": 0.0,
    "loading_time": 0.0,
    "handover_time": 0.0,
    "help_variation": 0.0,
    "idle_power": 0.0,
    "open_hour": 10.0,
    "close_hour": 20.0,
}


def make_legs(count=1, people=20.0, **columns):
    """Legs of 1 km, 600 s and 20 Wh in which nothing happens, but for some columns."""
    own = {
        "seconds": 600.0,
        "energy": 20.0,
        "progress": 1.0,
        "distance": 1.0,
        "contacts": np.zeros((count, len(CONTACTS))),
        "is_spoiled": False,
        "is_late": False,
        "is_failed": False,
        "clusters": np.arange(count),
        **columns,
    }
    flat = {
        key: np.broadcast_to(np.asarray(value), count)
        for key, value in own.items()
        if key != "contacts"
    }
    return Legs(people, contacts=own["contacts"], **flat)


def make_library(*groups, capex=730.0):
    """A library; 730 USD a robot over two years are one USD a day."""
    return Library("made up", groups or (make_legs(),), capex, True)


def make_settings(**values):
    """The plain fleet with other values; orders come evenly over all hours."""
    even = HourlyCurve("even", (1.0,) * 24)
    loaded = with_values(load_settings(), {**PLAIN, **values})
    return checked(dataclasses.replace(loaded, demand_by_hour=even), "test")


def make_prices(**values):
    """The published prices, without calls for help, with other values of optional ones."""
    prices = load_prices()
    values = {"remote_assistance_rate": 0.0, **values}
    return FleetPrices(prices, with_values(load_optional_prices(), values))


@dataclasses.dataclass
class Simulated:
    """A day with everything that it was made of."""

    day: object
    log: object
    robots: list
    orders: object
    library: Library


def simulate_day(placed, library=None, settings=None, at=None, seed=0):
    """Simulate the orders placed at some times [s after opening]."""
    library = library or make_library()
    settings, at = settings or make_settings(), at or make_prices()
    times = settings.open_hour.value * 3600.0 + np.asarray(placed, dtype=float)
    orders = draw_orders(library, settings, at.optional, times, (seed,))
    fleet = FleetDay(orders, settings, at.optional, np.random.default_rng(seed))
    fleet.run()
    day = settle(fleet.log, fleet.robots, orders, library, settings, at)
    return Simulated(day, fleet.log, fleet.robots, orders, library)

"""The orders of a day, and the legs that each one's way is made of."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.economics.optional_prices import OptionalPrices
from harness.fleet.legs import Legs, Library
from harness.fleet.settings import FleetSettings
from harness.statistics.bootstrap import IntArray
from navstack.types import FloatArray

SECONDS_PER_HOUR = 3600.0
SECONDS_PER_MINUTE = 60.0
REMOTE, FIELD = 1, 2  # who helps


@dataclass(frozen=True, slots=True)
class Way:
    """Legs of one order among as many people: there, and back to the next pick-up.

    Places are numbers of legs among :class:`GroupWays`' own.
    """

    start: int
    turn: int
    end: int
    first_trouble: int  # number of the first trouble among these legs


@dataclass(frozen=True, slots=True, eq=False)
class GroupWays:
    """The ways of all orders of a day, if their legs were driven among so many people.

    Lists, which a simulation reads faster than arrays.
    """

    numbers: IntArray  # of the legs in their group, one after the other
    ways: list[Way]  # of each order
    seconds: list[float]  # [s] before each leg, and after the last
    energy: list[float]  # [Wh] likewise
    spoiled: list[float]  # legs that spoil the cargo, likewise
    trouble_at: list[int]  # leg after which help is needed; rising, then one beyond all
    trouble_kind: list[int]  # REMOTE or FIELD


@dataclass(frozen=True, slots=True, eq=False)
class DayOrders:
    """What is ordered on a day."""

    placed: list[float]  # [s] since 0:00
    groups: tuple[GroupWays, ...]  # of the library
    group_at_hour: list[int]  # from which legs are drawn


def draw_orders(
    library: Library,
    settings: FleetSettings,
    optional: OptionalPrices,
    placed: FloatArray,
    seed: Sequence[int],
) -> DayOrders:
    """Draw the ways of a day's orders; the same for libraries that are alike.

    Args:
        library: of driven legs.
        settings: of the fleet.
        optional: whose rate of calls for help holds.
        placed: when orders are placed [s], rising.
        seed: of the day.
    """
    distances = _distances(settings, len(placed), np.random.default_rng([*seed, 0]))
    groups = []
    for number, legs in enumerate(library.groups):
        own = np.random.default_rng([*seed, 1, number])
        groups.append(_ways(legs, distances, settings, optional, own))
    crowd = settings.people_by_hour.shares / settings.people_by_hour.shares.max()
    at_hour = [library.group_at(share) for share in crowd]
    return DayOrders(placed.tolist(), tuple(groups), at_hour)


def order_times(settings: FleetSettings, rng: np.random.Generator) -> FloatArray:
    """When orders are placed [s], rising: Poisson, with a rate for each hour."""
    begins, lengths = settings.open_parts
    weights = settings.open_demand
    counts = rng.poisson(settings.orders_per_day.value * weights / weights.sum())
    begin, length = np.repeat(begins, counts), np.repeat(lengths, counts)
    times: FloatArray = np.sort(begin + length * rng.random(counts.sum())) * SECONDS_PER_HOUR
    return times


def _distances(settings: FleetSettings, count: int, rng: np.random.Generator) -> FloatArray:
    """The way of each order [km], one way."""
    way = settings.way
    if way.low is None or way.high is None:
        return np.full(count, way.value)
    return rng.uniform(way.low, way.high, count)


def _ways(
    legs: Legs,
    distances: FloatArray,
    settings: FleetSettings,
    optional: OptionalPrices,
    rng: np.random.Generator,
) -> GroupWays:
    """Draw legs with replacement until each way is as long as it is on average."""
    wanted = distances / legs.mean_progress
    whole = np.floor(wanted)
    per_way = np.maximum(whole + (rng.random(len(wanted)) < wanted - whole), 1.0).astype(int)
    ends = np.cumsum(2 * per_way)
    starts = ends - 2 * per_way
    numbers = rng.integers(0, len(legs.seconds), int(ends[-1]) if len(ends) else 0)
    crossing = settings.crossings_per_km.value * settings.crossing_wait.value  # [s/km]
    seconds = legs.seconds + crossing * legs.progress
    calls = rng.poisson(optional.remote_assistance_rate.value, len(starts))
    lengths = np.repeat(2 * per_way, calls)
    called = np.repeat(starts, calls) + (rng.random(len(lengths)) * lengths).astype(int)
    places, kinds = _troubles(legs, numbers, called)
    firsts = np.searchsorted(places, starts).tolist()
    bounds = zip(starts.tolist(), (starts + per_way).tolist(), ends.tolist(), firsts, strict=True)
    return GroupWays(
        numbers=numbers,
        ways=[Way(*each) for each in bounds],
        seconds=_before(seconds[numbers]),
        energy=_before(legs.energy[numbers]),
        spoiled=_before(legs.is_spoiled[numbers].astype(float)),
        trouble_at=[*places.tolist(), len(numbers)],
        trouble_kind=kinds.tolist(),
    )


def _troubles(legs: Legs, numbers: IntArray, called: IntArray) -> tuple[IntArray, IntArray]:
    """After which legs help is needed, and whose, in order; field help comes last."""
    late = np.flatnonzero(legs.is_late[numbers])
    failed = np.flatnonzero(legs.is_failed[numbers])
    places = np.concatenate((called, late, failed))
    remote = np.full(len(called) + len(late), REMOTE)
    kinds = np.concatenate((remote, np.full(len(failed), FIELD)))
    order = np.lexsort((kinds, places))
    return places[order], kinds[order]


def _before(amounts: FloatArray) -> list[float]:
    """Sums before each entry and after the last."""
    sums: list[float] = np.concatenate(([0.0], np.cumsum(amounts))).tolist()
    return sums

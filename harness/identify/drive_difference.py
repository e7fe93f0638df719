"""Two recorded drives side by side: per kilometre, one less the other."""

import math

import numpy as np

from harness.identify.drive_cost import DriveCost
from harness.statistics.interval import Interval
from harness.statistics.rates import poisson_rate

KINDS = ("contact", "near_miss", "hard_brake", "intervention")


def kilometres(cost: DriveCost) -> float:
    """[km] of a drive, never 0."""
    return max(1e-3 * cost.distance, 1e-9)


def rate_difference(first: tuple[int, float], second: tuple[int, float]) -> Interval:
    """Difference of two Poisson rates, first less second, each a count and its exposure.

    The interval is recovered from those of both rates (MOVER: Zou & Donner 2008, Statistics in
    Medicine 27, 1693-1702).
    """
    one = poisson_rate(np.ones(first[0]), first[1])
    other = poisson_rate(np.ones(second[0]), second[1])
    below = math.hypot(_gap(one.value, one.low), _gap(other.high, other.value))
    above = math.hypot(_gap(one.high, one.value), _gap(other.value, other.low))
    value = _gap(one.value, other.value)
    return Interval(value, value - below, value + above, one.n + other.n)


def _gap(one: float | None, other: float | None) -> float:
    return (one or 0.0) - (other or 0.0)


def differences(cost: DriveCost, other: DriveCost) -> dict[str, Interval]:
    """What one drive has per km more than another; dollars of single drives have no interval."""
    one_km, other_km = kilometres(cost), kilometres(other)
    found = {
        f"{kind}_per_km": rate_difference((cost.count(kind), one_km), (other.count(kind), other_km))
        for kind in KINDS
    }
    speed = cost.distance / max(cost.duration, 1e-9) - other.distance / max(other.duration, 1e-9)
    singles = {
        "total_usd_per_km": cost.total / one_km - other.total / other_km,
        "energy_kwh_per_km": cost.energy / one_km - other.energy / other_km,
        "speed_mps": speed,
    }
    return found | {key: Interval(value, None, None, 1) for key, value in singles.items()}

"""Between what values prices are varied: each alone, or as an axis of a map."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.economics.price import limits_of, price_keys
from harness.economics.prices import Prices
from navstack.errors import InputError, UnknownNameError
from navstack.types import FloatArray

SPREAD = 0.2  # up and down, where the source of a price gives no range
STATED, ASSUMED = "source", "20 %"  # where a range comes from
MAP_FACTORS = np.linspace(0.0, 3.0, 31)  # of the values of today
LEAST_FACTOR = 0.3  # of what formulas divide by


@dataclass(frozen=True, slots=True)
class Range:
    """Between what values a price is varied."""

    unit: str
    low: float
    value: float
    high: float
    range: str  # where it comes from: STATED or ASSUMED


@dataclass(frozen=True, slots=True)
class PriceAxis:
    """One price, or a group of prices that go up and down together."""

    key: str
    base: Mapping[str, float]  # values of today
    unit: str  # empty: a factor on all of the group
    factors: FloatArray

    @property
    def today(self) -> float:
        """Where the axis is today: the price, or the factor 1."""
        if self.unit:
            return next(iter(self.base.values()))
        return 1.0

    @property
    def values(self) -> FloatArray:
        """What stands on the axis: the price, or the factor."""
        return self.factors * self.today


def ranges(group: Any, keys: Sequence[str] | None = None) -> dict[str, Range]:
    """The range of each price of a group.

    Its source's, else 20 % up and down, within what is allowed.
    """
    found = {}
    for key, price in price_keys(group).items():
        if keys is not None and key not in keys:
            continue
        least, most = limits_of(group, key)
        low, high = price.value * (1.0 - SPREAD), price.value * (1.0 + SPREAD)
        origin = ASSUMED
        if price.low is not None:
            low, origin = price.low, STATED
        if price.high is not None:
            high, origin = price.high, STATED
        found[key] = Range(price.unit, max(low, least), price.value, min(high, most), origin)
    return found


def price_ranges(prices: Prices) -> dict[str, Range]:
    """The range of each price with all others as they are.

    A refund is never less than the fee that it contains.
    """
    found = ranges(prices)
    fee, refund = found["delivery_fee"], found["refund"]
    found["delivery_fee"] = dataclasses.replace(fee, high=min(fee.high, refund.value))
    found["refund"] = dataclasses.replace(refund, low=max(refund.low, fee.value))
    return found


def axes(prices: Prices, x: str, y: str) -> tuple[PriceAxis, PriceAxis]:
    """The two axes of a map.

    Raises:
        InputError: a price is on both, or one is unknown.
    """
    across, up = axis(prices, x), axis(prices, y)
    if common := sorted(across.base.keys() & up.base.keys()):
        raise InputError(
            f"--map '{x},{y}' has {common[0]} on both axes; give two that have no price in common"
        )
    return across, up


def axis(prices: Prices, key: str) -> PriceAxis:
    """The axis of a price or a group such as ``injury.costs``, up to three times today's values.

    Raises:
        UnknownNameError: neither a price nor a group of prices.
    """
    known = price_keys(prices)
    base = {
        name: price.value
        for name, price in known.items()
        if name == key or name.startswith(f"{key}.")
    }
    if not base:
        groups = {name.rpartition(".")[0] for name in known} - {""}
        raise UnknownNameError("price", key, sorted({*known, *groups}))
    inside = np.ones(MAP_FACTORS.size, dtype=np.bool_)
    for name, value in base.items():  # of a group the factors that suit every price
        least, most = limits_of(prices, name)
        inside &= value * MAP_FACTORS <= most
        if least:
            inside &= MAP_FACTORS >= LEAST_FACTOR
    unit = ""
    if key in known:
        unit = known[key].unit
    return PriceAxis(key, base, unit, MAP_FACTORS[inside])

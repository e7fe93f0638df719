"""How much each price matters: one price at a time, two at a time, and what the data leave open."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.economics.break_even import break_even_probability
from harness.economics.cost_model import Economics
from harness.economics.price import limits_of, price_keys
from harness.economics.prices import Prices
from navstack.errors import InputError, UnknownNameError
from navstack.types import FloatArray

SPREAD = 0.2  # up and down, where the source of a price gives no range
STATED, ASSUMED = "source", "20 %"  # where a range comes from
MAP_FACTORS = np.linspace(0.0, 3.0, 31)  # of the values of today
LEAST_FACTOR = 0.3  # of what formulas divide by
CURVE_RUNS = np.geomspace(100.0, 1e6, 61)  # [run] at which the probability of break-even is told

# Prices that replace those of today, by key -> the money then, and all prices then.
Evaluate = Callable[[Mapping[str, float]], tuple[Economics, Prices]]


@dataclass(frozen=True, slots=True)
class Range:
    """Between what values a price is varied."""

    low: float
    value: float
    high: float
    unit: str
    origin: str  # STATED or ASSUMED


@dataclass(frozen=True, slots=True)
class Bar:
    """What one price does between the ends of its range, all else as it is [USD/run]."""

    key: str
    range: Range
    margin_at_low: float
    margin_at_high: float
    profit_at_low: float
    profit_at_high: float

    @property
    def swing(self) -> float:
        """Difference in profit between the ends of the range [USD/run]."""
        return abs(self.profit_at_high - self.profit_at_low)


@dataclass(frozen=True, slots=True)
class Axis:
    """One price, or a group of prices that go up and down together."""

    key: str
    base: Mapping[str, float]  # values of today
    unit: str  # empty: a factor on all of the group
    factors: FloatArray

    @property
    def values(self) -> FloatArray:
        """What stands on the axis: the price, or the factor."""
        return self.factors * (next(iter(self.base.values())) if self.unit else 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class TwoWay:
    """Profit over two axes."""

    x: Axis
    y: Axis
    profit: FloatArray  # (y, x) [USD/run]; NaN where the refund would be less than the fee that it contains


@dataclass(frozen=True, slots=True, eq=False)
class BreakEvenSpread:
    """What the deliveries leave open about the break-even point."""

    runs: FloatArray  # (draws,) [run] in each resample; inf: never
    never: float  # share of resamples in which the margin is not positive
    curve_runs: FloatArray  # [run]
    curve_probability: FloatArray  # that the capex is paid back within these runs


def profit_per_run(economics: Economics, prices: Prices) -> float:
    """Contribution margin less the capital expenditure spread over the robot's life [USD/run].

    Raises:
        InputError: the margin is undefined.
    """
    return _margin(economics) - economics.capex_usd / prices.robot_life_runs


def _margin(economics: Economics) -> float:
    if economics.contribution_margin is None:
        raise InputError("the margin is undefined because the cargo was not simulated; run with a world that has cargo")
    return economics.contribution_margin


def ranges(group: Any, keys: Sequence[str] | None = None) -> dict[str, Range]:
    """The range of each price of a group: its source's, else 20 % up and down, within what is allowed."""
    found = {}
    for key, price in price_keys(group).items():
        if keys is not None and key not in keys:
            continue
        least, most = limits_of(group, key)
        low = price.value * (1.0 - SPREAD) if price.low is None else price.low
        high = price.value * (1.0 + SPREAD) if price.high is None else price.high
        origin = ASSUMED if price.low is None and price.high is None else STATED
        found[key] = Range(max(low, least), price.value, min(high, most), price.unit, origin)
    return found


def price_ranges(prices: Prices) -> dict[str, Range]:
    """The range of each price with all others as they are: a refund is never less than the fee that it contains."""
    found = ranges(prices)
    fee, refund = found["delivery_fee"], found["refund"]
    found["delivery_fee"] = dataclasses.replace(fee, high=min(fee.high, refund.value))
    found["refund"] = dataclasses.replace(refund, low=max(refund.low, fee.value))
    return found


def tornado(evaluate: Evaluate, varied: Mapping[str, Range]) -> list[Bar]:
    """One bar per price, the widest swing of profit first."""
    bars = []
    for key, span in varied.items():
        low, high = evaluate({key: span.low}), evaluate({key: span.high})
        bars.append(
            Bar(
                key=key,
                range=span,
                margin_at_low=_margin(low[0]),
                margin_at_high=_margin(high[0]),
                profit_at_low=profit_per_run(*low),
                profit_at_high=profit_per_run(*high),
            )
        )
    return sorted(bars, key=lambda bar: (-bar.swing, bar.key))


def axis(prices: Prices, key: str) -> Axis:
    """The axis of a price, or of a group such as ``injury.costs``, from zero to three times the values of today.

    Raises:
        UnknownNameError: neither a price nor a group of prices.
    """
    known = price_keys(prices)
    base = {name: price.value for name, price in known.items() if name == key or name.startswith(f"{key}.")}
    if not base:
        groups = {name.rpartition(".")[0] for name in known} - {""}
        raise UnknownNameError("price", key, sorted({*known, *groups}))
    inside = np.ones(MAP_FACTORS.size, dtype=np.bool_)
    for name, value in base.items():  # of a group the factors that suit every price
        least, most = limits_of(prices, name)
        inside &= (value * MAP_FACTORS <= most) & (MAP_FACTORS >= (LEAST_FACTOR if least else 0.0))
    return Axis(key, base, known[key].unit if key in known else "", MAP_FACTORS[inside])


def two_way(evaluate: Evaluate, x: Axis, y: Axis) -> TwoWay:
    """Profit at every combination of two axes, see :class:`TwoWay`."""
    profit = np.empty((y.factors.size, x.factors.size))
    for i, up in enumerate(y.factors):
        for j, right in enumerate(x.factors):
            values = {key: value * right for key, value in x.base.items()}
            values |= {key: value * up for key, value in y.base.items()}
            economics, prices = evaluate(values)
            profit[i, j] = profit_per_run(economics, prices) if prices.food_price >= 0.0 else np.nan
    return TwoWay(x, y, profit)


def break_even_spread(capex_usd: float, means: FloatArray, deviations: FloatArray) -> BreakEvenSpread:
    """What resampled profits of a delivery (draws,) [USD/run] say of the break-even point."""
    runs = np.divide(capex_usd, means, out=np.full_like(means, np.inf), where=means > 0.0)
    curve = [break_even_probability(float(n), capex_usd, means, deviations) for n in CURVE_RUNS]
    return BreakEvenSpread(runs, float((means <= 0.0).mean()), CURVE_RUNS, np.array(curve))

"""Deliveries under every shipped set of prices, and under every injury curve.

Who earns money, and who is ahead.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.analysis.rare import reach_of, widest
from harness.analysis.repricing import Choices, accounted_dollars, accounted_margins, choose
from harness.economics.accountings import AT_FAULT, MONOTONE, PUBLISHED
from harness.economics.cost_model import price
from harness.economics.measured import Measured
from harness.economics.optional_prices import load_optional_prices
from harness.economics.optional_terms import OptionalTerms, all_optional_costs
from harness.economics.prices import load_prices, price_sets
from harness.economics.unseen import margin_admitting_unseen
from harness.economics.valuation import CENT, missions
from harness.metrics.summary import summarize
from harness.statistics.interval import NO_INTERVAL, Interval
from harness.study.stored_run import StoredRun, StoredStack

Parts = Sequence[tuple[StoredRun, StoredStack]]  # a stack in its runs

# Injury curve -> set of prices that has it (None: those of the run), and accounting of contacts.
CURVES = {
    "published": (None, PUBLISHED),
    "published, monotone": (None, MONOTONE),
    "published, robot at fault": (None, AT_FAULT),
    "crash tests": ("robot_crash_tests", PUBLISHED),
    "crash tests, robot at fault": ("robot_crash_tests", AT_FAULT),
}


@dataclass(frozen=True, slots=True)
class Money:
    """What a stack's deliveries come to under a set of prices, its accounting and its terms."""

    margin: Interval  # [USD/run]
    capex_usd: float
    life_runs: float  # [run] of the robot

    @property
    def profit(self) -> Interval:
        """Margin less the CAPEX spread over the robot's life [USD/run]."""
        share, margin = self.capex_usd / self.life_runs, self.margin
        value, low, high = (
            None if each is None else each - share
            for each in (margin.value, margin.low, margin.high)
        )
        return Interval(value, low, high, margin.n)


@dataclass(frozen=True, slots=True)
class UnderSet:
    """The stacks of a run at one set of prices."""

    choices: Choices
    money: Mapping[str, Money]  # by stack; those without a margin are left out

    @property
    def order(self) -> tuple[str, ...]:
        """The stacks, the one of most profit first."""
        return order(self.money)

    def as_json(self) -> dict[str, Any]:
        """As one JSON object."""
        return {
            "as_of": self.choices.prices.as_of,
            "accounting": self.choices.prices.accounting,
            "optional_terms": list(self.choices.optional.names),
            "margins": {stack: money.margin.as_json() for stack, money in self.money.items()},
            "capex_usd": {stack: money.capex_usd for stack, money in self.money.items()},
            "profits": {stack: money.profit.as_json() for stack, money in self.money.items()},
            "order": list(self.order),
        }


def order(money: Mapping[str, Money]) -> tuple[str, ...]:
    """Stacks by their profit to the cent, the best first; those alike stay in the order given."""

    def cents(stack: str) -> int:
        return round((money[stack].profit.value or 0.0) / CENT)

    return tuple(sorted(money, key=lambda stack: -cents(stack)))


def under_price_sets(run: StoredRun) -> dict[str, UnderSet]:
    """What a run's stacks come to under each set, by its name; the published set first."""
    found = {}
    for name in price_sets():
        choices = choose(run, name, {}, ())
        money = {
            stack.name: money_of([(run, stack)], choices) for stack in run.stacks if stack.rows
        }
        found[name] = UnderSet(
            choices, {stack: each for stack, each in money.items() if each.margin.n}
        )
    return found


def money_of(parts: Parts, choices: Choices) -> Money:
    """The money of a stack's deliveries, one at least, by the accounting that goes with the prices.

    Raises:
        InputError: rows and events of a run are of different states.
    """
    (first, stack), rows = parts[0], [row for _, each in parts for row in each.rows]
    prices = choices.prices
    known = accounted_margins(first, parts, [prices.accounting], choices)
    measured = Measured(**summarize(rows, prices.rolling_resistance_force))
    extra = all_optional_costs(measured, stack.localizer, prices, choices.optional)
    capex = price(measured, stack.carries, stack.data_collection, prices, extra).capex_usd
    return Money(known.get(prices.accounting, NO_INTERVAL), capex, prices.robot_life_runs)


def under_curves(parts: Parts) -> dict[str, Interval]:
    """The mean margin [USD/run] under each of :data:`CURVES`, at the first run's prices.

    Admits an unseen loss.
    """
    first, found = parts[0][0], {}
    clusters = missions([row for _, stack in parts for row in stack.rows])
    for name, (curves, accounting) in CURVES.items():
        prices = first.prices()
        if curves is not None:
            prices = dataclasses.replace(prices, injury=load_prices(curves).injury)
        choices = Choices(prices, OptionalTerms((), load_optional_prices()), {})
        margins = accounted_dollars(first, parts, [accounting], choices)
        found[name] = NO_INTERVAL
        if margins:
            reach = widest(reach_of(run, prices, accounting) for run, _ in parts)
            found[name] = margin_admitting_unseen(margins[accounting], reach, clusters, first.seed)
    return found

"""What a stored stack earns as a function of prices, and delivery by delivery."""

from collections.abc import Callable, Mapping

import numpy as np

from harness.analysis.repricing import Choices
from harness.economics.accountings import (
    ACCOUNTINGS,
    PUBLISHED,
    accounted,
    contacts_of,
    injury_price,
)
from harness.economics.cost_model import Economics, price
from harness.economics.measured import Measured
from harness.economics.optional_terms import OptionalTerms, all_optional_costs
from harness.economics.price import price_keys, with_values
from harness.economics.prices import Prices
from harness.economics.valuation import beside_the_paper, deliveries, margins
from harness.metrics.columns import Row
from harness.metrics.contacts import PRICED_PROPERTY
from harness.metrics.summary import summarize
from harness.study.stored_run import StoredRun, StoredStack, repriced
from navstack.errors import InputError
from navstack.types import FloatArray

# Prices that replace those of today, by key -> the money then, and all prices then.
Evaluate = Callable[[Mapping[str, float]], tuple[Economics, Prices]]
PROPERTY_COUNTS = tuple(f"{kind}_contacts" for kind in PRICED_PROPERTY)


def evaluator(run: StoredRun, stack: StoredStack, choices: Choices) -> Evaluate:
    """The money of a stack's deliveries as a function of single prices.

    By the accounting that goes with the prices. Quick enough to be asked thousands of times.
    """
    base = summarize(stack.rows, choices.prices.rolling_resistance_force)
    base |= beside_the_paper(stack.rows) | _paid_property(run, stack, choices.prices)
    kind, share_of = ACCOUNTINGS[choices.prices.accounting]
    contacts = contacts_of(stack.rows, run.events, kind)
    people, price_of = contacts.with_people, injury_price(choices.prices.accounting)
    impulses, shares = contacts.impulses[people], share_of(contacts)[people]
    own, terms = set(price_keys(choices.prices)), choices.optional.names

    def economics_at(values: Mapping[str, float]) -> tuple[Economics, Prices]:
        prices = with_values(
            choices.prices, {key: number for key, number in values.items() if key in own}
        )
        other = {key: number for key, number in values.items() if key not in own}
        optional = OptionalTerms(terms, with_values(choices.optional.prices, other))
        injuries = float((price_of(impulses, prices) * shares).sum())
        measured = Measured(
            **base
            | {
                "pedestrian_injury_usd_per_run": injuries / len(stack.rows),
                "avg_mechanical_power_kw": prices.rolling_resistance_force
                * base["avg_velocity_mps"]
                / 1000.0,
            }
        )
        extra = all_optional_costs(measured, stack.localizer, prices, optional)
        return price(measured, stack.carries, stack.data_collection, prices, extra), prices

    return economics_at


def _paid_property(run: StoredRun, stack: StoredStack, prices: Prices) -> Row:
    """Means of what the accounting of the prices counts of contacts with property.

    Empty for the published one: they stand in the rows.
    """
    if prices.accounting == PUBLISHED:
        return {}
    each = deliveries(stack.rows, prices.rolling_resistance_force)
    found = accounted(each, stack.rows, run.events, prices.accounting, prices)
    counts = {key: getattr(found, key) for key in (*PROPERTY_COUNTS, "other_property_usd")}
    return {key: float(np.mean(count)) for key, count in counts.items() if count is not None}


def profits(run: StoredRun, stack: StoredStack, choices: Choices) -> FloatArray:
    """What each delivery of a stack earns less what it costs [USD], shape (n,).

    By the accounting that goes with the prices.

    Raises:
        InputError: the cargo was not simulated, so that it is undefined.
    """
    stack = repriced(stack, run.events, choices.prices)
    each = deliveries(stack.rows, choices.prices.rolling_resistance_force)
    extra = all_optional_costs(each, stack.localizer, choices.prices, choices.optional)
    accounting = choices.prices.accounting
    margin = margins(stack.rows, choices.prices, run.events, accounting, extra)
    if margin is None:
        raise InputError(
            f"{stack.name}: the margin is undefined, because the cargo was not simulated"
        )
    return margin

"""What the money of a stored run hangs on: every price, pairs of prices, and what its deliveries leave open."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.analysis.repricing import Choices, evaluator, profits
from harness.economics.cost_model import Economics
from harness.economics.optional_terms import TERMS
from harness.economics.prices import Prices
from harness.economics.sensitivity import (
    Axis,
    Bar,
    BreakEvenSpread,
    TwoWay,
    axis,
    break_even_spread,
    price_ranges,
    profit_per_run,
    ranges,
    tornado,
    two_way,
)
from harness.economics.valuation import missions, profit_draws, tells_of_rare
from harness.metrics import Row
from harness.study.stored_run import StoredRun, StoredStack
from navstack.errors import InputError

MAPS = (("delivery_fee", "injury.costs"), ("robot_cost", "deliveries_per_day"))
QUANTILES = (0.025, 0.5, 0.975)


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivity:
    """All of it for one stack."""

    stack: StoredStack
    economics: Economics
    profit: float  # [USD/run] margin less the capex spread over the robot's life
    bars: list[Bar]
    maps: list[TwoWay]
    spread: BreakEvenSpread | None  # None: one mission, or deliveries that are all alike, tell nothing of it
    life_runs: float  # [run] of the robot


def sensitivities(run: StoredRun, choices: Choices, maps: Sequence[str]) -> list[Sensitivity]:
    """Work out every stack of a run.

    Args:
        run: the run.
        choices: prices and optional terms to start from.
        maps: pairs of prices or of groups of prices, ``X,Y`` each; none: :data:`MAPS`.

    Raises:
        InputError: an unknown price, no finished delivery, or a margin that is undefined.
    """
    pairs = [_pair(text) for text in maps] or list(MAPS)
    stacks = [stack for stack in run.stacks if stack.rows]
    if not stacks:
        raise InputError(f"run folder '{run.folder}' has no finished delivery; there is nothing to vary")
    return [_of_stack(run, stack, choices, pairs) for stack in stacks]


def document(run: StoredRun, results: Sequence[Sensitivity], choices: Choices, figures: Sequence[str]) -> Row:
    """The JSON document of ``navbench sensitivity``."""
    return {
        "schema": 1,
        "folder": str(run.folder),
        "settings": dict(choices.settings),
        "optional_terms": list(choices.optional.names),
        "runs": [_document(result) for result in results],
        "figures": list(figures),
    }


def _pair(text: str) -> tuple[str, str]:
    x, comma, y = (part.strip() for part in text.partition(","))
    if not comma or not x or not y:
        raise InputError(f"--map '{text}' is not two prices X,Y, e.g. delivery_fee,injury.costs")
    return x, y


def _of_stack(run: StoredRun, stack: StoredStack, choices: Choices, pairs: Sequence[tuple[str, str]]) -> Sensitivity:
    evaluate = evaluator(run, stack, choices)
    economics, prices = evaluate({})
    optional = [key for name in choices.optional.names for key in TERMS[name][1]]
    margin = profits(run, stack, choices)
    clusters, spread = missions(stack.rows), None
    if tells_of_rare(margin, clusters):
        spread = break_even_spread(economics.capex_usd, *profit_draws(margin, clusters, run.seed))
    return Sensitivity(
        stack=stack,
        economics=economics,
        profit=profit_per_run(economics, prices),
        bars=tornado(evaluate, price_ranges(prices) | ranges(choices.optional.prices, optional)),
        maps=[two_way(evaluate, *_axes(prices, *pair)) for pair in pairs],
        spread=spread,
        life_runs=prices.robot_life_runs,
    )


def _axes(prices: Prices, x: str, y: str) -> tuple[Axis, Axis]:
    """Of a map; each price is on one of them at most."""
    axes = axis(prices, x), axis(prices, y)
    if common := sorted(axes[0].base.keys() & axes[1].base.keys()):
        raise InputError(f"--map '{x},{y}' has {common[0]} on both axes; give two that have no price in common")
    return axes


def _document(result: Sensitivity) -> Row:
    return {
        "stack": result.stack.name,
        "episodes": len(result.stack.rows),
        "contribution_margin": result.economics.contribution_margin,
        "profit_usd_per_run": result.profit,
        "tornado": [
            {
                "price": bar.key,
                "unit": bar.range.unit,
                "low": bar.range.low,
                "value": bar.range.value,
                "high": bar.range.high,
                "range": bar.range.origin,
                "contribution_margin": [bar.margin_at_low, bar.margin_at_high],
                "profit_usd_per_run": [bar.profit_at_low, bar.profit_at_high],
            }
            for bar in result.bars
        ],
        "maps": [
            {
                "x": {"price": each.x.key, "unit": each.x.unit or "factor", "values": each.x.values.tolist()},
                "y": {"price": each.y.key, "unit": each.y.unit or "factor", "values": each.y.values.tolist()},
                "profit_usd_per_run": [[_known(value) for value in row] for row in each.profit.tolist()],
            }
            for each in result.maps
        ],
        "break_even": None if result.spread is None else _break_even(result.spread),
    }


def _break_even(spread: BreakEvenSpread) -> Row:
    return {
        "never": spread.never,
        "runs": quantiles(spread),
        "within_runs": spread.curve_runs.tolist(),
        "probability": spread.curve_probability.tolist(),
    }


def quantiles(spread: BreakEvenSpread) -> dict[str, float | None]:
    """Median and 95 % interval of the break-even point [run]; None: never."""
    low, middle, high = np.quantile(spread.runs, QUANTILES, method="inverted_cdf")
    return {
        key: float(number) if np.isfinite(number) else None
        for key, number in (("value", middle), ("low", low), ("high", high))
    }


def _known(value: float) -> float | None:
    """A figure for JSON, which has no NaN."""
    return None if math.isnan(value) else value

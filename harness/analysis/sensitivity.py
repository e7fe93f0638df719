"""What the money of a stored run hangs on.

Every price, pairs of prices, and what its deliveries leave open.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.analysis.evaluator import Evaluate, evaluator, profits
from harness.analysis.price_ranges import PriceAxis, Range, axes, price_ranges, ranges
from harness.analysis.repricing import Choices
from harness.economics.break_even import break_even_probability, profit_draws
from harness.economics.cost_model import Economics
from harness.economics.cost_terms import OPTIONAL_TERMS
from harness.economics.prices import Prices
from harness.economics.valuation import MOST_LEFT_OUT, has_too_few, missions, tells_of_rare
from harness.metrics.columns import Row
from harness.storage.documents import as_json
from harness.study.stored_run import StoredRun, StoredStack
from navstack.errors import InputError
from navstack.types import FloatArray

MAPS = (("delivery_fee", "injury.costs"), ("robot_cost", "deliveries_per_day"))
QUANTILES = (0.025, 0.5, 0.975)
CURVE_RUNS = np.geomspace(100.0, 1e6, 61)  # [run] at which the probability of break-even is told


@dataclass(frozen=True, slots=True)
class TornadoBar(Range):
    """What one price does between the ends of its range, all else as it is."""

    price: str  # its key
    contribution_margin: tuple[float, float]  # [USD/run] at the low and the high end
    profit_usd_per_run: tuple[float, float]

    @property
    def swing(self) -> float:
        """Difference in profit between the ends of the range [USD/run]."""
        low, high = self.profit_usd_per_run
        return abs(high - low)


@dataclass(frozen=True, slots=True, eq=False)
class TwoWay:
    """Profit over two axes."""

    x: PriceAxis
    y: PriceAxis
    # (y, x) [USD/run]; NaN where the refund would be less than the fee that it contains
    profit: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class BreakEvenSpread:
    """What the deliveries leave open about the break-even point."""

    runs: FloatArray  # (draws,) [run] in each resample; inf: never
    never: float  # share of resamples in which the margin is not positive
    curve_runs: FloatArray  # [run]
    curve_probability: FloatArray  # that the capex is paid back within these runs


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivity:
    """All of it for one stack."""

    stack: StoredStack
    economics: Economics
    profit: float  # [USD/run] margin less the capex spread over the robot's life
    bars: list[TornadoBar]
    maps: list[TwoWay]
    # None: one mission, or deliveries that are all alike, tell nothing of it
    spread: BreakEvenSpread | None
    life_runs: float  # [run] of the robot


def sensitivities(
    run: StoredRun,
    choices: Choices,
    maps: Sequence[tuple[str, str]],
) -> list[Sensitivity]:
    """Work out every stack of a run.

    Args:
        run: the run.
        choices: prices and optional terms to start from.
        maps: pairs of prices or of groups of prices, such as :data:`MAPS`.

    Raises:
        InputError: an unknown price, no finished delivery, or a margin that is undefined.
    """
    stacks = [stack for stack in run.stacks if stack.rows]
    if not stacks:
        raise InputError(
            f"run folder '{run.folder}' has no finished delivery; there is nothing to vary"
        )
    for stack in stacks:
        _require_margin(stack)
    return [_of_stack(run, stack, choices, maps) for stack in stacks]


def _require_margin(stack: StoredStack) -> None:
    """Check that so few deliveries have no result that the margin is told.

    Raises:
        InputError: there are more.
    """
    finished, errors = len(stack.rows), stack.errors
    if has_too_few(finished, errors):
        raise InputError(
            f"{stack.name}: the margin is undefined, because {errors} of {finished + errors} "
            f"deliveries have no result, more than {MOST_LEFT_OUT:.0%}; drive them again with "
            "navbench run --resume DIR --retry-errors"
        )


def sensitivity_document(
    run: StoredRun,
    results: Sequence[Sensitivity],
    choices: Choices,
    figures: Sequence[str],
) -> Row:
    """The JSON document of ``navbench sensitivity``."""
    return {
        "schema": 1,
        "folder": str(run.folder),
        "settings": dict(choices.settings),
        "accounting": choices.prices.accounting,
        "optional_terms": list(choices.optional.names),
        "runs": [_document(result) for result in results],
        "figures": list(figures),
    }


def _of_stack(
    run: StoredRun,
    stack: StoredStack,
    choices: Choices,
    pairs: Sequence[tuple[str, str]],
) -> Sensitivity:
    evaluate = evaluator(run, stack, choices)
    economics, prices = evaluate({})
    optional = [key for name in choices.optional.names for key in OPTIONAL_TERMS[name].prices]
    margin = profits(run, stack, choices)
    clusters, spread = missions(stack.rows), None
    if tells_of_rare(margin, clusters):
        spread = break_even_spread(economics.capex_usd, *profit_draws(margin, clusters, run.seed))
    return Sensitivity(
        stack=stack,
        economics=economics,
        profit=profit_per_run(economics, prices),
        bars=tornado(evaluate, price_ranges(prices) | ranges(choices.optional.prices, optional)),
        maps=[two_way(evaluate, *axes(prices, *pair)) for pair in pairs],
        spread=spread,
        life_runs=prices.robot_life_runs,
    )


def _document(result: Sensitivity) -> Row:
    return {
        "stack": result.stack.name,
        "episodes": len(result.stack.rows),
        "contribution_margin": result.economics.contribution_margin,
        "profit_usd_per_run": result.profit,
        "tornado": [{"price": bar.price, **as_json(bar)} for bar in result.bars],
        "maps": [
            {
                "x": _axis_document(each.x),
                "y": _axis_document(each.y),
                "profit_usd_per_run": [
                    [_finite(value) for value in row] for row in each.profit.tolist()
                ],
            }
            for each in result.maps
        ],
        "break_even": _spread_document(result.spread),
    }


def _spread_document(spread: BreakEvenSpread | None) -> Row | None:
    if spread is None:
        return None
    return {
        "never": spread.never,
        "runs": quantiles(spread),
        "within_runs": spread.curve_runs.tolist(),
        "probability": spread.curve_probability.tolist(),
    }


def _finite(value: float) -> float | None:
    """A number of the JSON document; None where it is none."""
    if math.isfinite(value):
        return float(value)
    return None


def _axis_document(axis: PriceAxis) -> Row:
    return {"price": axis.key, "unit": axis.unit or "factor", "values": axis.values.tolist()}


def quantiles(spread: BreakEvenSpread) -> dict[str, float | None]:
    """Median and 95 % interval of the break-even point [run]; None: never."""
    low, middle, high = np.quantile(spread.runs, QUANTILES, method="inverted_cdf")
    return {"value": _finite(middle), "low": _finite(low), "high": _finite(high)}


def profit_per_run(economics: Economics, prices: Prices) -> float:
    """Contribution margin less the capital expenditure spread over the robot's life [USD/run].

    Raises:
        InputError: the margin is undefined.
    """
    return _margin(economics) - economics.capex_usd / prices.robot_life_runs


def _margin(economics: Economics) -> float:
    if economics.contribution_margin is None:
        raise InputError(
            "the margin is undefined because the cargo was not simulated; run with a world that "
            "has cargo"
        )
    return economics.contribution_margin


def tornado(evaluate: Evaluate, varied: Mapping[str, Range]) -> list[TornadoBar]:
    """One bar per price, the widest swing of profit first."""
    bars = []
    for key, span in varied.items():
        low = evaluate({key: span.low})
        high = evaluate({key: span.high})
        bars.append(
            TornadoBar(
                **dataclasses.asdict(span),
                price=key,
                contribution_margin=(_margin(low[0]), _margin(high[0])),
                profit_usd_per_run=(profit_per_run(*low), profit_per_run(*high)),
            )
        )
    return sorted(bars, key=lambda bar: (-bar.swing, bar.price))


def two_way(evaluate: Evaluate, x: PriceAxis, y: PriceAxis) -> TwoWay:
    """Profit at every combination of two axes, see :class:`TwoWay`."""
    profit = np.empty((y.factors.size, x.factors.size))
    for i, up in enumerate(y.factors):
        for j, right in enumerate(x.factors):
            values = {key: value * right for key, value in x.base.items()}
            values |= {key: value * up for key, value in y.base.items()}
            economics, prices = evaluate(values)
            profit[i, j] = profit_per_run(economics, prices) if prices.food_price >= 0.0 else np.nan
    return TwoWay(x, y, profit)


def break_even_spread(
    capex_usd: float,
    means: FloatArray,
    deviations: FloatArray,
) -> BreakEvenSpread:
    """What resampled profits of a delivery (draws,) [USD/run] say of the break-even point."""
    runs = np.divide(capex_usd, means, out=np.full_like(means, np.inf), where=means > 0.0)
    curve = [break_even_probability(float(n), capex_usd, means, deviations) for n in CURVE_RUNS]
    return BreakEvenSpread(runs, float((means <= 0.0).mean()), CURVE_RUNS, np.array(curve))

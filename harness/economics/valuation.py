"""What deliveries come to: their means, what they cost and earn, and how sure all that is."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from harness.economics.accountings import PUBLISHED, accounted
from harness.economics.break_even import break_even_probability, profit_draws
from harness.economics.cost_model import Economics, price, running
from harness.economics.cost_terms import DOLLARS, MARGIN
from harness.economics.measured import FLAT_WAY, Measured
from harness.economics.optional_terms import (
    NO_EXTRA_COSTS,
    ExtraCosts,
    OptionalTerms,
    all_optional_costs,
    optional_costs,
    together,
)
from harness.economics.prices import Prices
from harness.economics.rates import MARGIN_PER_KM, NEEDS_PEOPLE, event_rates, margin_per_km
from harness.metrics.catalog import EPISODE_METRICS
from harness.metrics.columns import Row
from harness.metrics.metric import Metric
from harness.metrics.summary import summarize, summarize_more
from harness.statistics.bootstrap import (
    IntArray,
    bootstrap_cvar,
    cvar,
    number_clusters,
)
from harness.statistics.interval import Interval, interval_json, wilson_interval
from harness.statistics.mean_intervals import mean_intervals
from harness.storage.rows import values
from harness.world.outcome import OUTCOMES, Outcome
from navstack.types import FloatArray

MOST_LEFT_OUT = 0.01  # share of deliveries without a result beyond which no margin is told
# column of deliveries among nobody: what meetings with people cost them on average [USD]
MEETINGS_LOSS = "meetings_loss_usd"
CENT = 0.01  # [USD] deliveries whose costs differ by less are alike
# columns that tell missions apart
MISSION = ("map", "start_x_m", "start_y_m", "start_yaw_rad", "goal_x_m", "goal_y_m")


class Priced(Protocol):
    """What of a stack decides its costs."""

    @property
    def carries(self) -> tuple[str, ...]:
        """Sensors that have a price."""

    @property
    def localizer(self) -> str:
        """Name of its localizer."""

    @property
    def data_collection(self) -> bool:
        """Whether data collection is part of its CAPEX."""


@dataclass(frozen=True, slots=True)
class Risk:
    """How bad it can get.

    None where the cargo is not modelled or the deliveries are too few to tell.
    """

    opex_cvar95_usd_per_run: Interval | None  # [USD/run] mean cost of the worst 5 % of deliveries
    within_runs: float  # [run] the robot's life
    # that the profits summed up pay back the capex within these runs
    break_even_probability: float | None

    def as_json(self) -> Row:
        """The risk as one JSON object."""
        worst = self.opex_cvar95_usd_per_run
        return {
            "opex_cvar95_usd_per_run": None if worst is None else worst.as_json(),
            "break_even": {
                "within_runs": self.within_runs,
                "probability": self.break_even_probability,
            },
        }


@dataclass(frozen=True, slots=True)
class Valuation:
    """What the finished deliveries of one stack come to."""

    measured: Row  # keys of the paper's simulation table
    more: Row  # means that the paper's table does not have
    economics: Economics
    # of shares (Wilson), of means (bootstrap over missions) and of events (Poisson)
    intervals: dict[str, Interval]
    risk: Risk
    terms: dict[str, ExtraCosts]  # the optional ones, each by itself


def value(
    rows: Sequence[Row],
    stack: Priced,
    prices: Prices,
    seed: int,
    optional: OptionalTerms | None = None,
    left_out: int = 0,
) -> Valuation:
    """Sum up finished deliveries and price them.

    Where too many are left out, nothing is said of the margin: it may be theirs that matter.

    Args:
        rows: of ``episodes.parquet``, at least one, none of an error; what they cost stands in them
            at these prices.
        stack: that made them.
        prices: the price file.
        seed: of the resamples.
        optional: costs beyond the paper; None: none.
        left_out: number of deliveries without a result.
    """
    force = prices.rolling_resistance_force
    summary = summarize(rows, force)
    measured = deliveries(rows, force)
    means = Measured(**summary, **beside_the_paper(rows))
    terms = optional_costs(means, stack.localizer, prices, optional)
    extra = all_optional_costs(measured, stack.localizer, prices, optional)
    costs = running(measured, prices, extra)
    economics = price(means, stack.carries, stack.data_collection, prices, together(terms.values()))
    clusters = missions(rows)
    published = {key: getattr(measured, key) for key in summary if key not in OUTCOMES}
    dollars = {key: costs.amounts[key] for key in DOLLARS}
    further = [metric for metric in EPISODE_METRICS if not metric.is_published]
    valuation = Valuation(
        measured=summary,
        more=summarize_more(rows),
        economics=economics,
        intervals={
            **_rates(rows),
            **mean_intervals(published, clusters, seed),
            **mean_intervals(mean_columns(rows, further), clusters, seed),
            **mean_intervals(dollars, clusters, seed, CENT),
            **event_rates(rows, prices),
            **_per_km(costs.contribution_margin, rows, clusters, seed),
        },
        risk=_risk(
            costs.opex,
            costs.contribution_margin,
            economics.capex_usd,
            clusters,
            prices,
            seed,
        ),
        terms=terms,
    )
    if has_too_few(len(rows), left_out):
        return _without_margin(valuation)
    return valuation


def has_too_few(finished: int, left_out: int) -> bool:
    """Whether more than :data:`MOST_LEFT_OUT` of the deliveries have no result."""
    return left_out > MOST_LEFT_OUT * (finished + left_out)


def _without_margin(valuation: Valuation) -> Valuation:
    economics, risk = valuation.economics, valuation.risk
    return replace(
        valuation,
        economics=replace(
            economics,
            running=replace(economics.running, contribution_margin=None),
            break_even_runs=None,
            break_even_days=None,
        ),
        intervals={
            key: each
            for key, each in valuation.intervals.items()
            if key not in (MARGIN, MARGIN_PER_KM)
        },
        risk=replace(risk, break_even_probability=None),
    )


def deliveries(rows: Sequence[Row], rolling_resistance_force: float) -> Measured:
    """What a run sums up, delivery by delivery: arrays in place of means.

    None where one is undefined.
    """
    columns = mean_columns(rows, [metric for metric in EPISODE_METRICS if metric.is_published])
    outcomes = np.array(values(rows, "outcome"))
    shares = {outcome: (outcomes == outcome).astype(np.float64) for outcome in OUTCOMES}
    if (outcomes == Outcome.ARRIVED.value).any():
        shares |= {"sla": np.array([np.nan]), "spoiled": np.array([np.nan])}
    power = rolling_resistance_force * columns["avg_velocity_mps"] / 1000.0
    known: dict[Any, FloatArray] = {**shares, **columns, "avg_mechanical_power_kw": power}
    fields: dict[Any, Any] = {
        key: None if np.isnan(found).any() else found for key, found in known.items()
    }
    fields["further_km"] = further_ways(rows)
    fields["back_assistance"] = back_assistance(rows)
    return Measured(**fields)


def beside_the_paper(rows: Sequence[Row]) -> dict[str, float]:
    """Means of what the paper's table does not have, by field of :class:`Measured`."""
    each = {"further_km": further_ways(rows), "back_assistance": back_assistance(rows)}
    return {name: float(found.mean()) for name, found in each.items()}


def back_assistance(rows: Sequence[Row]) -> FloatArray:
    """A 1 for each delivery whose way back ended in physical assistance, shape (n,)."""
    ends = [end == Outcome.PHYSICAL_ASSISTANCE.value for end in values(rows, "way_back")]
    return np.array(ends, dtype=np.float64)


def further_ways(rows: Sequence[Row]) -> FloatArray:
    """Shortest way [km] of each delivery beyond ``FLAT_WAY``, shape (n,); 0 without success."""
    ways = np.maximum(np.nan_to_num(column(rows, "shortest_path_m")) / 1000.0 - FLAT_WAY, 0.0)
    succeeded: FloatArray = np.array(values(rows, "outcome")) == Outcome.SLA.value
    return ways * succeeded


def mean_columns(
    rows: Sequence[Row], metrics: Sequence[Metric] = EPISODE_METRICS
) -> dict[str, FloatArray]:
    """Each delivery's share in the means of metrics, shape (n,), by the key of the mean.

    NaN where undefined.
    """
    return {
        metric.mean_key: column(rows, metric.key) / metric.mean_divisor
        for metric in metrics
        if metric.mean_key
    }


def column(rows: Sequence[Row], key: str) -> FloatArray:
    """A column (n,) of rows; NaN where it is null."""
    return np.array(
        [np.nan if each is None else each for each in values(rows, key)], dtype=np.float64
    )


def margins(
    rows: Sequence[Row],
    prices: Prices,
    events: Sequence[Row] = (),
    accounting: str = PUBLISHED,
    extra: ExtraCosts = NO_EXTRA_COSTS,
) -> FloatArray | None:
    """Each delivery's contribution margin [USD], shape (n,).

    That of one among nobody is less what meetings cost it. None where the cargo of one is not
    modelled.

    Args:
        rows: of the deliveries.
        prices: the price file.
        events: rows of ``events.parquet``, for accountings other than the published one.
        accounting: a name of :data:`harness.economics.accountings.ACCOUNTINGS`.
        extra: costs beyond the paper.
    """
    each = deliveries(rows, prices.rolling_resistance_force)
    if accounting != PUBLISHED:
        each = accounted(each, rows, events, accounting, prices)
    margin = running(each, prices, extra).contribution_margin
    if margin is None:
        return None
    found: FloatArray = np.asarray(margin, dtype=np.float64) - meetings_losses(rows)
    return found


def meetings_losses(rows: Sequence[Row]) -> FloatArray:
    """What meetings cost deliveries among nobody on average [USD], shape (n,); 0: of others."""
    return np.array([loss or 0.0 for loss in values(rows, MEETINGS_LOSS)])


def missions(rows: Sequence[Row]) -> IntArray:
    """Number of each row's mission, in order of appearance."""
    return number_clusters(list(zip(*(values(rows, key) for key in MISSION), strict=True)))


def _per_km(
    margin: FloatArray | None,
    rows: Sequence[Row],
    clusters: IntArray,
    seed: int,
) -> dict[str, Interval]:
    if margin is None:
        return {}
    each = np.broadcast_to(np.asarray(margin, dtype=np.float64), clusters.shape)
    return {MARGIN_PER_KM: margin_per_km(each, rows, clusters, seed)}


def _rates(rows: Sequence[Row]) -> dict[str, Interval]:
    outcomes = values(rows, "outcome")
    names: Sequence[str] = OUTCOMES
    if Outcome.ARRIVED.value in outcomes:
        names = NEEDS_PEOPLE
    return {name: wilson_interval(outcomes.count(name), len(rows)) for name in names}


def _risk(
    opex: FloatArray | None,
    margin: FloatArray | None,
    capex: float,
    clusters: IntArray,
    prices: Prices,
    seed: int,
) -> Risk:
    life = prices.robot_life_runs
    if opex is None or margin is None or clusters.max() == 0:
        return Risk(None, life, None)
    alike = Interval(cvar(opex), None, None, len(opex))  # nothing is known of what is rare
    worst = alike
    if not (float(np.ptp(opex)) <= CENT):
        worst = bootstrap_cvar(opex, np.random.default_rng(seed), clusters=clusters)
    if not tells_of_rare(margin, clusters):
        return Risk(worst, life, None)
    means, deviations = profit_draws(margin, clusters, seed)
    return Risk(worst, life, break_even_probability(life, capex, means, deviations))


def tells_of_rare(margin: FloatArray, clusters: IntArray) -> bool:
    """Whether resamples of margins [USD], shape (n,), say anything.

    Of one mission, or alike to a cent, they do not.
    """
    return bool(clusters.max() > 0 and np.ptp(margin) > CENT)


def valuation_document(valuation: Valuation | None) -> Row:
    """What ``navbench run`` tells of a stack's deliveries and their money; None: there are none."""
    if valuation is None:
        return {
            "outcomes": dict.fromkeys(OUTCOMES),
            "measured": None,
            "economics": None,
            "intervals": {},
            "risk": None,
        }
    intervals = valuation.intervals
    return {
        "outcomes": {name: interval_json(intervals.get(name)) for name in OUTCOMES},
        "measured": {**valuation.measured, **valuation.more},
        "economics": valuation.economics.as_json(),
        "intervals": {name: interval.as_json() for name, interval in intervals.items()},
        "risk": valuation.risk.as_json(),
    }

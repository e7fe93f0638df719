"""What the arms of an ablation did, how they differ, and what an injected error costs."""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.ablation.arms import KINDS, injected_kind, injected_level, is_buildable
from harness.analysis.audited import audit_sides
from harness.analysis.compare import compare
from harness.analysis.pairing import have_common_missions
from harness.analysis.rare import margin_with_unseen
from harness.analysis.side import Side
from harness.audit.auditor import Audit
from harness.economics.break_even import break_even_runs
from harness.economics.cost_terms import MARGIN
from harness.economics.prices import Prices
from harness.economics.valuation import CENT, margins, missions
from harness.meetings.estimators import DELIVERIES
from harness.metrics.columns import Row
from harness.statistics.bootstrap import bootstrap_quantile
from harness.statistics.interval import NO_INTERVAL, Interval
from harness.statistics.paired import PairedDifference, paired_slope, together
from harness.study.drive import StackResult
from harness.study.stored_run import StoredRun
from harness.task.stack import GEOMETRY, TRUTH, Stack
from navstack.errors import UnknownNameError
from navstack.params.extensions import uses_map
from navstack.types import FloatArray, IntArray

COMPARED = (MARGIN, "sla", "avg_localization_error_median_m")  # metrics of harness.analysis.compare
# Quantiles over the deliveries of a quantile over each delivery's ticks: key, column, level, factor
# on the column.
ERRORS = (
    ("localization_error_median_m", "localization_error_median_m", 0.5, 1.0),
    ("localization_error_p95_m", "localization_error_p95_m", 0.95, 1.0),
    ("heading_error_median_deg", "heading_error_median_rad", 0.5, 180.0 / np.pi),
    ("heading_error_p95_deg", "heading_error_p95_rad", 0.95, 180.0 / np.pi),
)


@dataclass(frozen=True, slots=True)
class AblationDeclaration:
    """What of an ablation its run folder does not know otherwise."""

    stack: str  # of which all arms are made
    against: str  # arm to which the others are compared
    sources: tuple[str, ...] = ()  # where the localizers' parameters are from, in sentences
    estimator: str = DELIVERIES  # of harness.meetings.estimators
    # [USD] that a margin may lie off; an arm drives until then. None: all drive as often
    within: float | None = None

    def check(self, arms: Sequence[Stack]) -> None:
        """Check that there is such an arm.

        Raises:
            UnknownNameError: there is not.
        """
        names = [arm.name for arm in arms]
        if self.against not in names:
            raise UnknownNameError("localizer", self.against, names)


@dataclass(frozen=True, slots=True)
class Arm:
    """What one arm did, and what it costs."""

    stack: Stack
    result: StackResult
    errors: dict[str, Interval]  # by key of ERRORS
    margin: Interval  # [USD/run]
    unseen: Interval | None  # the same, admitting an unseen loss; None: it is undefined
    # [USD] with the sensors that it needs; None: it cannot be built, or nothing is known
    capex_usd: float | None
    break_even: Interval  # [run] over that of ``unseen``; None as the upper end: never

    @property
    def name(self) -> str:
        """Of the arm."""
        return self.stack.name


@dataclass(frozen=True, slots=True)
class ArmDifference:
    """One metric of one arm less that of another."""

    arm: str
    against: str
    metric: str
    paired: PairedDifference  # adjusted for all comparisons of this metric
    unseen: Interval | None = None  # of the margin, admitting an unseen loss


@dataclass(frozen=True, slots=True)
class ErrorPrice:
    """What an error costs: minus the slope of the margin over the injected error."""

    kind: str  # of harness.ablation.arms.KINDS
    levels: tuple[float, ...]  # in the kind's unit, 0 included
    price: Interval  # [USD/run] per unit


@dataclass(frozen=True, slots=True)
class Ablation:
    """The whole result."""

    declaration: AblationDeclaration
    episodes: int  # asked for, per arm
    arms: tuple[Arm, ...]
    differences: tuple[ArmDifference, ...]
    prices: tuple[ErrorPrice, ...]
    audits: dict[str, Audit]  # of each arm that can be built, against the reference
    run: StoredRun  # its folder

    def of(self, metric: str) -> list[ArmDifference]:
        """The differences in one metric."""
        return [difference for difference in self.differences if difference.metric == metric]


def analyse(
    declaration: AblationDeclaration,
    results: Sequence[StackResult],
    run: StoredRun,
    prices: Prices,
    episodes: int,
) -> Ablation:
    """Work out everything that the report tells.

    Args:
        declaration: which arm the others are compared to.
        results: one per arm, in their order.
        run: the same deliveries, as their folder has them.
        prices: at which they were priced.
        episodes: deliveries asked for per arm.
    """
    sides = {stored.name: Side(run, stored) for stored in run.stacks}
    rows = {name: side.stack.rows for name, side in sides.items()}
    arms = tuple(_arm(result, sides[result.stack.name]) for result in results)
    return Ablation(
        declaration,
        episodes,
        arms,
        tuple(_differences(arms, declaration.against, sides)),
        tuple(_prices(arms, rows, prices, run.seed)),
        dict(_audits(arms, declaration.against, sides)),
        run,
    )


def _arm(result: StackResult, side: Side) -> Arm:
    valuation, rows, seed = result.valuation, side.stack.rows, side.run.seed
    unseen = margin_with_unseen(side.run, side.stack)
    capex, break_even = None, NO_INTERVAL
    if valuation is not None and is_buildable(result.stack):
        capex = valuation.economics.capex_usd
        break_even = break_even_interval(capex, unseen or NO_INTERVAL)
    return Arm(
        stack=result.stack,
        result=result,
        errors={
            key: _quantile(rows, column, level, factor, seed)
            for key, column, level, factor in ERRORS
        },
        margin=result.intervals.get(MARGIN, NO_INTERVAL),
        unseen=unseen,
        capex_usd=capex,
        break_even=break_even,
    )


def _quantile(rows: Sequence[Row], column: str, level: float, factor: float, seed: int) -> Interval:
    """Quantile over the deliveries in which the column is defined."""
    known = [row for row in rows if row[column] is not None]
    values = factor * np.array([row[column] for row in known])
    return bootstrap_quantile(values, level, np.random.default_rng(seed), clusters=missions(known))


def break_even_interval(capex_usd: float, margin: Interval) -> Interval:
    """Break-even point [run] over the interval of the margin [USD/run].

    An end is None where the margin is a loss.

    An upper end that is None beside a lower one means that break-even may never come.
    """
    low, high = break_even_runs(capex_usd, margin.high), break_even_runs(capex_usd, margin.low)
    return Interval(break_even_runs(capex_usd, margin.value), low, high, margin.n)


def _differences(
    arms: Sequence[Arm],
    against: str,
    sides: Mapping[str, Side],
) -> Iterator[ArmDifference]:
    """Every arm against the reference, and each wrong map against the right one."""
    pairs = compared_pairs([arm.stack for arm in arms], against)
    measured = {arm.name: arm.result.intervals.keys() for arm in arms}
    known = {}
    for name, other in pairs:
        metrics = [key for key in COMPARED if key in measured[name] and key in measured[other]]
        if metrics and have_common_missions(sides[other], sides[name]):
            known[name, other] = compare(sides[other], sides[name], metrics)
    for metric in COMPARED:
        family = {pair: each for pair, each in known.items() if metric in each.differences}
        adjusted = together([each.differences[metric].paired for each in family.values()])
        for (pair, each), paired in zip(family.items(), adjusted, strict=True):
            unseen = None
            if metric == MARGIN:
                unseen = each.unseen
            yield ArmDifference(*pair, metric, paired, unseen)


def compared_pairs(arms: Sequence[Stack], against: str) -> list[tuple[str, str]]:
    """Every arm with the reference, and each wrong map with the right one: by name, once."""
    pairs = [(arm.name, against) for arm in arms if arm.name != against]
    for wrong, right in wrong_maps(arms):
        if (wrong, right) not in pairs and (right, wrong) not in pairs:
            pairs.append((wrong, right))
    return pairs


def _audits(
    arms: Sequence[Arm],
    against: str,
    sides: Mapping[str, Side],
) -> Iterator[tuple[str, Audit]]:
    reference = sides[against]
    for arm in arms:
        side = sides[arm.name]
        is_another = arm.name != against and is_buildable(arm.stack)
        if is_another and have_common_missions(reference, side):
            yield arm.name, audit_sides(reference, side)


def wrong_maps(arms: Sequence[Stack]) -> list[tuple[str, str]]:
    """Arms on a navigation mesh, each with the same localizer's arm on the geometry map."""
    localizer_on = {(arm.localizer, arm.localization_map): arm.name for arm in arms}
    return [
        (name, localizer_on[localizer, GEOMETRY])
        for (localizer, map_name), name in localizer_on.items()
        if map_name != GEOMETRY and uses_map(localizer) and (localizer, GEOMETRY) in localizer_on
    ]


def _prices(
    arms: Sequence[Arm],
    rows: dict[str, Sequence[Row]],
    prices: Prices,
    seed: int,
) -> Iterator[ErrorPrice]:
    """The price of each injected kind of error, over missions that every level finished."""
    for kind, levels in injected_levels([arm.stack for arm in arms]).items():
        own = _paired([rows[name] for name in levels])
        is_modelled = all(row["pieces_at_start"] is not None for rows in own for row in rows)
        found = [margins(each, prices) if is_modelled else None for each in own]
        known = [margin for margin in found if margin is not None]
        if not own[0] or len(known) < len(own):
            yield ErrorPrice(kind, tuple(levels.values()), NO_INTERVAL)
            continue
        yield error_price(kind, levels, np.column_stack(known), missions(own[0]), seed)


def injected_levels(arms: Sequence[Stack]) -> dict[str, dict[str, float]]:
    """How much of an error each arm has, by kind and name: 0 of the truth, in the kind's unit."""
    found: dict[str, dict[str, float]] = {}
    truth = [arm for arm in arms if arm.localizer == TRUTH and injected_kind(arm) is None]
    for kind in KINDS:
        injected = [arm for arm in arms if injected_kind(arm) == kind]
        if truth and injected:
            levels = {arm.name: injected_level(arm, kind) for arm in injected}
            found[kind] = {truth[0].name: 0.0, **levels}
    return found


def error_price(
    kind: str,
    levels: Mapping[str, float],
    margin: FloatArray,
    clusters: IntArray,
    seed: int,
) -> ErrorPrice:
    """What an error costs, from the margins of deliveries at every level.

    Args:
        kind: of the error.
        levels: of it, by arm.
        margin: [USD], shape (n, levels).
        clusters: number of each delivery's mission, shape (n,).
        seed: of random signs.
    """
    sizes = np.array(list(levels.values()))
    slope = paired_slope(sizes, -margin, clusters, np.random.default_rng(seed))
    centred = sizes - sizes.mean()
    apart = np.ptp(margin @ centred / (centred @ centred)) * np.ptp(sizes)
    if apart < CENT or np.ptp(margin, axis=1).max() < CENT:  # what is rare has not been seen
        slope = Interval(slope.value, None, None, slope.n)
    return ErrorPrice(kind, tuple(levels.values()), slope)


def _paired(rows: Sequence[Sequence[Row]]) -> list[list[Row]]:
    """The rows of the episodes that all have, in the same order."""
    by_episode = [{row["episode"]: row for row in own} for own in rows]
    common = sorted(set.intersection(*(set(own) for own in by_episode)))
    return [[own[episode] for episode in common] for own in by_episode]


def points(ablation: Ablation) -> list[tuple[Arm, Interval, Interval]]:
    """The arms that a figure of error against margin can show, with both, as tables tell them."""
    shown = (
        (arm, arm.errors["localization_error_median_m"], arm.unseen or NO_INTERVAL)
        for arm in ablation.arms
    )
    return list(itertools.filterfalse(lambda each: None in (each[1].value, each[2].value), shown))

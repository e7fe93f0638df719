"""Two stacks on the missions that they have in common.

Differences, how sure they are, and what stands against it.
"""

import dataclasses
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NoReturn

import numpy as np

from harness.analysis.apart import Apart, apart
from harness.analysis.pairing import paired_rows
from harness.analysis.rare import difference_with_unseen
from harness.analysis.side import Side
from harness.analysis.unlike import unlike
from harness.audit.auditor import Audit
from harness.economics.accountings import ACCOUNTINGS, PUBLISHED
from harness.economics.cost_model import running
from harness.economics.cost_terms import DOLLARS, MARGIN
from harness.economics.valuation import (
    CENT,
    deliveries,
    has_too_few,
    margins,
    mean_columns,
    missions,
)
from harness.metrics.catalog import EPISODE_METRICS, RUN_METRICS
from harness.metrics.columns import Row
from harness.metrics.metric import Better
from harness.statistics.bootstrap import IntArray, number_clusters
from harness.statistics.interval import Interval, interval_json
from harness.statistics.paired import PairedDifference, compare_pairs, together
from harness.study.stored_run import StoredRun
from harness.world.outcome import OUTCOMES
from navstack.errors import InputError, UnknownNameError
from navstack.types import FloatArray

EARNED = ("revenue", MARGIN)
FAMILY = (MARGIN,)  # what decides, unless metrics are named; their p values are adjusted together
SHORT = {"margin": MARGIN}  # as elsewhere on the command line
# metric -> accounting
ACCOUNTED = {f"contribution_margin_{name}": name for name in ACCOUNTINGS if name != PUBLISHED}


@dataclass(frozen=True, slots=True)
class Compared:
    """One metric of both sides over the pairs in which both have it."""

    first: float  # mean of the first
    second: float
    paired: PairedDifference
    in_family: bool  # whether p is adjusted together with others'; else it is for looking only
    better: Better

    @property
    def differs(self) -> bool:
        """Whether any pair does."""
        return self.paired.differs

    @property
    def p_holm(self) -> float | None:
        """P adjusted for the family's metrics in which some pair differs."""
        if self.in_family:
            return self.paired.p_holm
        return None


@dataclass(frozen=True, slots=True)
class OfADollar:
    """What resolves a difference of 1 USD a delivery with a power of 0.8."""

    pairs: int
    seconds: float | None  # of workers, for both sides; None: a run does not tell


@dataclass(frozen=True, slots=True)
class Comparison:
    """The second side against the first."""

    first: Side
    second: Side
    pairs: int
    left_out: tuple[int, int]  # finished deliveries of each side without a partner
    differences: dict[str, Compared]
    warnings: list[str]
    # of the margin's difference, admitting a loss not seen yet; None: it is not compared
    unseen: Interval | None
    dollar: OfADollar | None  # None: the margin is not compared, or differs alike on every mission
    audit: Audit | None = None  # of the second against the first; None: not asked for

    @property
    def apart(self) -> Apart | None:
        """The margins of all deliveries, paired or not; None: the margin is not compared."""
        if MARGIN not in self.differences:
            return None
        return apart(self.first, self.second)

    @property
    def family(self) -> list[str]:
        """Metrics whose p values are adjusted together."""
        return [key for key, entry in self.differences.items() if entry.in_family]


def side_of(run: StoredRun) -> Side:
    """The side that a run stands for.

    Raises:
        InputError: it has several stacks, or none.
    """
    if len(run.stacks) == 1:
        return Side(run, run.stacks[0])
    names = ", ".join(f"{run.folder}:{stack.name}" for stack in run.stacks)
    raise InputError(
        f"run folder '{run.folder}' has {len(run.stacks)} stacks; choose one of: {names}"
    )


def compare(first: Side, second: Side, metrics: Collection[str] = ()) -> Comparison:
    """Compare two sides, second minus first.

    Args:
        first: the one that is there.
        second: the one that is held against it.
        metrics: which to compare, the family of the adjusted p values; none: all that both sides
            have, of which ``FAMILY`` is the family, but not :data:`ACCOUNTED`.

    Raises:
        InputError: no mission in common, or a metric that is unknown or undefined.
    """
    rows = paired_rows(first, second)
    pairs = len(rows[0])
    columns = [
        _columns(side, own, metrics) for side, own in zip((first, second), rows, strict=True)
    ]
    keys = [key for key in columns[0] if key in columns[1]]
    named = [SHORT.get(key, key) for key in metrics]
    for key in named:
        if key not in keys:
            _refuse(key, (first, second), columns, [*keys, *ACCOUNTED])
    wanted = [key for key in keys if key in named or not named]
    clusters = missions(rows[0])
    known = {}
    for key in wanted:
        entry = _compare(columns[0][key], columns[1][key], clusters, key, first.run.seed)
        if entry is not None:
            in_family = bool(named) or key in FAMILY
            known[key] = dataclasses.replace(entry, in_family=in_family)
    family = [key for key, entry in known.items() if entry.in_family]
    adjusted = together([known[key].paired for key in family])
    for key, paired in zip(family, adjusted, strict=True):
        known[key] = dataclasses.replace(known[key], paired=paired)
    unseen = dollar = None
    if MARGIN in known:
        dollar = _of_a_dollar(first, second, known[MARGIN].paired)
        unseen = difference_with_unseen(
            first.run, second.run, columns[1][MARGIN] - columns[0][MARGIN], clusters
        )
    return Comparison(
        first=first,
        second=second,
        pairs=pairs,
        left_out=(len(first.stack.rows) - pairs, len(second.stack.rows) - pairs),
        differences=known,
        warnings=warnings_of(first, second),
        unseen=unseen,
        dollar=dollar,
    )


def _refuse(
    key: str, sides: Sequence[Side], columns: Sequence[Mapping[str, FloatArray]], known: list[str]
) -> NoReturn:
    """Say why a metric that was named is not compared.

    Raises:
        InputError: always; it is undefined for a side, or there is none of this name.
    """
    for side, own in zip(sides, columns, strict=True):
        if key in _directions() and key not in own:
            raise InputError(
                f"{key} is undefined on all common missions of {side.label}, e.g. as its cargo is "
                "not modelled; leave it out"
            )
    raise UnknownNameError("metric", key, known)


def _of_a_dollar(first: Side, second: Side, margin: PairedDifference) -> OfADollar | None:
    if margin.detectable is None:
        return None
    pairs = max(margin.fewest, math.ceil(margin.difference.n * margin.detectable**2))
    known = [side.seconds for side in (first, second) if side.seconds is not None]
    total = None
    if len(known) == 2:
        total = pairs * sum(known)
    return OfADollar(pairs, total)


def comparison_document(comparison: Comparison) -> Row:
    """The JSON document of ``navbench compare``."""
    first, second = comparison.first, comparison.second
    others = second.rates
    return {
        "schema": 1,
        "a": {
            "folder": str(first.run.folder),
            "stack": first.stack.name,
            "left_out": comparison.left_out[0],
        },
        "b": {
            "folder": str(second.run.folder),
            "stack": second.stack.name,
            "left_out": comparison.left_out[1],
        },
        "pairs": comparison.pairs,
        "differences": {
            key: {
                **entry.paired.difference.as_json(),
                "p": entry.paired.p,
                "p_holm": entry.p_holm,
                "pairs_needed": entry.paired.needed,
                "a": entry.first,
                "b": entry.second,
            }
            for key, entry in comparison.differences.items()
        },
        "rates": {
            key: {"a": own.as_json(), "b": others[key].as_json()}
            for key, own in first.rates.items()
        },
        "of_a_dollar": None if comparison.dollar is None else dataclasses.asdict(comparison.dollar),
        "margin_with_unseen": interval_json(comparison.unseen),
        "margin_of_all": _apart_document(comparison.apart),
        "audit": None if comparison.audit is None else comparison.audit.as_json(),
        "warnings": comparison.warnings,
    }


def _apart_document(found: Apart | None) -> Row | None:
    if found is None:
        return None
    return {
        **found.difference.as_json(),
        "deliveries": list(found.deliveries),
        "of_a_dollar": None if found.of_a_dollar is None else list(found.of_a_dollar),
        "seconds": found.seconds,
    }


def _columns(side: Side, rows: Sequence[Row], asked: Collection[str]) -> dict[str, FloatArray]:
    """Every quantity of a side, delivery by delivery, NaN where undefined.

    Those undefined for all are left out.

    Margins under other accountings are among them if they are ``asked`` for.
    """
    prices = side.run.prices()
    measured = deliveries(rows, prices.rolling_resistance_force)
    costs = running(measured, prices)
    columns: dict[str, FloatArray | None] = {
        **{key: getattr(measured, key) for key in OUTCOMES},
        **{key: costs.amounts[key] for key in DOLLARS},
        **mean_columns(rows),
        **{
            key: margins(rows, prices, side.run.events, name)
            for key, name in ACCOUNTED.items()
            if key in asked
        },
    }
    known = {
        key: np.broadcast_to(column, len(rows))
        for key, column in columns.items()
        if column is not None
    }
    return {key: column for key, column in known.items() if not np.isnan(column).all()}


def _compare(
    first: FloatArray,
    second: FloatArray,
    clusters: IntArray,
    key: str,
    seed: int,
) -> Compared | None:
    both = ~(np.isnan(first) | np.isnan(second))
    if not both.any():
        return None
    own = number_clusters(clusters[both].tolist())
    resolution = 0.0
    if key in DOLLARS or key in ACCOUNTED:
        resolution = CENT
    rng = np.random.default_rng(seed)
    paired = compare_pairs(first[both], second[both], own, rng, resolution)
    means = float(first[both].mean()), float(second[both].mean())
    return Compared(*means, paired, False, _directions()[key])


@cache
def _directions() -> dict[str, Better]:
    directions = {metric.key: metric.better for metric in RUN_METRICS}
    directions |= dict.fromkeys(DOLLARS, Better.LOWER) | dict.fromkeys(EARNED, Better.HIGHER)
    directions |= dict.fromkeys(ACCOUNTED, Better.HIGHER)
    return directions | {
        metric.mean_key: metric.better for metric in EPISODE_METRICS if metric.mean_key
    }


def warnings_of(first: Side, second: Side) -> list[str]:
    """Why the two might differ for other reasons than their stacks."""
    warnings = [
        f"{side.label}: {side.stack.errors} of {side.stack.errors + len(side.stack.rows)} "
        "deliveries have no result, which may be those that matter"
        for side in (first, second)
        if has_too_few(len(side.stack.rows), side.stack.errors)
    ]
    return warnings + unlike(first.run, second.run)

"""The comparisons of a page: stacks on the missions that they have in common."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from harness.analysis.compare import Comparison, compare
from harness.analysis.family import EVERY_PAIR_UP_TO, as_one_family
from harness.analysis.pairing import have_common_missions
from harness.economics.cost_terms import DOLLARS, MARGIN
from harness.metrics.catalog import EPISODE_METRICS, RUN_METRICS
from harness.metrics.metric import Metric
from harness.report.comparison import winner
from harness.report.page.entries import PageEntry
from harness.report.texts import OUTCOMES
from harness.statistics.interval import Interval, admitting
from harness.statistics.paired import PairedDifference

Json = dict[str, Any]

FOREMOST = (
    "contribution_margin",
    "opex",
    "pedestrian_safety",
    "property_damage",
    "service_compensation",
    "sla",
    "avg_runtime_h",
    "avg_distance_km",
    "avg_pedestrian_contacts",
    "avg_localization_error_mean_m",
)


def comparisons(entries: Sequence[PageEntry]) -> list[Json]:
    """Stacks on the missions that they have in common; pairs without one are left out.

    More than ``EVERY_PAIR_UP_TO`` are held against the first with the same missions only.
    """
    pairs = list(itertools.combinations(entries, 2))
    if len(entries) > EVERY_PAIR_UP_TO:
        pairs = _against_first(entries)
    pairs = [pair for pair in pairs if have_common_missions(pair[0].side, pair[1].side)]
    found = [compare(first.side, second.side) for first, second in pairs]
    earning = [each for each in found if MARGIN in each.differences]
    family = as_one_family(earning, [entry.side for entry in entries if not entry.no_margin])
    margins = dict(zip(map(id, earning), family.pairs, strict=True))
    return [
        _comparison(first, second, result, margins.get(id(result)))
        for (first, second), result in zip(pairs, found, strict=True)
    ]


def _against_first(entries: Sequence[PageEntry]) -> list[tuple[PageEntry, PageEntry]]:
    """Each entry with the first that drove its missions.

    On a page of several maps each map has a first one.
    """
    pairs = []
    for number, entry in enumerate(entries):
        first = next(
            (each for each in entries[:number] if have_common_missions(each.side, entry.side)), None
        )
        if first is not None:
            pairs.append((first, entry))
    return pairs


def _comparison(
    first: PageEntry, second: PageEntry, result: Comparison, margin: PairedDifference | None
) -> Json:
    """A pair of stacks; ``margin``: their difference as one of all pairs'."""
    known = [key for key, entry in result.differences.items() if entry.differs]
    order = [key for key in FOREMOST if key in known]
    order += [key for key in known if key not in FOREMOST]
    rows, titles = [], metric_titles()
    for key in order:
        entry = result.differences[key]
        if key == MARGIN and margin is not None:
            entry = replace(entry, paired=margin)
        span = entry.paired.difference
        if key == MARGIN:
            span = admitting(span, result.unseen)
        rows.append(
            {
                "metric": titles.get(key, key),
                "a": entry.first,
                "b": entry.second,
                "difference": interval_ends(span),
                "p": entry.paired.p_holm,
                "needed": entry.paired.needed,
                "better": winner(entry, first.label, second.label),
                "first": key in FOREMOST,
            }
        )
    return {
        "a": first.label,
        "b": second.label,
        "pairs": result.pairs,
        "leftOut": list(result.left_out),
        "warnings": result.warnings,
        "rows": rows,
        "alike": len(result.differences) - len(known),
    }


def metric_titles() -> dict[str, str]:
    """What the metrics of a comparison are called, with their units."""
    named = [(metric.key, metric) for metric in RUN_METRICS]
    named += [(metric.mean_key, metric) for metric in EPISODE_METRICS if metric.mean_key]
    titles = {}
    for key, metric in named:
        titles[key] = metric.title
        unit = _unit(metric)
        if unit:
            titles[key] += f" [{unit}]"
    return {
        **titles,
        **{outcome: text.capitalize() for outcome, text in OUTCOMES.items()},
        **{term: f"{term.replace('_', ' ').capitalize()} [USD/run]" for term in DOLLARS},
    }


def _unit(metric: Metric) -> str:
    """Of a metric's mean: where that is divided for another unit, the one at the end of its key."""
    if metric.mean_divisor == 1.0:
        return metric.unit
    return (metric.mean_key or "").rpartition("_")[2]


def interval_ends(interval: Interval) -> Json:
    """A value with its bounds, as the scripts know them."""
    return {"v": interval.value, "lo": interval.low, "hi": interval.high}

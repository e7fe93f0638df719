"""The figures of a page as plain values.

Headline, tables, waterfall, outcomes, profit, break-even, comparisons.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from harness.analysis.repricing import FORGIVEN, accounted_margins
from harness.economics.accountings import AT_FAULT, PUBLISHED
from harness.economics.cost_terms import COST_LABELS, MARGIN
from harness.economics.valuation import CENT, missions
from harness.report.page.comparisons import comparisons, interval_ends
from harness.report.page.entries import PageEntry
from harness.report.paper_tables import Column, number_text, span_text, table_notes
from harness.report.published import load_published, published_columns
from harness.report.repriced import SHOWN, TITLES, forgiven
from harness.report.short.run import PUBLISHED_BESIDE
from harness.report.short.setup import (
    robot_price_line,
    setup_line,
    unlike_line,
    unlike_published,
)
from harness.report.table_rows import LAYOUTS, RATE_LAYOUT, TableRow
from harness.report.texts import notes
from harness.report.verdict import earnings, rankings
from harness.statistics.interval import Interval
from harness.world.outcome import OUTCOMES, Outcome
from navstack.types import FloatArray

Json = dict[str, Any]

DRAWS = 2000  # resamples of a profit curve
MOST_DRAWN = 4_000_000  # resampled missions in memory
CURVE_POINTS = 150
BINS = 28  # of the break-even distribution


Accounted = Sequence[Mapping[str, Interval]]  # margins under each accounting, entry by entry


def figures(entries: Sequence[PageEntry]) -> Json:
    """All of them, by the names that the page's scripts know.

    Raises:
        InputError: rows and events of a run are of different states.
    """
    known = [accounted_margins(entry.run, [(entry.run, entry.stack)]) for entry in entries]
    return {
        "headline": headline(entries, known),
        "tables": tables(entries),
        "waterfall": waterfall(entries),
        "accountings": accountings(entries, known),
        "outcomes": outcomes(entries),
        "profit": profit(entries),
        "noProfit": [
            {"label": entry.label, "why": entry.no_margin} for entry in entries if entry.no_margin
        ],
        "breakEven": break_even(entries),
        "noBreakEven": [
            {"label": entry.label, "why": entry.no_draws} for entry in entries if entry.no_draws
        ],
        "comparisons": comparisons(entries),
    }


def headline(entries: Sequence[PageEntry], known: Accounted) -> Json:
    """What each stack earns per delivery, and the published stack that drives like these."""
    parties = [(each.label, each.side, each.valuation.intervals.get(MARGIN)) for each in entries]
    return {
        "stacks": [
            {
                **_headline(entry.column, entry),
                "atFault": interval_ends(each[AT_FAULT]) if AT_FAULT in each else None,
            }
            for entry, each in zip(entries, known, strict=True)
        ],
        "paper": _headline(_published(entries)[0]),
        "verdicts": rankings(parties) or earnings(parties),
        "setup": _setup(entries),
    }


def _setup(entries: Sequence[PageEntry]) -> list[str]:
    """What drove where, and what of that is not as in the paper: up to three lines for each run."""
    lines: list[str] = []
    for run in {id(entry.run): entry.run for entry in entries}.values():
        lines += [setup_line(run), unlike_line(unlike_published(run))]
        lines.append(robot_price_line(run, run.prices()))
    return list(dict.fromkeys(filter(None, lines)))


def _headline(column: Column, entry: PageEntry | None = None) -> Json:
    margin, risk = column.interval("contribution_margin"), None
    if entry:
        risk = entry.valuation.risk
    return {
        "label": column.title,
        "n": column.n,
        "margin": _quantity(column, "contribution_margin"),
        "loses": margin is not None and margin.sign < 0,
        "sla": _quantity(column, "sla"),
        "opex": _quantity(column, "opex"),
        "breakEvenRuns": column.values["break_even_runs"],
        "probability": risk.break_even_probability if risk else None,
        "worst": interval_ends(risk.opex_cvar95_usd_per_run)
        if risk and risk.opex_cvar95_usd_per_run
        else None,
    }


def _quantity(column: Column, key: str) -> Json:
    interval = column.interval(key)
    if interval is None:
        return {"v": column.values[key], "lo": None, "hi": None}
    return interval_ends(interval)


def _published(entries: Sequence[PageEntry]) -> list[Column]:
    """The paper's columns at the first run's prices, :data:`PUBLISHED_BESIDE` first."""
    columns = published_columns(load_published(), entries[0].prices)
    return sorted(columns, key=lambda column: column.title != PUBLISHED_BESIDE)


def tables(entries: Sequence[PageEntry]) -> Json:
    """Both tables as text, formatted as they are printed."""
    columns = [*(entry.column for entry in entries), *_published(entries)]
    return {
        "columns": [
            {"title": each.title, "n": each.n, "paper": each.published} for each in columns
        ],
        "beside": PUBLISHED_BESIDE,
        "layouts": [
            {
                "title": layout.title,
                "sections": [
                    {
                        "title": section.title,
                        "rows": [_row(row, columns) for row in section.all_rows],
                    }
                    for section in layout.sections
                ],
            }
            for layout in (*LAYOUTS, RATE_LAYOUT)
        ],
        "notes": table_notes(columns),
    }


def _row(row: TableRow, columns: Sequence[Column]) -> Json:
    cells = [
        [number_text(each.values.get(row.key), row), span_text(each.interval(row.key), row)]
        for each in columns
    ]
    return {"label": row.label, "bold": row.bold, "cells": cells}


def waterfall(entries: Sequence[PageEntry]) -> list[Json]:
    """From revenue to margin, stack by stack and for the published one [USD/run]."""
    columns = [(entry.column, entry.no_margin) for entry in entries]
    columns.append((_published(entries)[0], ""))
    bars = []
    for column, why in columns:
        label = column.title
        if column.published:
            label += " (paper)"
        bars.append(
            {
                "label": label,
                "revenue": column.values["revenue"],
                "terms": [[title, column.values[term]] for term, title in COST_LABELS.items()],
                "margin": _quantity(column, "contribution_margin"),
                "paper": column.published,
                "why": why,
            }
        )
    return bars


def accountings(entries: Sequence[PageEntry], known: Accounted) -> Json | None:
    """A row for each accounting, a cell for each stack.

    None where all are alike, or margins are undefined.
    """
    if not any(each[name] != each[PUBLISHED] for each in known if each for name in SHOWN):
        return None
    rows = [
        {
            "title": TITLES[name],
            "cells": [each[name].as_json() if name in each else None for each in known],
        }
        for name in SHOWN
    ]
    lines = [
        f"{entry.label}: {forgiven(each.get(FORGIVEN), entry.no_margin)}."
        for entry, each in zip(entries, known, strict=True)
    ]
    return {"notes": [*notes("accountings"), *lines], "rows": rows}


def outcomes(entries: Sequence[PageEntry]) -> list[Json]:
    """Deliveries by outcome, stack by stack and for the published one."""
    own = []
    for entry in entries:
        found = [row["outcome"] for row in entry.stack.rows]
        counts = {
            name: found.count(name) / len(found) for name in (*OUTCOMES, Outcome.ARRIVED.value)
        }
        own.append(
            {"label": entry.label, "n": len(found), "shares": counts, "errors": entry.stack.errors}
        )
    paper = _published(entries)[0]
    shares = {name: paper.values[name] or 0.0 for name in OUTCOMES}
    return [
        *own,
        {
            "label": f"{paper.title} (paper)",
            "n": paper.n,
            "shares": shares,
            "errors": 0,
            "paper": True,
        },
    ]


def profit(entries: Sequence[PageEntry]) -> list[Json]:
    """Profit summed up over the deliveries, with the band in which resampled ones lie."""
    return [
        {
            "label": entry.label,
            **profit_curve(entry.margin, missions(entry.stack.rows), entry.run.seed),
        }
        for entry in entries
        if entry.margin is not None and not entry.has_too_few
    ]


def profit_curve(margin: FloatArray, clusters: Any, seed: int) -> Json:
    """Sums over the first missions [USD], and the 95 % band of sums over resampled ones.

    The quantiles are None where there is one mission only, or all came to the same: too few to
    tell.

    Args:
        margin: of each delivery [USD], shape (n,).
        clusters: number of each delivery's mission, shape (n,).
        seed: of the resamples.
    """
    count = int(clusters.max()) + 1
    # missions in the order of their first delivery
    totals = np.bincount(clusters, weights=margin, minlength=count)
    shown = np.unique(np.linspace(0, count - 1, min(count, CURVE_POINTS)).round().astype(int))
    per_mission = len(margin) / count
    curve = {
        "k": _rounded((shown + 1) * per_mission, 1),
        "sum": _rounded(totals.cumsum()[shown], 2),
    }
    if np.ptp(totals) <= CENT:
        return {**curve, "low": None, "high": None}
    draws = max(200, min(DRAWS, MOST_DRAWN // count))
    drawn = totals[np.random.default_rng(seed).integers(0, count, (draws, count))].cumsum(axis=1)
    low, high = np.percentile(drawn[:, shown], (2.5, 97.5), axis=0)
    return {**curve, "low": _rounded(low, 2), "high": _rounded(high, 2)}


def break_even(entries: Sequence[PageEntry]) -> list[Json]:
    """How the break-even point is spread over the bootstrap's resamples."""
    return [
        {
            "label": entry.label,
            "capex": entry.valuation.economics.capex_usd,
            "runs": entry.valuation.economics.break_even_runs,
            "life": entry.valuation.risk.within_runs,
            **break_even_histogram(draws, entry.valuation.economics.capex_usd),
        }
        for entry in entries
        if (draws := entry.mean_draws()) is not None
    ]


def break_even_histogram(means: FloatArray, capex: float) -> Json:
    """Shares of resampled mean margins (draws,) [USD/run] by their break-even point.

    Bins are even in the logarithm; ``never`` is the share whose mean is not positive.
    """
    earning = means[means > 0.0]
    never = 1.0 - len(earning) / len(means)
    if not len(earning):
        return {"edges": [], "shares": [], "never": never}
    runs = np.log10(capex / earning)
    low, high = np.percentile(runs, (0.5, 99.5))
    middle, half = (low + high) / 2.0, max((high - low) / 2.0, 0.02)
    edges = np.linspace(middle - half, middle + half, BINS + 1)
    counts, _ = np.histogram(np.clip(runs, edges[0], edges[-1]), edges)
    return {
        "edges": _rounded(10.0**edges, 2),
        "shares": _rounded(counts / len(means), 5),
        "never": never,
    }


def _rounded(values: FloatArray, decimals: int) -> list[float]:
    rounded: list[float] = np.round(values, decimals).tolist()
    return rounded

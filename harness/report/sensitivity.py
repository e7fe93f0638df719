"""What ``navbench sensitivity`` found, and its figures.

Tornado, two-way maps, break-even.
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.analysis.price_ranges import STATED, PriceAxis
from harness.analysis.sensitivity import BreakEvenSpread, Sensitivity, TwoWay, quantiles
from harness.report.blocks import Block, Chart, Table, Text, declared, notes_of
from harness.report.figures import save_figure
from harness.report.numbers import count_text, number_text
from harness.report.texts import notes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BARS = 12  # widest ones that the tornado shows
MOST_STACKS = 3  # that the short text shows
SHORT_LINES, OTHER_LINES = 22, 5  # of the short text; of each stack beside its bars
BAR_INCH = 0.24
AT_LOW, AT_HIGH, LINE, NEVER = "#4575b4", "#d73027", "#222222", "#9a9a9a"
COLOURED = 0.97  # share of a map that its colours resolve
LARGE = 1000.0  # from which prices stand without decimals
LEGIBLE_SWING = 1e-3  # [USD/run] less is no bar


def sensitivity_blocks(results: Sequence[Sensitivity], figures: Sequence[str]) -> list[Block]:
    """The tornado and the break-even distribution of each stack."""
    blocks: list[Block] = []
    for result in results:
        blocks += [_tornado(result), Text(f"{result.stack.name}: {_break_even(result)}\n")]
    return [*blocks, *notes_of(notes("sensitivity")), *map(Chart, figures)]


def short_sensitivity(results: Sequence[Sensitivity], figures: Sequence[str]) -> list[Block]:
    """The widest bars of each stack, and its break-even point."""
    shown = results[:MOST_STACKS]
    bars = SHORT_LINES // len(shown) - OTHER_LINES
    blocks: list[Block] = []
    for result in shown:
        blocks += [_tornado(result, bars), Text(f"{result.stack.name}: {_break_even(result)}")]
    if len(results) > len(shown):
        blocks.append(Text(f"and {len(results) - len(shown)} more stacks: --full"))
    return [*blocks, *map(Chart, figures)]


def _tornado(result: Sensitivity, most: int | None = None) -> Table:
    rows = []
    for bar in result.bars[:most]:
        numbers = [f"{number:g}" for number in (bar.low, bar.value, bar.high)]
        money = [number_text(number, 4) for number in (*bar.profit_usd_per_run, bar.swing)]
        stated = {STATED: "source"}.get(bar.range, "")
        rows.append((bar.price, bar.unit, stated, *numbers, *money))
    return declared("tornado", rows, stack=result.stack.name, profit=result.profit)


def _break_even(result: Sensitivity) -> str:
    if (spread := result.spread) is None:
        return (
            "one mission, or deliveries that are all alike, tell nothing of how sure break-even is"
        )
    bounds = quantiles(spread)
    if bounds["value"] is None:
        middle = "no break-even point in most resamples"
    else:
        high = count_text(bounds["high"], "never")
        middle = f"breaks even after {bounds['value']:,.0f} runs [{bounds['low']:,.0f}, {high}]"
    share = f"{100.0 * spread.never:.1f} %"
    return f"{middle}; in {share} of the resamples of {len(result.stack.rows)} deliveries never"


def draw_figures(result: Sensitivity, folder: Path) -> list[Path]:
    """Write every figure of a stack as PDF and PNG; returns their paths.

    Raises:
        InputError: the folder cannot be written.
    """
    name = result.stack.name
    shown = max(1, min(BARS, sum(bar.swing >= LEGIBLE_SWING for bar in result.bars)))
    paths = save_figure(
        folder / f"{name}-tornado",
        1.1 + BAR_INCH * shown,
        partial(_draw_tornado, result=result, shown=shown),
    )
    for each in result.maps:
        stem = folder / f"{name}-map-{each.x.key}-{each.y.key}"
        paths += save_figure(stem, 3.6, partial(_two_way, study=each, name=name))
    if result.spread is None:
        return paths
    return paths + save_figure(
        folder / f"{name}-break-even",
        3.0,
        partial(_draw_break_even, result=result, spread=result.spread),
    )


def _draw_tornado(axes: "Axes", result: Sensitivity, shown: int) -> None:
    """Bars from the profit of today to that at either end of a price's range, the widest on top."""
    bars = result.bars[:shown]
    for place, bar in enumerate(bars):
        for profit, colour in zip(bar.profit_usd_per_run, (AT_LOW, AT_HIGH), strict=True):
            axes.barh(
                place,
                profit - result.profit,
                left=result.profit,
                height=0.62,
                color=colour,
                linewidth=0,
            )
    lowest = min(min(bar.profit_usd_per_run) for bar in bars)
    highest = max(max(bar.profit_usd_per_run) for bar in bars)
    margin = 0.16 * (highest - lowest or 1.0)
    for place, bar in enumerate(bars):
        ends = sorted(zip(bar.profit_usd_per_run, (bar.low, bar.high), strict=True))
        for (profit, number), side in zip(ends, ("right", "left"), strict=True):
            gap = 0.01
            if side == "right":
                gap = -0.01
            at = profit + gap * (highest - lowest)
            if number >= LARGE:
                text = f"{number:,.0f}"
            else:
                text = f"{number:.4g}"
            axes.text(at, place, text, va="center", ha=side, fontsize=6.5)
    axes.axvline(result.profit, color=LINE, linewidth=0.8)
    axes.set_yticks(range(shown), [_label(bar.price, bar.unit) for bar in bars])
    axes.set_xlim(lowest - margin, highest + margin)
    axes.invert_yaxis()
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel("profit over the robot's life [$/run]")
    axes.set_title(
        f"{result.stack.name}: today's prices give {number_text(result.profit)} $/run",
        loc="left",
        fontsize=8,
    )
    for colour, text in ((AT_LOW, "price at its low end"), (AT_HIGH, "at its high end")):
        axes.barh(0, 0, color=colour, label=text)
    axes.figure.legend(loc="outside lower right", ncols=2, frameon=False, fontsize=7)


def _two_way(axes: "Axes", study: TwoWay, name: str) -> None:
    """Profit over two prices.

    The black line is break-even over the robot's life, the cross stands for today.
    """
    from matplotlib.ticker import MaxNLocator

    x, y = study.x.values, study.y.values
    reach = float(np.nanquantile(np.abs(study.profit), COLOURED)) or 1.0
    levels = MaxNLocator(nbins=16, symmetric=True).tick_values(-reach, reach)
    filled = axes.contourf(x, y, study.profit, levels=levels, cmap="RdBu", extend="both")
    filled.set_edgecolor("face")  # no hairlines between the levels in PDF viewers
    if np.nanmin(study.profit) < 0.0 < np.nanmax(study.profit):
        line = axes.contour(x, y, study.profit, levels=[0.0], colors=LINE, linewidths=1.2)
        axes.clabel(line, fmt={0.0: "break-even"}, fontsize=7)
    axes.plot(study.x.today, study.y.today, "+", color=LINE, markersize=9, markeredgewidth=1.4)
    axes.set_xlabel(_axis_label(study.x))
    axes.set_ylabel(_axis_label(study.y))
    axes.set_title(f"{name}: profit over the robot's life; + today", loc="left", fontsize=8)
    bar = axes.figure.colorbar(filled, ax=axes, pad=0.02, format="%.3g")
    bar.set_label("[$/run]")


def _draw_break_even(axes: "Axes", result: Sensitivity, spread: BreakEvenSpread) -> None:
    """Probability that the robot has been paid back within so many deliveries."""
    axes.plot(spread.curve_runs, spread.curve_probability, color=AT_LOW, linewidth=1.6)
    axes.fill_between(
        spread.curve_runs,
        1.0 - spread.never,
        1.0,
        color=NEVER,
        alpha=0.25,
        linewidth=0,
    )
    if spread.never > 0.02:
        share = f"never, in {100.0 * spread.never:.0f} % of the resamples"
        axes.text(
            spread.curve_runs[0] * 1.15, 1.0 - 0.5 * spread.never, share, va="center", fontsize=7
        )
    axes.axvline(result.life_runs, color=LINE, linewidth=0.8, linestyle="--")
    axes.text(result.life_runs * 1.06, 0.97, "robot's life", rotation=90, va="top", fontsize=7)
    axes.set_xscale("log")
    axes.set_xlim(spread.curve_runs[0], spread.curve_runs[-1])
    axes.set_ylim(0.0, 1.0)
    axes.set_xlabel("deliveries")
    axes.set_ylabel("probability of break-even by then")
    episodes = len(result.stack.rows)
    axes.set_title(
        f"{result.stack.name}: from {episodes} deliveries measured", loc="left", fontsize=8
    )


def _axis_label(axis: PriceAxis) -> str:
    if axis.unit:
        return _label(axis.key, axis.unit)
    return f"{_words(axis.key)}, factor on all"


def _label(key: str, unit: str) -> str:
    if unit == "1":
        return _words(key)
    return f"{_words(key)} [{unit.replace('USD', '$')}]"


def _words(key: str) -> str:
    return (
        key.replace("injury.", "injury ")
        .replace(".", ": ")
        .replace("mais_", "MAIS ")
        .replace("_", " ")
    )

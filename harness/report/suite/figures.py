"""The figures of a suite: a panel for each condition, a line for each stack."""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import cycle, islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.economics.cost_terms import COST_LABELS, MARGIN
from harness.report.figures import save_panels
from harness.report.suite.results import Results, Standing
from harness.report.texts import OUTCOMES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FOLDER = "figures"
# of a page; of a stack; of what surrounds a panel's lines
WIDTH_INCH, LINE_INCH, FRAME_INCH = 7.2, 0.2, 0.75
PANELS_PER_ROW = 3
MOST_PANELS = 24
SMALL = 6.5  # [pt] of numbers beside the lines
# Okabe and Ito's colours, which most eyes tell apart
EARNS, LOSES, OPEN = "#0072b2", "#d55e00", "#8a8a8a"
PALETTE = ("#0072b2", "#e69f00", "#8a8a8a", "#d55e00", "#56b4e9", "#009e73", "#f0e442", "#cc79a7")
COST_COLOURS = tuple(islice(cycle(PALETTE), len(COST_LABELS)))
ARRIVED_COLOUR = "#56b4e9"
OUTCOME_COLOURS = ("#009e73", "#e69f00", "#8a8a8a", "#d55e00")
# [USD] a margin below the first makes the axis logarithmic beyond the second
FAR, LINEAR = -100.0, 10.0
DECADES = (-1000.0, -100.0, -10.0, 0.0, 10.0, 100.0, 1000.0)  # [USD] that such an axis names
# a stack whose value is so many times the median's is cut, and its value stands beside it
STRETCH = 20.0

Line = Callable[["Axes", int, Standing], None]


def draw_figures(results: Results, folder: Path) -> list[Path]:
    """Write every figure as PDF and PNG; returns their paths. None where nothing has been driven.

    Raises:
        InputError: the folder cannot be written.
    """
    if not any(each.valuation for each in results.standings):
        return []
    shown = results.conditions[:MOST_PANELS]
    rows = -(-len(shown) // PANELS_PER_ROW)
    height = rows * (FRAME_INCH + LINE_INCH * len(results.suite.stacks)) + 0.3
    paths = []
    for name, draw in FIGURES.items():
        paths += save_panels(
            folder / FOLDER / name, (WIDTH_INCH, height), partial(draw, results=results)
        )
    return paths


def _panels(
    figure: "Figure",
    results: Results,
    line: Line,
    beside: Callable[[Standing], str],
    title: str,
) -> "list[Axes]":
    """A panel for each condition.

    ``line`` draws one stack into it, ``beside`` is the text to its right.
    """
    shown = results.conditions[:MOST_PANELS]
    columns = min(PANELS_PER_ROW, len(shown))
    rows = -(-len(shown) // columns)
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    panels = list(grid.flat)
    names = results.ranked
    for axes, condition in zip(panels, shown, strict=False):
        standings = results.under(condition)
        numbers = sorted({each.n for each in standings if each.valuation is not None})
        for each in standings:
            place = names.index(each.stack)
            if each.valuation is None:
                axes.text(0.02, place, "not driven", transform=axes.get_yaxis_transform(),
                          va="center", fontsize=SMALL, color=OPEN, style="italic")  # fmt: skip
                continue
            line(axes, place, each)
            if len(numbers) == 1:
                text = beside(each)
            else:
                text = f"{beside(each)} ({each.n})"
            axes.text(
                1.02,
                place,
                text,
                transform=axes.get_yaxis_transform(),
                va="center",
                fontsize=SMALL,
            )
        n = "n in brackets"
        if not (len(numbers) > 1):
            n = f"n = {max(numbers, default=0)}"
        axes.set_title(f"{results.label(condition)} ({n})", fontsize=8, loc="left")
        axes.set_yticks(range(len(names)), names)
        axes.tick_params(axis="y", length=0)
    for axes in panels[len(shown) :]:
        axes.set_visible(False)
    panels[0].set_ylim(len(names) - 0.4, -0.6)
    figure.supxlabel(title, fontsize=8)
    return panels[: len(shown)]


def _margin(figure: "Figure", results: Results) -> None:
    def line(axes: "Axes", place: int, standing: Standing) -> None:
        margin = standing.interval(MARGIN)
        if margin.value is None:
            return
        low, high = (margin.value if end is None else end for end in (margin.low, margin.high))
        colour = (OPEN, EARNS, LOSES)[margin.sign]
        is_sure = bool(margin.sign)
        axes.plot((low, high), (place, place), color=colour, linewidth=1.6, solid_capstyle="butt")
        axes.plot(margin.value, place, "o" if is_sure else "D", color=colour, markersize=4.0,
                  markerfacecolor=colour if is_sure else "white")  # fmt: skip

    known = [each.interval(MARGIN) for each in results.standings]
    ends = [end for each in known for end in (each.value, each.low, each.high) if end is not None]
    lowest, highest = min(ends, default=0.0), max(ends, default=0.0)
    scale = ""
    if lowest < FAR:
        scale = f", logarithmic beyond {LINEAR:g}"
    colours = "(blue: above 0, red: below, hollow: neither)"
    title = f"contribution margin [USD/delivery], 95 % interval{scale} {colours}"
    panels = _panels(
        figure, results, line, lambda each: _number(each.interval(MARGIN).value), title
    )
    if lowest < FAR:
        panels[0].set_xscale("symlog", linthresh=LINEAR, linscale=1.5)
        panels[0].set_xticks(DECADES, [_number(each, 0) for each in DECADES])
        panels[0].set_xlim(1.2 * lowest, max(LINEAR, 1.1 * highest))
        panels[0].minorticks_off()
    for axes in panels:
        axes.axvline(0.0, color="black", linewidth=0.7, zorder=0)
        axes.grid(axis="x", color="#dddddd", linewidth=0.5, zorder=0)


def _costs(figure: "Figure", results: Results) -> None:
    totals = sorted(
        each.valuation.economics.opex or 0.0 for each in results.standings if each.valuation
    )
    median = totals[len(totals) // 2]
    if totals[-1] <= STRETCH * median or median <= 0.0:
        end = totals[-1]
    else:
        end = STRETCH * median

    def line(axes: "Axes", place: int, standing: Standing) -> None:
        assert standing.valuation is not None
        terms = standing.valuation.economics.running.terms
        if _stack(axes, place, [terms[key] for key in COST_LABELS], COST_COLOURS) > end:
            axes.plot(
                end * 1.03,
                place,
                ">",
                color="white",
                markeredgecolor="black",
                markersize=4,
                clip_on=False,
            )

    def total(each: Standing) -> str:
        return _number(None if each.valuation is None else each.valuation.economics.opex)

    panels = _panels(figure, results, line, total, "costs [USD/delivery], means")
    panels[0].set_xlim(0.0, 1.05 * end or 1.0)
    _legend(figure, panels[0], tuple(COST_LABELS.values()), COST_COLOURS)


def _outcomes(figure: "Figure", results: Results) -> None:
    def line(axes: "Axes", place: int, standing: Standing) -> None:
        shares = [standing.interval(key).value for key in OUTCOMES]
        arrived = 0.0
        if shares[0] is None and standing.n:  # without cargo none is in time and intact, or spoiled
            arrived = 1.0 - sum(share or 0.0 for share in shares)
        _stack(axes, place, [*shares, arrived], (*OUTCOME_COLOURS, ARRIVED_COLOUR))

    def compliance(each: Standing) -> str:
        share = each.interval("sla").value
        if share is None:
            return ""
        return f"{share:.3f}"

    panels = _panels(
        figure, results, line, compliance, "share of deliveries; beside each: in time and intact"
    )
    panels[0].set_xlim(0.0, 1.0)
    titles: tuple[str, ...] = tuple(OUTCOMES.values())
    colours: tuple[str, ...] = OUTCOME_COLOURS
    if any(each.n and each.interval("sla").value is None for each in results.standings):
        titles, colours = (*titles, "arrived, without cargo"), (*colours, ARRIVED_COLOUR)
    _legend(figure, panels[0], titles, colours)


def _break_even(figure: "Figure", results: Results) -> None:
    def probability(each: Standing) -> float | None:
        if each.valuation is None:
            return None
        return each.valuation.risk.break_even_probability

    def line(axes: "Axes", place: int, standing: Standing) -> None:
        chance = probability(standing)
        if chance is not None:
            axes.plot((0.0, chance), (place, place), color="#bbbbbb", linewidth=1.2, zorder=1)
            axes.plot(chance, place, "o", color=EARNS, markersize=4.5, clip_on=False)

    def beside(each: Standing) -> str:
        chance = probability(each)
        if chance is None:
            return "unknown"
        return f"{chance:.2f}"

    panels = _panels(
        figure, results, line, beside, "probability that the robot pays for itself within its life"
    )
    panels[0].set_xlim(-0.02, 1.02)
    for axes in panels:
        axes.grid(axis="x", color="#dddddd", linewidth=0.5, zorder=0)


def _stack(
    axes: "Axes",
    place: int,
    parts: Sequence[float | None],
    colours: Sequence[str],
) -> float:
    """A bar of parts one after the other; returns its end."""
    widths = np.array([part or 0.0 for part in parts])
    ends = widths.cumsum()
    axes.barh(
        [place] * len(parts),
        widths,
        left=ends - widths,
        height=0.66,
        color=colours,
        linewidth=0,
    )
    return float(ends[-1])


def _legend(figure: "Figure", axes: "Axes", names: Sequence[str], colours: Sequence[str]) -> None:
    from matplotlib.patches import Patch

    handles = [Patch(color=colour, label=name) for name, colour in zip(names, colours, strict=True)]
    figure.legend(
        handles=handles,
        loc="outside upper center",
        ncols=len(handles),
        frameon=False,
        fontsize=7,
    )


def _number(value: float | None, decimals: int = 2) -> str:
    if value is None:
        return ""
    return f"{value:.{decimals}f}".replace("-", "−")


FIGURES = {"margin": _margin, "costs": _costs, "outcomes": _outcomes, "break_even": _break_even}

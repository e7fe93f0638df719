"""Figures of a tuning study, fit for a paper's column."""

import math
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.report.figures import SUFFIXES, error_bars, save_figure
from harness.report.numbers import bounds_text, number_text
from harness.report.texts import TEXTS
from harness.report.tuning.tables import value_text
from harness.statistics.interval import Interval
from harness.tuning.explanation import Explanation
from harness.tuning.history import Best
from harness.tuning.objective import is_money
from harness.tuning.result import COMPLETE, StudyResult, TrialTable, trial_table
from harness.tuning.space.paths import is_list
from harness.tuning.space.space import Parameter
from harness.tuning.waterfall import Step, Waterfall

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BAR_INCH, FRAME_INCH = 0.26, 1.0  # heights: of a bar with its label, of what is about the bars
GRID_COLUMNS, CELL_INCH = 3, 1.35  # of the slices
GAIN, LOSS, NEW = "#009e73", "#d55e00", "#0072b2"  # Okabe and Ito 2008
OLD, LINE, FAINT = "#9a9a9a", "#222222", "#b8b8b8"
LEAST_RANGE = 0.2  # [USD/run] that an axis of money shows
EDGE = 0.04  # share of a range that is free on both sides
# ratio of a logarithmic range's ends below which its decades are too few for ticks
FEW_DECADES = 100.0
LONGEST = 24  # characters of a step's name that fit beside its bar
OUTLIERS = 0.05  # share of the trials, the worst ones, that an axis may leave below


def draw_tuning(study: StudyResult, explanation: Explanation, folder: Path) -> list[Path]:
    """Write every figure that there are data for as PDF and PNG, in place of earlier ones.

    Returns their paths.

    Raises:
        InputError: the folder cannot be written.
    """
    for stem in TEXTS.tuning_figures:
        for suffix in SUFFIXES:
            (folder / f"{stem}{suffix}").unlink(missing_ok=True)
    table = trial_table(study.space, study.trials)
    name = study.objectives[0]
    paths: list[Path] = []
    if explanation.history:
        paths += save_figure(
            folder / "history", 2.8, partial(_history, study=study, bests=explanation.history)
        )
    if len(study.objectives) > 1:
        paths += save_figure(folder / "front", 2.8, partial(_front, study=study))
    if len(table.trials) > 1:
        rows = math.ceil(len(table.parameters) / GRID_COLUMNS)
        draw = partial(_slices, table=table, study=study, name=name)
        paths += save_figure(folder / "slices", 0.5 + CELL_INCH * rows, draw)
    if explanation.waterfall is not None:
        # a label may have two lines
        height = FRAME_INCH + 1.4 * BAR_INCH * (len(explanation.waterfall.steps) + 2)
        paths += save_figure(
            folder / "waterfall", height, partial(_waterfall, found=explanation.waterfall)
        )
    return paths


def _history(axes: "Axes", study: StudyResult, bests: Sequence[Best]) -> None:
    """Every trial, and as steps the best so far with its interval."""
    from matplotlib.ticker import MaxNLocator

    driven = [trial for trial in study.trials if trial.told]
    for is_complete, colour, marker, title in (
        (True, NEW, "o", "drove all training missions"),
        (False, FAINT, "x", "dropped on the way (estimate)"),
    ):
        chosen = [trial for trial in driven if (trial.state == COMPLETE) == is_complete]
        points = [trial.number for trial in chosen], [trial.told[0] for trial in chosen]
        axes.plot(*points, marker, color=colour, markersize=3.0, markeredgewidth=0.9, label=title)
    numbers = [each.number for each in bests] + [max(trial.number for trial in study.trials) + 1]
    scores = [each.score for each in bests]
    values, lows, highs = ([_end(each, key) for each in scores] for key in ("value", "low", "high"))
    axes.step(
        numbers,
        [*values, values[-1]],
        where="post",
        color=LINE,
        linewidth=1.2,
        label="best so far",
    )
    axes.fill_between(
        numbers,
        [*lows, lows[-1]],
        [*highs, highs[-1]],
        step="post",
        color=LINE,
        alpha=0.12,
        linewidth=0,
    )
    _hold([trial.told[0] for trial in driven], [*lows, *highs], study.objectives[0], axes)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("trial (0: the original)")
    axes.set_ylabel(_objective(study.objectives[0]))
    axes.set_title(
        f"n = {len(study.train_missions)} training missions; band: 95 % interval",
        loc="left",
        fontsize=8,
    )
    axes.figure.legend(loc="outside lower right", ncols=3, frameon=False, fontsize=7)


def _front(axes: "Axes", study: StudyResult) -> None:
    """Complete trials in the first two objectives, and those that no other beats."""
    known = [trial for trial in study.trials if trial.state == COMPLETE]
    for is_best, colour, title in (
        (False, FAINT, "beaten in every objective"),
        (True, NEW, "Pareto front"),
    ):
        chosen = [trial for trial in known if (trial.number in study.front) == is_best]
        points = [trial.values[0] for trial in chosen], [trial.values[1] for trial in chosen]
        axes.plot(*points, "o", color=colour, markersize=4.0, label=title)
    original = study.trials[0].values
    axes.plot(
        original[0],
        original[1],
        "s",
        color=LINE,
        markerfacecolor="none",
        markersize=7.0,
        label="original",
    )
    axes.set_xlabel(_objective(study.objectives[0]))
    axes.set_ylabel(_objective(study.objectives[1]))
    axes.figure.legend(loc="outside lower right", ncols=3, frameon=False, fontsize=7)


def _hold(values: Sequence[float], others: Sequence[float], name: str, axes: "Axes") -> None:
    """Let the height hold all but the worst trials, which would flatten the rest.

    Of these it tells the number.
    """
    inside = float(np.quantile(values, OUTLIERS, method="lower"))
    low, high = min(inside, *others), max(*values, *others)
    if is_money(name) and high - low < LEAST_RANGE:
        low, high = 0.5 * (low + high - LEAST_RANGE), 0.5 * (low + high + LEAST_RANGE)
    gap = 0.06 * (high - low or 1.0)
    axes.set_ylim(low - gap, high + gap)
    axes.ticklabel_format(axis="y", useOffset=False)
    below = sum(value < low - gap for value in values)
    if below:
        axes.text(0.995, 0.02, f"below: {below}", transform=axes.transAxes, ha="right", fontsize=7)


def _scale(parameter: Parameter, cell: "Axes") -> None:
    """Let the width be the parameter's range."""
    from matplotlib.ticker import LogLocator, NullFormatter

    low, high = parameter.low, parameter.high
    if not parameter.is_log:
        gap = EDGE * (high - low or 1.0)
        cell.set_xlim(low - gap, high + gap)
        return
    cell.set_xscale("log")
    gap = (high / low) ** EDGE
    cell.set_xlim(low / gap, high * gap)
    if high / low < FEW_DECADES:
        cell.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    cell.xaxis.set_major_formatter("{x:g}")
    cell.xaxis.set_minor_formatter(NullFormatter())


def _slices(axes: "Axes", table: TrialTable, study: StudyResult, name: str) -> None:
    """A graph per parameter: objective over value, original and incumbent marked."""
    figure, rows = axes.figure, math.ceil(len(table.parameters) / GRID_COLUMNS)
    axes.remove()
    grid = figure.subplots(rows, GRID_COLUMNS, sharey=True, squeeze=False)
    complete = np.array([trial.state == COMPLETE for trial in table.trials])
    best = next(
        (i for i, t in enumerate(table.trials) if t.candidate.key == study.incumbent.key), None
    )
    for number, cell in enumerate(grid.flat):
        if number >= len(table.parameters):
            cell.axis("off")
            continue
        parameter = table.parameters[number]
        if parameter.choices:
            x = table.places[:, number] * (len(parameter.choices) - 1)
            cell.set_xticks(range(len(parameter.choices)), _choices(parameter), fontsize=6)
        else:
            x = np.array([float(trial.point[parameter.name]) for trial in table.trials])
            _scale(parameter, cell)
        cell.plot(
            x[~complete],
            table.objective[~complete],
            "x",
            color=FAINT,
            markersize=2.5,
            markeredgewidth=0.7,
        )
        cell.plot(x[complete], table.objective[complete], "o", color=NEW, markersize=2.5)
        cell.plot(x[0], table.objective[0], "s", color=LINE, markersize=4.5, label="original")
        if best is not None:
            cell.plot(x[best], table.objective[best], "*", color=LOSS, markersize=8, label="tuned")
        unit = ""
        if parameter.unit:
            unit = f" [{parameter.unit}]"
        cell.set_xlabel(f"{parameter.name}{unit}", fontsize=7)
        cell.tick_params(labelsize=6)
    _hold(table.objective.tolist(), [float(table.objective[0])], name, grid[0, 0])
    for cell in grid[1:, 0]:
        cell.ticklabel_format(axis="y", useOffset=False)
    figure.supylabel(_objective(name), fontsize=8)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=2, frameon=False, fontsize=7)


def _choices(parameter: Parameter) -> list[str]:
    """What stands below choices; of lists, the first of which is the original, their numbers."""
    if is_list(parameter.original):
        return ["original", *(f"other {number}" for number in range(1, len(parameter.choices)))]
    return [value_text(choice) for choice in parameter.choices]


def _step_label(step: Step) -> str:
    """What stands beside a step: one parameter with its values, or how many there are."""
    count = len(step.changes)
    if count > 1:
        if len(step.player) < LONGEST:
            return f"{step.player} ({count})"
        return f"{count} together"
    ((name, (before, after)),) = step.changes.items()
    if is_list(before):
        return name
    return f"{name}\n{value_text(before)} -> {value_text(after)}"


def _waterfall(axes: "Axes", found: Waterfall) -> None:
    """From the old margin on the left in steps to the new one.

    Whiskers are the steps' own intervals.
    """
    labels = ["original file", *map(_step_label, found.steps), "tuned file"]
    reached = found.original
    for place, step in enumerate(found.steps, start=1):
        interval = step.gain_usd_per_run
        gain = interval.value or 0.0
        axes.barh(
            place,
            gain,
            left=reached,
            height=0.6,
            color=GAIN if gain >= 0.0 else LOSS,
            linewidth=0,
        )
        ends = error_bars([interval])
        axes.errorbar(
            [reached + gain],
            [place],
            xerr=ends,
            fmt="none",
            ecolor=LINE,
            linewidth=0.8,
            capsize=2.0,
        )
        axes.plot([reached + gain] * 2, [place - 0.3, place + 1.3], color=LINE, linewidth=0.6)
        reached += gain
    axes.plot([found.original] * 2, [-0.3, 1.3], color=LINE, linewidth=0.6)
    axes.plot(found.original, 0, "s", color=OLD, markersize=7)
    axes.plot(found.incumbent, len(labels) - 1, "s", color=NEW, markersize=7)
    texts = [
        number_text(found.original),
        *(number_text(step.gain_usd_per_run.value or 0.0, is_signed=True) for step in found.steps),
        number_text(found.incumbent),
    ]
    _label(axes, labels, texts)
    axes.margins(x=0.04)
    axes.use_sticky_edges = False  # of the bars, at which the frame would end
    axes.autoscale_view()
    low, high = axes.get_xlim()
    if high - low < LEAST_RANGE:
        axes.set_xlim(0.5 * (low + high - LEAST_RANGE), 0.5 * (low + high + LEAST_RANGE))
    axes.set_xlabel(f"contribution margin [USD/run]; total {_difference(found.total)}")
    title = f"n = {found.missions} {found.kind} missions; whiskers: 95 % intervals"
    axes.set_title(title, loc="left", fontsize=8)


def _label(axes: "Axes", labels: Sequence[str], texts: Sequence[str]) -> None:
    """Rows from top to bottom, with labels to their left and texts to their right."""
    axes.set_yticks(range(len(labels)), labels)
    axes.set_ylim(len(labels) - 0.5, -0.5)
    right = axes.secondary_yaxis("right")
    right.set_yticks(range(len(labels)), texts)
    right.spines["right"].set_visible(False)
    for each in (axes, right):
        each.tick_params(axis="y", length=0)


def _difference(interval: Interval) -> str:
    return f"{number_text(interval.value, is_signed=True)} {bounds_text(interval)}".rstrip()


def _end(interval: Interval, key: str) -> float:
    """A bound; the value where there is none."""
    number = getattr(interval, key)
    if number is None:
        return float(interval.value or 0.0)
    return float(number)


def _objective(name: str) -> str:
    if is_money(name):
        return f"{name} [USD/run]"
    return name

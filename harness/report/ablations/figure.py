"""The figure of an ablation: margin over the error of position, a point for each arm."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.ablation.analysis import Ablation, Arm, points
from harness.ablation.arms import KINDS, injected_kind
from harness.report.figures import error_bars, save_figure
from harness.report.numbers import range_text
from harness.statistics.interval import Interval
from navstack.types import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# heights: at least, of a label, of what is about the labels
LEAST_INCH, LABEL_INCH, FRAME_INCH = 3.0, 0.19, 0.8
# after Okabe and Ito 2008
LOCALIZERS = ("#222222", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#8c6d31", "#7f7f7f")
# marker and colour map by kind of injected error
SHADES = {"position": ("s", "Reds"), "heading": ("^", "Blues")}
LIGHTEST, DARKEST = 0.4, 0.95  # of a colour map
FREE = 0.1  # share of the height that is free above and below
LEAST_RANGE = 0.2  # [USD/run] that the height shows
WIDE = 20.0  # ratio of errors from which the axis is logarithmic
DODGE = 4.0  # [pt] between arms without any error of position, which would hide each other
Point = tuple[Arm, Interval, Interval]  # with its error [m] and margin [USD/run]


def label(arm: Arm) -> str:
    """An arm's name in a figure, with the unit of its error."""
    kind = injected_kind(arm.stack)
    if kind is None:
        return arm.name
    return f"{arm.name} {KINDS[kind].unit}"


def draw_ablation(ablation: Ablation, folder: Path) -> list[Path]:
    """Write the figure as PDF and PNG.

    Returns their paths, none where no arm has both error and margin.

    Raises:
        InputError: the folder cannot be written.
    """
    shown = points(ablation)
    if not shown:
        return []
    height = max(LEAST_INCH, FRAME_INCH + LABEL_INCH * len(shown))
    return save_figure(
        folder / "ablation", height, partial(_draw, stack=ablation.declaration.stack, shown=shown)
    )


def _draw(axes: "Axes", stack: str, shown: Sequence[Point]) -> None:
    from matplotlib.transforms import ScaledTranslation

    _scale(axes, [error for _, error, _ in shown], [margin for _, _, margin in shown])
    at_zero = 0
    for (arm, error, margin), (marker, colour) in zip(
        shown, _looks([arm for arm, _, _ in shown]), strict=True
    ):
        dodge = at_zero * DODGE / 72.0 if error.value == 0.0 else 0.0  # [inch]
        at_zero += error.value == 0.0
        axes.errorbar(
            [error.value or 0.0],
            [margin.value or 0.0],
            xerr=error_bars([error]),
            yerr=error_bars([margin]),
            fmt=marker,
            color=colour,
            markersize=4.0,
            linewidth=0.9,
            label=label(arm),
            transform=axes.transData + ScaledTranslation(dodge, 0.0, axes.figure.dpi_scale_trans),
        )
    axes.set_xlabel("localization error, median over the deliveries [m]")
    axes.set_ylabel("contribution margin [USD/run]")
    counts = range_text(arm.result.episodes for arm, _, _ in shown)
    spans = ""
    if any(each.low is not None for _, *both in shown for each in both):
        spans = ", 95 % intervals"
    axes.set_title(f"{stack}: n = {counts} deliveries each{spans}", loc="left", fontsize=8)
    axes.figure.legend(loc="outside right upper", frameon=False, fontsize=7)


def _scale(axes: "Axes", errors: Sequence[Interval], margins: Sequence[Interval]) -> None:
    """Let the axes hold every interval.

    Errors of very different sizes on a logarithmic axis, linear about zero.
    """
    values = np.array([error.value for error in errors], dtype=np.float64)
    farthest, some = float(_bounds(errors).max()), values[values > 0.0]
    if some.size and values.max() > WIDE * some.min():
        linear = float(10.0 ** np.floor(np.log10(some.min())))
        axes.set_xscale("symlog", linthresh=linear)
        axes.xaxis.set_major_formatter("{x:g}")
        axes.set_xlim(-0.3 * linear, 1.3 * farthest)
    else:
        axes.set_xlim(-0.05 * (farthest or 1.0), 1.05 * (farthest or 1.0))
    money = _bounds(margins)
    middle, half = 0.5 * (money.min() + money.max()), 0.5 * max(float(np.ptp(money)), LEAST_RANGE)
    axes.set_ylim(middle - (1.0 + FREE) * half, middle + (1.0 + FREE) * half)


def _bounds(intervals: Sequence[Interval]) -> FloatArray:
    """All values and ends that there are."""
    numbers = (
        number
        for each in intervals
        for number in (each.low, each.value, each.high)
        if number is not None
    )
    return np.array(list(numbers), dtype=np.float64)


def _looks(arms: Sequence[Arm]) -> Iterator[tuple[str, object]]:
    """Marker and colour of each arm: localizers in colours, injected errors in shades."""
    from matplotlib import colormaps

    kinds = [injected_kind(arm.stack) for arm in arms]
    for number, kind in enumerate(kinds):
        place = kinds[:number].count(kind)
        if kind is None:
            yield "o", LOCALIZERS[place % len(LOCALIZERS)]
        else:
            marker, colours = SHADES[kind]
            yield (
                marker,
                colormaps[colours](np.linspace(DARKEST, LIGHTEST, kinds.count(kind))[-1 - place]),
            )

"""What ``navbench ablate`` found, and its figure.

What each arm knew of its position and what it earned.
"""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.ablation.analysis import (
    Ablation,
    Arm,
    ArmDifference,
    ErrorPrice,
    break_even_interval,
    points,
    wrong_maps,
)
from harness.ablation.arms import KINDS, injected_kind, is_buildable
from harness.analysis.rare import margin_with_unseen
from harness.economics.cost_terms import MARGIN
from harness.economics.valuation import margins
from harness.report.audit import audit_sentence
from harness.report.blocks import Block, Chart, Table, Text, declared, notes_of
from harness.report.figures import error_bars, save_figure
from harness.report.numbers import (
    UNDEFINED,
    all_of,
    bounds_text,
    count_text,
    counted,
    interval_text,
    number_text,
    p_text,
    range_text,
)
from harness.report.short.setup import robot_price_line
from harness.report.texts import OUTCOMES, notes
from harness.report.verdict import DOUBT, going_on, repeated, undecided
from harness.statistics.interval import Interval, wider
from harness.storage.texts import quoted
from navstack.types import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

METRICS = {
    MARGIN: "margin [USD/run]",
    "sla": f"share {OUTCOMES['sla']}",
    "avg_localization_error_median_m": "localization error [m]",
}
NOT_BUILDABLE = "not buildable"
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
MORE = 4  # times as many missions, where those driven tell nothing
Point = tuple[Arm, Interval, Interval]  # with its error [m] and margin [USD/run]


def ablation_blocks(ablation: Ablation, figures: Sequence[Path], folder: Path) -> list[Block]:
    """What the arms did, how they differ, what that says, and where it is."""
    sentences = [sentence(difference) for difference in ablation.differences]
    more = [*_wrong_maps(ablation), *map(price_sentence, ablation.prices)]
    more += [f"{arm}: {audit_sentence(audit)}" for arm, audit in ablation.audits.items()]
    priced = [robot_price_line(ablation.run, ablation.run.prices())]
    return [
        _outcomes(ablation),
        _money(ablation),
        _differences(ablation),
        *map(Text, [*sentences, "", *more]),
        *notes_of(notes("ablation")),
        *map(Chart, figures),
        Text(f"run folder: {folder}", "whole"),
        *(Text(line, "whole") for line in [*deciding(ablation), *priced] if line),
    ]


def deciding(ablation: Ablation) -> list[str]:
    """The command that would decide all margins that are not significant, in a line.

    None where arms drive no further than their margins are to be known.
    """
    if ablation.declaration.within is not None:
        return []
    open_ones = [each.paired for each in ablation.of(MARGIN) if not each.paired.is_significant]
    needed = max((pair.needed or pair.fewest for pair in open_ones if pair.differs), default=0)
    if command := needed and repeated(ablation.run, needed):
        return [f"to decide every margin: {command}"]
    return []


def _outcomes(ablation: Ablation) -> Table:
    rows = []
    for arm in ablation.arms:
        known = arm.result.intervals
        rates = [interval_text(known.get(name), absent="not modelled") for name in OUTCOMES]
        rows.append((arm.name, str(arm.result.episodes), str(arm.result.errors), *rates))
    return declared("ablation_outcomes", rows, stack=ablation.declaration.stack)


def _money(ablation: Ablation) -> Table:
    rows = []
    admitting = margins_with_unseen(ablation)
    for arm in ablation.arms:
        sensors, *investment = investment_of(arm, admitting[arm.name])
        position = interval_text(arm.errors["localization_error_median_m"], 3)
        tail = number_text(arm.errors["localization_error_p95_m"].value)
        heading = number_text(arm.errors["heading_error_median_deg"].value)
        margin = interval_text(admitting[arm.name], absent="undefined")
        rows.append((arm.name, sensors, position, tail, heading, margin, *investment))
    return declared("ablation_money", rows)


def margins_with_unseen(ablation: Ablation) -> dict[str, Interval | None]:
    """The margin of each arm [USD/run], admitting an unseen loss; None: it is undefined."""
    known = {arm.name for arm in ablation.arms if arm.margin.value is not None}
    found: dict[str, Interval | None] = {arm.name: None for arm in ablation.arms}
    for stack in ablation.run.stacks:
        if stack.name in known:
            found[stack.name] = margin_with_unseen(ablation.run, stack)
    return found


def investment_of(arm: Arm, margin: Interval | None) -> tuple[str, str, str]:
    """Sensors, capital expenditure and break-even point in words.

    Args:
        arm: that is told of.
        margin: as it is told beside them [USD/run]; None: it is undefined.
    """
    if not is_buildable(arm.stack):
        return "none exists", NOT_BUILDABLE, UNDEFINED
    sensors = " + ".join(arm.stack.carries) or "none"
    return sensors, count_text(arm.capex_usd), _break_even(arm.capex_usd, margin)


def _break_even(capex_usd: float | None, margin: Interval | None) -> str:
    if capex_usd is None or margin is None or margin.value is None:
        return UNDEFINED
    runs = break_even_interval(capex_usd, margin)
    value = count_text(runs.value, "never")
    if margin.low is None or runs.low is None:
        return value
    return f"{value} [{runs.low:,.0f}, {count_text(runs.high, 'never')}]"


def _differences(ablation: Ablation) -> Table:
    rows = []
    for difference in ablation.differences:
        paired = difference.paired
        cells = (
            interval_text(wider(paired.difference, difference.unseen), None),
            p_text(paired.p_holm),
            str(paired.difference.n),
            number_text(paired.detectable, None),
            count_text(paired.needed),
        )
        rows.append((difference.arm, difference.against, METRICS[difference.metric], *cells))
    return declared("ablation_differences", rows)


def next_command(ablation: Ablation, folder: Path) -> str:
    """More missions where every delivery earned the same; else the dearest one explained."""
    earned: set[float] = set()  # to the cent
    for stack in ablation.run.stacks:
        margin = margins(stack.rows, ablation.run.prices())
        earned.update([math.nan] if margin is None else np.round(margin, 2).tolist())
    more = ""
    if len(earned) == 1 and min(earned) > 0.0:
        driven = max(arm.result.episodes for arm in ablation.arms)
        more = going_on("ablate", folder, MORE * driven)
    return more or f"navbench explain {quoted(folder)}"


def sentence(difference: ArmDifference) -> str:
    """What one comparison says, and what it does not: the first of two less the second."""
    paired = difference.paired
    subject, n = _subject(difference), paired.difference.n
    if not paired.differs:
        return f"{subject} on {all_of(n, 'mission')}, which says nothing of what is rare."
    told = f"{counted(n, 'mission')}, adjusted p {p_text(paired.p_holm)}"
    if paired.is_significant:
        doubt = ""
        if (difference.unseen or paired.difference).sign == 0:
            doubt = DOUBT
        return f"{subject}: significant ({told}){doubt}."
    text = f"{subject}: not significant ({told})"
    text += undecided(paired)
    if paired.detectable is not None:
        text += f"; with {n}, differences from {paired.detectable:.3g} on are found"
    return f"{text}."


def _subject(difference: ArmDifference) -> str:
    """Who has more of what than whom, by how much."""
    gap, whose = wider(difference.paired.difference, difference.unseen), difference.against
    is_money = difference.metric == MARGIN
    if not difference.paired.differs:
        verb = "earned the same as" if is_money else f"has the same {METRICS[difference.metric]} as"
        return f"{difference.arm} {verb} {whose}"
    value = gap.value or 0.0
    if is_money and value < 0.0:
        earned = f"{interval_text(gap.negated, None)} USD a delivery less"
        return f"{difference.arm} earned {earned} than {whose}"
    if is_money:
        earned = f"{interval_text(gap, None)} USD a delivery more"
        return f"{difference.arm} earned {earned} than {whose}"
    signed = f"{number_text(value, None, True)} {bounds_text(gap, None, True)}".rstrip()
    return f"{difference.arm} less {whose}, {METRICS[difference.metric]}: {signed}"


def price_sentence(price: ErrorPrice) -> str:
    """What an error costs."""
    unit = {"m": "metre", "deg": "degree"}[KINDS[price.kind].unit]
    levels = ", ".join(f"{level:g}" for level in price.levels)
    subject = f"price of {price.kind} error (RMS of {levels} {KINDS[price.kind].unit}):"
    if price.price.value is None:
        return f"{subject} undefined, no mission with a margin was finished at every level."
    verdict = ""
    if price.price.low is None or price.price.high is None:
        verdict = (
            ", too few missions, or all alike to a cent, for an interval: "
            "that says nothing about rare events"
        )
    elif not price.price.sign:
        verdict = ", not significant"
    cost = f"{interval_text(price.price, None)} USD per run per {unit}"
    return f"{subject} {cost}, n = {price.price.n}{verdict}."


def _wrong_maps(ablation: Ablation) -> list[str]:
    """What each wrong map costs."""
    pairs = wrong_maps([arm.stack for arm in ablation.arms])
    found = [each for each in ablation.of(MARGIN) if (each.arm, each.against) in pairs]
    return [f"what the wrong map costs: {sentence(each)}" for each in found]


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

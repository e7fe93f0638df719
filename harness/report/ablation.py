"""The printed result of ``navbench ablate``."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.text import Text

from harness.ablation.analysis import MARGIN, SURE, Ablation, Arm, Difference, ErrorPrice, wrong_maps
from harness.ablation.arms import KINDS, injected_kind, is_buildable
from harness.economics.valuation import OUTCOMES
from harness.report.markdown import interval_text, number_text, p_text
from harness.report.sheet import Sheet, declared, print_sheet
from harness.statistics.interval import Interval

METRICS = {
    MARGIN: "margin [USD/run]",
    "sla": "SLA compliance",
    "avg_localization_error_median_m": "localization error [m]",
}
NOT_BUILDABLE = "not buildable"
NOTES = (
    "[low, high]: 95 % interval; Wilson's for shares of deliveries, bootstrap over missions for the rest.",
    "error: the median over the deliveries of each delivery's median over time; 95 %: the 95th percentile over the "
    "deliveries of each one's 95th percentile (in 95 % of deliveries the error was no larger for 95 % of the time).",
    "sensors: those with a price that the arm cannot do without; CAPEX and BEP (break-even point) count these alone.",
    "p Holm: paired sign-flip test (McNemar's for shares), adjusted for all comparisons of one metric. detectable: "
    "the smallest difference that as many missions find with a power of 80 % at 5 % (one comparison, normal "
    "approximation). needed: missions that would so find a difference as large as the one observed.",
)


def print_ablation(ablation: Ablation, figures: Sequence[Path], folder: Path, console: Console) -> None:
    """Print what the arms did, how they differ, what that says, and where it is."""
    for sheet in (_outcomes(ablation), _money(ablation), _differences(ablation)):
        print_sheet(sheet, console)
    for difference in ablation.differences:
        console.print(Text(sentence(difference)))
    console.print()
    for line in [*_wrong_maps(ablation), *map(price_sentence, ablation.prices)]:
        console.print(Text(line))
    for note in NOTES:
        console.print(Text(note, style="dim"))
    for figure in figures:
        console.print(f"figure: {figure}", soft_wrap=True)
    console.print(f"run folder: {folder}", soft_wrap=True)


def _outcomes(ablation: Ablation) -> Sheet:
    rows = []
    for arm in ablation.arms:
        rates = [interval_text(arm.result.intervals.get(name), absent="not modelled") for name in OUTCOMES]
        rows.append((arm.name, str(arm.result.episodes), str(arm.result.errors), *rates))
    return declared("ablation_outcomes", rows, stack=ablation.declaration.stack)


def _money(ablation: Ablation) -> Sheet:
    rows = []
    for arm in ablation.arms:
        sensors, *investment = _investment(arm)
        position = interval_text(arm.errors["localization_error_median_m"], 3)
        tail = number_text(arm.errors["localization_error_p95_m"].value)
        heading = number_text(arm.errors["heading_error_median_deg"].value)
        margin = interval_text(arm.margin, absent="undefined")
        rows.append((arm.name, sensors, position, tail, heading, margin, *investment))
    return declared("ablation_money", rows)


def _investment(arm: Arm) -> tuple[str, str, str]:
    """Sensors, capital expenditure and break-even point in words."""
    if not is_buildable(arm.stack):
        return "none exists", NOT_BUILDABLE, "--"
    capex = "--" if arm.capex_usd is None else f"{arm.capex_usd:,.0f}"
    return " + ".join(arm.stack.carries) or "none", capex, _break_even(arm.break_even, arm.margin)


def _break_even(runs: Interval, margin: Interval) -> str:
    if margin.value is None:
        return "--"
    value = "never" if runs.value is None else f"{runs.value:,.0f}"
    if margin.low is None or runs.low is None:
        return value
    return f"{value} [{runs.low:,.0f}, {'never' if runs.high is None else f'{runs.high:,.0f}'}]"


def _differences(ablation: Ablation) -> Sheet:
    rows = []
    for difference in ablation.differences:
        paired = difference.compared.paired
        cells = (
            interval_text(paired.difference, None),
            p_text(difference.p_holm),
            str(paired.difference.n),
            number_text(paired.detectable, None),
            "--" if paired.needed is None else f"{paired.needed:,d}",
        )
        rows.append((difference.arm, difference.against, METRICS[difference.metric], *cells))
    return declared("ablation_differences", rows)


def sentence(difference: Difference) -> str:
    """What one comparison says, and what it does not."""
    paired, span = difference.compared.paired, interval_text(difference.compared.paired.difference, None)
    subject = f"{difference.arm} against {difference.against}, {METRICS[difference.metric]}:"
    n = paired.difference.n
    if not paired.differs:
        return f"{subject} alike on all {n} missions."
    if difference.is_alike_to_a_cent:
        return f"{subject} alike to a cent on all {n} missions, which says nothing of what is rare."
    if difference.is_significant:
        return f"{subject} {span}, significant at n = {n} (p Holm {difference.p_holm:.2g})."
    text = f"{subject} {span}, not significant at n = {n} (p Holm {difference.p_holm:.2g})"
    if paired.needed is not None and paired.needed > n:
        text += f"; a difference as large as this one would take about {paired.needed:,d} missions"
    elif difference.compared.paired.p < SURE:
        text += f"; alone it would be (p {paired.p:.2g}), among several comparisons it may be chance"
    if paired.detectable is not None:
        text += f"; with {n}, differences from {paired.detectable:.3g} on are found"
    return f"{text}."


def price_sentence(price: ErrorPrice) -> str:
    """What an error costs."""
    unit = {"m": "metre", "deg": "degree"}[KINDS[price.kind].unit]
    levels = ", ".join(f"{level:g}" for level in price.levels)
    subject = f"price of {price.kind} error (RMS of {levels} {KINDS[price.kind].unit}):"
    if price.price.value is None:
        return f"{subject} undefined, no mission with a margin was finished at every level."
    verdict = ""
    if price.price.low is None or price.price.high is None:
        verdict = ", too few missions, or all alike to a cent, for an interval: that says nothing about rare events"
    elif price.price.low <= 0.0 <= price.price.high:
        verdict = ", not significant"
    return f"{subject} {interval_text(price.price, None)} USD per run per {unit}, n = {price.price.n}{verdict}."


def _wrong_maps(ablation: Ablation) -> list[str]:
    """What each wrong map costs."""
    pairs = wrong_maps(ablation.arms)
    found = [each for each in ablation.of(MARGIN) if (each.arm, each.against) in pairs]
    return [f"what the wrong map costs: {sentence(each)}" for each in found]


def label(arm: Arm) -> str:
    """An arm's name in a figure, with the unit of its error."""
    kind = injected_kind(arm.stack)
    return arm.name if kind is None else f"{arm.name} {KINDS[kind].unit}"

"""What ``navbench compare`` found."""

from harness.analysis.apart import Apart
from harness.analysis.compare import Compared, Comparison, OfADollar
from harness.economics.rates import RATE_TITLES
from harness.metrics.metric import Better
from harness.report.audit import audit_blocks
from harness.report.blocks import Block, Text, declared, notes_of
from harness.report.numbers import (
    UNDEFINED,
    all_of,
    bounds_text,
    count_text,
    counted,
    interval_text,
    number_text,
    p_text,
)
from harness.report.texts import notes
from harness.report.verdict import undecided

WORTH_SAYING = 1.5  # times as long by pairs


def comparison_blocks(comparison: Comparison) -> list[Block]:
    """The differences, what they rest on, and what stands against comparing."""
    first, second = comparison.first, comparison.second
    rows = [
        (key, *comparison_cells(entry))
        for key, entry in comparison.differences.items()
        if entry.differs
    ]
    return [
        Text(f"A: {first.run.folder} {first.stack.name}", "whole"),
        Text(f"B: {second.run.folder} {second.stack.name}\n", "whole"),
        declared("comparison", rows, pairs=comparison.pairs),
        declared("rates", _rates(comparison)),
        *notes_of(_notes(comparison)),
        *([] if comparison.audit is None else audit_blocks(comparison.audit)),
    ]


def _rates(comparison: Comparison) -> list[list[str]]:
    both = comparison.first.rates, comparison.second.rates
    return [
        [title, *(interval_text(rates[key], 1) for rates in both)]
        for key, title in RATE_TITLES.items()
    ]


def comparison_cells(entry: Compared) -> list[str]:
    """Both means, the difference with its interval, p values, n, and who is better."""
    paired, span = entry.paired, entry.paired.difference
    return [
        f"{entry.first:.4g}",
        f"{entry.second:.4g}",
        number_text(span.value, None),
        bounds_text(span, None) or UNDEFINED,
        p_text(paired.p),
        p_text(entry.p_holm),
        str(span.n),
        count_text(paired.needed),
        winner(entry, "A", "B"),
    ]


def winner(entry: Compared, first: str, second: str) -> str:
    """The better of two; empty where that is not significant."""
    difference = entry.paired.difference.value
    is_judged = entry.in_family and entry.better is not Better.NEITHER
    if not is_judged or not entry.paired.is_significant or not difference:
        return ""
    if (difference > 0.0) == (entry.better is Better.HIGHER):
        return second
    return first


def _open(comparison: Comparison) -> list[str]:
    """What would decide those of the family that are not significant."""
    runs = comparison.first.run, comparison.second.run
    family = [(key, comparison.differences[key].paired) for key in comparison.family]
    return [
        f"{key}: not significant{undecided(paired, *runs)}"
        for key, paired in family
        if paired.differs and not paired.is_significant
    ]


def _dollar(dollar: OfADollar, apart: Apart | None) -> str:
    """How long one has to drive to resolve a difference of one dollar."""
    text = f"contribution_margin: a difference of 1 USD a delivery takes {dollar.pairs:,d} missions"
    if dollar.seconds is not None:
        minutes = f"{dollar.seconds / 60.0:,.0f} min"
        text += f", {minutes} of one worker where deliveries last as long as these"
    if apart is not None:
        text += unequal(apart)
    return f"{text} (power 0.8)."


def unequal(apart: Apart) -> str:
    """How long it takes with other numbers of deliveries of each."""
    if apart.of_a_dollar is None or apart.seconds is None:
        return ""
    first, second = apart.of_a_dollar
    minutes = f"{apart.seconds / 60.0:,.0f} min"
    return f"; {first:,d} deliveries of A and {second:,d} of B, unpaired, take {minutes}"


def of_all(apart: Apart) -> str:
    """What all deliveries say of the margin, where not all have a partner."""
    first, second = apart.deliveries
    difference, more = apart.difference, "more"
    if difference.value is not None and difference.value < 0.0:
        difference, more = difference.negated, "less"
    return (
        f"{all_of(first, 'delivery')} of A and {all_of(second, 'delivery')} of B: B earned "
        f"{interval_text(difference, 2)} USD a delivery {more}"
    )


def sooner(apart: Apart, dollar: OfADollar | None) -> str:
    """The numbers of deliveries that tell a dollar much sooner than pairs do; empty: none do."""
    if apart.seconds is None or dollar is None or dollar.seconds is None:
        return ""
    if dollar.seconds < WORTH_SAYING * apart.seconds:
        return ""
    pairs = f"{dollar.pairs:,d} pairs take {dollar.seconds / 60.0:,.0f} min of one worker"
    return f"to tell 1 USD a delivery {pairs}{unequal(apart)}"


def _notes(comparison: Comparison) -> list[str]:
    left, apart = comparison.left_out, comparison.apart
    alike = [key for key, entry in comparison.differences.items() if not entry.differs]
    lines = notes("comparison", family=" and ".join(comparison.family))
    lines += _open(comparison)
    if comparison.unseen is not None:
        unseen = interval_text(comparison.unseen, 2)
        lines.append(
            f"contribution_margin, if an unseen loss is admitted: {unseen} USD a delivery."
        )
    if comparison.dollar is not None:
        lines.append(_dollar(comparison.dollar, apart))
    if alike:
        lines.append(f"alike on every mission: {', '.join(alike)}.")
    if any(left):
        lines.append(
            f"left out, without a partner that finished: {counted(left[0], 'delivery')} of A, "
            f"{left[1]} of B."
        )
        if apart is not None:
            lines.append(f"{of_all(apart)}.")
    return lines

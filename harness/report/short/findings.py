"""What the commands that compare and price found, each in at most 25 lines."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path

from harness.ablation.analysis import Ablation
from harness.ablation.precision import half_width
from harness.analysis.compare import Comparison
from harness.analysis.repricing import Choices, Repriced, admitting_unseen
from harness.analysis.sensitivity import Sensitivity
from harness.analysis.side import Side
from harness.economics.cost_terms import MARGIN
from harness.economics.rates import RATE_TITLES
from harness.report.ablations.screen import (
    deciding,
    investment_of,
    price_sentence,
    sentence,
)
from harness.report.audit import audit_sentence
from harness.report.blocks import Block, Text
from harness.report.comparison import of_all, sooner
from harness.report.numbers import all_of, count_text, counted, interval_text, number_text
from harness.report.page.comparisons import FOREMOST, metric_titles
from harness.report.repriced import SHOWN, goes_with
from harness.report.short.run import BRACKETS, CONTACT_RATE, MANY, aligned, errors_of
from harness.report.short.setup import (
    drivers_of,
    robot_price_line,
    setup_line,
    unlike_line,
    unlike_published,
    where_line,
)
from harness.report.texts import TEXTS
from harness.report.verdict import rankings
from harness.statistics.interval import Interval, admitting
from harness.study.stored_run import StoredRun, load_run

MOST_PRICES = 5  # on which the money depends most
MOST_STACKS = 16


def lines_of(lines: Sequence[str]) -> list[Block]:
    """Each line that says something, whole."""
    return [Text(line, "whole") for line in lines if line]


def short_comparison(comparison: Comparison) -> list[Block]:
    """Who was compared, the verdict, and the foremost metrics in which the two differ."""
    sides = {"A": comparison.first, "B": comparison.second}
    lines = compared_lines(sides)
    known = comparison.differences
    if MARGIN in known:
        means = known[MARGIN].first, known[MARGIN].second
        parties = [
            (letter, side, Interval(mean, None, None, comparison.pairs))
            for (letter, side), mean in zip(sides.items(), means, strict=True)
        ]
        lines += rankings(parties)
    shown = [key for key in FOREMOST if key in known] if MARGIN in known else list(known)
    titles = metric_titles()
    rows = [(titles.get(key, key), *_cells(comparison, key)) for key in shown if known[key].differs]
    if rows:
        lines += aligned([[BRACKETS, "A", "B", "B - A"], *rows])
    else:
        lines.append(f"alike on {all_of(comparison.pairs, 'common mission')}")
    lines.append(_rates_line(comparison))
    if comparison.audit is not None:
        lines.append(audit_sentence(comparison.audit))
    left = comparison.left_out
    if any(left):
        of_first = counted(left[0], "delivery")
        lines.append(f"left out, without a partner: {of_first} of A, {left[1]} of B")
    apart = comparison.apart
    if apart is not None and any(left):
        lines.append(of_all(apart))
    if apart is not None:
        lines.append(sooner(apart, comparison.dollar))
    return lines_of(lines)


def compared_lines(sides: Mapping[str, Side]) -> list[str]:
    """Who is compared: one line where both drove in one run, else a line for each."""
    first, second = sides.values()
    if first.run.folder != second.run.folder:
        return [f"{letter}: {side_line(side)}" for letter, side in sides.items()]
    both = dataclasses.replace(first.run, stacks=(first.stack, second.stack))
    told = ", ".join(f"{letter} {side.stack.name}" for letter, side in sides.items())
    return [f"{told} of {first.run.folder}: {setup_line(both)}"]


def _cells(comparison: Comparison, key: str) -> list[str]:
    """Both means and their difference, of a metric."""
    entry = comparison.differences[key]
    difference, decimals = entry.paired.difference, None
    if key == MARGIN:
        difference, decimals = admitting(difference, comparison.unseen), 2
    means = (number_text(mean, decimals) for mean in (entry.first, entry.second))
    return [*means, interval_text(difference, decimals)]


def _rates_line(comparison: Comparison) -> str:
    """The rate that an insurer asks for, of both sides."""
    of_each = [
        f"{letter} {interval_text(side.rates[CONTACT_RATE], 0)}"
        for letter, side in (("A", comparison.first), ("B", comparison.second))
    ]
    return f"{RATE_TITLES[CONTACT_RATE]}: {', '.join(of_each)}"


def side_line(side: Side) -> str:
    """A side of a comparison: its folder, what drove, and where."""
    return f"{side.run.folder}: {setup_line(side.run.only(side.stack.name))}"


def short_repricing(
    run: StoredRun, results: Sequence[Repriced], choices: Choices, sensitive: Sequence[Sensitivity]
) -> list[Block]:
    """The margin of each stack under the main accountings, and what it depends on.

    Args:
        run: that was priced.
        results: of each stack.
        choices: prices and terms that were asked for.
        sensitive: what the profit of each stack depends on; none: its margin is undefined.
    """
    sets = [f"{key} = {number:g}" for key, number in choices.settings.items()]
    sets += [f"with {name}" for name in choices.optional.names]
    lines = [setup_line(run), unlike_line(unlike_published(run)), ", ".join(sets)]
    paying = choices.prices.accounting
    if rule := goes_with(choices):
        lines.append(f"{rule}: break-even and what profit depends on are by it")
    shown = tuple(dict.fromkeys((*SHOWN, paying)))
    titles = (TEXTS.accountings[name] for name in shown)
    head = ["Margin ($/delivery)", *titles, "Break-even (runs)"]
    rows = []
    for each in results[:MOST_STACKS]:
        margins = [
            interval_text(admitting_unseen(run, each, name, choices.prices), absent="undefined")
            for name in shown
        ]
        runs = count_text(each.accountings[paying].break_even_runs)
        rows.append([each.stack.name, *margins, runs])
    table = [head, *rows]
    if len(rows) < MANY:  # which fit beside each other
        table = [list(column) for column in zip(*table, strict=True)]
    lines += aligned(table)
    if len(results) > MOST_STACKS:
        lines.append(f"and {len(results) - MOST_STACKS} more stacks: --full")
    lines += [robot_price_line(run, choices.prices), *errors_of(run)]
    if len(results) == len(sensitive) <= 2:
        lines += [line for each in sensitive for line in dependence(each)]
    return lines_of(lines)


def dependence(result: Sensitivity) -> list[str]:
    """The prices on which a stack's profit depends most, in one line."""
    bars = ", ".join(
        f"{bar.price} {bar.low:g}..{bar.high:g} {bar.unit}: {bar.swing:.2f}"
        for bar in result.bars[:MOST_PRICES]
    )
    return [f"{result.stack.name} depends most on (USD a delivery between a price's ends): {bars}"]


def ablation_setup(ablation: Ablation, folder: Path) -> str:
    """What drove with which localizers, where and among whom: one line."""
    run = load_run(str(folder))
    arms = ", ".join(arm.name for arm in ablation.arms)
    first = drivers_of(run)[0]
    who = f"{ablation.declaration.stack}, robot {first.robot}, sensors {first.sensors}"
    return f"{who}, with {arms}; {where_line(run)}"


def known_within(ablation: Ablation) -> list[str]:
    """Which margins are known as well as was asked for, in a line; nothing was asked: in none."""
    within = ablation.declaration.within
    if within is None:
        return []
    wide = []
    for arm in ablation.arms:
        width = half_width(arm.unseen)
        if width is None or width > within:
            wide.append(f"{arm.name} ({_half_width_text(width, arm.result.errors)})")
    if not wide:
        return [f"every margin is known to within {within:g} USD"]
    most = f"after at most {counted(ablation.episodes, 'delivery')}"
    return [f"not known to within {within:g} USD {most}: {', '.join(wide)}"]


def _half_width_text(width: float | None, errors: int) -> str:
    if width is None and errors:
        return f"undefined, {counted(errors, 'error')}: --resume DIR --retry-errors"
    if width is None:
        return "undefined"
    return f"+-{number_text(width)}"


def ablation_answer(ablation: Ablation) -> list[str]:
    """Which margins differ: a sentence for each pair."""
    found = [sentence(each) for each in ablation.differences if each.metric == MARGIN]
    return [*found, *known_within(ablation)]


def short_ablation(ablation: Ablation, folder: Path) -> list[Block]:
    """What each localizer knows of its position and earns, and which differences are significant.

    Args:
        ablation: what was found.
        folder: of its run.
    """
    lines = [ablation_setup(ablation, folder), *ablation_answer(ablation)]
    head = [BRACKETS, "Error [m]", "95th pct.", "Margin ($/delivery)", "n", "Sensors", "CAPEX ($)"]
    rows = [
        (
            arm.name,
            number_text(arm.errors["localization_error_median_m"].value, 3),
            number_text(arm.errors["localization_error_p95_m"].value),
            interval_text(arm.unseen, absent="undefined"),
            str(arm.result.episodes),
            *investment_of(arm)[:2],
        )
        for arm in ablation.arms
    ]
    lines += aligned([head, *rows])
    lines += [
        f"{name}: {audit_sentence(audit)}"
        for name, audit in ablation.audits.items()
        if audit.flagged
    ]
    lines += [*map(price_sentence, ablation.prices), *deciding(ablation)]
    lines += ablation.declaration.sources
    return lines_of(lines)

"""A finished run in at most 25 lines: what drove, verdict, eight quantities; more of streets."""

import dataclasses
from collections.abc import Sequence

from harness.analysis.rare import margin_with_unseen
from harness.analysis.side import Side
from harness.economics.cost_terms import MARGIN
from harness.economics.rates import MARGIN_PER_KM, RATE_TITLES
from harness.economics.valuation import has_too_few, value
from harness.report.blocks import Block, Text
from harness.report.numbers import counted
from harness.report.paper_tables import Column, cells_of, own_column
from harness.report.published import load_published, published_columns
from harness.report.repriced import NO_MARGIN
from harness.report.short.setup import (
    USUAL_SENSORS,
    robot_price_line,
    setup_line,
    unlike_line,
    unlike_published,
)
from harness.report.short.touches import touches_line
from harness.report.table_rows import RATES, TableRow
from harness.report.verdict import earnings, rankings
from harness.storage.rows import values
from harness.study.stored_run import StoredRun, StoredStack

PUBLISHED_BESIDE = "Nav2 w/ GPS"  # the published method that drives like the stacks here
PAPER = "paper w/ GPS"  # above it, short enough for a terminal of 80 characters
CONTACT_RATE = "contacts_per_1000_km"
BRACKETS = "[95 % interval]"  # above tables; docs/tables.md says of which kind
ROWS = (
    TableRow("Margin ($/delivery)", MARGIN, 2, absent="undefined"),
    TableRow("In time, intact", "sla", 3, absent="not modelled"),
    TableRow("Spoiled", "spoiled", 3, absent="not modelled"),
    TableRow("Timeout", "timeout", 3),
    TableRow("Assistance", "physical_assistance", 3),
    TableRow("Injuries ($/delivery)", "pedestrian_safety", 2),
    TableRow(RATE_TITLES[CONTACT_RATE], CONTACT_RATE, 0),
    TableRow("Break-even (runs)", "break_even_runs", 0),
)
ON_STREETS = (
    TableRow(RATES[MARGIN_PER_KM], MARGIN_PER_KM, 2, absent="undefined"),
    *(TableRow(title, key, 0) for key, title in RATE_TITLES.items() if key != CONTACT_RATE),
)
OF_MANY = (MARGIN, "sla", "pedestrian_safety", CONTACT_RATE)  # rows where many stacks drove
MANY = 4  # stacks from which they stand below each other
MOST_LINES = 15  # of stacks
MOST_VERDICTS = 3


def summary_blocks(run: StoredRun) -> list[Block]:
    """What drove, what that proves, and eight quantities of each stack beside the paper's.

    On streets also the other rates, with exact Poisson bounds, and the margin per kilometre.

    Args:
        run: of which at least one delivery finished.
    """
    driven = [stack for stack in run.stacks if stack.rows]
    if not driven:
        return [Text(f"no delivery finished; run folder: {run.folder}", "whole")]
    columns = [_column(run, stack) for stack in driven]
    lines = [setup_line(run), *verdicts(run, driven, columns)]
    columns = [
        admitting_unseen(run, stack, column) for stack, column in zip(driven, columns, strict=True)
    ]
    if len(columns) < MANY:
        rows = list(ROWS)
        if run.has_legs:
            rows += ON_STREETS
        lines += aligned(_beside([*columns, _paper(run)], rows))
        priced = robot_price_line(run, run.prices())
        touched = touches_line(run)
    else:
        lines += aligned(_below([*columns, _paper(run)]))  # without the break-even point
        priced = touched = ""
        if len(columns) > MOST_LINES:
            lines.append(f"and {len(columns) - MOST_LINES} more stacks: --full")
    unlike = unlike_published(run)
    if unlike == {"sensors": USUAL_SENSORS}:  # the first line says so
        unlike = {}
    lines += filter(None, [touched, unlike_line(unlike), priced])
    return [Text(line, "whole") for line in (*lines, *errors_of(run))]


def errors_of(run: StoredRun) -> list[str]:
    """What ended in an error: at most one line."""
    found = []
    for stack in run.stacks:
        if stack.errors:
            lost = counted(stack.errors, "delivery")
            found.append(f"{stack.name}: {lost} ended in an error, left out")
        if has_too_few(len(stack.rows), stack.errors):
            found.append(NO_MARGIN)
        failures = sum(error is not None for error in values(stack.rows, "stack_error"))
        if failures:
            ended = counted(failures, "delivery")
            found.append(f"{stack.name}: its own errors ended {ended} (assistance)")
    return list(filter(None, ["; ".join(found)]))


def verdicts(run: StoredRun, driven: Sequence[StoredStack], columns: Sequence[Column]) -> list[str]:
    """Which stack earns more, or whether a single one earns money; one sentence each."""
    parties = [
        (stack.name, Side(run, stack), column.intervals.get(MARGIN))
        for stack, column in zip(driven, columns, strict=True)
    ]
    found = rankings(parties) or earnings(parties)
    if len(found) > MOST_VERDICTS:
        more = f"{len(found) - MOST_VERDICTS} more comparisons: navbench compare"
        return [*found[:MOST_VERDICTS], more]
    return found


def _column(run: StoredRun, stack: StoredStack) -> Column:
    valuation = value(stack.rows, stack, run.prices(), run.seed, left_out=stack.errors)
    return own_column(stack.name, valuation, len(stack.rows))


def admitting_unseen(run: StoredRun, stack: StoredStack, column: Column) -> Column:
    """The same with the margin's interval that admits an unseen loss."""
    unseen = margin_with_unseen(run, stack)
    if unseen is None or MARGIN not in column.intervals:
        return column
    return dataclasses.replace(column, intervals={**column.intervals, MARGIN: unseen})


def _paper(run: StoredRun) -> Column:
    columns = published_columns(load_published(), run.prices())
    (paper,) = (column for column in columns if column.title == PUBLISHED_BESIDE)
    return dataclasses.replace(paper, title=PAPER)


def _beside(columns: Sequence[Column], shown: Sequence[TableRow]) -> list[list[str]]:
    """A row for each quantity, a column for each stack."""
    cells = [cells_of(shown, column) for column in columns]
    rows = [[row.label, *(own[row.key] for own in cells)] for row in shown]
    return [[BRACKETS, *(column.title for column in columns)], *rows]


def _below(columns: Sequence[Column]) -> list[list[str]]:
    """A row for each stack, a column for a few quantities."""
    shown = [row for row in ROWS if row.key in OF_MANY]
    *own, paper = columns
    lines = [
        [column.title, *(cells_of([row], column)[row.key] for row in shown)]
        for column in (*own[:MOST_LINES], paper)
    ]
    return [[BRACKETS, *(row.label for row in shown)], *lines]


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of cells as lines: the first column to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for first, *others in rows:
        cells = [cell.rjust(width + 2) for cell, width in zip(others, widths[1:], strict=True)]
        lines.append((first.ljust(widths[0]) + "".join(cells)).rstrip())
    return lines

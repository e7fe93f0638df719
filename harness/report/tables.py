"""The paper's two result tables on a console, for any mix of one's own runs and published columns."""

import os
import sys
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from io import TextIOWrapper
from typing import TextIO

from rich import box
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from harness.economics.cost_model import Economics
from harness.economics.measured import Measured
from harness.economics.valuation import OUTCOMES, Valuation
from harness.metrics.contacts import PRICED_PROPERTY
from harness.report.table_rows import LAYOUTS, Layout, Row
from harness.report.texts import TEXTS, print_notes
from harness.statistics.interval import Interval, wilson_interval

PLAIN_WIDTH = 120  # [characters] where the output is no terminal
WIDEST = 1000  # [characters] that any table may have
INDENT = "  "  # of a row under its section
GAP = 2  # [characters] between columns
# [characters] at which a column's title is broken; eight columns then fit into PLAIN_WIDTH
TITLE_LINE = 9


@dataclass(frozen=True, slots=True)
class Column:
    """One column of both tables."""

    title: str
    # by field of Measured and Economics, and means that the paper does not have
    values: Mapping[str, float | None]
    n: int  # deliveries behind it
    intervals: Mapping[str, Interval] = field(default_factory=dict)  # by the same keys
    published: bool = False

    def interval(self, key: str) -> Interval | None:
        """Its 95 % interval: the one given, or Wilson's for a share of one's own deliveries."""
        value = self.values[key]
        if value is None or self.published:
            return None
        if key in self.intervals:
            return self.intervals[key]
        return wilson_interval(round(value * self.n), self.n) if key in OUTCOMES else None


def own_column(title: str, valuation: Valuation, n: int) -> Column:
    """The column of one's own deliveries."""
    values = values_of(Measured(**valuation.measured), valuation.economics) | valuation.more
    return Column(title, values, n, valuation.intervals)


def values_of(measured: Measured, economics: Economics) -> dict[str, float | None]:
    """What both say, by their fields."""
    return {**asdict(measured), **economics.as_json()}


class QuietConsole(Console):
    """A console whose reader may leave early, as ``head`` does: that is no error."""

    def on_broken_pipe(self) -> None:
        """Write the rest to nowhere."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self.file.fileno())


def report_console(stream: TextIO | None = None) -> Console:
    """A console of a terminal's own width and colours, or plain text of a fixed width.

    By default standard output.
    """
    stream = stream or sys.stdout
    if isinstance(stream, TextIOWrapper):
        stream.reconfigure(errors="replace")  # a Δ on an ASCII terminal is no reason to stop
    return QuietConsole(
        file=stream, width=None if stream.isatty() else PLAIN_WIDTH, highlight=False, markup=False
    )


def report_table(title: str | None = None) -> Table:
    """An empty table as all reports have them: lines above and below its head, none around it.

    No markup in a title.
    """
    return Table(
        title=None if title is None else Text(title, style="bold"),
        title_justify="left",
        box=box.HORIZONTALS,
        padding=(0, GAP - 1, 0, 0),  # the box's divider is the other space
        show_edge=False,
        pad_edge=False,
    )


def print_table(table: Table, console: Console) -> None:
    """Print a table at its full width, wherever it goes: what is cut off is lost."""
    given = console.width
    console.width = max(given, _width(table, console))
    console.print(table)
    console.width = given


def _width(table: Table, console: Console) -> int:
    """Of a table that nothing is cut off from [characters]."""
    return Measurement.get(console, console.options.update(max_width=WIDEST), table).maximum


def render_tables(columns: Sequence[Column], console: Console) -> None:
    """Print both tables and what is to be known about their entries."""
    for layout in LAYOUTS:
        render_table(layout, columns, console)
    print_notes(table_notes(columns), console)


def render_table(layout: Layout, columns: Sequence[Column], console: Console) -> None:
    """Print one table.

    Columns that do not fit beside each other continue in a further one below.
    """
    shown: list[Column] = []
    for column in columns:
        if shown and _width(_table(layout, [*shown, column]), console) > console.width:
            console.print(_table(layout, shown))
            console.print()
            shown = []
        shown.append(column)
    console.print(_table(layout, shown))
    console.print()


def _broken(title: str) -> list[str]:
    """A title in lines of at most :data:`TITLE_LINE` characters where its words allow it."""
    return textwrap.wrap(
        " ".join(title.split()), TITLE_LINE, break_long_words=False, break_on_hyphens=False
    )


def number_text(value: float | None, row: Row) -> str:
    """A value with its row's decimals."""
    if value is None:
        return row.absent
    return f"{value:z,.{row.decimals}f}"


def span_text(interval: Interval | None, row: Row) -> str:
    """An interval as text; empty where there is none."""
    if interval is None or interval.low is None or interval.high is None:
        return ""
    return f"[{number_text(interval.low, row)}, {number_text(interval.high, row)}]"


def _table(layout: Layout, columns: Sequence[Column]) -> Table:
    """Values stand below each other, and so do their intervals."""
    table = report_table(layout.title)
    table.add_column("Metric", no_wrap=True, vertical="bottom")
    rows = [row for section in layout.sections for row in section.all_rows]
    cells = []
    for column in columns:
        spans = {row.key: span_text(column.interval(row.key), row) for row in rows}
        width = max(map(len, spans.values()))
        own = {
            row.key: f"{number_text(column.values[row.key], row)} {spans[row.key]:>{width}}"
            for row in rows
        }
        cells.append(own if width else {key: text.rstrip() for key, text in own.items()})
        title = [*_broken(column.title), *(["paper"] if column.published else []), f"n={column.n}"]
        table.add_column(Text("\n".join(title)), justify="right", no_wrap=True, vertical="bottom")
    for section in layout.sections:
        table.add_row(Text(section.title, style="italic"))
        for row in section.all_rows:
            style = "bold" if row.bold else ""
            table.add_row(INDENT + row.label, *(Text(own[row.key]) for own in cells), style=style)
        table.add_section()
    return table


def table_notes(columns: Sequence[Column]) -> list[str]:
    """Footnotes, only those that the tables give cause for."""
    causes = {
        "break_even": any(column.values["break_even_runs"] is None for column in columns),
        "contact": any(
            column.values[f"{kind}_contacts"] is None
            for column in columns
            for kind in PRICED_PROPERTY
        ),
        "not_modelled": any(column.values["spoiled"] is None for column in columns),
        "interval": any(column.interval(key) for column in columns for key in OUTCOMES),
        "paper": any(column.published for column in columns),
    }
    return [TEXTS.table_notes[name] for name, is_there in causes.items() if is_there]

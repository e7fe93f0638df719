"""The paper's two result tables, for any mix of one's own runs and published columns."""

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field

from harness.economics.cost_model import Economics
from harness.economics.measured import Measured
from harness.economics.valuation import Valuation
from harness.metrics.contacts import PRICED_PROPERTY
from harness.report.blocks import Block, Table, notes_of
from harness.report.table_rows import LAYOUTS, RATES, TableLayout, TableRow
from harness.report.texts import TEXTS
from harness.statistics.interval import Interval, wilson_interval
from harness.world.outcome import OUTCOMES

INDENT = "  "  # of a row under its section
# [characters] at which a column's title is broken; eight columns then fit into the plain width
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
        value = self.values.get(key)
        if value is None or self.published:
            return None
        if key in self.intervals:
            return self.intervals[key]
        if key in OUTCOMES:
            return wilson_interval(round(value * self.n), self.n)
        return None


def own_column(title: str, valuation: Valuation, n: int) -> Column:
    """The column of one's own deliveries."""
    values = values_of(Measured(**valuation.measured), valuation.economics) | valuation.more
    rates = {key: each.value for key, each in valuation.intervals.items() if key in RATES}
    return Column(title, values | rates, n, valuation.intervals)


def values_of(measured: Measured, economics: Economics) -> dict[str, float | None]:
    """What both say, by their fields."""
    return {**asdict(measured), **economics.as_json()}


def paper_blocks(columns: Sequence[Column]) -> list[Block]:
    """Both tables and what is to be known about their entries."""
    tables = [layout_table(layout, columns) for layout in LAYOUTS]
    return [*tables, *notes_of(table_notes(columns))]


def layout_table(layout: TableLayout, columns: Sequence[Column]) -> Table:
    """One table: values stand below each other, and so do their intervals."""
    headers = ["Metric", *map(_header, columns)]
    of_layout = [row for section in layout.sections for row in section.all_rows]
    cells = [cells_of(of_layout, column) for column in columns]
    rows: list[Sequence[str]] = []
    styles: dict[int, str] = {}
    for section in layout.sections:
        styles[len(rows)] = "italic"
        rows.append((section.title,))
        for row in section.all_rows:
            if row.bold:
                styles[len(rows)] = "bold"
            rows.append((INDENT + row.label, *(own[row.key] for own in cells)))
        rows.append(())
    return Table(layout.title, headers, rows, styles=styles, folds=True)


def _header(column: Column) -> str:
    """Title in lines of at most :data:`TITLE_LINE` characters where its words allow it, and n."""
    title = " ".join(column.title.split())
    lines = textwrap.wrap(title, TITLE_LINE, break_long_words=False, break_on_hyphens=False)
    if column.published:
        lines.append("paper")
    return "\n".join([*lines, f"n={column.n}"])


def cells_of(rows: Sequence[TableRow], column: Column) -> dict[str, str]:
    """A column's values with their intervals, by the keys of rows."""
    spans = {row.key: span_text(column.interval(row.key), row) for row in rows}
    width = max(map(len, spans.values()))
    cells = {}
    for row in rows:
        cells[row.key] = number_text(column.values.get(row.key), row)
        if width:
            cells[row.key] += f" {spans[row.key]:>{width}}"
    return cells


def number_text(value: float | None, row: TableRow) -> str:
    """A value with its row's decimals."""
    if value is None:
        return row.absent
    return f"{value:z,.{row.decimals}f}"


def span_text(interval: Interval | None, row: TableRow) -> str:
    """An interval as text; empty where there is none."""
    if interval is None or interval.low is None or interval.high is None:
        return ""
    return f"[{number_text(interval.low, row)}, {number_text(interval.high, row)}]"


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

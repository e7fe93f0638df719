"""The tables of ``navbench bench``."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from harness.bench.measure import CPP
from harness.report.tables import print_table, report_table

Row = Mapping[str, Any]

PARTS = "breakdown_ms_per_simulated_s"
WRAPPERS = "breakdown_wrappers_ms_per_simulated_s"


def print_bench(rows: Sequence[Row], notes: Sequence[str], console: Console) -> None:
    """Print components, closed loops and where their time goes; then notes."""
    components = [row for row in rows if "ratio" in row]
    loops = [row for row in rows if "real_time_factor" in row]
    if components:
        print_table(_components(components), console)
        console.print()
    if loops:
        print_table(_loops(loops), console)
        console.print()
    broken_down = [row for row in loops if PARTS in row]
    if broken_down:
        print_table(_breakdown(broken_down), console)
        console.print()
    for note in notes:
        console.print(Text(note, style="dim"))


def _table(title: str, first: str, others: Sequence[str]) -> Table:
    table = report_table(title)
    table.add_column(first, no_wrap=True)
    for name in others:
        table.add_column(Text(name), justify="right", no_wrap=True)
    return table


def _components(rows: Sequence[Row]) -> Table:
    """A line per component and reference."""
    columns = ("ours [ms]", "reference [ms]", "ratio", "quartiles", "n", "at most", "", "reference")
    table = _table("Components: ours / reference, processor time of one core", "component", columns)
    table.columns[-1].justify = "left"
    for row in rows:
        span = f"{_short(row['low'])} to {_short(row['high'])}"
        cells = (_short(row["ours_ms"]), _short(row["reference_ms"]), _short(row["ratio"]), span, str(row["n"]))
        style = "bold" if row["reference"] == CPP else "dim"
        table.add_row(Text(row["name"]), *map(Text, cells), *_target(row), Text(row["reference"]), style=style)
    return table


def _loops(rows: Sequence[Row]) -> Table:
    """A line per closed loop; ratios of one with another stand beside it."""
    columns = ("x real time", "quartiles", "n", "by wall clock", "of the one before", "at least", "")
    table = _table("Closed loops: simulated seconds per second of one core's time", "loop", columns)
    for row in rows:
        relative = row.get("of_value_without") or row.get("of_one_worker")
        ratio = "" if relative is None else f"{relative['value']:.2f} ({relative['low']:.2f} to {relative['high']:.2f})"
        wall = row.get("wall_real_time_factor")
        cells = (
            f"{row['real_time_factor']:.1f}",
            f"{row['low']:.1f} to {row['high']:.1f}",
            str(row["n"]),
            "" if wall is None else f"{wall:.1f}",
            ratio,
        )
        table.add_row(Text(row["name"]), *map(Text, cells), *_target(row))
    return table


def _breakdown(rows: Sequence[Row]) -> Table:
    """A line per part, a column per closed loop."""
    table = _table(
        "One simulated second by part: ms of processor time, and share", "part", [row["name"] for row in rows]
    )
    names = list(dict.fromkeys(name for row in rows for name in row[PARTS]))
    names.sort(key=lambda name: -max(row[PARTS].get(name, 0.0) for row in rows))
    for name in names:
        table.add_row(Text(name), *(Text(_share(row, name)) for row in rows))
    table.add_section()
    table.add_row("together", *(f"{sum(row[PARTS].values()):.2f}      " for row in rows))
    table.add_row("the wrappers' own, left out", *(f"{row[WRAPPERS]:.2f}      " for row in rows))
    return table


def _share(row: Row, name: str) -> str:
    value = row[PARTS].get(name, 0.0)
    return f"{value:.2f} {100.0 * value / sum(row[PARTS].values()):3.0f} %"


def _short(value: float) -> str:
    return f"{value:.3g}" if value < 1000.0 else f"{value:.0f}"


def _target(row: Row) -> tuple[Text, Text]:
    if row["target"] is None:
        return Text(""), Text("")
    return Text(f"{row['target']:g}"), Text("met" if row["met"] else "MISSED")

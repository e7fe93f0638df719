"""The tables of ``python -m tools.bench``."""

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console

from harness.report.blocks import Table, notes_of
from harness.report.tables import print_blocks

Row = Mapping[str, Any]

PARTS = "breakdown_ms_per_simulated_s"
COMPONENT_HEADERS = (
    *("component", "reference", "ours [ms]", "reference [ms]", "ratio", "quartiles", "n"),
    *("at most", ""),
)
LOOP_HEADERS = (
    *("loop", "x real time", "quartiles", "n", "by wall clock", "of one worker", "at least"),
    "",
)
WRAPPERS = "breakdown_wrappers_ms_per_simulated_s"


def print_bench(rows: Sequence[Row], notes: Sequence[str], console: Console) -> None:
    """Print components, closed loops and where their time goes; then notes."""
    components = [row for row in rows if "ratio" in row]
    loops = [row for row in rows if "real_time_factor" in row]
    parts = _breakdown([row for row in loops if PARTS in row])
    print_blocks([_components(components), _loops(loops), parts, *notes_of(notes)], console)


def _components(rows: Sequence[Row]) -> Table:
    """A line per component and reference."""
    lines = []
    for row in rows:
        numbers = map(_short, (row["ours_ms"], row["reference_ms"], row["ratio"]))
        span = f"{_short(row['low'])} to {_short(row['high'])}"
        lines.append((row["name"], row["reference"], *numbers, span, str(row["n"]), *_target(row)))
    title = "Components: ours / reference, processor time of one core"
    return Table(title, COMPONENT_HEADERS, lines, texts=2)


def _loops(rows: Sequence[Row]) -> Table:
    """A line per closed loop; that of two workers over one stands beside it."""
    lines = []
    for row in rows:
        relative = row.get("of_one_worker")
        ratio = ""
        if relative is not None:
            ratio = f"{relative['value']:.2f} ({relative['low']:.2f} to {relative['high']:.2f})"
        wall = row.get("wall_real_time_factor")
        span = f"{row['low']:.1f} to {row['high']:.1f}"
        cells = (
            f"{row['real_time_factor']:.1f}",
            span,
            str(row["n"]),
            "" if wall is None else f"{wall:.1f}",
            ratio,
        )
        lines.append((row["name"], *cells, *_target(row)))
    title = "Closed loops: simulated seconds per second of one core's time"
    return Table(title, LOOP_HEADERS, lines)


def _breakdown(rows: Sequence[Row]) -> Table:
    """A line per part, a column per closed loop."""
    names = list(dict.fromkeys(name for row in rows for name in row[PARTS]))
    names.sort(key=lambda name: -max(row[PARTS].get(name, 0.0) for row in rows))
    lines = [(name, *(_share(row, name) for row in rows)) for name in names]
    if rows:
        lines += [
            (),
            ("together", *(f"{sum(row[PARTS].values()):.2f}      " for row in rows)),
            ("the wrappers' own, left out", *(f"{row[WRAPPERS]:.2f}      " for row in rows)),
        ]
    title = "One simulated second by part: ms of processor time, and share"
    return Table(title, ("part", *(row["name"] for row in rows)), lines)


def _share(row: Row, name: str) -> str:
    value = row[PARTS].get(name, 0.0)
    return f"{value:.2f} {100.0 * value / sum(row[PARTS].values()):3.0f} %"


def _short(value: float) -> str:
    if value < 1000.0:
        return f"{value:.3g}"
    return f"{value:.0f}"


def _target(row: Row) -> tuple[str, str]:
    if row["target"] is None:
        return "", ""
    return f"{row['target']:g}", "met" if row["met"] else "MISSED"

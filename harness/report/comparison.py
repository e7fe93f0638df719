"""The printed result of ``navbench compare``."""

from rich.console import Console
from rich.text import Text

from harness.analysis.compare import Compared, Comparison
from harness.metrics.metric import Better
from harness.report.tables import print_table, report_table

SURE = 0.05  # adjusted p below which a side is called better


def print_comparison(comparison: Comparison, console: Console) -> None:
    """Print the differences, what they rest on, and what stands against comparing."""
    first, second = comparison.first, comparison.second
    table = report_table(f"B minus A over {comparison.pairs} common missions")
    table.add_column("Metric", no_wrap=True)
    for title in ("A", "B", "B - A", "95 % interval", "p", "p Holm", "n", "needed"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("better")
    for key, entry in comparison.differences.items():
        if entry.differs:
            table.add_row(Text(key), *map(Text, _cells(entry)))
    console.print(f"A: {first.run.folder} {first.stack.name}", markup=False, soft_wrap=True)
    console.print(f"B: {second.run.folder} {second.stack.name}", markup=False, soft_wrap=True)
    console.print()
    if table.rows:
        print_table(table, console)
        console.print()
    for note in _notes(comparison):
        console.print(Text(note, style="dim"))


def _cells(entry: Compared) -> list[str]:
    paired, span = entry.paired, entry.paired.difference
    known = span.low is not None and span.high is not None
    return [
        _number(entry.first, 4),
        _number(entry.second, 4),
        _number(span.value),
        f"[{_number(span.low)}, {_number(span.high)}]" if known else "--",
        _probability(paired.p),
        _probability(entry.p_holm),
        str(span.n),
        "--" if paired.needed is None else f"{paired.needed:,d}",
        _winner(entry),
    ]


def _winner(entry: Compared) -> str:
    if entry.better is Better.NEITHER or entry.p_holm >= SURE or not entry.paired.difference.value:
        return ""
    return "B" if (entry.paired.difference.value > 0.0) == (entry.better is Better.HIGHER) else "A"


def _number(value: float | None, digits: int = 3) -> str:
    return "--" if value is None else f"{value:.{digits}g}"


def _probability(p: float) -> str:
    return "<.001" if p < 0.001 else f"{p:.3f}".removeprefix("0")


def _notes(comparison: Comparison) -> list[str]:
    left = comparison.left_out
    alike = [key for key, entry in comparison.differences.items() if not entry.differs]
    notes = [
        "Interval: bootstrap over missions. p: paired sign-flip test, McNemar's for shares of deliveries. p Holm: "
        f"adjusted for all {len(comparison.differences) - len(alike)} metrics above; --metric narrows the family.",
        "needed: missions that resolve a difference as large as the one observed (power 0.8, this metric alone).",
        "better: who is, where p Holm is below 0.05.",
    ]
    if alike:
        notes.append(f"alike on every mission: {', '.join(alike)}.")
    if any(left):
        notes.append(f"left out, without a partner that finished: {left[0]} deliveries of A, {left[1]} of B.")
    return notes

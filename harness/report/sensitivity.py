"""The printed result of ``navbench sensitivity``."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from harness.analysis.sensitivity import STATED, Sensitivity, quantiles
from harness.report.tables import report_table


def print_sensitivity(results: Sequence[Sensitivity], figures: Sequence[str], console: Console) -> None:
    """Print the tornado and the break-even distribution of each stack."""
    for result in results:
        console.print(_tornado(result))
        console.print()
        console.print(f"{result.stack.name}: {_break_even(result)}", markup=False)
        console.print()
    console.print(
        Text(
            "profit: contribution margin less CAPEX over the robot's life. Range: the source's own where it says so, "
            "else 20 % up and down, within what is allowed.",
            style="dim",
        )
    )
    for figure in figures:
        console.print(f"figure: {figure}", markup=False, soft_wrap=True)


def _tornado(result: Sensitivity) -> Table:
    table = report_table(
        f"{result.stack.name}: profit {result.profit:.3f} $/run; between the ends of each price's range"
    )
    table.add_column("Price", no_wrap=True)
    for heading in ("low", "value", "high", "profit at low", "at high", "swing"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    table.add_column("range", no_wrap=True)
    for bar in result.bars:
        span = bar.range
        numbers = [f"{number:g}" for number in (span.low, span.value, span.high)]
        money = [f"{number:.4f}" for number in (bar.profit_at_low, bar.profit_at_high, bar.swing)]
        origin = "source" if span.range == STATED else ""
        table.add_row(*map(Text, (bar.key, *numbers, *money, span.unit, origin)))
    return table


def _break_even(result: Sensitivity) -> str:
    if (spread := result.spread) is None:
        return "one mission, or deliveries that are all alike, tell nothing of how sure break-even is"
    bounds = quantiles(spread)
    if bounds["value"] is None:
        middle = "no break-even point in most resamples"
    else:
        high = "never" if bounds["high"] is None else f"{bounds['high']:,.0f}"
        middle = f"breaks even after {bounds['value']:,.0f} runs [{bounds['low']:,.0f}, {high}]"
    return f"{middle}; in {100.0 * spread.never:.1f} % of the resamples of {len(result.stack.rows)} deliveries never"

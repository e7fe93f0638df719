"""The printed result of ``navbench sensitivity``."""

from collections.abc import Sequence

from rich.console import Console
from rich.text import Text

from harness.analysis.sensitivity import STATED, Sensitivity, quantiles
from harness.report.sheet import Sheet, declared, print_sheet


def print_sensitivity(results: Sequence[Sensitivity], figures: Sequence[str], console: Console) -> None:
    """Print the tornado and the break-even distribution of each stack."""
    for result in results:
        print_sheet(_tornado(result), console)
        console.print(f"{result.stack.name}: {_break_even(result)}")
        console.print()
    console.print(
        Text(
            "profit: contribution margin less CAPEX over the robot's life. Range: the source's own where it says so, "
            "else 20 % up and down, within what is allowed.",
            style="dim",
        )
    )
    for figure in figures:
        console.print(f"figure: {figure}", soft_wrap=True)


def _tornado(result: Sensitivity) -> Sheet:
    rows = []
    for bar in result.bars:
        numbers = [f"{number:g}" for number in (bar.low, bar.value, bar.high)]
        money = [f"{number:.4f}" for number in (*bar.profit_usd_per_run, bar.swing)]
        rows.append((bar.price, bar.unit, "source" if bar.range == STATED else "", *numbers, *money))
    return declared("tornado", rows, stack=result.stack.name, profit=result.profit)


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

"""What ``navbench run`` found.

Both tables with the paper's column beside, and where the run is.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

from harness.analysis.side import Side
from harness.economics.cost_terms import MARGIN
from harness.economics.prices import Prices
from harness.economics.valuation import has_too_few
from harness.report.blocks import Block, Text
from harness.report.numbers import counted
from harness.report.paper_tables import layout_table, own_column, paper_blocks
from harness.report.published import load_published, published_columns
from harness.report.repriced import NO_MARGIN, risk_text
from harness.report.short.run import PUBLISHED_BESIDE
from harness.report.short.setup import robot_price_line, unlike_line, unlike_published
from harness.report.table_rows import RATE_LAYOUT, further_metrics
from harness.report.verdict import earnings, rankings
from harness.storage.checksums import root_digest
from harness.study.drive import StackResult
from harness.study.stored_run import load_run
from harness.task.study import Study


def run_blocks(
    results: Sequence[StackResult],
    study: Study,
    prices: Prices,
    folder: Path,
) -> list[Block]:
    """The tables of a run and what its figures rest on."""
    columns = [
        own_column(result.stack.name, result.valuation, result.episodes)
        for result in results
        if result.valuation is not None
    ]
    if not columns:
        return [Text(f"no delivery finished; run folder: {folder}", "whole")]
    paper = published_columns(load_published(), prices)
    beside = [column for column in paper if column.title == PUBLISHED_BESIDE]
    run = load_run(str(folder))
    margins = {each.stack.name: each.intervals.get(MARGIN) for each in results}
    parties = [(stack.name, Side(run, stack), margins[stack.name]) for stack in run.stacks]
    lines = [line for result in results for line in _stack_lines(result, study, prices)]
    whole = [
        *earnings(parties),
        *rankings(parties),
        f"run folder: {folder}",
        f"checksum of the run (SHA-256 of its checksums.json): {root_digest(folder)}",
        *filter(None, [unlike_line(unlike_published(run)), robot_price_line(run, prices)]),
    ]
    return [
        *paper_blocks([*columns, *beside]),
        Text(""),
        layout_table(RATE_LAYOUT, columns),
        layout_table(further_metrics(), columns),
        *map(Text, [*lines, ""]),
        *(Text(line, "whole") for line in whole),
    ]


def speed_text(result: StackResult, workers: int) -> str:
    """How fast deliveries were driven; old runs know their wall time only."""
    wall = f"{result.wall_s:,.0f} s of wall time, summed over {workers} workers"
    if result.real_time_factor_per_core is None:
        return wall
    return (
        f"{result.real_time_factor_per_core:.1f} x real time of processor time "
        f"({result.km_per_core_hour:.1f} km per core hour), {wall}"
    )


def _stack_lines(result: StackResult, study: Study, prices: Prices) -> Iterator[str]:
    """What is to be said of one stack."""
    name = result.stack.name
    if result.valuation is None:
        yield f"{name}: no delivery finished, {result.errors} errors"
        return
    runs = result.valuation.economics.break_even_runs
    if runs is not None and runs > prices.robot_life_runs:
        life = f"{prices.robot_life_runs:,.0f}"
        yield f"{name}: breaks even only beyond the robot's life of {life} runs"
    is_short = has_too_few(result.episodes, result.errors)
    yield f"{name}: {risk_text(result.valuation.risk, is_short)}"
    speed = f"{name}: {speed_text(result, study.workers)}"
    if result.errors:
        speed += f"; {result.errors} ended in an error"
    yield speed
    if is_short:
        yield f"{name}: {NO_MARGIN}"
    if result.failures:
        yield (
            f"{name}: its own errors ended {counted(result.failures, 'delivery')}, "
            "which counts as physical assistance"
        )

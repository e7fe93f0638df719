"""The printed result of ``navbench run``.

Both tables with the paper's column beside, and where the run is.
"""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from harness.analysis.compare import Side
from harness.economics.cost_terms import MARGIN
from harness.economics.prices import Prices
from harness.episode.factory import world_params
from harness.report.published import load_published, published_columns
from harness.report.repriced import risk_text
from harness.report.table_rows import further_metrics
from harness.report.tables import own_column, render_table, render_tables
from harness.report.verdict import earnings, rankings
from harness.study.drive import StackResult
from harness.study.stored_run import load_run
from harness.task.study import Study

PUBLISHED_BESIDE = "Nav2 w/ GPS"  # the published method that drives like the stacks here


def print_results(
    results: Sequence[StackResult], study: Study, prices: Prices, folder: Path, console: Console
) -> None:
    """Print the tables of a run and what its figures rest on."""
    columns = [
        own_column(result.stack.name, result.valuation, result.episodes)
        for result in results
        if result.valuation is not None
    ]
    if not columns:
        console.print(f"no delivery finished; run folder: {folder}")
        return
    published = [
        column
        for column in published_columns(load_published(), prices)
        if column.title == PUBLISHED_BESIDE
    ]
    render_tables([*columns, *published], console)
    console.print()
    render_table(further_metrics(), columns, console)
    console.print(_world_of(study))
    for result in results:
        if result.valuation is None:
            console.print(f"{result.stack.name}: no delivery finished, {result.errors} errors")
            continue
        runs = result.valuation.economics.break_even_runs
        if runs is not None and runs > prices.robot_life_runs:
            life = f"{prices.robot_life_runs:,.0f}"
            console.print(
                f"{result.stack.name}: breaks even only beyond the robot's life of {life} runs"
            )
        console.print(f"{result.stack.name}: {risk_text(result.valuation.risk)}")
        errors = f", {result.errors} ended in an error" if result.errors else ""
        console.print(
            f"{result.stack.name}: {result.real_time_factor_per_core:.1f} x real time per core{errors}"
        )
    run = load_run(str(folder))
    margins = {each.stack.name: each.intervals.get(MARGIN) for each in results}
    console.print()
    parties = [(stack.name, Side(run, stack), margins[stack.name]) for stack in run.stacks]
    for line in (*earnings(parties), *rankings(parties)):
        console.print(line, soft_wrap=True)
    console.print(f"run folder: {folder}", soft_wrap=True)
    console.print(f"next: navbench report {folder} --out report.html", soft_wrap=True)


def _world_of(study: Study) -> str:
    """Where the deliveries were driven, and among whom."""
    template = study.template
    people = world_params(template.world, template.pedestrians, template.people).people
    who = f"{people.count} people ({people.model})"
    if people.model == "replay":  # whose number is the recording's
        who = f"people replayed from {Path(people.replay.file).name}"
    return f"map {Path(template.map_name).stem}, {template.missions} missions, seed {template.seed}, {who}"

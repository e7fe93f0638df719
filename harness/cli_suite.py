"""``navbench suite``: every cell of a declared study one after the other, and the overview of all."""

import itertools
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from rich import box
from rich.table import Table

from harness.benchmark import TABLES, StackResult, run_document
from harness.cli_run import (
    INTERRUPTED,
    SOME_ERRORS,
    OnFinished,
    Tally,
    drive,
    finish,
    say,
    say_interrupted,
    say_what_failed,
    shown,
)
from harness.execution import Workers
from harness.manifest import load_study, version_notes
from harness.preflight import check
from harness.report.tables import report_console
from harness.resources import resolve, shipped
from harness.runs import RunFolder, count_finished, default_folder, point_latest, require_usable
from harness.statistics import Interval
from harness.study import Study, usable_workers
from harness.study_workers import Where, open_workers
from harness.suite import (
    Cell,
    Condition,
    Suite,
    cell_study,
    cells,
    create_suite,
    load_suite,
    stored_suite,
    summarize_condition,
    write_overview,
)
from harness.table_files import Row


def suite_command(file: str, where: Where, out: Path | None, as_json: bool) -> int:
    """Drive a new suite, show progress on stderr, print the overview on stdout; returns the exit status."""
    source = resolve(file, shipped("params") / "suites", "suite")
    suite = load_suite(source)
    path = out or default_folder(source.stem)
    require_usable(path)
    notes = [note for cell in cells(suite) if cell.seed == suite.seeds[0] for note in check(cell_study(suite, cell))]
    for note in dict.fromkeys(notes):
        say(f"note: {note}")
    create_suite(path, suite, sys.argv)
    return _drive(path, suite, where, as_json)


def resume_suite_command(path: Path, where: Where, as_json: bool) -> int:
    """Go on with a suite folder; otherwise as :func:`suite_command`."""
    path = path.resolve()  # a link may point elsewhere before the suite ends
    suite = stored_suite(path)
    for note in dict.fromkeys(note for cell in cells(suite) for note in version_notes(path / cell.name)):
        say(f"note: {note}")
    return _drive(path, suite, where, as_json)


def _drive(path: Path, suite: Suite, where: Where, as_json: bool) -> int:
    studies = {cell: load_study(path / cell.name, where.workers) for cell in cells(suite)}
    records: dict[Cell, list[Row]] = {}
    interrupted = False
    tally = _tally(path, studies)
    count = usable_workers(where.workers, tally.total)
    where = Where() if tally.done == tally.total else where  # a cluster is not needed to tell of a finished suite
    runs = {path / cell.name: study for cell, study in studies.items()}
    with open_workers(where, count, path, runs) as workers, shown(tally) as on_finished:
        for cell, study in studies.items():
            records[cell], interrupted = _drive_cell(path / cell.name, study, workers, on_finished)
            if interrupted:
                break
    say_what_failed([record for own in records.values() for record in own])
    if interrupted:
        say_interrupted(tally, path)
    conditions = _conditions(studies, records)
    document = {"schema": 1, "title": suite.title, "rows": [_row(c, r) for c in conditions for r in c.results]}
    write_overview(path, document)
    point_latest(path)
    _print(conditions, {**document, "folder": str(path)}, as_json)
    if interrupted:
        return INTERRUPTED
    return SOME_ERRORS if any(result.errors for c in conditions for result in c.results) else 0


def _tally(path: Path, studies: dict[Cell, Study]) -> Tally:
    """Count what is finished already, and tell it."""
    total = sum(study.total for study in studies.values())
    done = sum(count_finished(path / cell.name) for cell in studies)
    if done == total:
        say(f"suite {path} is complete: all of its {total} deliveries are finished")
    elif done:
        say(f"going on after {done} of {total} deliveries")
    return Tally(total, done)


def _drive_cell(path: Path, study: Study, workers: Workers, on_finished: OnFinished) -> tuple[list[Row], bool]:
    """The records of a cell, and whether it was interrupted."""
    with RunFolder(path, TABLES, study.total) as folder:
        interrupted = drive(study, folder, workers, on_finished)
        finish(study, folder)
        return folder.records, interrupted


def _conditions(studies: dict[Cell, Study], records: dict[Cell, list[Row]]) -> list[Condition]:
    groups = (list(group) for _, group in itertools.groupby(records, key=lambda cell: cell.condition))
    return [
        summarize_condition(group, studies[group[0]], [record for cell in group for record in records[cell]])
        for group in groups
    ]


def _row(condition: Condition, result: StackResult) -> Row:
    """One row of the overview in the JSON document: as of a run, for all seeds together."""
    row = run_document(result, condition.study, None)
    del row["seed"]
    where = {"world": Path(condition.world).stem, "pedestrians": condition.pedestrians, "seeds": list(condition.seeds)}
    return {**row, **where}


def _print(conditions: Sequence[Condition], document: Row, as_json: bool) -> None:
    if as_json:
        sys.stdout.write(json.dumps(document, indent=2, allow_nan=False) + "\n")
        return
    console = report_console(sys.stdout)
    console.print(document["title"], markup=False)
    console.print(_table(conditions))
    console.print("[low, high]: 95 % interval, the seeds of a row together", markup=False)
    console.print(f"suite folder: {document['folder']}", markup=False, soft_wrap=True)


def _table(conditions: Sequence[Condition]) -> Table:
    table = Table("Map", "World", box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("People", justify="right")
    table.add_column("Stack")
    for title in ("n", "Errors", "SLA compliance", "Contribution margin ($/run)"):
        table.add_column(title, justify="right")
    for condition in conditions:
        where = Path(condition.map_name).stem, Path(condition.world).stem
        people = "own" if condition.pedestrians is None else str(condition.pedestrians)
        for result in condition.results:
            sla, margin = (_text(result, key, n) for key, n in (("sla", 3), ("contribution_margin", 2)))
            name = result.stack.name
            table.add_row(*where, people, name, str(result.episodes), str(result.errors), sla, margin)
    return table


def _text(result: StackResult, key: str, decimals: int) -> str:
    interval = result.intervals.get(key, Interval(None, None, None, 0))
    if interval.value is None:
        return "--"
    bounds = "" if interval.low is None else f" [{interval.low:.{decimals}f}, {interval.high:.{decimals}f}]"
    return f"{interval.value:.{decimals}f}{bounds}"

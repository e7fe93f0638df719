"""Every cell of a declared study one after the other, and the overview of all."""

import dataclasses
import sys
from collections import defaultdict
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.execution.process_cache import forget_changed
from harness.execution.workers import Workers
from harness.report.numbers import counted
from harness.report.page.document import write_study_page
from harness.report.suite.document import PAGE, write_results
from harness.report.suite.results import Results, overview, read_results
from harness.storage.documents import write_document
from harness.storage.new_run import output_folder, point_latest, require_usable
from harness.storage.rows import Row, Rows
from harness.storage.run_folder import RunFolder, count_finished
from harness.storage.shipped import resolve, shipped
from harness.study.again import PARTINGS, record_again, recorded_again
from harness.study.barn import Score, made_maps, map_names, optimal_times, score_of
from harness.study.drive import TABLES, finish, require_own
from harness.study.manifest import load_study, version_notes
from harness.study.places import Where, open_workers
from harness.study.preflight import check
from harness.study.stored_run import load_run
from harness.study.suite import Cell, Portion, Suite, cell_study, cells, load_suite
from harness.study.suite_folder import (
    DECLARATION,
    begin,
    declare,
    is_begun,
    is_packed,
    require_alike,
    require_same,
    stored_suite,
)
from harness.study.suite_log import note_session, session_of, sessions_of
from harness.task.study import Study, usable_workers
from navbench.api.driving import (
    Tally,
    any_text,
    is_interrupted,
    say_interrupted,
    say_notes,
    say_what_failed,
)
from navbench.api.progress import say, shown
from navbench.api.report import today

MANY = 20  # cells that take a while to look at
ALL = Portion()


@dataclass(frozen=True)
class SuiteRun:
    """What a suite folder comes to."""

    folder: Path
    results: Results
    is_interrupted: bool  # and what is finished is kept
    has_errors: bool  # deliveries ended in an error

    @property
    def barn(self) -> dict[str, Score]:
        """What the BARN challenge says of the stacks; nothing where its worlds were not driven."""
        times = optimal_times(self.folder)
        rows = defaultdict[str, list[Row]](list)
        for each in self.results.standings:
            if times and each.side is not None:
                rows[each.stack] += each.side.stack.rows
        return {stack: score_of(driven, times) for stack, driven in rows.items() if driven}

    def as_json(self) -> dict[str, Any]:
        """As ``navbench suite --json`` prints it."""
        document = {**overview(self.results), "folder": str(self.folder)}
        scores = {stack: dataclasses.asdict(each) for stack, each in self.barn.items()}
        if scores:
            document["barn"] = scores
        return document


def suite(
    file: str,
    *,
    portion: Portion = ALL,
    world: str | None = None,
    barn: Path | None = None,
    where: Where | None = None,
    out: Path | None = None,
) -> SuiteRun:
    """Drive a suite; an interrupt ends it early.

    Args:
        file: of the suite, or its name.
        portion: of the suite that is driven now.
        world: a name of params/worlds or a file in place of the suite's own; None: those.
        barn: folder of the BARN challenge's worlds, to be driven in place of the suite's maps.
        where: it is driven; None: on this machine.
        out: folder; one that holds this suite already is added to.

    Raises:
        InputError: something that was given cannot be used.
    """
    forget_changed()
    source = resolve(file, shipped("params") / "suites", "suite")
    with output_folder(out, source.stem) as folder:
        path = folder.resolve()
        declared = load_suite(source, [] if barn is None else map_names(barn, path))
        if world is not None:
            other = str(Path(world).absolute()) if Path(world).is_file() else world
            declared = dataclasses.replace(declared, worlds=(other,))
        if (path / DECLARATION).is_file():
            require_same(path, declared)
        else:
            require_usable(path)
        with nullcontext() if barn is None else made_maps(barn, path):
            _check_cells(path, declared, portion)
        declare(path, declared)
    return _drive(path, declared, portion, where or Where())


def _check_cells(path: Path, declared: Suite, portion: Portion) -> None:
    """Check what is to be driven, and say what there is to note."""
    episodes = portion.episodes or declared.episodes
    studies = {cell: cell_study(declared, cell, episodes) for cell in portion.cells(declared)}
    for cell, study in studies.items():
        if is_begun(path, cell):
            require_alike(path, cell, study)
    if len(studies) > MANY:
        say(f"checking the files of {len(studies)} cells before the first delivery")
    notes: list[str] = []
    for cell, study in studies.items():
        if cell.seed == declared.seeds[0]:
            notes += check(study)
    say_notes(dict.fromkeys(notes))


def resume_suite(folder: Path, portion: Portion = ALL, where: Where | None = None) -> SuiteRun:
    """Go on with a suite folder; otherwise as :func:`suite`."""
    path = folder.resolve()  # a link may point elsewhere before the suite ends
    stored = stored_suite(path)
    begun = [cell for cell in portion.cells(stored) if is_begun(path, cell)]
    say_notes(dict.fromkeys(note for cell in begun for note in version_notes(path / cell.name)))
    for cell in begun:
        study = load_study(path / cell.name)
        if count_finished(path / cell.name) < study.total:
            check(study)
    return _drive(path, stored, portion, where or Where())


def _drive(path: Path, declared: Suite, portion: Portion, where: Where) -> SuiteRun:
    asked = portion.cells(declared)
    chosen = [cell for cell in asked if not is_packed(path, cell)]
    if stored := len(asked) - len(chosen):
        say(f"note: stored with other stacks, and left as they are: {counted(stored, 'cell')}")
    if not chosen:
        return SuiteRun(path, write_overview(path), False, False)
    sessions_of(path)  # a damaged list is told before anything is driven
    for cell in chosen:
        begin(path, declared, cell, portion.episodes or declared.episodes, sys.argv)
    studies = {cell: load_study(path / cell.name, where.workers) for cell in chosen}
    now = {cell: _first(study, portion.episodes) for cell, study in studies.items()}
    tally = _tally(path, now)
    before = _finished(path, studies)
    count = usable_workers(where.workers, sum(study.total for study in now.values()))
    if tally.done == tally.total:
        where = Where()  # a cluster is not needed to tell of a finished suite
    runs = {path / cell.name: study for cell, study in studies.items()}
    failed: list[Row] = []
    interrupted = False
    try:
        with open_workers(where, count, path, runs) as workers, shown(tally):
            for cell, study in studies.items():
                own, interrupted = _drive_cell(path / cell.name, study, now[cell], workers, tally)
                failed += own.where(any_text, "error", "stack_error")
                if interrupted:
                    break
            if not interrupted and _is_complete(path, declared):
                interrupted = not record_partings(path, read_results(path), workers)
    finally:
        # also what was kept and not yet counted
        after = _finished(path, studies)
        tally.done = sum(min(count, now[cell].total) for cell, count in after.items())
        driven = {
            cell.name: count - before[cell] for cell, count in after.items() if count > before[cell]
        }
        if driven:
            note_session(path, session_of(driven))
    say_what_failed(failed)
    if interrupted:
        say_interrupted(tally.done, f"{tally.done} of {tally.total} deliveries", path)
    return SuiteRun(path, write_overview(path), interrupted, bool(failed))


def write_overview(path: Path) -> Results:
    """Write what a suite folder comes to into it: ``suite.json``, page, figures and table."""
    results = read_results(path)
    write_document(path / "suite.json", overview(results))
    write_results(results, path)
    runs = [load_run(str(folder)) for folder in recorded_again(path / PARTINGS)]
    write_study_page(path / PAGE, runs, today())
    point_latest(path)
    return results


def record_partings(path: Path, results: Results, workers: Workers) -> bool:
    """Drive the missions on which stacks part ways most once more, recorded.

    A run folder for each condition.

    Returns:
        False: it was interrupted.
    """
    try:
        for parting in results.partings:
            runs = [each for each in parting.runs if each.seed == parting.seed]
            studies = [load_study(run.folder) for run in runs]
            stacks = [study.stacks[0] for study in studies]
            name = runs[0].folder.name.removesuffix(f"-{stacks[0].name}")
            template = studies[0].template
            record_again(path / PARTINGS, name, stacks, template, parting.episodes, workers)
    except KeyboardInterrupt:
        return False
    return True


def _finished(path: Path, studies: Mapping[Cell, Study]) -> dict[Cell, int]:
    """How many deliveries of each cell are finished."""
    return {cell: count_finished(path / cell.name) for cell in studies}


def _is_complete(path: Path, declared: Suite) -> bool:
    every = cells(declared)
    done = sum(count_finished(path / cell.name) for cell in every)
    return done == declared.episodes * len(every)


def _tally(path: Path, studies: Mapping[Cell, Study]) -> Tally:
    """Count what is finished already, and tell it."""
    total = sum(study.total for study in studies.values())
    finished = _finished(path, studies)
    done = sum(min(finished[cell], study.total) for cell, study in studies.items())
    if done == total:
        say(f"suite {path} is complete, with {counted(total, 'delivery')}")
    elif done:
        say(f"going on after {done} of {total} deliveries")
    return Tally(total, done)


def _first(study: Study, episodes: int | None) -> Study:
    """The first so many deliveries of each stack; None: all."""
    if episodes is None:
        return study
    return dataclasses.replace(study, episodes=min(study.episodes, episodes))


def _drive_cell(
    path: Path, study: Study, now: Study, workers: Workers, tally: Tally
) -> tuple[Rows, bool]:
    """The rows of a cell of which a part is to be driven now, and whether it was interrupted."""
    with RunFolder(path, TABLES, study.total) as folder:
        say_notes(folder.notes)
        require_own(study, folder)
        for row in folder.rows:
            tally.count(row)
        interrupted = is_interrupted(now, folder, workers, tally)
        finish(study, folder)
        return folder.rows, interrupted

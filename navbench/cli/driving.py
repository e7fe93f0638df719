"""What the commands that drive have in common: progress while they do, and what is said of it."""

import statistics
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from harness.episode.episode import Delivery
from harness.episode.factory import prices_of
from harness.execution.workers import Finished, Workers
from harness.report.run_tables import run_blocks
from harness.report.tables import print_blocks, report_console
from harness.storage.manifest_file import accept_changes, other_study
from harness.storage.rows import Row
from harness.storage.run_folder import RunFolder, create_run, default_folder, require_usable
from harness.study.drive import (
    TABLES,
    StackResult,
    drive_missing,
    finish,
    require_own,
    run_document,
)
from harness.study.manifest import about, load_study, parameters, version_notes
from harness.study.places import Where, open_workers
from harness.study.preflight import check
from harness.task.study import EpisodeTask, Study
from navbench.cli.progress import Bar, say, shown
from navbench.cli.streams import print_json
from navstack.errors import InputError

INTERRUPTED, SOME_ERRORS = 130, 3


class Tally(Bar):
    """Finished episodes, their outcomes and their speed."""

    def __init__(self, total: int, done: int) -> None:
        super().__init__("{done} of {total} deliveries", total, done)
        self._outcomes: Counter[str] = Counter()
        self._factors: list[float] = []  # real-time factor of each delivery

    def add(self, finished: Finished[EpisodeTask, Delivery], record: Row) -> None:
        """Take in one finished episode."""
        row = record["row"]
        self._outcomes["error" if row.get("error") else row["outcome"]] += 1
        if not row.get("error"):
            self._factors.append(record["timing"]["real_time_factor"])
        self.done += 1
        if finished.lost and finished.error is None:
            say(
                f"repeated {finished.task.stack.name} episode {finished.task.episode}: {finished.lost[0]}"
            )

    @property
    def note(self) -> str:
        """Outcomes so far and the median real-time factor per core."""
        outcomes = "  ".join(f"{name} {count}" for name, count in sorted(self._outcomes.items()))
        if not self._factors:
            return outcomes or "starting; the first delivery ever also compiles"
        return f"{outcomes}  {statistics.median(self._factors):.0f} x real time per core"


def begin_run(study: Study, out: Path | None, where: Where, as_json: bool) -> int:
    """Drive a new study, show progress on stderr, print results on stdout.

    Returns the exit status.
    """
    path = make_folder(study, out)
    return _drive(load_study(path, study.workers), path, where, as_json)


def make_folder(study: Study, out: Path | None) -> Path:
    """Check a study, tell notes on stderr, and make its run folder.

    Raises:
        InputError: something that the user gave cannot be used.
    """
    path = out or default_folder("-".join(stack.name for stack in study.stacks))
    require_usable(path)
    for note in check(study):
        say(f"note: {note}")
    create_run(path, about(study, sys.argv), parameters(study))
    return path


def resume_run(path: Path, where: Where, as_json: bool, is_forced: bool = False) -> int:
    """Go on with the study of a run folder, also with a changed one if forced.

    Otherwise as :func:`begin_run`.
    """
    path = path.resolve()  # a link may point elsewhere before the run ends
    if known := other_study(path):
        kind, command = known
        raise InputError(f"'{path}' is {kind}; go on with navbench {command} --resume {path}")
    if is_forced:
        accept_changes(path)
    study = load_study(path, where.workers)
    check(study)
    for note in version_notes(path):
        say(f"note: {note}")
    return _drive(study, path, where, as_json)


def _drive(study: Study, path: Path, where: Where, as_json: bool) -> int:
    results, interrupted = drive_folder(study, path, where)
    _print(results, study, path, as_json)
    return exit_status(results, interrupted)


def drive_folder(study: Study, path: Path, where: Where) -> tuple[list[StackResult], bool]:
    """Drive what a run folder lacks, show progress on stderr.

    Returns the results and whether it was interrupted.

    Args:
        study: as its folder tells it.
        path: of the folder.
        where: they are driven.
    """
    interrupted = False
    with RunFolder(path, TABLES, study.total) as folder:
        for note in folder.notes:
            say(f"note: {note}")
        require_own(study, folder)
        say_what_is_done(folder, study)
        tally = Tally(study.total, len(folder.rows))
        if not folder.is_closed:
            with open_workers(where, study.workers, path, {path: study}) as workers, shown(tally):
                interrupted = is_interrupted(study, folder, workers, tally)
        results = finish(study, folder)
    say_what_failed(folder.rows.where(bool, "error"))
    if interrupted:
        tally.done = len(folder.rows)  # the last one may have been kept and not yet counted
        say_interrupted(tally, path)
    return results, interrupted


def exit_status(results: Sequence[StackResult], interrupted: bool) -> int:
    """What the program leaves with."""
    if interrupted:
        return INTERRUPTED
    return SOME_ERRORS if any(result.errors for result in results) else 0


def is_interrupted(study: Study, folder: RunFolder, workers: Workers, tally: Tally) -> bool:
    """Drive what a folder lacks; returns whether it was interrupted."""
    if folder.is_closed:
        return False
    try:
        drive_missing(study, folder, workers, tally.add)
    except KeyboardInterrupt:
        return True
    return False


def say_what_is_done(folder: RunFolder, study: Study) -> None:
    """Tell how much of a run there already is."""
    if folder.is_complete:
        say(f"run {folder.path} is complete: all of its {study.total} deliveries are finished")
    elif folder.rows:
        say(f"going on after {len(folder.rows)} of {study.total} deliveries")


def say_what_failed(rows: Iterable[Row]) -> None:
    """Tell the deliveries that ended in an error."""
    for row in rows:
        say(f"error in {row['stack']} episode {row['episode']}: {row['error']}")


def say_interrupted(tally: Tally, path: Path, options: str = "") -> None:
    """Tell what an interrupt leaves; ``options`` go with the one that goes on."""
    kept = f"the finished ones are kept in {path}; go on with --resume {path}{options}"
    kept = kept if tally.done else "none was finished"
    say(f"interrupted after {tally.done} of {tally.total} deliveries; {kept}")


def _print(results: list[StackResult], study: Study, path: Path, as_json: bool) -> None:
    if as_json:
        document = {"schema": 1, "runs": [run_document(result, study, path) for result in results]}
        print_json(document)
        return
    blocks = run_blocks(results, study, prices_of(study.template.prices), path)
    print_blocks(blocks, report_console())

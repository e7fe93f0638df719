"""``navbench run``: progress while it drives, tables when it is done."""

import contextlib
import json
import statistics
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from harness.episode.episode import Delivery
from harness.episode.factory import prices_of
from harness.execution.workers import Finished, Workers
from harness.report.run_tables import print_results
from harness.report.tables import report_console
from harness.storage.run_folder import RunFolder, create_run, default_folder, other_study, require_usable
from harness.study.drive import (
    TABLES,
    Row,
    StackResult,
    require_own,
    run_document,
    run_study,
    summarize_study,
)
from harness.study.manifest import about, load_study, parameters, version_notes
from harness.study.places import Where, open_workers
from harness.study.preflight import check
from harness.task.study import EpisodeTask, Study
from navstack.errors import InputError

LINE_PERIOD = 10.0  # [s] between progress lines where there is no terminal
INTERRUPTED, SOME_ERRORS = 130, 3

OnFinished = Callable[[Finished[EpisodeTask, Delivery], Row], None]


class Tally:
    """Counts outcomes and speed of the finished episodes."""

    def __init__(self, total: int, done: int) -> None:
        self.total, self.done = total, done
        self.done_before = done
        self._outcomes: Counter[str] = Counter()
        self._factors: list[float] = []  # real-time factor of each delivery

    def add(self, record: Row) -> None:
        """Take in one finished episode."""
        self.done += 1
        row = record["row"]
        self._outcomes["error" if row.get("error") else row["outcome"]] += 1
        if not row.get("error"):
            self._factors.append(record["timing"]["real_time_factor"])

    @property
    def text(self) -> str:
        """Outcomes so far and the median real-time factor per core."""
        outcomes = "  ".join(f"{name} {count}" for name, count in sorted(self._outcomes.items()))
        if not self._factors:
            return "starting; the first delivery ever also compiles"
        return f"{outcomes}  {statistics.median(self._factors):.0f} x real time per core"


class BarDisplay:
    """A live bar on a terminal."""

    def __init__(self, console: Console, tally: Tally) -> None:
        self._tally = tally
        columns = (TextColumn("deliveries"), BarColumn(), MofNCompleteColumn(), TextColumn("ETA"))
        self._progress = Progress(*columns, TimeRemainingColumn(), TextColumn("{task.fields[text]}"), console=console)
        self._task = self._progress.add_task("run", total=tally.total, completed=tally.done, text=tally.text)

    def start(self) -> None:
        """Show the bar."""
        self._progress.start()

    def stop(self) -> None:
        """Leave the bar as it is."""
        self._progress.stop()

    def update(self) -> None:
        """One more episode is done."""
        self._progress.update(self._task, advance=1, text=self._tally.text)


class LineDisplay:
    """A plain line every ten seconds, where standard error is not a terminal."""

    def __init__(self, tally: Tally) -> None:
        self._tally = tally
        self._stopped = threading.Event()
        self._start = time.monotonic()
        self._said = tally.done  # deliveries in the last line

    def start(self) -> None:
        """Begin to tell."""
        threading.Thread(target=self._tell, daemon=True).start()

    def stop(self) -> None:
        """Say where it ended."""
        self._stopped.set()
        if self._tally.done != self._said:
            self._say()

    def update(self) -> None:
        """Nothing to do: the next line shows it."""

    def _tell(self) -> None:
        while not self._stopped.wait(LINE_PERIOD):
            self._say()

    def _say(self) -> None:
        self._said = done = self._tally.done
        total, driven = self._tally.total, done - self._tally.done_before
        left = (time.monotonic() - self._start) / driven * (total - done) if driven else 0.0  # [s]
        eta = f", about {left:.0f} s left" if left else ""
        sys.stderr.write(f"{done} of {total} deliveries{eta}: {self._tally.text}\n")
        sys.stderr.flush()


def run_command(study: Study, out: Path | None, where: Where, as_json: bool) -> int:
    """Drive a new study, show progress on stderr, print results on stdout; returns the exit status."""
    path = out or default_folder("-".join(stack.name for stack in study.stacks))
    require_usable(path)
    for note in check(study):
        say(f"note: {note}")
    create_run(path, about(study, sys.argv), parameters(study))
    return _drive(load_study(path, study.workers), path, where, as_json)


def resume_command(path: Path, where: Where, as_json: bool) -> int:
    """Go on with the study of a run folder; otherwise as :func:`run_command`."""
    path = path.resolve()  # a link may point elsewhere before the run ends
    if known := other_study(path):
        kind, command = known
        raise InputError(f"'{path}' is {kind}; go on with navbench {command} --resume {path}")
    study = load_study(path, where.workers)
    check(study)
    for note in version_notes(path):
        say(f"note: {note}")
    return _drive(study, path, where, as_json)


def _drive(study: Study, path: Path, where: Where, as_json: bool) -> int:
    results, interrupted = drive_run(study, path, where)
    _print(results, study, path, as_json)
    return exit_status(results, interrupted)


def drive_run(study: Study, path: Path, where: Where) -> tuple[list[StackResult], bool]:
    """Drive what a run folder lacks, show progress on stderr; returns the results and whether it was interrupted.

    Args:
        study: as its folder tells it.
        path: of the folder.
        where: they are driven.
    """
    interrupted = False
    with RunFolder(path, TABLES, study.total) as folder:
        require_own(study, folder)
        say_what_is_done(folder, study)
        tally = Tally(study.total, len(folder.records))
        if not folder.is_closed:
            with open_workers(where, study.workers, path, {path: study}) as workers, shown(tally) as on_finished:
                interrupted = drive(study, folder, workers, on_finished)
        results = finish(study, folder)
    say_what_failed(folder.records)
    if interrupted:
        tally.done = len(folder.records)  # the last one may have been kept and not yet counted
        say_interrupted(tally, path)
    return results, interrupted


def exit_status(results: Sequence[StackResult], interrupted: bool) -> int:
    """What the program leaves with."""
    if interrupted:
        return INTERRUPTED
    return SOME_ERRORS if any(result.errors for result in results) else 0


def drive(study: Study, folder: RunFolder, workers: Workers, on_finished: OnFinished) -> bool:
    """Run what a folder lacks; returns whether it was interrupted."""
    if folder.is_closed:
        return False
    try:
        run_study(study, folder, workers, on_finished)
    except KeyboardInterrupt:
        return True
    return False


def finish(study: Study, folder: RunFolder) -> list[StackResult]:
    """The results of what is finished, which the folder keeps too."""
    results = summarize_study(study, folder.records)
    if not folder.is_closed:
        folder.write_summary({"schema": 1, "runs": [run_document(result, study, None) for result in results]})
    return results


@contextlib.contextmanager
def shown(tally: Tally) -> Iterator[OnFinished]:
    """Show progress meanwhile; yields what has to hear of each finished delivery."""
    console = Console(stderr=True, highlight=False)
    display = BarDisplay(console, tally) if console.is_terminal else LineDisplay(tally)

    def on_finished(finished: Finished[EpisodeTask, Delivery], record: Row) -> None:
        tally.add(record)
        display.update()
        if finished.lost and finished.error is None:
            where = f"{finished.task.stack.name} episode {finished.task.episode}"
            console.print(f"repeated {where}: {finished.lost[0]}", markup=False, soft_wrap=True)

    display.start()
    try:
        yield on_finished
    finally:
        display.stop()


def say(line: str) -> None:
    """Write a line on standard error."""
    Console(stderr=True, highlight=False).print(line, markup=False, soft_wrap=True)


def say_what_is_done(folder: RunFolder, study: Study) -> None:
    """Tell how much of a run there already is."""
    if folder.is_complete:
        say(f"run {folder.path} is complete: all of its {study.total} deliveries are finished")
    elif folder.records:
        say(f"going on after {len(folder.records)} of {study.total} deliveries")


def say_what_failed(records: Sequence[Row]) -> None:
    """Tell the deliveries that ended in an error."""
    for record in records:
        row = record["row"]
        if row.get("error"):
            say(f"error in {row['stack']} episode {row['episode']}: {row['error']}")


def say_interrupted(tally: Tally, path: Path, options: str = "") -> None:
    """Tell what an interrupt leaves; ``options`` go with the one that goes on."""
    kept = f"the finished ones are kept in {path}; go on with --resume {path}{options}"
    kept = kept if tally.done else "none was finished"
    say(f"interrupted after {tally.done} of {tally.total} deliveries; {kept}")


def _print(results: list[StackResult], study: Study, path: Path, as_json: bool) -> None:
    if as_json:
        document = {"schema": 1, "runs": [run_document(result, study, path) for result in results]}
        sys.stdout.write(json.dumps(document, indent=2, allow_nan=False) + "\n")
        return
    print_results(results, study, prices_of(study.template.prices), path, report_console(sys.stdout))

"""``navbench run``: progress while it drives, tables when it is done."""

import json
import statistics
import sys
import threading
import time
from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from harness.benchmark import (
    TABLES,
    Row,
    StackResult,
    about,
    parameters,
    run_document,
    run_study,
    summarize_study,
)
from harness.episode import Delivery
from harness.execution import Finished
from harness.preflight import check
from harness.report.run_tables import print_results
from harness.report.tables import report_console
from harness.runs import RunFolder, default_folder, require_usable
from harness.setup import prices_of
from harness.study import EpisodeTask, Study

LINE_PERIOD = 10.0  # [s] between progress lines where there is no terminal
INTERRUPTED, SOME_ERRORS = 130, 3


class Tally:
    """Counts outcomes and speed of the finished episodes."""

    def __init__(self, total: int, workers: int) -> None:
        self.total, self._workers = total, workers
        self.done = 0
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
        self._task = self._progress.add_task("run", total=tally.total, text=tally.text)

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
        self._said = -1  # deliveries in the last line

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
        total = self._tally.total
        eta = (
            f", about {(time.monotonic() - self._start) / done * (total - done):.0f} s left" if 0 < done < total else ""
        )
        sys.stderr.write(f"{done} of {total} deliveries{eta}: {self._tally.text}\n")
        sys.stderr.flush()


def run_command(study: Study, out: Path | None, as_json: bool) -> int:
    """Drive the study, show progress on stderr, print results on stdout; returns the exit status."""
    errors = Console(stderr=True, highlight=False)
    path = out or default_folder("-".join(stack.name for stack in study.stacks))
    require_usable(path)
    for note in check(study):
        errors.print(f"note: {note}", markup=False, soft_wrap=True)
    tally = Tally(study.episodes * len(study.stacks), study.workers)
    display = BarDisplay(errors, tally) if errors.is_terminal else LineDisplay(tally)
    records: list[Row] = []

    def on_finished(finished: Finished[EpisodeTask, Delivery], record: Row) -> None:
        records.append(record)
        tally.add(record)
        display.update()

    interrupted = False
    with RunFolder(path, about(study, sys.argv), parameters(study), TABLES) as folder:
        display.start()
        try:
            run_study(study, folder, on_finished)
        except KeyboardInterrupt:
            interrupted = True
        finally:
            display.stop()
        results = summarize_study(study, records)
        folder.write_summary({"schema": 1, "runs": [run_document(result, study, None) for result in results]})
    _say_what_failed(records, errors)
    if interrupted:
        kept = f"the finished ones are kept in {path}" if records else "none was finished"
        errors.print(f"interrupted after {len(records)} of {tally.total} deliveries; {kept}", soft_wrap=True)
    _print(results, study, path, as_json)
    if interrupted:
        return INTERRUPTED
    return SOME_ERRORS if any(record["row"].get("error") for record in records) else 0


def _say_what_failed(records: list[Row], console: Console) -> None:
    for record in records:
        row = record["row"]
        if row.get("error"):
            console.print(
                f"error in {row['stack']} episode {row['episode']}: {row['error']}", markup=False, soft_wrap=True
            )


def _print(results: list[StackResult], study: Study, path: Path, as_json: bool) -> None:
    if as_json:
        document = {"schema": 1, "runs": [run_document(result, study, path) for result in results]}
        sys.stdout.write(json.dumps(document, indent=2, allow_nan=False) + "\n")
        return
    print_results(results, study, prices_of(study.template.prices), path, report_console(sys.stdout))

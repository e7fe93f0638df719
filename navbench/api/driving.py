"""What the functions that drive have in common: progress while they do, and what is said of it."""

import sys
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from harness.episode.episode import Delivery
from harness.execution.workers import Finished, Workers
from harness.report.numbers import counted
from harness.report.texts import OUTCOMES
from harness.storage.manifest_file import extend_run, read_manifest
from harness.storage.new_run import create_run, output_folder, require_usable
from harness.storage.rows import Row
from harness.storage.run_folder import RunFolder, count_finished
from harness.study.drive import TABLES, StackResult, drive_missing, finish, require_own
from harness.study.manifest import about, load_study, parameters
from harness.study.places import Where, open_workers
from harness.study.preflight import check
from harness.task.study import MAX_EPISODES, EpisodeTask, Study
from navbench.api.progress import Bar, say, shown
from navstack.errors import InputError


@dataclass(frozen=True)
class Driven:
    """What came of the deliveries of a run folder."""

    study: Study
    folder: Path
    results: list[StackResult]
    is_interrupted: bool  # and what is finished is kept

    @property
    def has_errors(self) -> bool:
        """Whether deliveries ended in an error, be it the machine's or the stack's own."""
        return any(result.errors or result.failures for result in self.results)


class Tally(Bar):
    """Finished episodes and their outcomes."""

    def __init__(self, total: int, done: int, has_several: bool = False) -> None:
        """Nothing is finished yet.

        Args:
            total: deliveries.
            done: of them before.
            has_several: whether several stacks drive, so that each is named.
        """
        super().__init__("{done} of {total} deliveries", total, done)
        self._outcomes: Counter[str] = Counter()
        self._has_several, self._latest = has_several, ""

    def add(self, finished: Finished[EpisodeTask, Delivery], record: Row) -> None:
        """Take in one finished episode."""
        self.count(record["row"])
        self.done += 1
        self._latest = finished.task.stack.name
        if finished.lost and finished.error is None:
            task = finished.task
            say(f"repeated {task.stack.name} episode {task.episode}: {finished.lost[0]}")

    def count(self, row: Row) -> None:
        """Take in the outcome of one, also of those from before."""
        if row.get("error"):
            self._outcomes["error"] += 1
        else:
            outcome = str(row["outcome"])
            self._outcomes[OUTCOMES.get(outcome, outcome)] += 1

    @property
    def note(self) -> str:
        """Outcomes so far, the most frequent first, and who drove last."""
        if not self._outcomes:
            return "starting; the first delivery ever also compiles"
        outcomes = "; ".join(f"{count} {name}" for name, count in self._outcomes.most_common())
        if self._has_several and self._latest:
            outcomes += f"; last by {self._latest}"
        return outcomes


def begin(study: Study, out: Path | None, where: Where) -> Driven:
    """Check a study, make its run folder and drive it, with notes and progress on stderr.

    Args:
        study: to be driven.
        out: run folder; None: ``results/<time>-<stacks>``.
        where: it is driven.

    Raises:
        InputError: something that the user gave cannot be used.
    """
    with output_folder(out, "-".join(stack.name for stack in study.stacks)) as path:
        require_usable(path)
        say_notes(check(study))
        create_run(path, about(study, sys.argv), parameters(study))
    return drive_folder(load_study(path, study.workers), path, where)


def extend(path: Path, episodes: int) -> None:
    """Let a run have more deliveries per stack; what it has stays, and it says what was looked at.

    Args:
        path: of its folder.
        episodes: per stack, from now on.

    Raises:
        InputError: it has more, or only chosen ones; or its folder cannot be written.
    """
    content = read_manifest(path)
    before = int(content["episodes"])
    if episodes == before:
        return
    if content.get("only"):
        raise InputError(f"'{path}' has deliveries that --only chose: --resume adds none")
    if episodes < before:
        raise InputError(
            f"--episodes {episodes}: '{path}' was made for {before} deliveries a stack; "
            f"give {before} or more"
        )
    if episodes > MAX_EPISODES:
        raise InputError(f"--episodes {episodes}: at most {MAX_EPISODES}")
    extend_run(path, episodes, seen=count_finished(path) // len(content["stacks"]))


def drive_folder(study: Study, path: Path, where: Where, retries_errors: bool = False) -> Driven:
    """Drive what a run folder lacks, with progress on stderr.

    Args:
        study: as its folder tells it.
        path: of the folder.
        where: they are driven.
        retries_errors: whether also what ended in an error of the machine.
    """
    is_stopped = False
    with RunFolder(path, TABLES, study.total, retries_errors) as folder:
        say_notes(folder.notes)
        require_own(study, folder)
        say_what_is_done(folder, study)
        tally = Tally(study.total, len(folder.rows), len(study.stacks) > 1)
        for row in folder.rows:
            tally.count(row)
        if not folder.is_closed:
            with open_workers(where, study.workers, path, {path: study}) as workers, shown(tally):
                is_stopped = is_interrupted(study, folder, workers, tally)
        results = finish(study, folder)
    say_what_failed(folder.rows.where(any_text, "error", "stack_error"))
    if is_stopped:
        tally.done = len(folder.rows)  # the last one may have been kept and not yet counted
        say_interrupted(tally.done, f"{tally.done} of {tally.total} deliveries", path)
    return Driven(study, path, results, is_stopped)


def is_interrupted(study: Study, folder: RunFolder, workers: Workers, tally: Tally) -> bool:
    """Drive what a folder lacks; returns whether it was interrupted."""
    if folder.is_closed:
        return False
    try:
        drive_missing(study, folder, workers, tally.add)
    except KeyboardInterrupt:
        return True
    return False


def say_notes(notes: Iterable[str]) -> None:
    """Write each on standard error."""
    for note in notes:
        say(f"note: {note}")


def say_what_is_done(folder: RunFolder, study: Study) -> None:
    """Tell how much of a run there already is."""
    if folder.is_complete:
        say(f"run {folder.path} is complete, with {counted(study.total, 'delivery')}")
    elif folder.rows:
        say(f"going on after {len(folder.rows)} of {study.total} deliveries")


def say_what_failed(rows: Iterable[Row]) -> None:
    """Tell the deliveries that ended in an error."""
    for row in rows:
        error = row["error"] or row["stack_error"]
        say(f"error in {row['stack']} episode {row['episode']}: {error}")


def any_text(*texts: str | None) -> bool:
    """Whether one of them says something."""
    return any(texts)


def say_interrupted(finished: float, told: str, path: Path) -> None:
    """Tell what an interrupt leaves; the command tells how to go on.

    Args:
        finished: how many deliveries or missions.
        told: the same in words.
        path: of the folder that keeps them.
    """
    kept = "none was finished"
    if finished:
        kept = f"the finished ones are kept in {path}"
    say(f"interrupted after {told}; {kept}")

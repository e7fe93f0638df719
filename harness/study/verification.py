"""Whether a run folder is as it was written, and its deliveries come out as they are stored."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from harness.episode.episode import Delivery, run_episode
from harness.metrics.columns import EPISODE_COLUMNS, Row
from harness.storage.checksums import CHECKSUMS, changed_files, root_digest
from harness.storage.files import BROKEN
from harness.storage.manifest_file import mixed_files
from harness.storage.rows import values
from harness.storage.run_folder import JOURNAL
from harness.storage.tables import names_of_columns, opened_table
from harness.study.consistency import contradictions, recording_files
from harness.study.manifest import code_notes, differences, is_this_program, load_study
from harness.study.stored_run import StoredRun, load_run
from harness.task.stack import ROS2
from harness.task.study import Study
from navstack.errors import MapError

ELSEWHERE = "commands came over ROS 2, from a program that is not here"


@dataclass(slots=True)
class Verification:
    """What was found in one run folder."""

    folder: Path
    digest: str | None  # SHA-256 of its checksums; None: it has none
    has_checksums: bool
    changed: list[str]  # files, since the run was written
    mixed: list[str]  # files that were changed and taken as they were
    notes: list[str]
    reasons: list[str]  # why its rows need not come out here as they are stored
    wrong: list[str] = field(default_factory=list)  # what in it contradicts the rest
    wanted: int = 0  # deliveries to be driven again
    repeated: list[str] = field(default_factory=list)  # deliveries, as "STACK NUMBER"
    other: dict[str, list[str]] = field(default_factory=dict)  # delivery -> columns that differ
    not_comparable: list[str] = field(default_factory=list)  # deliveries that differ, for reasons

    @property
    def is_sound(self) -> bool | None:
        """Whether all is as it was; None where nothing was compared, or not everything could be."""
        if self.changed or self.mixed or self.other or self.wrong or not self.has_checksums:
            return False
        if self.not_comparable or not self.repeated:
            return None
        return True

    @property
    def has_passed(self) -> bool:
        """Whether nothing was found, and as many deliveries repeat as were to."""
        return self.is_sound is not False and len(self.repeated) >= self.wanted


def verify_run(
    folder: Path, sample: int, seed: int, tell: Callable[[], None] = lambda: None
) -> Verification:
    """Check the files of a run, and drive some of its deliveries again.

    Args:
        folder: of the run.
        sample: deliveries driven again.
        seed: by which they are drawn.
        tell: hears of each that was driven.

    Raises:
        InputError: the folder holds no run that can be read.
    """
    found = Verification(
        folder=folder,
        digest=root_digest(folder),
        has_checksums=(folder / CHECKSUMS).is_file(),
        changed=changed_files(folder, not (folder / JOURNAL).exists(), with_recordings=True),
        mixed=mixed_files(folder),
        notes=[],
        reasons=differences(folder),
    )
    if found.changed:
        return found  # what would be driven is not what was
    run = load_run(str(folder))
    rows = [row for stack in run.stacks for row in stack.rows]
    chosen = np.random.default_rng(seed).permutation(len(rows))[:sample]
    found.wanted = len(chosen)
    drawn = [rows[place] for place in sorted(chosen)]
    try:
        study = load_study(folder)
    except MapError as error:  # one of the user's, which is not on this machine
        found.reasons.append(str(error))
        found.not_comparable += map(_name, drawn)
        return found
    found.notes += code_notes(folder)
    found.wrong += contradictions(folder, study, run, is_exact=not found.reasons)
    _drive_again(found, study, run, drawn, tell)
    return found


def _drive_again(
    found: Verification,
    study: Study,
    run: StoredRun,
    drawn: Sequence[Row],
    tell: Callable[[], None],
) -> None:
    tasks = {(task.stack_number, task.episode): task for task in study.tasks()}
    newer = {name: _newer_columns(run.only(name)) for name in {row["stack"] for row in drawn}}
    said: dict[str, set[str]] = {}
    for row in drawn:
        task, name = tasks.get((row["stack_number"], row["episode"])), _name(row)
        if task is None:
            continue  # a contradiction by then
        if task.stack.navigator == ROS2:
            found.not_comparable.append(name)
            found.reasons = [*dict.fromkeys((*found.reasons, ELSEWHERE))]
            continue
        driven = _differing(found.folder, run, row, run_episode(task))
        tell()
        columns = [column for column in driven if column not in newer[row["stack"]]]
        said.setdefault(row["stack"], set()).update(set(driven) - set(columns))
        if not columns:
            found.repeated.append(name)
        elif found.reasons:
            found.not_comparable.append(name)
        else:
            found.other[name] = columns
    found.notes += (
        f"{stack}: {', '.join(sorted(columns))} not stored by the program of that time, and not "
        "compared"
        for stack, columns in sorted(said.items())
        if columns
    )


def _newer_columns(run: StoredRun) -> set[str]:
    """Columns of a run of one stack that another program than this has in none of its rows."""
    if is_this_program(run.about):
        return set()
    (stack,) = run.stacks
    return {
        name for name in EPISODE_COLUMNS if all(each is None for each in values(stack.rows, name))
    }


def _name(row: Row) -> str:
    return f"{row['stack']} {row['episode']}"


def _differing(folder: Path, run: StoredRun, stored: Row, driven: Delivery) -> list[str]:
    """What of a delivery comes out otherwise; columns that its table lacks are left out."""
    own = [
        event
        for event in run.events
        if (event["stack"], event["episode"]) == (stored["stack"], stored["episode"])
    ]
    columns = names_of_columns(folder / "episodes.parquet")
    found = sorted(name for name in columns if not _is_same(driven.row.get(name), stored[name]))
    of_events = names_of_columns(folder / "events.parquet")
    if not _are_same(driven.events, own, of_events):
        found.append("events")
    recording, decisions = recording_files(folder, stored)
    if driven.recording is not None and not _is_recorded(driven.recording, recording):
        found.append(recording.name)
    if driven.decisions is not None and not _are_told(*driven.decisions, decisions):
        found.append(decisions.name)
    return found


def _are_same(ours: Sequence[Row], stored: Sequence[Row], names: Sequence[str]) -> bool:
    return len(ours) == len(stored) and all(
        _is_same(a.get(name), b.get(name))
        for a, b in zip(ours, stored, strict=True)
        for name in names
    )


def _is_recorded(arrays: Mapping[str, Any], file: Path) -> bool:
    try:
        with np.load(file, allow_pickle=False) as stored:
            return set(stored.files) == set(arrays) and all(
                np.array_equal(stored[name], value, equal_nan=value.dtype.kind == "f")
                for name, value in arrays.items()
            )
    except BROKEN:
        return False


def _are_told(columns: Mapping[str, Any], ours: Sequence[Row], file: Path) -> bool:
    try:
        with opened_table(file) as table:
            return _are_same(ours, table.read().to_pylist(), [*columns])
    except BROKEN:
        return False


def _is_same(ours: Any, stored: Any) -> bool:
    both_are_nan = ours != ours and stored != stored
    return both_are_nan or bool(ours == stored)

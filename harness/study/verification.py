"""Whether a run folder is as it was written, and whether its deliveries come out as they are stored."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

from harness.episode.episode import run_episode
from harness.metrics.columns import Row
from harness.storage.checksums import CHECKSUMS, changed_files
from harness.storage.manifest_file import mixed_files
from harness.storage.run_folder import JOURNAL
from harness.study.manifest import differences, load_study, version_notes
from harness.study.stored_run import load_run
from harness.task.study import EpisodeTask
from navstack.errors import MapError


@dataclass(slots=True)
class Verification:
    """What was found in one run folder."""

    folder: Path
    has_checksums: bool
    changed: list[str]  # files, since the run was written
    mixed: list[str]  # files that were changed and taken as they were
    notes: list[str]
    reasons: list[str]  # why its rows need not come out here as they are stored
    repeated: list[str] = field(default_factory=list)  # deliveries, as "STACK NUMBER"
    other: dict[str, list[str]] = field(default_factory=dict)  # delivery -> columns that differ
    not_comparable: list[str] = field(default_factory=list)  # deliveries that differ, for reasons

    @property
    def is_sound(self) -> bool | None:
        """Whether all is as it was; None where nothing was compared, or not everything could be."""
        if self.changed or self.mixed or self.other:
            return False
        if self.not_comparable or not self.repeated:
            return None
        return True


def verify_run(folder: Path, sample: int, seed: int) -> Verification:
    """Check the files of a run, and drive some of its deliveries again.

    Args:
        folder: of the run.
        sample: deliveries driven again.
        seed: by which they are drawn.

    Raises:
        InputError: the folder holds no run that can be read.
    """
    found = Verification(
        folder=folder,
        has_checksums=(folder / CHECKSUMS).is_file(),
        changed=changed_files(folder, not (folder / JOURNAL).exists()),
        mixed=mixed_files(folder),
        notes=version_notes(folder),
        reasons=differences(folder),
    )
    if found.changed:
        return found  # what would be driven is not what was
    rows = [row for stack in load_run(str(folder)).stacks for row in stack.rows]
    chosen = np.random.default_rng(seed).permutation(len(rows))[:sample]
    try:
        tasks = {(task.stack_number, task.episode): task for task in load_study(folder).tasks()}
    except MapError as error:  # one of the user's, which is not on this machine
        found.reasons.append(str(error))
        found.not_comparable += [_name(rows[place]) for place in sorted(chosen)]
        return found
    for place in sorted(chosen):
        row = rows[place]
        name = _name(row)
        columns = _differing_columns(folder, row, tasks[row["stack_number"], row["episode"]])
        if not columns:
            found.repeated.append(name)
        elif found.reasons:
            found.not_comparable.append(name)
        else:
            found.other[name] = columns
    return found


def _name(row: Row) -> str:
    return f"{row['stack']} {row['episode']}"


def _differing_columns(folder: Path, stored: Row, task: EpisodeTask) -> list[str]:
    """The columns of a delivery that come out otherwise; those that its table lacks are left out."""
    there = pq.read_schema(folder / "episodes.parquet").names
    row = run_episode(task).row
    return sorted(name for name in there if not _is_same(row.get(name), stored[name]))


def _is_same(ours: Any, stored: Any) -> bool:
    both_are_nan = ours != ours and stored != stored
    return both_are_nan or bool(ours == stored)

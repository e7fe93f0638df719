"""Some deliveries of a study driven once more, with everything recorded.

The same deliveries, to be looked at.
"""

import dataclasses
import hashlib
import json
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

from harness.execution.workers import Workers
from harness.storage.new_run import MANIFEST, create_run
from harness.storage.run_folder import RunFolder
from harness.study.drive import TABLES, drive_missing, finish
from harness.study.manifest import about, load_study, parameters
from harness.task.stack import Stack
from harness.task.study import EpisodeTask, Study

# folder, inside that of a study, with the deliveries in which its files or stacks part ways
PARTINGS = "partings"
DIGITS = 12  # of a digest in a path


def record_again(
    parent: Path,
    name: str,
    stacks: Sequence[Stack],
    template: EpisodeTask,
    numbers: Sequence[int],
    workers: Workers,
) -> Path:
    """Drive deliveries into a run folder, unless they have been; returns the folder.

    Args:
        parent: of such folders. Each stands in one that is named after what was driven, so that
            whoever keeps files in memory by their paths never takes one for another.
        name: of the folder; older ones of the name are removed.
        stacks: which drive them, their names unlike.
        template: any task of the study, its seed that of the deliveries.
        numbers: of the deliveries, at least one.
        workers: where they are driven.

    Raises:
        InputError: the folder cannot be written.
    """
    whole = dataclasses.replace(template, stack=stacks[0], keep_trace=True, keep_decisions=True)
    study = Study(tuple(stacks), len(numbers), 1, whole, tuple(sorted(numbers)))
    texts = parameters(study)
    content = json.dumps((study.only, whole.seed, whole.map_name, texts), sort_keys=True)
    folder = parent / hashlib.sha256(content.encode()).hexdigest()[:DIGITS] / name
    for other in parent.glob(f"*/{name}"):
        if other != folder:
            shutil.rmtree(other.parent)
    if not (folder / MANIFEST).is_file():
        create_run(folder, about(study, ("navbench",)), texts)
    with RunFolder(folder, TABLES, study.total) as run:
        stored = load_study(folder)
        drive_missing(stored, run, workers, lambda *_: None)
        finish(stored, run)
    return folder


def recorded_again(parent: Path) -> Iterator[Path]:
    """The run folders that :func:`record_again` made."""
    yield from (
        manifest.parent
        for manifest in sorted(parent.glob(f"*/*/{MANIFEST}"), key=lambda each: each.parts[-2])
    )

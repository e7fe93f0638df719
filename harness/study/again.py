"""Some deliveries of a study driven once more, with everything recorded: the same deliveries, to be looked at."""

import dataclasses
import shutil
from collections.abc import Sequence
from pathlib import Path

from harness.execution.workers import Workers
from harness.storage.run_folder import MANIFEST, RunFolder, create_run, read_manifest
from harness.study.drive import TABLES, drive_missing, finish
from harness.study.manifest import about, load_study, parameters
from harness.task.stack import Stack
from harness.task.study import EpisodeTask, Study
from navstack.params.strict import read_text

PARTINGS = "partings"  # folder, inside that of a study, with the deliveries in which its files or stacks part ways


def record_again(
    folder: Path, stacks: Sequence[Stack], template: EpisodeTask, numbers: Sequence[int], workers: Workers
) -> Path:
    """Drive deliveries into a run folder, unless it has them already; returns the folder.

    Args:
        folder: of the run; one that holds others is made anew.
        stacks: which drive them, their names unlike.
        template: any task of the study, its seed that of the deliveries.
        numbers: of the deliveries, at least one.
        workers: where they are driven.

    Raises:
        InputError: the folder cannot be written.
    """
    whole = dataclasses.replace(template, stack=stacks[0], keep_trace=True, keep_decisions=True)
    study = Study(tuple(stacks), len(numbers), 1, whole, tuple(sorted(numbers)))
    if folder.exists() and not _holds(folder, study):
        shutil.rmtree(folder)
    if not folder.exists():
        create_run(folder, about(study, ("navbench",)), parameters(study))
    with RunFolder(folder, TABLES, study.total) as run:
        stored = load_study(folder)
        drive_missing(stored, run, workers, lambda *_: None)
        finish(stored, run)
    return folder


def _holds(folder: Path, study: Study) -> bool:
    """Whether a folder is of these deliveries, and of these files."""
    if not (folder / MANIFEST).is_file():
        return False
    found, asked = read_manifest(folder), about(study, ("navbench",))
    files = parameters(study)
    return all(found.get(key) == asked[key] for key in ("only", "seed")) and all(
        (folder / "params" / name).is_file() and read_text(folder / "params" / name) == text
        for name, text in files.items()
    )

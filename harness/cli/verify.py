"""The command ``navbench verify``.

Whether a run folder is as it was written, and whether its deliveries repeat.
"""

import sys
from pathlib import Path
from typing import Any

import click

from harness.cli.options import JSON
from harness.cli.streams import print_json
from navstack.errors import InputError


@click.command()
@click.argument("folder", metavar="RUN", type=click.Path(path_type=Path))
@click.option(
    "--sample",
    type=click.IntRange(min=0),
    default=3,
    show_default=True,
    help="Deliveries driven again.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="By which they are drawn.",
)
@JSON
def verify(folder: Path, sample: int, seed: int, as_json: bool) -> None:
    """Check the files of a run, or of a suite's runs, and drive some of its deliveries again.

    A delivery repeats if every column of its row comes out as it is stored, to the last bit; another version of a
    library may change that.

    \b
    Examples:
      navbench verify results/latest
      navbench verify results/my_suite --sample 10 --seed 1 --json

    Exit status: 0 all is as it was; 1 something was changed, or a delivery came out otherwise.
    """
    from harness.storage.run_folder import MANIFEST

    runs = (
        [folder]
        if (folder / MANIFEST).is_file()
        else sorted(file.parent for file in folder.glob(f"*/{MANIFEST}"))
    )
    if not runs:
        raise InputError(f"'{folder}' holds no run; give the folder that a run or a suite wrote")
    found = [_verified(run, sample, seed) for run in runs]
    is_sound = not any(each["changed"] or each["mixed"] or each["other"] for each in found)
    if as_json:
        print_json({"schema": 1, "sound": is_sound, "runs": found})
    else:
        sys.stdout.write("".join(f"{line}\n" for each in found for line in _lines(each)))
    sys.exit(0 if is_sound else 1)


def _verified(folder: Path, sample: int, seed: int) -> dict[str, Any]:
    import numpy as np

    from harness.storage.checksums import CHECKSUMS, changed_files
    from harness.storage.manifest_file import mixed_files
    from harness.storage.run_folder import JOURNAL
    from harness.study.manifest import version_notes
    from harness.study.stored_run import load_run

    changed = changed_files(folder, not (folder / JOURNAL).exists())
    found: dict[str, Any] = {
        "folder": str(folder),
        "has_checksums": (folder / CHECKSUMS).is_file(),
        "changed": changed,
        "mixed": mixed_files(folder),
        "notes": version_notes(folder),
        "repeated": [],
        "other": {},
    }
    if changed:
        return found  # what would be driven is not what was
    rows = [row for stack in load_run(str(folder)).stacks for row in stack.rows]
    chosen = np.random.default_rng(seed).permutation(len(rows))[:sample]
    for row in (rows[place] for place in sorted(chosen)):
        differing = _differing(folder, row)
        name = f"{row['stack']} {row['episode']}"
        if differing:
            found["other"][name] = differing
        else:
            found["repeated"].append(name)
    return found


def _differing(folder: Path, stored: dict[str, Any]) -> list[str]:
    """The columns of a delivery that come out otherwise.

    Those that its table lacks are left out.
    """
    import pyarrow.parquet as pq

    from harness.episode.episode import run_episode
    from harness.study.manifest import load_study

    there = pq.read_schema(folder / "episodes.parquet").names
    key = stored["stack_number"], stored["episode"]
    task = next(
        task for task in load_study(folder).tasks() if (task.stack_number, task.episode) == key
    )
    row = run_episode(task).row
    return sorted(name for name in there if not _is_same(row.get(name), stored[name]))


def _is_same(ours: Any, stored: Any) -> bool:
    return bool(ours == stored) or (ours != ours and stored != stored)  # NaN


def _lines(found: dict[str, Any]) -> list[str]:
    folder = found["folder"]
    lines = [f"{folder}: {note}" for note in found["notes"]]
    if not found["has_checksums"]:
        lines.append(f"{folder}: has no checksums: it was written by an earlier version")
    if found["mixed"]:
        lines.append(
            f"{folder}: is mixed: {', '.join(found['mixed'])} were changed after it had begun"
        )
    if found["changed"]:
        return [*lines, f"{folder}: changed since it was written: {', '.join(found['changed'])}"]
    lines += [
        f"{folder}: {name} comes out otherwise: {', '.join(columns)}"
        for name, columns in found["other"].items()
    ]
    return [
        *lines,
        f"{folder}: {len(found['repeated'])} deliveries driven again came out as stored",
    ]

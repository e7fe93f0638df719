"""The command ``navbench verify``: is a run as it was written, and do its deliveries repeat."""

import dataclasses
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from navbench.cli.options import JSON
from navbench.cli.streams import print_json

if TYPE_CHECKING:
    from harness.study.verification import Verification


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

    A delivery repeats if every column of its row comes out as it is stored, to the last bit. Where
    a run comes from other libraries, or from a machine that computes otherwise, a delivery that
    differs is not comparable here: it is counted, and the run is neither called sound nor changed.

    \b
    Examples:
      navbench verify results/latest
      navbench verify results/my_suite --sample 10 --seed 1 --json

    Exit status: 0 nothing was changed; 1 something was, or a delivery came out otherwise.
    """
    from navbench.api import verify as api

    found = api.verify(folder, sample, seed)
    verdicts = [each.is_sound for each in found]
    if as_json:
        documents = [_document(each) for each in found]
        print_json({"schema": 1, "sound": _together(verdicts), "runs": documents})
    else:
        sys.stdout.write("".join(f"{line}\n" for each in found for line in _lines(each)))
    sys.exit(1 if False in verdicts else 0)


def _together(verdicts: list[bool | None]) -> bool | None:
    if False in verdicts:
        return False
    return None if None in verdicts else True


def _document(found: "Verification") -> dict[str, Any]:
    return {
        **dataclasses.asdict(found),
        "folder": str(found.folder),
        "sound": found.is_sound,
    }


def _lines(found: "Verification") -> list[str]:
    folder = found.folder
    lines = [f"{folder}: {note}" for note in found.notes]
    if not found.has_checksums:
        lines.append(f"{folder}: has no checksums: it was written by an earlier version")
    if found.mixed:
        names = ", ".join(found.mixed)
        lines.append(f"{folder}: is mixed: {names} were changed after it had begun")
    if found.changed:
        names = ", ".join(found.changed)
        return [*lines, f"{folder}: changed since it was written: {names}"]
    for name, columns in found.other.items():
        lines.append(f"{folder}: {name} comes out otherwise: {', '.join(columns)}")
    if found.not_comparable:
        count = len(found.not_comparable)
        lines.append(f"{folder}: {count} not comparable here: {'; '.join(found.reasons)}")
    lines.append(f"{folder}: {len(found.repeated)} deliveries driven again came out as stored")
    return lines

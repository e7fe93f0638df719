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
    The checksum stands for the whole run. It guards against accidents: who edits a run can write
    its checksums, too. So rows, events, recordings and summary are held against each other.

    \b
    Examples:
      navbench verify results/latest
      navbench verify results/my_suite --sample 10 --seed 1 --json

    Exit status: 0 nothing was changed, and the sample repeats; 1 something was, or fewer
    deliveries came out as stored than were to be driven again.
    """
    from navbench.api import verify as api

    found = api.verify(folder, sample, seed)
    verdicts = [each.is_sound for each in found]
    if as_json:
        documents = [_document(each) for each in found]
        print_json({"schema": 1, "sound": _together(verdicts), "runs": documents})
    else:
        sys.stdout.write("".join(f"{line}\n" for each in found for line in _lines(each)))
    sys.exit(int(not all(each.has_passed for each in found)))


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
    lines = [f"checksum {found.digest}", *found.notes]
    if not found.has_checksums:
        lines[0] = "has no checksums.json: nothing tells whether it is as it was written"
    if found.mixed:
        lines.append(f"is mixed: {', '.join(found.mixed)} were changed after it had begun")
    if found.changed:
        lines.append(f"changed since it was written: {', '.join(found.changed)}")
    lines += found.wrong
    for name, columns in found.other.items():
        lines.append(f"{name} comes out otherwise: {', '.join(columns)}")
    reasons = "; ".join(found.reasons)
    if found.not_comparable:
        lines.append(f"{len(found.not_comparable)} not comparable here: {reasons}")
    elif reasons:
        lines.append(f"{reasons}: rows could differ")
    if not found.changed:
        lines.append(
            f"{len(found.repeated)} of {found.wanted} deliveries driven again came out as stored"
        )
    return [f"{found.folder}: {line}" for line in lines]

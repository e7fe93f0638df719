"""The log of a suite folder: when which program drove how much of it."""

import dataclasses
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

from harness.execution.worker_check import project_digest
from harness.study.manifest import LIBRARIES, PROGRAM
from harness.study.suite import write_file
from navstack.errors import InputError
from navstack.params.strict import from_mapping, read_text

PIECES = "pieces.jsonl"


@dataclass(frozen=True, slots=True)
class Piece:
    """One call of the program that drove a part of a suite."""

    date: str
    deliveries: int
    program: str  # SHA-256 of its code, parameters and maps
    versions: dict[str, str]
    cells: dict[str, int] = field(default_factory=dict)  # deliveries by name of the cell; empty: not noted down


def piece_of(cells: Mapping[str, int]) -> Piece:
    """What this program drove today: deliveries by name of the cell."""
    versions = {name: version(name) for name in (PROGRAM, *LIBRARIES)}
    return Piece(time.strftime("%Y-%m-%d"), sum(cells.values()), project_digest(), versions, dict(cells))


def note_piece(path: Path, piece: Piece) -> None:
    """Add a line to the log of a suite folder.

    Raises:
        InputError: it cannot be written.
    """
    known = read_text(path / PIECES) if (path / PIECES).is_file() else ""
    write_file(path / PIECES, known + json.dumps(dataclasses.asdict(piece), sort_keys=True) + "\n")


def pieces_of(path: Path) -> tuple[Piece, ...]:
    """The log of a suite folder.

    Raises:
        InputError: it is damaged.
    """
    lines = read_text(path / PIECES).splitlines() if (path / PIECES).is_file() else []
    return tuple(_piece_in(line, f"{path / PIECES}: line {number}") for number, line in enumerate(lines, 1))


def _piece_in(line: str, where: str) -> Piece:
    try:
        content = json.loads(line)
    except (ValueError, RecursionError):
        raise InputError(f"{where} is damaged; each is the JSON of one call that drove deliveries: remove it") from None
    return from_mapping(Piece, content, where)

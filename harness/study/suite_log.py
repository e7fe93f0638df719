"""The log of a suite folder: when which program drove how much of it."""

import dataclasses
import json
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path

from harness.execution.worker_check import project_digest
from harness.storage.documents import write_file
from harness.study.manifest import LIBRARIES, PROGRAM
from navstack.errors import InputError
from navstack.params.strict import from_mapping, read_text

SESSIONS = "pieces.jsonl"


@dataclass(frozen=True, slots=True)
class Session:
    """One call of the program that drove a part of a suite."""

    date: str
    deliveries: int
    program: str  # SHA-256 of its code, parameters and maps
    versions: dict[str, str]
    # deliveries by name of the cell; empty: not noted down
    cells: dict[str, int] = field(default_factory=dict)


def session_of(cells: Mapping[str, int]) -> Session:
    """What this program drove today: deliveries by name of the cell."""
    versions = {name: version(name) for name in (PROGRAM, *LIBRARIES)}
    return Session(
        time.strftime("%Y-%m-%d"), sum(cells.values()), project_digest(), versions, dict(cells)
    )


def note_session(path: Path, session: Session) -> None:
    """Add a line to the log of a suite folder.

    Raises:
        InputError: it cannot be written.
    """
    known = read_text(path / SESSIONS) if (path / SESSIONS).is_file() else ""
    write_file(
        path / SESSIONS, known + json.dumps(dataclasses.asdict(session), sort_keys=True) + "\n"
    )


def sessions_of(path: Path) -> tuple[Session, ...]:
    """The log of a suite folder.

    Raises:
        InputError: it is damaged.
    """
    lines = read_text(path / SESSIONS).splitlines() if (path / SESSIONS).is_file() else []
    return tuple(
        _session_in(line, f"{path / SESSIONS}: line {number}")
        for number, line in enumerate(lines, 1)
    )


def _session_in(line: str, where: str) -> Session:
    try:
        content = json.loads(line)
    except (ValueError, RecursionError):
        raise InputError(
            f"{where} is damaged; each is the JSON of one call that drove deliveries: remove it"
        ) from None
    return from_mapping(Session, content, where)

"""What quantities are called in tables and figures, and what stands below printed results.

All of ``texts.toml``.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from navstack.params.strict import from_mapping

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Instant:
    """A column of the table of what was before an event."""

    title: str
    decimals: int  # of a number


@dataclass(frozen=True, slots=True)
class Texts:
    """The file's content."""

    outcomes: dict[str, str]
    accountings: dict[str, str]
    tuning_figures: dict[str, str]  # stem of a figure -> what it shows
    table_notes: dict[str, str]
    notes: dict[str, tuple[str, ...]]
    instants: dict[str, Instant]  # by key of harness.explain.document.instant


def read_data(cls: type[T], name: str) -> T:
    """A TOML file of this folder as a dataclass, its names and types checked."""
    return from_mapping(
        cls, tomllib.loads(Path(__file__).with_name(name).read_text(encoding="utf-8")), name
    )


TEXTS = read_data(Texts, "texts.toml")
OUTCOMES = TEXTS.outcomes


def notes(name: str, **values: str) -> list[str]:
    """The notes of a result; ``values``: what they have in braces."""
    return [note.format(**values) for note in TEXTS.notes[name]]

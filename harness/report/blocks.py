"""What a finding is made of; console, Markdown and page show the same blocks."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

DECLARED = tomllib.loads(Path(__file__).with_name("sheets.toml").read_text(encoding="utf-8"))


@dataclass(frozen=True, slots=True)
class Text:
    """A sentence, one that is not broken into lines, a note below a result, or a heading."""

    text: str
    kind: Literal["sentence", "whole", "paragraph", "note", "heading", "code", "diff"] = "sentence"


@dataclass(frozen=True, slots=True)
class Table:
    """A table of text: the first columns are text, the others stand to the right."""

    title: str
    headers: Sequence[str]
    rows: Sequence[Sequence[str]]  # an empty one is a line between those above and below
    texts: int = 1  # columns of text; where all are, the last one holds sentences
    notes: Sequence[str] = ()
    styles: Mapping[int, str] = field(default_factory=dict)  # of rows by their number, as of rich
    folds: bool = False  # columns beyond the console's width continue in a further table


@dataclass(frozen=True, slots=True)
class Chart:
    """A figure in a file."""

    path: Path | str
    caption: str = ""


@dataclass(frozen=True, slots=True)
class ReplayCommand:
    """A delivery to look at, by the command that drives or shows it."""

    command: str


Block = Text | Table | Chart | ReplayCommand


def notes_of(lines: Sequence[str]) -> list[Block]:
    """A note for each line."""
    return [Text(line, "note") for line in lines]


def declared(
    name: str,
    rows: Sequence[Sequence[str]],
    *more: str,
    columns: Sequence[str] = (),
    **values: Any,
) -> Table:
    """A table of ``sheets.toml``.

    Args:
        name: of the table there.
        rows: its cells.
        more: notes after those that always stand there.
        columns: headers after those that always stand there.
        values: what its texts have in braces.
    """
    entry = DECLARED[name]
    headers, notes = (
        [text.format(**values) for text in entry.get(key, ())] for key in ("headers", "notes")
    )
    title = entry["title"].format(**values)
    return Table(title, (*headers, *columns), rows, entry.get("texts", 1), (*notes, *more))

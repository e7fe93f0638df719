"""A table of text, which a terminal and a Markdown page show alike."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from rich.console import Console
from rich.text import Text

from harness.report.tables import print_table, report_table

SENTENCE = 80  # [characters] at which sentences in a table are broken
DECLARED = tomllib.loads(Path(__file__).with_name("sheets.toml").read_text(encoding="utf-8"))


@dataclass(frozen=True, slots=True)
class Sheet:
    """One table: the first columns are text, the others stand to the right."""

    title: str
    headers: Sequence[str]
    rows: Sequence[Sequence[str]]  # an empty one is a line between those above and below
    texts: int = 1  # columns of text; where all are, the last one holds sentences
    notes: Sequence[str] = ()


def declared(
    name: str, rows: Sequence[Sequence[str]], *more: str, columns: Sequence[str] = (), **values: Any
) -> Sheet:
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
    return Sheet(title, (*headers, *columns), rows, entry.get("texts", 1), (*notes, *more))


def print_sheet(sheet: Sheet, console: Console) -> None:
    """Print a table whole, its notes, and an empty line; nothing where it has no rows."""
    if not sheet.rows:
        return
    table = report_table(sheet.title)
    for place, header in enumerate(sheet.headers):
        is_sentence = sheet.texts == len(sheet.headers) == place + 1
        justify: Literal["left", "right"] = "left" if place < sheet.texts else "right"
        width = SENTENCE if is_sentence else None
        table.add_column(Text(header), no_wrap=not is_sentence, max_width=width, justify=justify)
    for row in sheet.rows:
        if row:
            table.add_row(*map(Text, row))
        else:
            table.add_section()
    print_table(table, console)
    for note in sheet.notes:
        console.print(Text(note, style="dim"), soft_wrap=True)
    console.print()


def markdown_lines(sheet: Sheet) -> list[str]:
    """The same as a section of a Markdown page; notes that are commands stand as they are typed."""
    rules = ["---" if place < sheet.texts else "---:" for place in range(len(sheet.headers))]
    rows = [sheet.headers, rules, *sheet.rows]
    table = ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows]
    notes = [f"`{note}`" if note.startswith("navbench ") else note for note in sheet.notes]
    return [f"## {sheet.title}", "", *table, *(line for note in notes for line in ("", note)), ""]

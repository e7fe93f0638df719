"""A table of text, which a terminal and a Markdown page show alike."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from rich.console import Console
from rich.text import Text

from harness.report.tables import print_table, report_table

SENTENCE = 80  # [characters] at which sentences in a table are broken


@dataclass(frozen=True, slots=True)
class Sheet:
    """One table: the first columns are text, the others stand to the right."""

    title: str
    headers: Sequence[str]
    rows: Sequence[Sequence[str]]  # an empty one is a line between those above and below
    texts: int = 1  # columns of text; where all are, the last one holds sentences
    notes: Sequence[str] = ()


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

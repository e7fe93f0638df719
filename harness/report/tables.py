"""Blocks on a console."""

import os
import sys
import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import replace
from io import TextIOWrapper
from typing import Literal, TextIO

from rich import box, table
from rich.console import Console
from rich.measure import Measurement
from rich.text import Text as RichText

from harness.report.blocks import Block, Chart, ReplayCommand, Table, Text

PLAIN_WIDTH = 120  # [characters] where the output is no terminal
WIDEST = 1000  # [characters] that any table may have
PARAGRAPH = 100  # [characters] of a line of a paragraph
SENTENCE = 80  # [characters] at which sentences in a table are broken
GAP = 2  # [characters] between columns
COMMAND = "navbench "  # how a command in a line begins, which a terminal must not break
STYLES = {"note": "dim", "heading": "bold"}


class QuietConsole(Console):
    """A console whose reader may leave early, as ``head`` does: that is no error."""

    def on_broken_pipe(self) -> None:
        """Write the rest to nowhere."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self.file.fileno())


def report_console(stream: TextIO | None = None) -> Console:
    """A console of a terminal's own width and colours, or plain text of a fixed width.

    By default standard output.
    """
    stream = stream or sys.stdout
    if isinstance(stream, TextIOWrapper):
        stream.reconfigure(errors="replace")  # a Δ on an ASCII terminal is no reason to stop
    width = None
    if not stream.isatty():
        width = PLAIN_WIDTH
    return QuietConsole(file=stream, width=width, highlight=False, markup=False, emoji=False)


def print_blocks(blocks: Iterable[Block], console: Console) -> None:
    """Print blocks one below the other; tables without rows are left out."""
    for block in blocks:
        match block:
            case Table():
                _print_block_table(block, console)
            case Text():
                _print_text(block, console)
            case Chart():
                console.print(f"figure: {block.path}", soft_wrap=True)
            case ReplayCommand():
                console.print(RichText(block.command, style="dim"), soft_wrap=True)


def _print_text(block: Text, console: Console) -> None:
    text = block.text
    if block.kind == "paragraph":
        width = min(PARAGRAPH, console.width)
        text = textwrap.fill(text, width, break_long_words=False, break_on_hyphens=False)
    if block.kind == "whole" and console.is_terminal and len(text) > console.width:
        text, command, rest = text.partition(COMMAND)
        console.print(RichText(text.rstrip()))  # broken between words
        text = command + rest  # can be copied as it is
        if not text:
            return
    is_whole = block.kind in ("whole", "paragraph")
    console.print(RichText(text, style=STYLES.get(block.kind, "")), soft_wrap=is_whole)


def _print_block_table(block: Table, console: Console) -> None:
    """Print a table whole, its notes, and an empty line."""
    if not block.rows:
        return
    for part in _folded(block, console):
        print_table(_rich_table(part), console)
        for note in part.notes:
            console.print(RichText(note, style="dim"), soft_wrap=True)
        console.print()


def _folded(block: Table, console: Console) -> list[Table]:
    """The table, or parts of it whose columns fit beside each other."""
    if not block.folds:
        return [block]
    parts: list[Table] = []
    shown: list[int] = []
    for place in range(block.texts, len(block.headers)):
        wider = _of_columns(block, [*shown, place])
        if shown and _width(_rich_table(wider), console) > console.width:
            parts.append(_of_columns(block, shown))
            shown = []
        shown.append(place)
    return [*parts, _of_columns(block, shown)]


def _of_columns(block: Table, shown: Sequence[int]) -> Table:
    """The columns of text and some others."""
    places = [*range(block.texts), *shown]
    rows = [[row[place] for place in places if place < len(row)] for row in block.rows]
    return replace(block, headers=[block.headers[place] for place in places], rows=rows)


def _rich_table(block: Table) -> table.Table:
    made = report_table(block.title)
    for place, header in enumerate(block.headers):
        is_sentence = block.texts == len(block.headers) == place + 1
        justify: Literal["left", "right"] = "right"
        if place < block.texts:
            justify = "left"
        width = None
        if is_sentence:
            width = SENTENCE
        made.add_column(
            RichText(header),
            no_wrap=not is_sentence,
            max_width=width,
            justify=justify,
            vertical="bottom",
        )
    for number, row in enumerate(block.rows):
        if row:
            made.add_row(*map(RichText, row), style=block.styles.get(number))
        else:
            made.add_section()
    return made


def report_table(title: str | None = None) -> table.Table:
    """An empty table as all reports have them: lines above and below its head, none around it.

    No markup in a title.
    """
    heading = None
    if title is not None:
        heading = RichText(title, style="bold")
    return table.Table(
        title=heading,
        title_justify="left",
        box=box.HORIZONTALS,
        padding=(0, GAP - 1, 0, 0),  # the box's divider is the other space
        show_edge=False,
        pad_edge=False,
    )


def print_table(shown: table.Table, console: Console) -> None:
    """Print a table at its full width, wherever it goes: what is cut off is lost."""
    given = console.width
    console.width = max(given, _width(shown, console))
    console.print(shown)
    console.width = given


def _width(shown: table.Table, console: Console) -> int:
    """Of a table that nothing is cut off from [characters]."""
    return Measurement.get(console, console.options.update(max_width=WIDEST), shown).maximum

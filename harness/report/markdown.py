"""Blocks as a Markdown page."""

import textwrap
from collections.abc import Iterable, Sequence

from harness.report.blocks import Block, Chart, ReplayCommand, Table, Text

WIDTH = 120  # [characters] of a line of text
FENCES = {"code": "```", "diff": "```diff"}


def markdown_text(blocks: Iterable[Block]) -> str:
    """The text of a page; tables without rows are left out."""
    return "\n\n".join(filter(None, map(_markdown, blocks))) + "\n"


def _markdown(block: Block) -> str:
    match block:
        case Table():
            return _section(block)
        case Chart():
            return f"![{block.caption}]({block.path})\n\n*{block.caption}*"
        case ReplayCommand():
            return f"`{block.command}`"
        case Text(text, "heading"):
            return f"## {text}"
        case Text(text, "code" | "diff"):
            return f"{FENCES[block.kind]}\n{text}\n```"
        case _:
            return block.text


def _section(block: Table) -> str:
    """A table under its title, and its notes."""
    if not block.rows:
        return ""
    parts = [f"## {block.title}", table(block.headers, block.rows, block.texts), *block.notes]
    return "\n\n".join(parts)


def table(heading: Sequence[str], rows: Sequence[Sequence[str]], texts: int | None = None) -> str:
    """A Markdown table whose columns are aligned in the text, too.

    Args:
        heading: of the columns.
        rows: cells; an empty row is left out.
        texts: columns that stand to the left; None: all.
    """
    lines = [[cell.replace("|", "\\|") for cell in line] for line in (heading, *rows) if line]
    widths = [max(3, *(len(line[place]) for line in lines)) for place in range(len(heading))]
    rules = ["-" * width for width in widths]
    if texts is not None:
        rules[texts:] = [f"{rule[:-1]}:" for rule in rules[texts:]]
    padded = [
        [cell.ljust(width) for cell, width in zip(line, widths, strict=True)] for line in lines
    ]
    padded.insert(1, rules)
    return "\n".join(f"| {' | '.join(line)} |" for line in padded)


def wrapped(text: str) -> str:
    """The same text with long lines broken, but for tables."""
    return "\n".join(
        line if line.lstrip().startswith("|") else _wrapped_line(line) for line in text.split("\n")
    )


def _wrapped_line(line: str) -> str:
    indent = ""
    if line.startswith("- "):
        indent = "  "
    return textwrap.fill(
        line,
        WIDTH,
        subsequent_indent=indent,
        break_long_words=False,
        break_on_hyphens=False,
    )

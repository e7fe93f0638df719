"""Numbers and tables as Markdown."""

import textwrap
from collections.abc import Sequence

from harness.statistics.interval import Interval

WIDTH = 120  # [characters] of a line of text


def table(heading: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table whose columns are aligned in the text, too."""
    lines = [[cell.replace("|", "\\|") for cell in line] for line in (heading, *rows)]
    widths = [max(3, *(len(line[place]) for line in lines)) for place in range(len(heading))]
    lines.insert(1, ["-" * width for width in widths])
    padded = [
        [cell.ljust(width) for cell, width in zip(line, widths, strict=True)] for line in lines
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in padded)


def number_text(value: float | None, decimals: int | None = 2, is_signed: bool = False) -> str:
    """A number to so many decimals, or to three significant digits; dashes where there is none."""
    sign = "+" if is_signed else ""
    return (
        "--"
        if value is None
        else f"{value:{sign}z.3g}"
        if decimals is None
        else f"{value:{sign}z.{decimals}f}"
    )


def bounds_text(interval: Interval, decimals: int | None = 2, is_signed: bool = False) -> str:
    """The interval alone; empty where there are too few data to say."""
    if interval.low is None or interval.high is None:
        return ""
    low, high = (number_text(end, decimals, is_signed) for end in (interval.low, interval.high))
    return f"[{low}, {high}]"


def interval_text(
    interval: Interval | None, decimals: int | None = 2, is_signed: bool = False, absent: str = "--"
) -> str:
    """A value with its interval; without bounds where there are too few data to say."""
    if interval is None or interval.value is None:
        return absent
    return f"{number_text(interval.value, decimals, is_signed)} {bounds_text(interval, decimals, is_signed)}".rstrip()


def counted(number: int, thing: str) -> str:
    """A number of things, in the plural but for one."""
    return f"{number} {thing}{'' if number == 1 else 's'}"


def p_text(p: float | None) -> str:
    """A p value; resampled ones below 0.001 tell no more than that."""
    return "--" if p is None else "<.001" if p < 0.001 else f"{p:.3f}"


def wrapped(text: str) -> str:
    """The same text with long lines broken, but for tables."""
    return "\n".join(
        line if line.lstrip().startswith("|") else _wrapped_line(line) for line in text.split("\n")
    )


def _wrapped_line(line: str) -> str:
    indent = "  " if line.startswith("- ") else ""
    return textwrap.fill(
        line, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )

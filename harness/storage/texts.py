"""Texts that come from elsewhere, made such that every file, table and terminal takes them."""

import shlex
from pathlib import Path
from typing import Any

LONGEST_TEXT = 1000  # [characters] of a text in a row
FEW = 100  # seconds or minutes, below which they are told as such


def utf_8(text: str) -> bytes:
    r"""A text as UTF-8, with escapes for what that cannot hold.

    Names of files that are not UTF-8 have lone surrogates in Python: ``\udcff`` becomes
    ``\\udcff``.
    """
    return text.encode("utf-8", "backslashreplace")


def clean_text(text: str) -> str:
    """A text without what UTF-8 cannot hold, of at most :data:`LONGEST_TEXT` characters."""
    if len(text) > LONGEST_TEXT:
        text = text[:LONGEST_TEXT]
    if text.isascii():
        return text
    return utf_8(text).decode("utf-8")[:LONGEST_TEXT]


def name_of(file: str | Path) -> str:
    """The name of what a file holds: a stack or a map. One that is given by its name has that."""
    return clean_text(Path(file).stem)


def quoted(path: str | Path) -> str:
    """A path or another word of a command that a user pastes into a shell."""
    return shlex.quote(str(path))


def clean_texts(value: Any) -> Any:
    """A value of JSON with each of its texts cleaned; names of columns stay as they are."""
    if isinstance(value, str):
        return clean_text(value)
    if isinstance(value, dict):
        return {key: clean_texts(each) for key, each in value.items()}
    if isinstance(value, list):
        return [clean_texts(each) for each in value]
    return value


def time_text(seconds: float) -> str:
    """A time in the unit in which one speaks of it."""
    if seconds < FEW:
        return f"{seconds:.0f} s"
    if seconds < 60.0 * FEW:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.1f} h"

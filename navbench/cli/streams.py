"""Standard output and error that are closed, full, or left by their reader."""

import io
import json
import os
import sys
from typing import Any

_STDERR = 2  # number of its file


def provide_streams() -> None:
    """Give a program that was started without them streams that lead to nowhere.

    They also take the numbers that the next files would get, which children would write to.

    Standard output writes a character that it has no bytes for as its escape, as standard error.
    What is said on standard error may be lost: work and answer go on without.
    """
    number = -1
    while number <= _STDERR:
        number = os.open(os.devnull, os.O_RDWR)
    os.close(number)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            nowhere = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - to the end
            setattr(sys, name, nowhere)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    if sys.stderr is sys.__stderr__ and type(sys.stderr) is io.TextIOWrapper:
        sys.stderr = io.TextIOWrapper(
            io.BufferedWriter(_Expendable(_STDERR, "w", closefd=False)),
            encoding=sys.stderr.encoding,
            errors="backslashreplace",
            line_buffering=True,
        )


class _Expendable(io.FileIO):
    """A stream that leads to nowhere from where its reader has left or its disk is full."""

    def write(self, content: Any, /) -> Any:
        """Write what can be written; returns how many bytes."""
        try:
            return super().write(content)
        except OSError:
            _lead_to_nowhere(self.fileno())
            return len(memoryview(content))


def _lead_to_nowhere(number: int) -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, number)
    os.close(nowhere)


def lost_output() -> OSError | None:
    """Why what was written to standard output cannot get there; None: it has.

    From then on it leads to nowhere.
    """
    try:
        sys.stdout.flush()
    except OSError as error:
        _lead_to_nowhere(sys.stdout.fileno())
        return error
    return None


def print_json(document: Any, ensure_ascii: bool = True) -> None:
    """Write a JSON document on standard output.

    Raises:
        ValueError: it holds a number that is none; the document says null in its place.
    """
    sys.stdout.write(
        json.dumps(document, indent=2, ensure_ascii=ensure_ascii, allow_nan=False) + "\n"
    )

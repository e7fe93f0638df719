"""Standard output and error that are closed, full, or left by their reader."""

import io
import json
import os
import sys
from typing import Any


def provide_streams() -> None:
    """Give a program that was started without them streams that lead to nowhere.

    They also take the numbers that the next files would get, which children would write to.

    Standard output writes a character that it has no bytes for as its escape, as standard error.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            nowhere = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - to the end
            setattr(sys, name, nowhere)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


def lost_output() -> OSError | None:
    """Why what was written to standard output cannot get there; None: it has.

    From then on it leads to nowhere.
    """
    try:
        sys.stdout.flush()
    except OSError as error:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
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

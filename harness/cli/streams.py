"""Standard output and error that are closed, full, or left by their reader."""

import os
import sys


def provide_streams() -> None:
    """Give a program that was started without them streams that lead to nowhere.

    They also take the numbers that the next files would get, which children would write to.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 - until the program ends


def lost_output() -> OSError | None:
    """Why what was written to standard output cannot get there; None: it has. From then on it leads to nowhere."""
    try:
        sys.stdout.flush()
    except OSError as error:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
        return error
    return None

"""Runs the malformed inputs one after another in this process, with a limit on memory.

A line of JSON for each.

Usage: python -m hostile.worker FIRST ROOT [NUMBER SEED]: the index of the first input, and a
folder; with NUMBER and SEED, so many random ones of :mod:`.mutations` instead of the corpus.
"""

import contextlib
import faulthandler
import gc
import io
import json
import os
import resource
import shutil
import sys
import time
import traceback
from pathlib import Path

from navbench.cli.app import _status, app
from tools.parity.__main__ import parity

from .corpus import CASES
from .mutations import mutants

EVERY = 100  # inputs, after which what is imported by then is left out of the search for garbage
MEMORY = 1 << 30  # [bytes]
TIME = 60.0  # [s] of one input, with what is compiled; beyond it this process ends


def attempt(arguments: list[str]) -> tuple[int | None, str, str]:
    """Exit status (None: a traceback), and what stood on stderr; then the traceback."""
    errors = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(errors):
        try:
            program = parity if arguments[0] == "parity" else app
            words = arguments[1:] if program is parity else arguments
            return _status(words, program), errors.getvalue(), ""
        except SystemExit as leaving:
            return int(leaving.code or 0), errors.getvalue(), ""
        except BaseException:  # noqa: BLE001 - whatever escapes is what is looked for
            return None, errors.getvalue(), traceback.format_exc(limit=-3)


def most_memory() -> int:
    """Most memory [bytes] that this process has had.

    Getrusage may tell that of the one which started it.
    """
    status = Path("/proc/self/status")
    if not status.exists():  # no Linux
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    (line,) = (line for line in status.read_text().splitlines() if line.startswith("VmHWM:"))
    return int(line.split()[1]) * 1024


def main() -> None:
    """Try every input from the first on."""
    first, root = int(sys.argv[1]), Path(sys.argv[2])
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    highest = 0
    cases = tuple(mutants(int(sys.argv[3]), int(sys.argv[4]))) if len(sys.argv) > 3 else CASES
    for number, case in enumerate(cases[first:], start=first):
        if number % EVERY == 1:
            gc.collect()
            gc.freeze()
        folder = root / f"case-{number}"
        folder.mkdir()
        os.chdir(folder)
        arguments = case.make(folder)
        before = {path: path.lstat().st_size for path in folder.rglob("*")}
        faulthandler.dump_traceback_later(TIME, exit=True)
        began = time.monotonic()
        status, said, trace = attempt(arguments)
        seconds = time.monotonic() - began
        faulthandler.cancel_dump_traceback_later()
        left = sorted(
            str(path.relative_to(folder)) for path in set(folder.rglob("*")) - before.keys()
        )
        peak = most_memory()
        harmed = [
            path.name for path in folder.glob("victim*") if path.stat().st_size != before[path]
        ]
        record = {
            "status": status,
            "said": said,
            "trace": trace,
            "seconds": seconds,
            "left": left,
            "harmed": harmed,
        }
        sys.stdout.write(json.dumps({**record, "peak": peak if peak > highest else 0}) + "\n")
        sys.stdout.flush()
        highest = max(peak, highest)
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()

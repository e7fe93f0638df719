"""The figures of one run as a row of a Markdown table.

How they went over time, and on which machine.
"""

import datetime
import os
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.execution.workers import available_cores
from harness.storage.files import write_text
from navstack.dispatch import processor
from navstack.errors import InputError
from tools.bench.measure import CPP, TWO_WORKERS

HEAD = """# Speed over time

A row per `python -m tools.bench --history tools/bench/history.md`: medians on the machine that the
row names. So compare rows of one machine only, and versions by `make check-speed`, which runs both
at once. Closed loops in x real time on one core (processor time), in the default world; components
as ours / recorded C++. How it is measured: docs/speed.md. A + behind a commit: it had been changed.

"""
LOOPS = {
    "paper-gps": "paper-gps",
    "paper-gps incr.": "paper-gps incremental",
    "nav2-amcl": "nav2-amcl",
    "nav2-amcl incr.": "nav2-amcl incremental",
    "nav2-stock incr.": "nav2-stock incremental",
}  # columns of real-time factors
RATIOS = {
    "costmap": "local costmap update, 480 x 480",
    "costmap + map": "local costmap update with the map, 480 x 480",
    "DWB 480": "DWB cycle, 480 x 480",
    "DWB 160": "DWB cycle, 160 x 160",
    "NavFn": "NavFn Dijkstra, 4000 x 4000",
    "replan": "IncrementalNavfn replan, 4000 x 4000",
    "AMCL 2000 x 360": "AMCL sensor update, 2000 x 360",
    "AMCL 500 x 60": "AMCL sensor update, 500 x 60",
    "field": "likelihood field, 4000 x 4000",
    "smoother": "simple smoother, 1172 poses",
}  # columns of components
UNKNOWN = "--"
COLUMNS = ("date", "commit", "machine", *LOOPS, TWO_WORKERS, *RATIOS)
HEADER = f"| {' | '.join(COLUMNS)} |\n|{' --- |' * len(COLUMNS)}\n"

Row = Mapping[str, Any]


def history_row(rows: Sequence[Row]) -> str:
    """The figures of a run as one line; what was not measured is ``--``."""
    loops = {row["name"]: row for row in rows if "real_time_factor" in row}
    ratios = {row["name"]: row["ratio"] for row in rows if row.get("reference") == CPP}
    factors = {name: row["real_time_factor"] for name, row in loops.items()}
    speedup = loops.get(TWO_WORKERS, {}).get("of_one_worker", {})
    cells = [
        datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d"),
        commit(),
        machine(),
        *(_cell(factors.get(name), ".1f") for name in LOOPS.values()),
        _cell(speedup.get("value"), ".2f"),
        *(_cell(ratios.get(name), ".3g") for name in RATIOS.values()),
    ]
    return f"| {' | '.join(cells)} |\n"


def _cell(value: float | None, form: str) -> str:
    if value is None:
        return UNKNOWN
    return format(value, form)


def read_history(file: Path) -> str:
    """A history file's text; a new one's where there is none.

    Raises:
        InputError: the file is no such history, or cannot be read.
    """
    try:
        if not file.exists():
            return HEAD + HEADER
        text = file.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"--history {file} cannot be read: {error}") from None
    if HEADER not in text:
        raise InputError(
            f"--history {file} holds another table; give a file that python -m tools.bench began"
        )
    return text


def append(file: Path, rows: Sequence[Row]) -> None:
    """Add a run's row to a history file, which is begun where there is none.

    Raises:
        InputError: the file is no such history, or cannot be read or written.
    """
    text = read_history(file).rstrip("\n") + "\n" + history_row(rows)
    try:
        write_text(file, text)
    except OSError as error:
        raise InputError(
            f"--history {file} cannot be written: {error.strerror}; give another file"
        ) from None


def machine() -> str:
    """Processor and number of cores that this process may use."""
    return f"{processor()}, {available_cores()} cores"


def load() -> float:
    """How many processes wanted a core, on average over the last minute."""
    return os.getloadavg()[0]


def commit() -> str:
    """The commit of the program's checkout, with a + where files differ from it.

    ``--`` outside a checkout.
    """
    folder = Path(__file__).resolve().parents[2]
    found = _git(folder, "rev-parse", "--short=9", "HEAD")
    if found is None:
        return UNKNOWN
    if _git(folder, "status", "--porcelain", "--untracked-files=no"):
        found += "+"
    return found


def _git(folder: Path, *words: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *words],
            capture_output=True,
            text=True,
            check=True,
            timeout=60.0,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()

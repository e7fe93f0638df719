"""On which machine, and of which version, figures were taken."""

import os
import subprocess
from pathlib import Path

from harness.execution.workers import available_cores

UNKNOWN = "--"


def processor() -> str:
    """The processor's name as the system gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return UNKNOWN
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, UNKNOWN)


def machine() -> str:
    """Processor and number of cores that this process may use."""
    return f"{processor()}, {available_cores()} cores"


def load() -> float:
    """How many processes wanted a core, on average over the last minute."""
    return os.getloadavg()[0]


def commit(folder: Path | None = None) -> str:
    """The commit of the program's checkout, with a + where files differ from it; ``--`` outside a checkout."""
    folder = folder or Path(__file__).resolve().parents[2]
    found = _git(folder, "rev-parse", "--short=9", "HEAD")
    if found is None:
        return UNKNOWN
    return found + ("+" if _git(folder, "status", "--porcelain", "--untracked-files=no") else "")


def _git(folder: Path, *words: str) -> str | None:
    try:
        done = subprocess.run(
            ["git", "-C", str(folder), *words], capture_output=True, text=True, check=True, timeout=60.0
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()

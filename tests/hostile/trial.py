"""Tries inputs in a process of its own.

One that hangs or dies costs its input, and another process goes on.
"""

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .mutations import mutants

LONGEST_LINE = 1200  # [characters]
Record = dict[str, Any]


@dataclass(frozen=True)
class Tried:
    """What a changed input led to."""

    title: str
    verdict: str
    said: str

    @property
    def is_bad(self) -> bool:
        """Whether this must not be."""
        return self.verdict not in ("refused in one line", "valid")


def work(first: int, root: Path, *more: str) -> list[Record]:
    """Records of the inputs from ``first`` on, as far as the process came."""
    path = os.pathsep.join((str(Path(__file__).parent.parent), os.environ.get("PYTHONPATH", "")))
    worker = subprocess.run(
        [sys.executable, "-m", "hostile.worker", str(first), str(root), *more],
        env={
            **os.environ,
            "PYTHONPATH": path,
            "NAVSTACK_CACHE": str(root / "cache"),
            "OPENBLAS_NUM_THREADS": "1",
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        check=False,
    )
    return [json.loads(line) for line in worker.stdout.splitlines()]


def try_mutants(number: int, seed: int, root: Path) -> list[Tried]:
    """What so many changed inputs led to."""
    found: list[Record] = []
    while len(found) < number:
        done = work(len(found), root, str(number), str(seed))
        found += done if len(found) + len(done) == number else [*done, {"lost": True, "said": ""}]
    judged = zip(mutants(number, seed), found, strict=True)
    return [
        Tried(each.title, _verdict(record, each.is_impossible), record["said"])
        for each, record in judged
    ]


def _verdict(record: Record, is_impossible: bool) -> str:
    if "lost" in record:
        return "hung or died"
    if record["trace"]:
        return "traceback"
    if record["status"] == 0:
        return "accepted though impossible" if is_impossible else "valid"
    lines = record["said"].splitlines()
    if record["status"] != 1:
        return f"exit status {record['status']}"
    if len(lines) != 1 or not lines[0].startswith("navbench: ") or len(lines[0]) > LONGEST_LINE:
        return "not one line"
    return "refused in one line"

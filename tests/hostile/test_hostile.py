"""Nothing received can harm: every malformed input ends in one clear line, in time, within memory, changing nothing."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from .corpus import CASES
from .worker import MEMORY, TIME

LONGEST_LINE = 1200  # [characters]
Record = dict[str, Any]


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> list[Record]:
    """What every input led to. A worker that hangs or dies costs its input, and another one goes on."""
    root = tmp_path_factory.mktemp("hostile")
    found: list[Record] = []
    _work(-1, tmp_path_factory.mktemp("warm-up"))
    while len(found) < len(CASES):
        done = _work(len(found), root)
        assert sum("lost" in record for record in found) < 20, "workers die all the time"
        found += done if len(found) + len(done) == len(CASES) else [*done, {"lost": True}]
    return found


def _work(first: int, root: Path) -> list[Record]:
    path = os.pathsep.join((str(Path(__file__).parent.parent), os.environ.get("PYTHONPATH", "")))
    worker = subprocess.run(
        [sys.executable, "-m", "hostile.worker", str(first), str(root)],
        env={**os.environ, "PYTHONPATH": path, "NAVSTACK_CACHE": str(root / "cache"), "OPENBLAS_NUM_THREADS": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        check=False,
    )
    return [json.loads(line) for line in worker.stdout.splitlines()]


@pytest.mark.parametrize("number", range(len(CASES)), ids=[case.title for case in CASES])
def test_a_malformed_input_is_one_clear_line(number: int, records: list[Record]) -> None:
    case, record = CASES[number], records[number]
    assert "lost" not in record, f"hung for more than {TIME} s, or died"
    assert not record["trace"], record["trace"]
    assert record["status"] == 1, record["said"]
    line, *others = record["said"].splitlines()
    assert not others, record["said"]
    assert line.startswith("navbench: ") and len(line) <= LONGEST_LINE
    assert case.says in line
    assert record["peak"] <= MEMORY
    assert not record["left"] and not record["harmed"], "files were made or harmed"


def test_the_corpus_is_large_and_every_title_is_there_once() -> None:
    assert len(CASES) >= 150
    assert len({case.title for case in CASES}) == len(CASES)

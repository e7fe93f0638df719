"""Nothing received can harm.

Every malformed input ends in one clear line, in time, within memory, changing nothing.
"""

from pathlib import Path

import pytest

from harness.study.compile_ahead import compile_new, every_module

from .corpus import CASES
from .mutations import VALID, mutants
from .trial import LONGEST_LINE, Record, try_mutants, work
from .worker import MEMORY, TIME

SAMPLE, SEED = 36, 20261125  # of random changes


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> list[Record]:
    """What every input led to.

    A worker that hangs or dies costs its input, and another one goes on.
    """
    root = tmp_path_factory.mktemp("hostile")
    found: list[Record] = []
    compile_new(every_module())  # which is no input's fault
    while len(found) < len(CASES):
        done = work(len(found), root)
        assert sum("lost" in record for record in found) < 20, "workers die all the time"
        found += done if len(found) + len(done) == len(CASES) else [*done, {"lost": True}]
    return found


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


@pytest.mark.slow
def test_random_changes_end_in_one_line_or_are_valid(tmp_path: Path) -> None:
    """A sample; ``python -m tests.hostile.mutations`` tries a thousand."""
    tried = try_mutants(SAMPLE, SEED, tmp_path)
    assert [f"{each.title}: {each.verdict}: {each.said}" for each in tried if each.is_bad] == []
    assert len({each.verdict for each in tried}) == 2, "all are refused, or none"
    assert {
        each.title.partition(" ")[2].partition(":")[0] for each in mutants(SAMPLE, SEED)
    } == VALID.keys()

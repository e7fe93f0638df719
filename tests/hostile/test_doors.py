"""A sample of malformed inputs at the doors; ``python -m tests.hostile.doors`` tries a thousand."""

from pathlib import Path

from .doors import DOORS, tried

SAMPLE, SEED = 6 * len(DOORS), 20261127


def test_what_is_malformed_is_refused_in_a_line_or_harmless(
    tmp_path: Path, in_process: None
) -> None:
    found = list(tried(SAMPLE, SEED, tmp_path))
    assert [f"{title}: {trouble}" for title, trouble in found if trouble] == []
    assert len({title.partition(" ")[0] for title, _ in found}) >= len(DOORS) - 2

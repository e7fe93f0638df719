"""Every recorded case of Nav2's C++ found in the folder of golden vectors, one test each."""

import os
from pathlib import Path

import pytest

from tools.parity.certificate import compare, discover
from tools.parity.golden import read_folder
from tools.parity.part import Case, Part

GOLDEN = Path(os.environ.get("NAVSTACK_GOLDEN") or Path(__file__).parents[1] / "golden")
CASES = discover(read_folder(GOLDEN))


@pytest.mark.parametrize(
    ("part", "case"),
    [pytest.param(part, case, id=f"{part.name}-{case.title}") for part, case in CASES],
)
def test_navstack_computes_what_nav2_computes(part: Part, case: Case) -> None:
    assert compare(part, case).wrong == []

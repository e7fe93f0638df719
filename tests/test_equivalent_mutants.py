"""What stands in the list of mutants that change nothing can still be planted."""

import runpy
from pathlib import Path


def test_every_mutant_of_the_list_can_be_planted() -> None:
    faults = runpy.run_path(str(Path(__file__).with_name("faults.py")))
    listed = faults["read_equivalent"]()
    planted = {
        mutant.change for mutant in faults["find_mutants"](sorted({file for file, _, _ in listed}))
    }
    assert set(listed) - planted == set()
    assert all(listed.values()), "a reason is missing"

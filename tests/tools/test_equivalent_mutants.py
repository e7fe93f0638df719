"""Every entry of the list of equivalent mutants can still be planted."""

from tools.faults import find_mutants, read_equivalent


def test_every_mutant_of_the_list_can_be_planted() -> None:
    listed = read_equivalent()
    planted = {mutant.change for mutant in find_mutants(sorted({file for file, _, _ in listed}))}
    assert set(listed) - planted == set()
    assert all(listed.values()), "a reason is missing"

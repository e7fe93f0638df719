"""The program drives what it drove: all columns of eighteen deliveries, to the last bit.

A number that changes anywhere on a delivery's way shows here, on every processor.
"""

import pytest

from . import reference

ROWS, DRIVEN = reference.stored()


def test_the_deliveries_have_what_they_are_there_for() -> None:
    assert set(ROWS) == set(reference.DELIVERIES) and len(ROWS) == 18
    for stack, episode, met in reference.EVENTFUL:
        row = ROWS[stack, episode]
        assert all(row[name] for name in met), (stack, episode)
    assert ROWS["evasive-gps-ekf", 13]["min_time_to_collision_s"] < 2.0, "somebody is met"


@pytest.mark.parametrize(("stack", "episode"), reference.DELIVERIES)
def test_a_delivery_is_driven_as_it_was(stack: str, episode: int) -> None:
    if why := reference.difference(DRIVEN):
        pytest.skip(f"the rows are not comparable here: {why}")
    row = reference.drive(stack, episode)
    expected = ROWS[stack, episode]
    found = reference.differing(row, expected)
    assert not {name: (row.get(name), expected[name]) for name in found}

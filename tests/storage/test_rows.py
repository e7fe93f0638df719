"""Rows in Arrow's columns are the rows that were put in."""

import random

import pytest

from harness.storage import rows as module
from harness.storage.rows import Row, Rows, take, values

COLUMNS = {"stack": "string", "episode": "int64", "margin": "double", "is_late": "bool"}


def row(number: int) -> Row:
    margin = None if number % 5 == 0 else number / 3.0
    return {
        "stack": f"stack{number % 2}",
        "episode": number,
        "margin": margin,
        "is_late": number % 3 == 0,
    }


@pytest.fixture(params=[0, 1, 3, 4, 11])
def pair(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> tuple[list[Row], Rows]:
    """So many rows as a list and as columns, of which four at a time are dicts."""
    monkeypatch.setattr(module, "AT_ONCE", 4)
    plain, rows = [row(number) for number in range(request.param)], Rows(COLUMNS)
    for each in plain:
        rows.append(each)
    return plain, rows


def test_they_are_a_sequence(pair: tuple[list[Row], Rows]) -> None:
    plain, rows = pair
    assert len(rows) == len(plain)
    assert list(rows) == plain
    assert [rows[number] for number in range(-len(plain), len(plain))] == [*plain, *plain]
    assert list(rows[1:9:2]) == plain[1:9:2]
    with pytest.raises(IndexError):
        rows[len(plain)]


def test_columns_and_choices(pair: tuple[list[Row], Rows]) -> None:
    plain, rows = pair
    for name in (*COLUMNS, "unknown"):
        assert values(rows, name) == values(plain, name) == [each.get(name) for each in plain]
    order = random.Random(0).sample(range(len(plain)), len(plain))
    assert list(take(rows, order)) == take(plain, order) == [plain[number] for number in order]
    late = rows.where(lambda stack, is_late: stack == "stack1" and is_late, "stack", "is_late")
    assert list(late) == [each for each in plain if each["stack"] == "stack1" and each["is_late"]]


def test_the_last_row_can_be_taken_back(pair: tuple[list[Row], Rows]) -> None:
    plain, rows = pair
    rows.append(row(99))
    rows.drop_last()
    assert list(rows) == plain
    rows.append(row(99))
    assert list(rows) == [*plain, row(99)]


def test_a_row_has_all_columns_and_no_others() -> None:
    rows = Rows(COLUMNS)
    rows.append({"episode": 1, "weather": "rain"})
    expected = {"stack": None, "episode": 1, "margin": None, "is_late": None}
    assert list(rows) == list(rows.take([0])) == [expected]
    assert rows[0] == expected

"""One failed task does not end the others, in one process or several."""

import pytest

from harness.execution import run_tasks


def double(number: int) -> int:
    if number == 3:
        raise ValueError("three is refused")
    return 2 * number


@pytest.mark.parametrize("workers", [1, 2])
def test_results_and_errors(workers: int) -> None:
    finished = list(run_tasks(double, range(6), workers))
    assert sorted(item.task for item in finished) == list(range(6))
    assert {item.task: item.result for item in finished if item.error is None} == {0: 0, 1: 2, 2: 4, 4: 8, 5: 10}
    assert [item.error for item in finished if item.error] == ["ValueError: three is refused"]


def test_closing_early_stops_the_workers() -> None:
    tasks = run_tasks(double, range(1000), 2)
    assert next(tasks).error is None
    tasks.close()
    assert list(tasks) == []

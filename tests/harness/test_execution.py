"""One failed task does not end the others, in one process or several."""

import os

import pytest

from harness.execution import WORKER_DIED, run_tasks


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


def die_on_one(number: int) -> int:
    if number == 1:
        os._exit(1)
    return number


def test_a_worker_that_dies_leaves_no_task_unaccounted_for() -> None:
    finished = list(run_tasks(die_on_one, range(12), 2))
    assert sorted(item.task for item in finished) == list(range(12))
    lost = [item.task for item in finished if item.error == WORKER_DIED]
    assert 1 in lost and len(lost) <= 2  # the one that died, and at most the one that ran beside it
    assert all(item.result == item.task for item in finished if item.error is None)

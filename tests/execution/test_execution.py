"""Where tasks run changes nothing; one that fails, dies or hangs does not end the others."""

import os
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from pathlib import Path

import pytest

from harness.execution import silence
from harness.execution.executors import InProcess, WorkerProcess
from harness.execution.workers import NOTHING_DONE, Workers
from navstack.errors import UnknownNameError

EXECUTORS: dict[str, Callable[[], Executor]] = {
    "in_process": InProcess,
    "spawn": WorkerProcess,
    "fork": partial(WorkerProcess, "fork"),
    "forkserver": partial(WorkerProcess, "forkserver"),
    "thread": partial(ThreadPoolExecutor, 1),
}
TIME_LIMIT = 6.0  # [s] enough for a process to start


def double(number: int) -> int:
    if number == 3:
        raise ValueError("three is refused")
    return 2 * number


def check_doubles(workers: Workers) -> None:
    finished = list(workers.run(double, range(6)))
    assert sorted(item.task for item in finished) == list(range(6))
    assert {item.task: item.result for item in finished if item.error is None} == {
        0: 0,
        1: 2,
        2: 4,
        4: 8,
        5: 10,
    }
    assert [item.error for item in finished if item.error] == ["ValueError: three is refused"]
    assert not any(item.lost for item in finished)


@pytest.mark.parametrize("name", EXECUTORS)
def test_results_and_errors(name: str) -> None:
    with Workers(2, EXECUTORS[name]) as workers:
        check_doubles(workers)


def refuse(task: int) -> int:
    """Raise what pickle can write and cannot read: its constructor takes other arguments."""
    raise UnknownNameError("critic", "Foo", ["GoalDist"])


def test_an_error_that_cannot_be_unpickled_is_the_tasks_own() -> None:
    with Workers(1, partial(WorkerProcess, "fork")) as workers:
        (finished,) = workers.run(refuse, [0])
    assert finished.error == "UnknownNameError: unknown critic 'Foo'; known: GoalDist"
    assert not finished.lost


def test_a_worker_imports_nothing_of_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A received folder may hold a file that is called as a module of Python's."""
    for name in ("socket.py", "pickle.py"):
        (tmp_path / name).write_text("raise ImportError('of the current folder')")
    monkeypatch.chdir(tmp_path)
    with WorkerProcess() as executor:
        assert executor.submit(abs, -3).result() == 3
        assert executor.submit(os.getenv, "PYTHONSAFEPATH").result() is None, "what it starts may"
    assert "PYTHONSAFEPATH" not in os.environ


def test_an_executor_with_several_workers() -> None:
    with ProcessPoolExecutor(2) as shared, Workers(2, lambda: shared) as workers:
        check_doubles(workers)


def test_workers_live_from_study_to_study() -> None:
    with Workers(1) as workers:
        first, second = (
            [item.result for item in workers.run(process_number, [0])] for _ in range(2)
        )
    assert first == second != [os.getpid()]


def process_number(task: int) -> int:
    return os.getpid()


def test_closing_early_stops_the_workers() -> None:
    with Workers(2) as workers:
        tasks = workers.run(double, range(1000))
        assert next(tasks).error is None
        tasks.close()
        assert list(tasks) == []


def test_a_deadline_keeps_what_is_finished_and_stops_the_rest() -> None:
    tasks, began = [0.01, 0.01, 30.0], time.monotonic()
    with Workers(1, partial(ThreadPoolExecutor, 1)) as workers:
        until = began + 1.0
        finished = [each.task for each in workers.run(time.sleep, tasks, until)]
    assert finished == tasks[:2]
    assert time.monotonic() - began < 20.0


def attempt(task: tuple[Path, int, str]) -> int:
    """Leave a trace; then, if so told, die or hang on the first attempt or on each."""
    folder, number, way = task
    (folder / f"{number}-{time.monotonic_ns()}").touch()
    is_first = len(list(folder.glob(f"{number}-*"))) == 1
    if "always" in way or ("once" in way and is_first):
        if "die" in way:
            os.kill(os.getpid(), signal.SIGKILL)
        threading.Event().wait()
    return number


def attempts(folder: Path, number: int) -> int:
    return len(list(folder.glob(f"{number}-*")))


@pytest.mark.parametrize(
    ("way", "reason"),
    [
        ("die once", "ended by signal 9 (out of memory?)"),
        ("die always", "ended by signal 9 (out of memory?)"),
        ("hang once", f"ran for more than {TIME_LIMIT:g} s"),
    ],
)
def test_a_lost_task_is_repeated_once_and_harms_no_other(
    tmp_path: Path,
    way: str,
    reason: str,
) -> None:
    tasks = [(tmp_path, number, way if number == 1 else "") for number in range(8)]
    with Workers(2, time_limit=TIME_LIMIT) as workers:
        finished = {item.task[1]: item for item in workers.run(attempt, tasks)}
    assert sorted(finished) == list(range(8))
    assert [attempts(tmp_path, number) for number in range(8)] == [1, 2, 1, 1, 1, 1, 1, 1]
    assert all(
        item.result == number and not item.lost for number, item in finished.items() if number != 1
    )
    if "once" in way:
        assert finished[1].result == 1 and reason in finished[1].lost[0]
    else:
        assert finished[1].result is None and finished[1].error is not None
        assert "lost 2 times" in finished[1].error and reason in finished[1].error


def test_a_worker_killed_between_two_studies_is_replaced() -> None:
    with Workers(1) as workers:
        (first,) = workers.run(process_number, [0])
        assert first.result is not None
        os.kill(first.result, signal.SIGKILL)
        (second,) = workers.run(process_number, [0])
        assert second.error is None and second.result != first.result


def stop_once(folder: str) -> int:
    """The first time the worker is stopped, as by SIGSTOP from outside.

    Then it counts for longer than the silence.
    """
    mark = Path(folder) / "stopped"
    if not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGSTOP)
    end, number = time.monotonic() + 4.0, 0
    while time.monotonic() < end:
        number += 1
    return os.getpid()


@pytest.mark.slow
def test_a_stopped_worker_is_given_up_and_one_that_works_on_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if silence.processor_time(os.getpid()) is None:
        pytest.skip("there is no /proc here")
    monkeypatch.setattr(silence, "SILENCE", 3.0)
    begun = time.monotonic()
    with Workers(1) as workers:
        (finished,) = workers.run(stop_once, [str(tmp_path)])
    assert finished.result and finished.error is None
    assert finished.lost == (NOTHING_DONE,)
    assert time.monotonic() - begun < 60.0, "not the time limit of half an hour"


def test_a_program_that_was_stopped_itself_blames_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, taken = [0.0], [5.0]
    monkeypatch.setattr(silence.time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(silence, "processor_time", lambda pid: taken[0])
    pulse = silence.Pulse()
    for clock[0] in range(1, 40):
        assert not pulse.is_silent(1)
    clock[0] = 1000.0  # Ctrl-Z, and a quarter of an hour later fg
    assert not pulse.is_silent(1)
    for clock[0] in range(1001, 1046):
        assert not pulse.is_silent(1)
    clock[0] = 1046.0
    assert pulse.is_silent(1)
    taken[0] = 6.0
    assert not pulse.is_silent(1), "it works again"

"""Where episodes run: in this process, or in several, with the same results."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Generic, TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class Finished(Generic[Task, Result]):
    """A task with its result, or with the reason why it has none."""

    task: Task
    result: Result | None
    error: str | None = None


def available_cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_tasks(
    function: Callable[[Task], Result], tasks: Iterable[Task], workers: int
) -> Iterator[Finished[Task, Result]]:
    """Yield each task as it finishes; a task that raises yields its error and the others go on.

    Closing the iterator (Ctrl-C included) stops the workers; what was yielded before stays valid.
    """
    if workers == 1:
        for task in tasks:
            yield _run_one(function, task)
        return
    yield from _run_pool(function, list(tasks), workers)


def _run_one(function: Callable[[Task], Result], task: Task) -> Finished[Task, Result]:
    try:
        return Finished(task, function(task))
    except Exception as error:  # one failed episode must not end a study
        return Finished(task, None, f"{type(error).__name__}: {error}")


def _ignore_interrupts() -> None:
    """Leave Ctrl-C to the parent, so that it decides what is kept."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _run_pool(function: Callable[[Task], Result], tasks: list[Task], workers: int) -> Iterator[Finished[Task, Result]]:
    context = multiprocessing.get_context("spawn")  # fork would copy the state of numba and PyBullet
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=_ignore_interrupts)
    waiting = iter(tasks)
    running: dict[Future[Result], Task] = {}
    try:
        for task in waiting:
            running[pool.submit(function, task)] = task
            if len(running) >= 2 * workers:
                break
        while running:
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                task = running.pop(future)
                following = next(waiting, None)
                if following is not None:
                    running[pool.submit(function, following)] = following
                yield _collect(task, future)
    except BrokenProcessPool:
        for task in [*running.values(), *waiting]:
            yield Finished(task, None, "a worker process died (out of memory?)")
    finally:
        for process in list((pool._processes or {}).values()):  # a running episode cannot be cancelled
            process.terminate()
        pool.shutdown(wait=True, cancel_futures=True)


def _collect(task: Task, future: "Future[Result]") -> Finished[Task, Result]:
    error = future.exception()
    if error is None:
        return Finished(task, future.result())
    return Finished(task, None, f"{type(error).__name__}: {error}")

"""Where episodes run: in this process, or in several, with the same results."""

import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from typing import Generic, TypeVar

WORKER_DIED = "a worker process died (out of memory?)"

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


def _begin_worker() -> None:
    """Leave signals to the parent, so that it decides what is kept, and end when it is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    multiprocessing.connection.wait([sentinel])
    os._exit(1)


def _run_pool(function: Callable[[Task], Result], tasks: list[Task], workers: int) -> Iterator[Finished[Task, Result]]:
    """Run in pools of processes; when a worker dies, its pool's running tasks fail and a new pool takes the rest."""
    waiting = deque(tasks)
    while waiting:
        yield from _run_one_pool(function, waiting, workers)


def _run_one_pool(
    function: Callable[[Task], Result], waiting: deque[Task], workers: int
) -> Iterator[Finished[Task, Result]]:
    context = multiprocessing.get_context("spawn")  # fork would copy the state of numba and PyBullet
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=_begin_worker)
    running: dict[Future[Result], Task] = {}
    try:
        accepts = True
        while running or (accepts and waiting):
            while accepts and waiting and len(running) < workers:
                accepts = _submit(pool, function, waiting, running)
            done, _ = wait(running, return_when=FIRST_COMPLETED)
            yield from [_collect(running.pop(future), future) for future in done]
    finally:
        for process in list((pool._processes or {}).values()):  # a running episode cannot be cancelled
            process.terminate()
        pool.shutdown(wait=True, cancel_futures=True)


def _submit(
    pool: ProcessPoolExecutor,
    function: Callable[[Task], Result],
    waiting: deque[Task],
    running: dict[Future[Result], Task],
) -> bool:
    """Hand the next waiting task to the pool; False, with the task still waiting, if the pool is broken."""
    try:
        future = pool.submit(function, waiting[0])
    except BrokenProcessPool:
        return False
    running[future] = waiting.popleft()
    return True


def _collect(task: Task, future: "Future[Result]") -> Finished[Task, Result]:
    error = future.exception()
    if error is None:
        return Finished(task, future.result())
    if isinstance(error, BrokenProcessPool):
        return Finished(task, None, WORKER_DIED)
    return Finished(task, None, f"{type(error).__name__}: {error}")

"""Where episodes run: any executor of ``concurrent.futures``, by default one process per worker."""

import math
import os
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass
from typing import Generic, TypeVar

from harness.execution.executors import WorkerProcess
from harness.execution.silence import SILENCE, Pulse
from navstack.errors import InputError

# [s] of wall time per task; a delivery takes seconds to a few minutes, compiling once included
TIME_LIMIT = 1800.0
ATTEMPTS = 2  # at a task whose worker dies or hangs
LOOK = 1.0  # [s] between two looks at who works, and how much room there is
NOTHING_DONE = f"its worker process did nothing for {SILENCE:g} s (stopped?)"

Task = TypeVar("Task")
Result = TypeVar("Result")


class NoExecutorError(InputError):
    """What tasks should run on is gone as a whole, was never there or does not fit.

    No task is to blame.
    """


@dataclass(frozen=True, slots=True)
class Finished(Generic[Task, Result]):
    """A task with its result, or with the reason why it has none."""

    task: Task
    result: Result | None
    error: str | None = None
    lost: tuple[str, ...] = ()  # why attempts were lost, whether or not another one gave a result


@dataclass(frozen=True, slots=True)
class _Outcome(Generic[Result]):
    """What came of a task where it ran, in a form that every executor can send back."""

    result: Result | None
    error: str | None = None


def _outcome(function: Callable[[Task], Result], task: Task) -> _Outcome[Result]:
    """Do a task; what it raises becomes text, since not every exception can be unpickled."""
    try:
        return _Outcome(function(task))
    except Exception as error:
        return _Outcome(None, _told(error))


def _told(error: BaseException) -> str:
    """An error as a row has it."""
    return f"{type(error).__name__}: {error}"


def available_cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Slot:
    """What one task at a time is given to."""

    def __init__(self, make_executor: Callable[[], Executor]) -> None:
        self._make_executor = make_executor
        self._executor: Executor | None = None

    def submit(self, function: Callable[[Task], Result], task: Task) -> "Future[_Outcome[Result]]":
        """Start a task; an executor that broke while it was idle is replaced first."""
        if self._executor is None:
            self._executor = self._make_executor()
        try:
            return self._executor.submit(_outcome, function, task)
        except BrokenExecutor:
            self.discard()
            self._executor = self._make_executor()
            return self._executor.submit(_outcome, function, task)

    @property
    def pid(self) -> int | None:
        """Of the process that works here; None: it is not known."""
        return self._executor.pid if isinstance(self._executor, WorkerProcess) else None

    def kill(self) -> None:
        """End the process that works here, whatever it is doing; where it is none nothing ends."""
        if isinstance(self._executor, WorkerProcess):
            self._executor.kill()

    def discard(self) -> str:
        """Give the executor up, with what runs there if it can be killed.

        Returns how it ended, if that is known.
        """
        executor, self._executor = self._executor, None
        if isinstance(executor, WorkerProcess):
            executor.kill()
            return executor.ending
        if executor is not None:
            executor.shutdown(wait=False, cancel_futures=True)
        return ""


@dataclass(frozen=True, slots=True)
class _Attempt(Generic[Task]):
    """A task on its way."""

    task: Task
    lost: tuple[str, ...] = ()  # why earlier attempts were lost


@dataclass(frozen=True, slots=True)
class _Running(Generic[Task]):
    """A task at work."""

    attempt: _Attempt[Task]
    slot: _Slot
    deadline: float  # [s] of the monotonic clock
    pulse: Pulse


class Workers:
    """A number of executors, each with one task at a time, that live from study to study.

    A task whose worker dies or exceeds the time limit is attempted once more, and then finishes
    with an error; the tasks of the other workers notice nothing. A task that raises finishes with
    its error at once.
    """

    def __init__(
        self,
        count: int,
        make_executor: Callable[[], Executor] = WorkerProcess,
        time_limit: float = TIME_LIMIT,
        room: Callable[[], int] | None = None,
    ) -> None:
        """Start nothing yet.

        Args:
            count: of tasks at a time, at most.
            make_executor: makes an executor of its own for each worker, and one to replace one that
                died; places in an executor that all workers share are made by :class:`Place`.
                PyBullet's worlds are kept per process: threads must not share one.
            time_limit: [s] of wall time per task. Executors other than :class:`WorkerProcess`
                cannot be killed: there the task's late result is ignored.
            room: for how many tasks there is room just now, asked again at least every second:
                workers may come and go. It may raise :class:`NoExecutorError`. None: always for
                ``count``.
        """
        self._count, self._make_executor, self._time_limit = count, make_executor, time_limit
        self._room = room
        self._idle: list[_Slot] = []

    def __enter__(self) -> "Workers":
        return self

    def __exit__(self, *error: object) -> None:
        for slot in self._idle:
            slot.kill()
        for slot in self._idle:
            slot.discard()

    def run(
        self,
        function: Callable[[Task], Result],
        tasks: Iterable[Task],
        until: float = math.inf,
    ) -> Generator[Finished[Task, Result], None, None]:
        """Yield each task as it finishes.

        Closing the iterator (Ctrl-C included) stops what is running; what was yielded before stays
        valid.

        Args:
            function: what is done with a task.
            tasks: in the order in which they begin.
            until: [s] of the monotonic clock; then it ends, and what is running is stopped.
        """
        waiting = deque(_Attempt(task) for task in tasks)
        running: dict[Future[_Outcome[Result]], _Running[Task]] = {}
        try:
            while (waiting or running) and time.monotonic() < until:
                while waiting and len(running) < self._most():
                    if not self._idle:
                        self._idle.append(_Slot(self._make_executor))
                    future = self._idle[-1].submit(function, waiting[0].task)
                    deadline = time.monotonic() + self._time_limit
                    running[future] = _Running(
                        waiting.popleft(), self._idle.pop(), deadline, Pulse()
                    )
                for future in self._ended(running):
                    each = running.pop(future)
                    self._idle.append(each.slot)
                    result = _collect(each, future, self._time_limit)
                    if isinstance(result, _Attempt):
                        waiting.appendleft(result)
                    else:
                        yield result
        finally:
            slots = [each.slot for each in running.values()]
            self._idle += slots
            for slot in slots:  # all of them, before another interrupt may come
                slot.kill()
            for slot in slots:
                slot.discard()

    def _most(self) -> int:
        """Number of tasks that may run just now."""
        if self._room is None:
            return self._count
        return min(self._count, self._room())

    def _ended(
        self, running: "dict[Future[_Outcome[Result]], _Running[Task]]"
    ) -> "list[Future[_Outcome[Result]]]":
        """Wait for what is done, overdue or silent; nothing, when it is time to look again."""
        if not running:
            time.sleep(LOOK)
            return []
        patience = max(min(each.deadline for each in running.values()) - time.monotonic(), 0.0)
        done, _ = wait(running, min(patience, LOOK), FIRST_COMPLETED)
        return list(done) or _overdue(running)


def _overdue(
    running: "dict[Future[_Outcome[Result]], _Running[Task]]",
) -> "list[Future[_Outcome[Result]]]":
    now = time.monotonic()
    # asks all of them
    silent = [future for future, each in running.items() if each.pulse.is_silent(each.slot.pid)]
    return [future for future, each in running.items() if each.deadline <= now or future in silent]


def _collect(
    each: "_Running[Task]", future: "Future[_Outcome[Result]]", time_limit: float
) -> "Finished[Task, Result] | _Attempt[Task]":
    """What became of a task that is done or overdue: its end, or another attempt."""
    task, lost = each.attempt.task, each.attempt.lost
    if not future.done():
        each.slot.discard()
        reason = NOTHING_DONE
        if each.deadline <= time.monotonic():
            reason = f"it ran for more than {time_limit:g} s (--episode-timeout)"
    else:
        error = future.exception()
        if error is None:
            outcome = future.result()
            return Finished(task, outcome.result, outcome.error, lost)
        if isinstance(error, NoExecutorError):
            raise error
        if not isinstance(error, BrokenExecutor):
            return Finished(task, None, _told(error), lost)
        reason = each.slot.discard() or str(error) or "its executor broke"
    lost = (*lost, reason)
    if len(lost) < ATTEMPTS:
        return _Attempt(task, lost)
    return Finished(task, None, f"lost {len(lost)} times: {'; '.join(dict.fromkeys(lost))}", lost)

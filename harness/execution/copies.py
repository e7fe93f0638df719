"""Copies of this process, which go on from where it is: everything in it is copied by fork."""

import contextlib
import ctypes
import os
import pickle
import signal
import traceback
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Generic, TypeVar

Job = TypeVar("Job")
Result = TypeVar("Result")
_PR_SET_PDEATHSIG = 1  # of prctl(2)


class CopyError(RuntimeError):
    """A copy failed; the message is its traceback."""


def can_copy() -> bool:
    """Whether this system can copy a process."""
    return hasattr(os, "fork")


def in_a_copy(work: Callable[[], Result]) -> Result:
    """What a function returns in a copy of this process; here nothing changes.

    Raises:
        CopyError: the function raised, or the copy died.
    """
    reading, writing = os.pipe()
    pid = os.fork()
    if not pid:
        os.close(reading)
        _answer(writing, work)
    os.close(writing)
    found: Result = _result(reading, pid)
    return found


class PausedCopy(Generic[Job, Result]):
    """A copy of this process as it was when this object was made, which waits for jobs."""

    def __init__(
        self,
        work: Callable[[Job], Result],
        others: Sequence["PausedCopy[Job, Result]"] = (),
    ) -> None:
        """Copy the process.

        Args:
            work: what is done with a job, each time in a copy of the copy.
            others: the paused copies made before, whose pipes this one must not keep open.
        """
        jobs, self._jobs = os.pipe()
        self._results, results = os.pipe()
        self._pid = os.fork()
        if not self._pid:
            for pipe in (self._jobs, self._results):
                os.close(pipe)
            for each in others:
                each._let_go()
            _answer(results, partial(_work_off, jobs, work))
        os.close(jobs)
        os.close(results)
        self._is_open = True

    def ask(self, jobs: Sequence[Job]) -> list[Result]:
        """The results of jobs; afterwards the copy is gone.

        Raises:
            CopyError: a job failed.
        """
        self._is_open = False
        with open(self._jobs, "wb") as file:
            pickle.dump(list(jobs), file)
        found: list[Result] = _result(self._results, self._pid)
        return found

    def close(self) -> None:
        """Let the copy end without a job, unless it has had some."""
        if self._is_open:
            self._let_go()
            os.waitpid(self._pid, 0)

    def _let_go(self) -> None:
        if self._is_open:
            self._is_open = False
            os.close(self._jobs)
            os.close(self._results)


def _work_off(pipe: int, work: Callable[[Job], Result]) -> list[Result]:
    """Do the jobs that come through a pipe; none, where its other end is closed."""
    with open(pipe, "rb") as file:
        text = file.read()
    if not text:
        return []
    return [in_a_copy(partial(work, job)) for job in pickle.loads(text)]


def _answer(pipe: int, work: Callable[[], Result]) -> None:
    """Write what a function returns, or its traceback, to a pipe, and end this process."""
    _end_with_parent()
    try:
        answer = pickle.dumps((work(), None))
    except BaseException:
        answer = pickle.dumps((None, traceback.format_exc()))
    try:
        with open(pipe, "wb") as file:
            file.write(answer)
    finally:
        os._exit(0)  # whatever came of it, a copy goes no further


def _end_with_parent() -> None:
    """Let the system kill this copy when the process that made it is killed.

    Where it cannot (not Linux), the copy ends after its job.
    """
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)


def _result(pipe: int, pid: int) -> Any:
    """What a copy wrote to a pipe, when it has ended.

    Raises:
        CopyError: it failed or died.
    """
    with open(pipe, "rb") as file:
        text = file.read()
    os.waitpid(pid, 0)
    if not text:
        raise CopyError("a copy of the process died")
    result, failure = pickle.loads(text)
    if failure is not None:
        raise CopyError(failure)
    return result

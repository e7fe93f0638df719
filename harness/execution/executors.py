"""Executors of ``concurrent.futures``.

A process of its own, this process, or a place in something larger.
"""

import contextlib
import ctypes
import multiprocessing
import multiprocessing.connection
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from multiprocessing.process import BaseProcess
from types import ModuleType
from typing import Any

_SAFE_PATH = "PYTHONSAFEPATH"  # Python's: nothing is imported from the current folder
_STARTING = threading.Lock()  # held while a process starts: what it inherits is all threads'
_M_MMAP_THRESHOLD, _LARGE = -3, 2**20  # of glibc's mallopt; [bytes] of an array


class WorkerProcess(ProcessPoolExecutor):
    """An executor with one process of its own, so that it is known which task a process dies of.

    Args:
        start_method: of :mod:`multiprocessing`; fork would copy the state of numba and PyBullet.
    """

    def __init__(self, start_method: str = "spawn") -> None:
        super().__init__(
            1,
            mp_context=multiprocessing.get_context(start_method),
            initializer=_begin_worker,
            initargs=(os.environ.get(_SAFE_PATH),),
        )
        self._process: BaseProcess | None = None

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """Run a call in the process, which starts with the first one."""
        with _nothing_of_the_users():
            future = super().submit(function, *args, **kwargs)
            self._process = next(iter((self._processes or {}).values()), self._process)
        return future

    def kill(self) -> None:
        """End the process, whatever it is doing."""
        if self._process is not None:
            self._process.kill()

    @property
    def pid(self) -> int | None:
        """Of the process; None: it has not started."""
        return None if self._process is None else self._process.pid

    @property
    def ending(self) -> str:
        """How the process ended; waits for its end."""
        self.shutdown(wait=True)
        code = self._process.exitcode if self._process is not None else None
        if code is None or code >= 0:
            return f"its worker process ended with status {code}"
        memory = " (out of memory?)" if code == -signal.SIGKILL else ""
        return f"its worker process was ended by signal {-code}{memory}"


@contextlib.contextmanager
def _nothing_of_the_users() -> Iterator[None]:
    """Let processes that start meanwhile run nothing of the user's before a task comes.

    Not the program's script again, which need not be guarded against that; and no module of the
    current folder in place of Python's own, which ``python -c`` would prefer.
    """
    with _STARTING:
        main, safe = sys.modules["__main__"], os.environ.get(_SAFE_PATH)
        sys.modules["__main__"] = ModuleType("__main__")
        os.environ[_SAFE_PATH] = "1"
        # an interrupt waits until the process has started, which waits for none of its own
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            yield
        finally:
            sys.modules["__main__"] = main
            _set_safe_path(safe)
            signal.pthread_sigmask(signal.SIG_SETMASK, blocked)


def _set_safe_path(value: str | None) -> None:
    if value is None:
        os.environ.pop(_SAFE_PATH, None)
    else:
        os.environ[_SAFE_PATH] = value


class ParentProcess(WorkerProcess):
    """A process whose tasks are done by copies of it: that it rests itself says nothing."""

    @property
    def pid(self) -> int | None:
        """None, so that nobody watches its processor time."""
        return None


class InProcess(Executor):
    """An executor that runs each call at once in this process: for debugging and profiling.

    It knows no time limit.
    """

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """Run a call to its end."""
        future: Future[Any] = Future()
        try:
            future.set_result(function(*args, **kwargs))
        except Exception as error:  # as every executor does
            future.set_exception(error)
        return future


class Place(Executor):
    """A place for one task at a time in something larger that stays open when the place is closed.

    Args:
        start: starts a call somewhere, such as ``submit`` of an executor that many places share.
            Cancelling the future that it returns should end the call; where it cannot, the call's
            late result is ignored.
    """

    def __init__(self, start: Callable[..., "Future[Any]"]) -> None:
        self._start = start
        self._future: Future[Any] | None = None

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> "Future[Any]":
        """Start a call."""
        self._future = self._start(function, *args, **kwargs)
        return self._future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the place.

        With ``cancel_futures`` what was started last is cancelled if it is not done.
        """
        if cancel_futures and self._future is not None:
            self._future.cancel()


def _begin_worker(safe_path: str | None) -> None:
    """Leave signals to the parent, so that it decides what is kept, and end when it is gone.

    ``safe_path``: the parent's, for what the worker itself starts.
    """
    _set_safe_path(safe_path)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    give_memory_back()
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def give_memory_back() -> None:
    """Let large arrays live outside the C library's heap.

    There, small ones that outlive them would keep their pages.
    """
    with contextlib.suppress(OSError, AttributeError):  # another C library than GNU's
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, _LARGE)


def _end_with(sentinel: int) -> None:
    multiprocessing.connection.wait([sentinel])
    os._exit(1)

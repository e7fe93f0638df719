"""Tasks on the workers of an existing Dask cluster.

One at a time on each, and only on workers that fit.
"""

import asyncio
import contextlib
import logging
import threading
import time
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import Any

from distributed import Client
from distributed.client import FutureCancelledError
from distributed.scheduler import KilledWorker
from distributed.versions import VersionMismatchWarning

from harness.execution.dask_calls import Heartbeats, Outcome, Worker, WorkerLostError, guarded
from harness.execution.executors import Place
from harness.execution.worker_check import PRELOAD, Look, look, trouble
from harness.execution.workers import LOOK, NoExecutorError

CONNECT = 15.0  # [s] within which a scheduler answers
PATIENCE = 180.0  # [s] without any worker
SILENCE = 120.0  # [s] within which a busy scheduler answers
UNHEARD = 50.0  # [s] without a heartbeat
GATHER = 0.1  # [s] to collect workers that are to be restarted together
RESTART = 20.0  # [s] for a worker to come back
# that must be the same on both sides, beside those of the caller
LIBRARIES = ("dask", "distributed")


class DaskCluster:
    """A connection to a scheduler, as a context manager.

    Each call is pinned to a worker that has nothing else of ours to do, so that Dask neither queues
    it behind another nor repeats it: the caller (:class:`harness.execution.workers.Workers`) counts
    attempts. Workers may come and go; one that does not fit is refused at the start and passed over
    later.
    """

    def __init__(
        self,
        scheduler: str,
        libraries: Sequence[str],
        files: Sequence[str],
        warn: Callable[[str], None],
    ) -> None:
        """Connect to nothing yet.

        Args:
            scheduler: its address, e.g. ``tcp://host:8786``.
            libraries: distributions whose versions must be the same here and there.
            files: absolute paths that must hold the same here and there.
            warn: hears, in one line, of workers that are not used.
        """
        self._scheduler, self._files, self._warn = scheduler, list(files), warn
        self._libraries = [*libraries, *LIBRARIES]
        self._loop = asyncio.new_event_loop()
        # Dask's own, of connections that end
        self._loop.set_exception_handler(lambda loop, context: None)
        self._thread = threading.Thread(
            target=self._loop.run_forever,
            name="dask client",
            daemon=True,
        )
        self._workers: dict[str, Worker] = {}  # by address
        # addresses; those that left meanwhile are skipped
        self._free: asyncio.Queue[str] = asyncio.Queue()
        self._heartbeats = Heartbeats()
        # addresses that do not fit, or are at work on what nobody waits for
        self._avoided: set[str] = set()
        self._calls: set[asyncio.Task[Any]] = set()
        self._doomed: list[str] = []  # addresses of workers to be restarted
        self._restarts: asyncio.Task[None] | None = None
        self._watcher: asyncio.Task[None] | None = None
        self._gone = ""  # why no call can be made any more
        self._over: asyncio.Future[None]  # done when that is known
        self._client: Any = None

    def __enter__(self) -> "DaskCluster":
        """Connect, and wait for the first worker.

        Raises:
            NoExecutorError: no scheduler answers, it is lost, it has no worker, or one that does
                not fit.
        """
        _silence()
        self._thread.start()
        try:
            asyncio.run_coroutine_threadsafe(self._connect(), self._loop).result()
        except BaseException as error:
            self._stop()
            if isinstance(error, OSError):
                raise NoExecutorError(self._lost_scheduler) from None
            raise
        return self

    def __exit__(self, *error: object) -> None:
        self._stop()

    def room(self) -> int:
        """Number of workers that can be used just now.

        Raises:
            NoExecutorError: the scheduler is lost, or all workers have been for a while.
        """
        if self._gone:
            raise NoExecutorError(self._gone)
        return len(self._workers)

    def place(self) -> Place:
        """A place for one call at a time.

        Cancelling a call restarts its worker, which nothing else could stop.
        """
        return Place(self._start)

    def _start(self, function: Callable[..., Any], /, *arguments: Any) -> "Future[Any]":
        return asyncio.run_coroutine_threadsafe(self._call(function, arguments), self._loop)

    def _stop(self) -> None:
        with contextlib.suppress(Exception):  # what is broken needs no closing
            asyncio.run_coroutine_threadsafe(self._close(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _connect(self) -> None:
        self._over = self._loop.create_future()
        self._here = look(self._libraries, self._files)
        open_client: Any = Client  # untyped
        try:
            self._client = await open_client(
                self._scheduler,
                asynchronous=True,
                timeout=CONNECT,
                set_as_default=False,
            )
        except (OSError, ValueError, ImportError) as error:
            reason = " ".join(str(error).split()) or type(error).__name__
            advice = "start one with 'dask scheduler', or correct --scheduler"
            raise NoExecutorError(
                f"no Dask scheduler answers at '{self._scheduler}' ({reason}); {advice}"
            ) from None
        began = time.monotonic()
        while not self._workers:
            await self._update(_refuse)
            if not self._workers and time.monotonic() - began > PATIENCE:
                raise NoExecutorError(self._without_workers)
            await asyncio.sleep(0.0 if self._workers else LOOK)
        self._watcher = self._loop.create_task(self._watch())

    async def _watch(self) -> None:
        """Notice workers that come and go, and a scheduler that is lost."""
        seen = time.monotonic()
        while not self._gone:
            await asyncio.sleep(LOOK)
            try:
                await asyncio.wait_for(self._update(self._warn), SILENCE)
                await asyncio.wait_for(self._listen(), SILENCE)
            except Exception:  # whatever a connection can break with
                self._fail(self._lost_scheduler)
            if self._workers:
                seen = time.monotonic()
            elif time.monotonic() - seen > PATIENCE:
                self._fail(self._without_workers)

    @property
    def _lost_scheduler(self) -> str:
        return f"the Dask scheduler at '{self._scheduler}' is lost; start it and its workers again"

    @property
    def _without_workers(self) -> str:
        return (
            f"the Dask cluster at '{self._scheduler}' has had no worker that fits for "
            f"{PATIENCE:g} s; start some with 'dask worker {self._scheduler} {PRELOAD} "
            "--nthreads 1'"
        )

    def _fail(self, reason: str) -> None:
        self._gone = self._gone or reason
        if not self._over.done():
            self._over.set_result(None)

    async def _update(self, complain: Callable[[str], None]) -> None:
        """Look which workers there are, and at the new ones."""
        present = set(await self._client.nthreads())
        for address in self._workers.keys() - present:
            self._workers.pop(address).lost.set_result(None)
        self._avoided &= present
        new = sorted(present - self._workers.keys() - self._avoided)
        if not new:
            return
        looks = await self._client.run(
            look, self._libraries, self._files, workers=new, on_error="return"
        )
        for address in new:
            self._admit(address, looks.get(address), complain)

    async def _listen(self) -> None:
        """Give up workers that have been silent for long."""
        known = (await self._client.scheduler.identity())["workers"]
        for address, worker in list(self._workers.items()):
            beat = known.get(address, {}).get("last_seen", 0.0)
            if self._heartbeats.is_silent(address, beat, UNHEARD):
                self._heartbeats.forget(address)
                worker.lost.set_result(None)
                self._abandon(address, worker)

    def _admit(
        self,
        address: str,
        seen: "Look | Exception | None",
        complain: Callable[[str], None],
    ) -> None:
        if seen is None or isinstance(seen, OSError):
            return  # it left meanwhile
        if isinstance(seen, Exception):
            where = address
            why = f"{type(seen).__name__}: {seen}"
            line = f"cannot run this program ({why}): install the same there and restart it"
        else:
            where = f"{address} on {seen.host}"
            line = trouble(self._here, seen)
            if not line:
                self._workers[address] = Worker(self._loop.create_future(), seen.is_guarded)
                self._free.put_nowait(address)
                return
        self._avoided.add(address)
        complain(f"Dask worker {where} {' '.join(line.split())}")

    async def _call(self, function: Callable[..., Any], arguments: Sequence[Any]) -> Any:
        """Make a call on a free worker.

        Raises:
            WorkerLostError: it was lost.
            NoExecutorError: the scheduler was.
        """
        task = asyncio.current_task()
        assert task is not None
        self._calls.add(task)
        task.add_done_callback(self._calls.discard)
        while (address := await self._free.get()) not in self._workers:
            pass  # it left while it was free
        worker = self._workers[address]
        future = self._client.submit(guarded, function, arguments, workers=[address], pure=False)
        outcome: asyncio.Future[Outcome] = asyncio.ensure_future(_outcome_of(future))
        try:
            await asyncio.wait(
                (outcome, worker.lost, self._over), return_when=asyncio.FIRST_COMPLETED
            )
            return self._taken(outcome, address)
        except asyncio.CancelledError:
            self._abandon(address, worker)
            raise
        finally:
            outcome.cancel()
            future.release()
            if address in self._workers:
                self._free.put_nowait(address)

    def _taken(self, outcome: "asyncio.Future[Outcome]", address: str) -> Any:
        """The result of a call, or why there is none."""
        if not outcome.done() and self._gone:
            raise NoExecutorError(self._gone)
        if not outcome.done():
            raise WorkerLostError(
                f"its Dask worker {address} was lost (killed, stopped, out of memory, or its "
                "machine is gone)"
            )
        try:
            made = outcome.result()
        except FutureCancelledError as error:
            if error.reason == "scheduler-connection-lost":
                self._fail(self._lost_scheduler)
                raise NoExecutorError(self._gone) from None
            raise WorkerLostError(f"the Dask cluster cancelled it ({error.reason})") from None
        except KilledWorker:
            raise WorkerLostError(f"its Dask worker {address} was lost several times") from None
        except OSError as error:
            raise WorkerLostError(
                f"its result did not arrive from Dask worker {address} ({error})"
            ) from None
        if made.error is not None:
            raise made.error
        return made.result

    def _abandon(self, address: str, worker: Worker) -> None:
        """Stop using a worker that is silent or whose call was cancelled.

        Its process is restarted if it has a nanny.
        """
        if self._workers.pop(address, None) is None:
            return
        self._avoided.add(address)
        if not worker.is_guarded:
            self._warn(
                f"Dask worker {address} has no nanny that could stop what it does; it is not used "
                "any more"
            )
            return
        self._doomed.append(address)
        if self._restarts is None or self._restarts.done():
            self._restarts = self._loop.create_task(self._restart())

    async def _restart(self) -> None:
        while self._doomed:
            await asyncio.sleep(GATHER)
            together, self._doomed = self._doomed, []
            with contextlib.suppress(Exception):  # one that left meanwhile needs none
                await self._client.restart_workers(together, timeout=RESTART, raise_for_error=False)
            self._avoided.difference_update(together)

    async def _close(self) -> None:
        if self._watcher is not None:
            self._watcher.cancel()
        for call in tuple(self._calls):
            call.cancel()
        await asyncio.gather(*self._calls, return_exceptions=True)
        if self._restarts is not None and not self._gone:
            await asyncio.wait({self._restarts}, timeout=RESTART)
        if self._client is not None:
            await self._client.close(timeout=CONNECT)


def _refuse(line: str) -> None:
    raise NoExecutorError(line)


async def _outcome_of(future: Any) -> Any:
    return await future


def _silence() -> None:
    """Leave it to this program's own lines to say what becomes of the cluster."""
    warnings.simplefilter("ignore", VersionMismatchWarning)  # versions are compared in worker_check
    for name in list(logging.root.manager.loggerDict):
        if name.split(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)

"""A Dask worker, its sign of life, what it is given, and what comes back."""

import asyncio
import time
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor
from typing import Any, NamedTuple


class WorkerLostError(BrokenExecutor):
    """A worker died, or left the cluster."""


class Worker(NamedTuple):
    """A worker that fits."""

    lost: "asyncio.Future[None]"  # done once it has left
    is_guarded: bool  # whether it comes back when it is killed


class Heartbeats:
    """Tells workers that have been silent: stopped, or cut off while their connection stays open.

    Workers send heartbeats every few seconds whatever they compute.
    """

    def __init__(self) -> None:
        # by address: the last heartbeat as the worker dates it, and when we noticed it [s]
        self._heard: dict[str, tuple[float, float]] = {}

    def is_silent(self, address: str, beat: float, longest: float) -> bool:
        """Whether a worker's newest heartbeat is still the one of more than ``longest`` [s] ago."""
        now = time.monotonic()
        last, noticed = self._heard.get(address, (None, now))
        if beat != last:
            noticed = now
        self._heard[address] = (beat, noticed)
        return now - noticed > longest

    def forget(self, address: str) -> None:
        """Begin anew with a worker."""
        del self._heard[address]


class Outcome(NamedTuple):
    """What became of a call on a worker, so that its own errors are not taken for the cluster's."""

    result: Any
    error: Exception | None


def guarded(function: Callable[..., Any], arguments: Sequence[Any]) -> Outcome:
    """Make a call."""
    try:
        return Outcome(function(*arguments), None)
    except Exception as error:
        return Outcome(None, error)

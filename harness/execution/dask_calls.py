"""A Dask worker, what it is given, and what comes back."""

import asyncio
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor
from typing import Any, NamedTuple


class WorkerLostError(BrokenExecutor):
    """A worker died, or left the cluster."""


class Worker(NamedTuple):
    """A worker that fits."""

    lost: "asyncio.Future[None]"  # done once it has left
    is_guarded: bool  # whether it comes back when it is killed


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

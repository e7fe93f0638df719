"""How long calls take, in wall time.

It is only ever looked at from outside: nothing is decided by it.
"""

import time
from array import array
from collections.abc import Sequence
from types import TracebackType
from typing import NamedTuple


class Stopwatch:
    """Times what runs inside a ``with``."""

    def __init__(self) -> None:
        self.durations = array("d")  # [s] of each time
        self._began = 0.0

    def clear(self) -> None:
        """Forget all durations."""
        self.durations = array("d")

    def __enter__(self) -> None:
        self._began = time.perf_counter()

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.durations.append(time.perf_counter() - self._began)


class Latencies(NamedTuple):
    """Wall times in [s], one per call, since the goal was given."""

    planner: Sequence[float] = ()  # of the planner's calls
    controller: Sequence[float] = ()  # of the controller's cycles

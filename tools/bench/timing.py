"""Times of short steps; readings alternate, so that a busy machine affects all of them."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from navstack.types import FloatArray

Step = Callable[[], object]

SHORTEST = 2e-3  # [s] that one reading lasts at least; a clock reads to about 1e-6 s
PROCESSOR, WALL = 0, 1  # clocks


@dataclass(frozen=True, slots=True)
class Spread:
    """The middle of a number of readings."""

    median: float
    low: float  # lower quartile
    high: float  # upper quartile
    n: int

    @classmethod
    def of(cls, values: FloatArray) -> "Spread":
        """Median and quartiles of values (n,), n of at least 1."""
        low, median, high = np.percentile(values, (25.0, 50.0, 75.0)).tolist()
        return cls(median, low, high, len(values))

    def as_json(self, name: str = "value") -> dict[str, float | int]:
        """The quantity as one JSON object, its median under ``name``.

        Bounds are quartiles, no confidence interval.
        """
        return {name: self.median, "low": self.low, "high": self.high, "n": self.n}


def readings(steps: Sequence[Step], runs: int, budget: float, fewest: int = 1) -> FloatArray:
    """Time of one call of each step, (n, steps, 2) in [s]: processor and wall.

    Forwards and backwards in turn.

    Nothing is left to compile. Short steps are repeated within a reading.

    Args:
        steps: what to time.
        runs: readings wanted of each.
        budget: [s] of processor time after which no further reading is taken.
        fewest: readings that are taken whatever the budget.
    """
    repeats = [_repeats(step) for step in steps]
    taken: list[FloatArray] = []
    began = time.process_time()
    while len(taken) < runs and (len(taken) < fewest or time.process_time() - began < budget):
        reading = np.empty((len(steps), 2))
        order = range(len(steps)) if len(taken) % 2 == 0 else reversed(range(len(steps)))
        for i in order:
            reading[i] = _read(steps[i], repeats[i])
        taken.append(reading)
    return np.array(taken)


def _repeats(step: Step) -> int:
    """Calls that make a reading long enough."""
    once = _read(step, 1)[PROCESSOR]  # perhaps with cold caches
    if once < SHORTEST:
        once = min(once, _read(step, 3)[PROCESSOR])
    return max(1, math.ceil(SHORTEST / max(once, 1e-7)))


def _read(step: Step, repeats: int) -> tuple[float, float]:
    """Processor and wall time in [s] of one call, as the mean of some."""
    wall, processor = time.perf_counter(), time.process_time()
    for _ in range(repeats):
        step()
    return (time.process_time() - processor) / repeats, (time.perf_counter() - wall) / repeats

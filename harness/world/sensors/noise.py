"""Random sequences that the sensors' errors are made of, each with a generator of its own."""

import math

import numpy as np

_BLOCK = 256  # rows of noise drawn at once


class NoiseStore:
    """Standard normal numbers, drawn in blocks because single draws are slow."""

    def __init__(self, rng: np.random.Generator, columns: int) -> None:
        """Hand out rows of ``columns`` numbers from ``rng``."""
        self._rng = rng
        self._columns = columns
        self._rows: list[list[float]] = []

    def row(self) -> list[float]:
        """The next row."""
        if not self._rows:
            self._rows = self._rng.standard_normal((_BLOCK, self._columns))[::-1].tolist()
        return self._rows.pop()


class GaussMarkov:
    """Independent stationary first-order Gauss-Markov processes of variance 1.

    x(t + dt) = exp(-dt / time) x(t) + sqrt(1 - exp(-2 dt / time)) w with w standard normal, which
    holds for any dt (Brown & Hwang, Introduction to Random Signals and Applied Kalman Filtering,
    "Gauss-Markov process").
    """

    def __init__(self, rng: np.random.Generator, columns: int, time: float) -> None:
        """Draw the stationary start.

        Args:
            rng: where everything is drawn from.
            columns: number of processes.
            time: [s] within which the correlation falls to 1/e.
        """
        self._noise = NoiseStore(rng, columns)
        self._time = time
        self._values = self._noise.row()
        self._stamp: float | None = None

    def at(self, stamp: float) -> list[float]:
        """The values at ``stamp`` [s], which never goes back; the first call is the start."""
        if self._stamp is not None:
            kept = math.exp((self._stamp - stamp) / self._time)
            fresh = math.sqrt(1.0 - kept * kept)
            row = self._noise.row()
            self._values = [
                kept * value + fresh * new for value, new in zip(self._values, row, strict=True)
            ]
        self._stamp = stamp
        return self._values

    @property
    def values(self) -> list[float]:
        """As last asked for."""
        return self._values

    def go_on(self, values: list[float], age: float) -> None:
        """Before the first call: take values that were those ``age`` [s] before time 0."""
        self._values, self._stamp = values, -age


class RandomWalk:
    """A Wiener process that starts at 0: its variance after t seconds is t."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._noise = NoiseStore(rng, 1)
        self.value = 0.0  # as last asked for
        self._stamp: float | None = None

    def begin_before(self, age: float) -> None:
        """Before the first call: let it have started ``age`` [s] before time 0."""
        self._stamp = -age

    def at(self, stamp: float) -> float:
        """The value at ``stamp`` [s], which never goes back; the first call is the start."""
        if self._stamp is not None:
            self.value += math.sqrt(stamp - self._stamp) * self._noise.row()[0]
        self._stamp = stamp
        return self.value

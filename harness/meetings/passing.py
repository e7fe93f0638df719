"""When and how often a robot that drives among nobody passes the places of its way."""

from dataclasses import dataclass

import numpy as np

from harness.meetings.way import SPACING
from navstack.types import FloatArray, IntArray

CELL = 10  # points of the way that are one place: 1 m


@dataclass(frozen=True, slots=True, eq=False)
class Passings:
    """The drive of one arm along the way, tick by tick."""

    stamps: FloatArray  # (n,) [s] at the start and after each tick
    points: IntArray  # (n,) farthest of the way by then, ascending

    def at(self, point: int, along: float) -> tuple[float, float] | None:
        """How often a metre this robot passes somebody there, and when.

        A robot that stands is passed by those who walk. Within the place the moment is where so
        many of the passings lie before it as of the place lie before the point: at a steady speed
        the robot is just there, and a standing one is met at any time.

        Args:
            point: of the way.
            along: [m/s] of the person along the way.

        Returns:
            [1/m] and [s]; None: the robot never passes anybody there.
        """
        cell = point // CELL
        first, last = np.searchsorted(self.points // CELL, (cell, cell + 1))
        ticks = np.arange(max(first, 1), last)
        if not len(ticks):
            return None
        spans = self.stamps[ticks] - self.stamps[ticks - 1]
        ways = SPACING * (self.points[ticks] - self.points[ticks - 1])
        rates = np.abs(_speeds(ways, spans) - along) * spans
        total = float(rates.sum())
        if total <= 0.0:
            return None
        part = (point % CELL + 0.5) / CELL
        number = int(np.searchsorted(np.cumsum(rates), part * total))
        return total / (CELL * SPACING), float(self.stamps[ticks[min(number, len(ticks) - 1)]])


def _speeds(ways: FloatArray, spans: FloatArray) -> FloatArray:
    """Speeds [m/s] of ticks, each the mean over five, as their ways are whole points."""
    window = np.ones(min(5, len(ways)))
    found: FloatArray = np.convolve(ways, window, "same") / np.convolve(spans, window, "same")
    return found

"""When and how often a robot that drives among nobody passes the places of its way."""

from dataclasses import dataclass

import numpy as np

from harness.meetings.way import SPACING, Progress, Way
from navstack.types import FloatArray, IntArray

CELL = 10  # points of the way that are one place: 1 m


@dataclass(frozen=True, slots=True, eq=False)
class Passings:
    """The drive of one arm along the way, tick by tick."""

    stamps: FloatArray  # (n,) [s] at the start and after each tick
    points: IntArray  # (n,) farthest of the way by then, ascending
    speeds: FloatArray  # (n - 1,) [m/s] along the way in each tick, not below 0

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
        passings = np.abs(self.speeds[ticks - 1] - along) * spans
        total = float(passings.sum())
        if total <= 0.0:
            return None
        part = (point % CELL + 0.5) / CELL
        number = int(np.searchsorted(np.cumsum(passings), part * total))
        stamp = float(self.stamps[ticks[min(number, len(ticks) - 1)]])
        return total / (CELL * SPACING), stamp


def passings_of(stamps: FloatArray, places: FloatArray, way: Way) -> Passings:
    """A drive along a way.

    Args:
        stamps: [s] at the start and after each tick, shape (n,).
        places: [m] of the robot then, map frame, shape (n, 2).
        way: as planned.
    """
    progress = Progress(way)
    points = np.array([progress.advance(x, y) for x, y in places.tolist()])
    steps = (np.diff(places, axis=0) * way.directions[points[1:]]).sum(axis=1)
    return Passings(stamps, points, np.maximum(steps / np.diff(stamps), 0.0))

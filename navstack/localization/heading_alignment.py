"""The heading of a robot that does not know it: from the way it has driven and the fixes along it."""

import math
from typing import NamedTuple

import numpy as np

from navstack.types import FloatArray, GpsFix, Pose2D

FEWEST_FIXES = 4
SHORTEST_WAY = 1.0  # [m] between two of the fixes
FARTHEST_OFF = 4.0  # [-] standard deviations of a fix from the fitted way
MOST_FIXES = 200  # that are kept; then every other is dropped


class Alignment(NamedTuple):
    """How the dead-reckoned way lies in the map."""

    turn: float  # [rad] from the dead-reckoned frame to the map
    center_here: FloatArray  # (2,) [m] mean of the dead-reckoned positions
    center_there: FloatArray  # (2,) [m] mean of the fixes, map frame
    turn_variance: float  # [rad2]
    position_variance: float  # [m2] per axis, of a fix

    def place(self, x: float, y: float) -> tuple[float, float]:
        """A dead-reckoned position in the map frame, [m]."""
        dx, dy = x - self.center_here[0], y - self.center_here[1]
        cos, sin = math.cos(self.turn), math.sin(self.turn)
        return float(self.center_there[0] + cos * dx - sin * dy), float(self.center_there[1] + sin * dx + cos * dy)


class HeadingAlignment:
    """Fits the dead-reckoned way to the fixes: rotation and translation of least squares (Umeyama 1991, without scale).

    The rotation's variance is taken as that of two fixes at the greatest distance: errors of fixes that follow each
    other are alike, so that more of them do not help much.
    """

    def __init__(self) -> None:
        self._here: list[tuple[float, float]] = []
        self._there: list[tuple[float, float]] = []
        self._variances: list[float] = []

    def add(self, reckoned: Pose2D, fix: GpsFix, variance: float) -> None:
        """Note a fix, its variance [m2] per axis, and the dead-reckoned pose of its time."""
        self._here.append((reckoned.x, reckoned.y))
        self._there.append((fix.x, fix.y))
        self._variances.append(variance)
        if len(self._here) > MOST_FIXES:
            del self._here[1::2], self._there[1::2], self._variances[1::2]

    def solve(self, largest_std: float) -> Alignment | None:
        """The alignment, or None as long as the heading's standard deviation is above ``largest_std`` [rad].

        A fix that is farther off the fitted way than ``FARTHEST_OFF`` standard deviations is left out.
        """
        here, there, variances = np.array(self._here), np.array(self._there), np.array(self._variances)
        while len(here) >= FEWEST_FIXES:
            found = _fit(here, there, float(variances.mean()))
            if found is None or found.turn_variance > largest_std**2:
                return None
            places = np.array([found.place(*point) for point in here])
            off = ((places - there) ** 2).sum(axis=1) / variances
            worst = int(off.argmax())
            if off[worst] <= FARTHEST_OFF**2:
                return found
            here, there, variances = (np.delete(each, worst, axis=0) for each in (here, there, variances))
        return None


def _fit(here: FloatArray, there: FloatArray, variance: float) -> Alignment | None:
    """The rigid transform of least squares; None: the way is too short."""
    center_here, center_there = here.mean(axis=0), there.mean(axis=0)
    a, b = here - center_here, there - center_there
    reach = _longest(here)
    if reach < SHORTEST_WAY:
        return None
    turn = math.atan2(float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()), float((a * b).sum()))
    return Alignment(turn, center_here, center_there, 2.0 * variance / reach**2, variance)


def _longest(points: FloatArray) -> float:
    """The greatest distance [m] of a point from the first or the last."""
    from_ends = points[:, None] - points[None, (0, -1)]
    return float(np.sqrt((from_ends**2).sum(axis=2)).max())

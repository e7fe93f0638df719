"""The heading of a robot that does not know it.

From the way it has driven and the fixes along it.
"""

import math
from typing import NamedTuple

import numpy as np

from navstack.types import FloatArray, GpsFix, Pose2D

FEWEST_FIXES = 4
SHORTEST_WAY = 1.0  # [m] between two of the fixes
FARTHEST_OFF = 4.0  # [-] standard deviations of a fix from the fitted way
MOST_FIXES = 200  # that are kept; then every other is dropped
LEFT_OUT = 10  # fixes left out of a vain search for each next fix without a search


class Alignment(NamedTuple):
    """How the dead-reckoned way lies in the map."""

    turn: float  # [rad] from the dead-reckoned frame to the map
    center_here: FloatArray  # (2,) [m] weighted mean of the dead-reckoned positions
    center_there: FloatArray  # (2,) [m] of the fixes, map frame
    turn_variance: float  # [rad2]
    position_variance: float  # [m2] per axis, of the mean
    # [m2] per axis, of the error that the last fix shares with the next ones
    shared_variance: float
    shared_with_position: float  # [m2] covariance per axis of that error and the mean's
    shared_with_turn: FloatArray  # (2,) [m rad] of it and the turn's

    def place(self, x: float, y: float) -> tuple[float, float]:
        """A dead-reckoned position in the map frame, [m]."""
        there_x, there_y = self.places(np.array(((x, y),)))[0].tolist()
        return there_x, there_y

    def places(self, points: FloatArray) -> FloatArray:
        """Dead-reckoned positions in the map frame [m], shape (N, 2)."""
        dx, dy = (points - self.center_here).T
        cos, sin = math.cos(self.turn), math.sin(self.turn)
        there_x, there_y = self.center_there.tolist()
        return np.column_stack((there_x + cos * dx - sin * dy, there_y + sin * dx + cos * dy))


class HeadingAlignment:
    """Fits the dead-reckoned way to the fixes.

    Rotation and translation of generalized least squares, without scale.

    Umeyama (1991) with weights: a share of a fix's error is one first-order Gauss-Markov process,
    as in the filter. So fixes that follow each other soon tell a direction well, and those of a
    robot at rest count as one, but for what is white in them.
    """

    def __init__(self, correlated_share: float, correlation_time: float) -> None:
        """Of a fix's variance the share [-] that is correlated, below 1, and for how long [s]."""
        self._share, self._time = correlated_share, correlation_time
        self._rows: list[tuple[float, float, float, float, float, float]] = []
        self._pause = 0  # next fixes without a search

    def add(self, reckoned: Pose2D, fix: GpsFix, variance: float) -> None:
        """Note a fix, its variance [m2] per axis, and the dead-reckoned pose of its time."""
        self._rows.append((fix.stamp, variance, reckoned.x, reckoned.y, fix.x, fix.y))
        if len(self._rows) > MOST_FIXES:
            del self._rows[1::2]

    def solve(self, largest_std: float) -> Alignment | None:
        """The alignment; None while the heading's deviation is above ``largest_std`` [rad].

        A fix that is farther off the fitted way than ``FARTHEST_OFF`` standard deviations is left
        out. Where many are, and in vain, a few fixes more have to come before the next search.
        """
        if self._pause:
            self._pause -= 1
            return None
        rows, weights = np.array(self._rows), None
        while len(rows) >= FEWEST_FIXES and _longest(rows[:, 2:4]) >= SHORTEST_WAY:
            if weights is None:
                weights = self._weights(rows)
            found = self._fit(rows, weights)
            if found.turn_variance > largest_std**2:
                break
            places = found.places(rows[:, 2:4])
            off = ((places - rows[:, 4:]) ** 2).sum(axis=1) / rows[:, 1]
            worst = int(off.argmax())
            if off[worst] <= FARTHEST_OFF**2:
                return found
            rows, weights = np.delete(rows, worst, axis=0), without(weights, worst)
        self._pause = (len(self._rows) - len(rows)) // LEFT_OUT
        return None

    def _weights(self, rows: FloatArray) -> FloatArray:
        """The inverse covariance [1/m2] of the fixes of ``rows``, per axis, shape (N, N)."""
        stamps, deviations = rows[:, 0], np.sqrt(rows[:, 1])
        alike = self._share * np.exp(-np.abs(stamps[:, None] - stamps) / self._time)
        correlations = alike + (1.0 - self._share) * np.eye(len(rows))
        found: FloatArray = np.linalg.inv(correlations * np.outer(deviations, deviations))
        return found

    def _fit(self, rows: FloatArray, weights: FloatArray) -> Alignment:
        """The rigid transform of ``rows`` (N, 6), as :meth:`add` notes them."""
        stamps, variances, here, there = rows[:, 0], rows[:, 1], rows[:, 2:4], rows[:, 4:]
        shares = weights.sum(axis=0) / weights.sum()  # of each fix in the mean
        center_here, center_there = shares @ here, shares @ there
        a, b = here - center_here, there - center_there
        products = a.T @ weights @ b
        turn = math.atan2(products[0, 1] - products[1, 0], products[0, 0] + products[1, 1])
        information = float(np.trace(a.T @ weights @ a))
        cos, sin = math.cos(turn), math.sin(turn)
        sideways = np.column_stack((-sin * a[:, 0] - cos * a[:, 1], cos * a[:, 0] - sin * a[:, 1]))
        now, last_variance = self._rows[-1][:2]
        shared_variance = self._share * last_variance
        decay = np.exp(-(now - stamps) / self._time)
        shared = self._share * decay * np.sqrt(variances) * math.sqrt(last_variance)
        return Alignment(
            turn=turn,
            center_here=center_here,
            center_there=center_there,
            turn_variance=1.0 / information,
            position_variance=1.0 / float(weights.sum()),
            shared_variance=shared_variance,
            shared_with_position=float(shares @ shared),
            shared_with_turn=sideways.T @ weights @ shared / information,
        )


def without(weights: FloatArray, number: int) -> FloatArray:
    """The inverse of a covariance without one of its variables, from the inverse with it.

    The inverse of a block by its Schur complement (Golub and Van Loan 2013, 3.2.11).

    Args:
        weights: the inverse with all N, shape (N, N).
        number: of the variable.
    """
    column = np.delete(weights[:, number], number)
    others = np.delete(np.delete(weights, number, axis=0), number, axis=1)
    found: FloatArray = others - np.outer(column, column) / weights[number, number]
    return found


def _longest(points: FloatArray) -> float:
    """The greatest distance [m] of a point from the first or the last."""
    from_ends = points[:, None] - points[None, (0, -1)]
    return float(np.sqrt((from_ends**2).sum(axis=2)).max())

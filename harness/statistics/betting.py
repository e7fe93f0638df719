"""A bound of a mean that holds at every look: a confidence sequence by betting.

Waudby-Smith and Ramdas 2024, "Estimating means of bounded random variables by betting", JRSS B 86,
theorem 3 with the diversified bets of their section B.5: against each mean m somebody bets a fixed
share of his capital on every value. If m is the mean, the capital is a martingale, and by Ville's
inequality it ever reaches 40 with a probability of at most 1/40. Means against which 40 was won, on
either side, are left out. Nothing is assumed but that the values lie in known limits and that each
has the same mean given those before it.
"""

import math

import numpy as np
from scipy.optimize import brentq

from harness.statistics.interval import CONFIDENCE, NO_INTERVAL, Interval
from navstack.types import FloatArray

SHARES = np.geomspace(0.01, 0.99, 14)  # of the capital that is bet, an equal part of it on each
WON = math.log(2.0 / (1.0 - CONFIDENCE))  # of the capital, on either side, that rejects a mean
LEAST = 1e-9  # of the limits' width: means nearer to a limit are not told apart from it


def bound_at_every_look(values: FloatArray, reach: float, times: float = 1.0) -> Interval:
    """The mean of values with its 95 % bound.

    With a probability of at least 95 % it holds after every number of values, so that one may look
    at any time and stop because of what is seen.

    Args:
        values: shape (n,), in the order in which they came.
        reach: they lie within -reach and reach; those beyond count as the limit.
        times: as if each had come so many times; the bound that more of their kind would give.
    """
    if values.size == 0:
        return NO_INTERVAL
    shares = (np.clip(values, -reach, reach) + reach) / (2.0 * reach)
    low = _lower(shares, times)
    high = 1.0 - _lower(1.0 - shares, times)
    mean = float(shares.mean())
    middle, lowest, highest = ((2.0 * end - 1.0) * reach for end in (mean, low, high))
    return Interval(middle, lowest, highest, values.size)


def capital_after_each(values: FloatArray, mean: float) -> FloatArray:
    """Logarithm of the capital of one who bets that the mean of values is larger, shape (n,).

    If ``mean`` is the mean, it ever reaches x with a probability of at most exp(-x).

    Args:
        values: in 0..1, shape (n,).
        mean: against which is bet, above 0.
    """
    capitals = np.cumsum(_gains(values, mean), axis=0)
    found: FloatArray = np.logaddexp.reduce(capitals, axis=1) - math.log(SHARES.size)
    return found


def _lower(values: FloatArray, times: float) -> float:
    """The least mean that is not rejected from below, of values in 0..1."""
    mean = float(values.mean())

    def won(least: float) -> float:
        capitals = _gains(values, least).sum(axis=0) * times
        return float(np.logaddexp.reduce(capitals)) - math.log(SHARES.size) - WON

    if mean <= LEAST or won(LEAST) <= 0.0:
        return 0.0
    return float(brentq(won, LEAST, mean, xtol=1e-7))


def _gains(values: FloatArray, mean: float) -> FloatArray:
    """Logarithm of the factor by which each value multiplies each bet, shape (n, shares)."""
    gains: FloatArray = np.log1p(np.outer(values / mean - 1.0, SHARES))
    return gains

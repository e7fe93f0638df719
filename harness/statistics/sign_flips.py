"""The sign-flip test of a mean of paired differences, and the interval that is its inversion.

The interval holds the means that the test does not reject, so that it includes zero exactly where
the test finds nothing.
"""

from dataclasses import dataclass

import numpy as np

from harness.statistics.bootstrap import DRAWS, IntArray, cluster_numbers, kept_draw
from harness.statistics.interval import SIGNIFICANCE, Interval
from navstack.types import FloatArray

EXACT_UP_TO = 12  # clusters of which every pattern of signs is tried
SIGNS_AT_ONCE = 1_000_000  # of a block of patterns; bounds the memory
ROUNDING = 1e-12  # of the sum of all sizes: sums that are equal differ by so much


@dataclass(frozen=True, slots=True)
class SignFlips:
    """Which means are as likely as the observed one, by each pattern of signs.

    A pattern is as far out as the observed signs for every mean between those of the values that
    it flips and of those that it keeps (Hartigan 1969, "Using subsample values as typical values").
    """

    lows: FloatArray  # shape (patterns,), rising; -inf: the pattern flips all, or nothing
    highs: FloatArray  # falling; inf likewise
    observed: int  # 1: the patterns are drawn, and the observed one counts beside them
    mean: float
    n: int  # values

    @property
    def p(self) -> float:
        """Two-sided p value of no mean difference (Fisher 1935; Good 2005, section 3.2)."""
        ends = -self.highs
        if self.mean > 0.0:
            ends = self.lows
        as_far_out = int(np.searchsorted(ends, 0.0, side="right"))
        return (as_far_out + self.observed) / self._patterns

    def interval(self, tests: int = 1) -> Interval:
        """The means that the test does not reject at 5 % over ``tests``.

        Without bounds where it rejects none, however far out, for want of values.
        """
        p_values = (np.arange(1, self.lows.size + 1) + self.observed) / self._patterns
        place = int(np.argmax(tests * p_values >= SIGNIFICANCE))
        low, high = float(self.lows[place]), float(self.highs[place])
        if not np.isfinite(low):
            return Interval(self.mean, None, None, self.n)
        return Interval(self.mean, low, high, self.n)

    @property
    def _patterns(self) -> int:
        return self.lows.size + self.observed


def flip_signs(
    differences: FloatArray,
    rng: np.random.Generator,
    clusters: IntArray | None = None,
) -> SignFlips:
    """Try the signs of a mission's differences the other way round, all together.

    Up to twelve missions every pattern of signs is tried; above, random ones, the observed one
    counted in (Phipson and Smyth 2010), so that p is never below 1 / 10 001. Where twelve or fewer
    missions differ, every pattern of theirs is tried equally often, so that p is exact.

    Args:
        differences: shape (n,), n of at least 1.
        rng: source of the random signs.
        clusters: number of each difference's mission, shape (n,); None: each is its own.
    """
    numbers = cluster_numbers(clusters, differences.size)
    sums = np.bincount(numbers, weights=differences)
    parts = np.column_stack((sums, np.bincount(numbers))).astype(np.float64)
    decisive = np.flatnonzero(sums)
    if sums.size <= EXACT_UP_TO:
        patterns, observed = _every(sums.size), 0
        flipped = patterns @ parts
    else:
        patterns, observed = np.empty((1, 0)), 1
        if 0 < decisive.size <= EXACT_UP_TO:
            patterns, observed = _every(decisive.size), 0
        flipped = _drawn(patterns, decisive, parts, rng)
    mean = float(differences.mean())
    of_both = np.stack((flipped, parts.sum(axis=0) - flipped))  # flipped and kept, sum and size
    totals, sizes = of_both[..., 0], of_both[..., 1]
    totals[np.abs(totals) <= ROUNDING * np.abs(sums).sum()] = 0.0
    with np.errstate(invalid="ignore"):
        means = totals / sizes
    is_split = (sizes > 0.0).all(axis=0)
    lows = np.where(is_split, np.minimum(means.min(axis=0), mean), -np.inf)
    highs = np.where(is_split, np.maximum(means.max(axis=0), mean), np.inf)
    return SignFlips(np.sort(lows), -np.sort(-highs), observed, mean, differences.size)


def _every(missions: int) -> FloatArray:
    """Every pattern of flips, shape (2^missions, missions)."""
    patterns = np.arange(2**missions)[:, np.newaxis] >> np.arange(missions) & 1
    return patterns.astype(np.float64)


def _drawn(
    patterns: FloatArray,
    decisive: IntArray,
    parts: FloatArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Sums of ``parts`` (missions, 2) that random flips turn, shape (draws, 2).

    Args:
        patterns: of the decisive missions, each tried equally often; without columns: none.
        decisive: numbers of these missions.
        parts: sum and size of each mission.
        rng: source of the other flips.
    """
    at_once = max(1, SIGNS_AT_ONCE // len(parts))
    draws = DRAWS // len(patterns) * len(patterns)
    flipped = []
    for first in range(0, draws, at_once):
        flips = kept_draw(_flips, rng, min(at_once, draws - first), len(parts))
        if patterns.size:
            turns = (first + np.arange(len(flips))) % len(patterns)
            flips = flips.copy()
            flips[:, decisive] = patterns[turns]
        flipped.append(flips @ parts)
    return np.concatenate(flipped)


def _flips(rng: np.random.Generator, rows: int, columns: int) -> FloatArray:
    """Which of the columns are flipped (1), row by row."""
    return rng.integers(0, 2, (rows, columns)).astype(np.float64)

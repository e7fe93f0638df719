"""Differences between deliveries that met the same missions.

Intervals, tests, and how many missions decide. What is significant is decided here alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from statistics import NormalDist

import numpy as np

from harness.statistics.bootstrap import IntArray, cluster_numbers
from harness.statistics.interval import (
    NO_INTERVAL,
    SIGNIFICANCE,
    Interval,
    Z,
    fewest_missions,
)
from harness.statistics.sign_flips import SignFlips, flip_signs
from navstack.types import FloatArray

POWER = 0.8
NORMAL = NormalDist()


@dataclass(frozen=True, slots=True)
class PairedDifference:
    """How much the second of two differs from the first.

    It is significant exactly where its interval excludes zero. A difference that is equal on every
    mission has no interval, since rare events were not seen; it may still be significant.
    """

    flips: SignFlips = field(compare=False, repr=False)
    # of the differences, per pair, missions as clusters; None: one mission, or all are equal
    variance: float | None
    missions: int  # that the pairs are of
    # whether any pair does; where none does, no test finds a difference (Tarone 1990)
    differs: bool
    p_holm: float  # p adjusted for its family; alone: p
    tests: int = 1  # for which Holm's method adjusts the test of this one

    @property
    def p(self) -> float:
        """Probability of a difference at least as large if there were none."""
        return self.flips.p

    @property
    def difference(self) -> Interval:
        """Mean difference with the interval that is its test inverted, at the level of the test."""
        if self.variance is None:
            return Interval(self.flips.mean, None, None, self.flips.n)
        return self.flips.interval(self.tests)

    @property
    def is_significant(self) -> bool:
        """Whether its adjusted p value is below :data:`SIGNIFICANCE`."""
        return self.p_holm < SIGNIFICANCE

    @property
    def fewest(self) -> int:
        """The missions without which it is never significant."""
        return fewest_missions(self.tests)

    @property
    def needed(self) -> int | None:
        """Pairs that resolve the observed difference with a power of 0.8 (normal approximation).

        That is (z_test + z_power)^2 * variance / mean^2 (e.g. Chow et al. 2008, section 3.1); but
        of :attr:`fewest` missions, and where the test does not find it, as many as it would by its
        own p value. None: there is no difference, or nothing is known of its variance.
        """
        mean, n = self.flips.mean, self.flips.n
        if self.variance is None or mean == 0.0:
            return None
        z = z_of_power(self.tests)
        needed = max(z * z * self.variance / (mean * mean), self.fewest * n / self.missions)
        is_open = self.missions >= self.fewest and not self.is_significant
        if is_open and self.p < 1.0:
            needed = max(needed, n * (z / NORMAL.inv_cdf(1.0 - self.p / 2.0)) ** 2)
        return math.ceil(needed)

    @property
    def detectable(self) -> float | None:
        """The smallest true difference that as many such pairs find with a power of 0.8.

        That is (z_test + z_power) * sqrt(variance / n), :attr:`needed` solved for the difference
        (e.g. Bloom 1995, Evaluation Review 19(5), "minimum detectable effects"). None: nothing is
        known of the variance, or there are fewer than :attr:`fewest` missions.
        """
        if not self.variance or self.missions < self.fewest:
            return None
        return math.sqrt(self.variance / self.flips.n) * z_of_power(self.tests)


def z_of_power(tests: int = 1) -> float:
    """Standard errors that a difference must measure to be found with a power of 0.8."""
    return NORMAL.inv_cdf(1.0 - SIGNIFICANCE / (2.0 * tests)) + NORMAL.inv_cdf(POWER)


def needed_for(mean: Interval) -> int | None:
    """Values that tell a mean from zero with a power of 0.8, where the interval is normal.

    That is n (z_test + z_power)^2 / z^2, z the mean in standard errors, which are the half width
    over 1.96. None: the mean is zero, or has no interval.
    """
    if mean.low is None or mean.high is None or not mean.value or mean.low == mean.high:
        return None
    error = (mean.high - mean.low) / (2.0 * Z)
    return math.ceil(mean.n * (z_of_power() * error / mean.value) ** 2)


def compare_pairs(
    first: FloatArray,
    second: FloatArray,
    clusters: IntArray,
    rng: np.random.Generator,
    resolution: float = 0.0,
) -> PairedDifference:
    """Compare paired values, second minus first, by the sign-flip test.

    For shares of pairs that stand for themselves that is McNemar's test.

    Args:
        first: shape (n,), n of at least 1.
        second: shape (n,), of the same missions.
        clusters: number of each pair's mission, shape (n,).
        rng: source of random signs.
        resolution: differences that are no larger count as none, and those that are no farther
            apart as alike: a hundredth of a cent on every mission must not decide.
    """
    differences = second - first
    differences[np.abs(differences) <= resolution] = 0.0
    flips = flip_signs(differences, rng, clusters)
    variance = None
    if np.ptp(differences) > resolution:
        variance = _pair_variance(differences, clusters)
    missions, differs = len(np.unique(clusters)), bool(differences.any())
    return PairedDifference(flips, variance, missions, differs, flips.p)


def together(pairs: Sequence[PairedDifference], others: int = 0) -> list[PairedDifference]:
    """The differences as one family: p values, intervals and power adjusted by Holm's method.

    Each significant difference reduces the number of tests at the next step. After the first one
    that is not significant the number stays. Pairs that do not differ are not tested.

    Args:
        pairs: the family's.
        others: further tests of the family, counted as not significant.
    """
    found = list(pairs)
    differing = [k for k, pair in enumerate(pairs) if pair.differs]
    order = sorted(differing, key=lambda k: pairs[k].p)
    adjusted = holm([pairs[k].p for k in order], others)
    tests = len(order) + others
    for rank, (k, p_holm) in enumerate(zip(order, adjusted, strict=True)):
        if rank and adjusted[rank - 1] < SIGNIFICANCE:
            tests = len(order) + others - rank
        found[k] = replace(pairs[k], p_holm=p_holm, tests=tests)
    return found


def _pair_variance(differences: FloatArray, clusters: IntArray) -> float | None:
    """Variance of one pair's worth of information; None where there is one mission only."""
    numbers = cluster_numbers(clusters, differences.size)
    missions = int(numbers.max()) + 1
    if missions < 2:
        return None
    deviations = np.bincount(numbers, weights=differences - differences.mean())
    return float((deviations**2).sum()) / differences.size * missions / (missions - 1)


def holm(p_values: Sequence[float], others: int = 0) -> list[float]:
    """P values adjusted by Holm's step-down method (Holm 1979), in the order given.

    ``others`` of the family are larger than all of them.
    """
    adjusted = [0.0] * len(p_values)
    largest = 0.0
    for rank, i in enumerate(sorted(range(len(p_values)), key=lambda i: p_values[i])):
        left = len(p_values) + others - rank
        largest = max(largest, min(1.0, left * p_values[i]))
        adjusted[i] = largest
    return adjusted


def paired_slope(
    levels: FloatArray,
    values: FloatArray,
    clusters: IntArray,
    rng: np.random.Generator,
) -> Interval:
    """Slope of values over levels by least squares, with an intercept for each mission.

    This is the fixed-effects ("within") estimator (e.g. Wooldridge 2010, Econometric Analysis of
    Cross Section and Panel Data, section 10.5). Where each mission meets every level it is the mean
    of the missions' own slopes; its interval is the sign-flip test of these, inverted.

    Args:
        levels: shape (k,), at least two different ones.
        values: shape (n, k), finite: of each delivery at each level.
        clusters: number of each delivery's mission, shape (n,).
        rng: source of random signs.

    Raises:
        ValueError: levels that are all alike.
    """
    centred = levels - levels.mean()
    spread = float(centred @ centred)
    if spread == 0.0:
        raise ValueError("a slope needs two different levels at least")
    slopes = values @ centred / spread
    if slopes.size == 0:
        return NO_INTERVAL
    if np.ptp(slopes) == 0.0:
        return Interval(float(slopes.mean()), None, None, slopes.size)
    return flip_signs(slopes, rng, clusters).interval()

"""Differences between deliveries that met the same missions.

Intervals, tests, and how many it takes to be sure.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np

from harness.statistics.bootstrap import (
    DRAWS,
    IntArray,
    bootstrap_mean,
    cluster_numbers,
    kept_draw,
)
from harness.statistics.interval import Interval, Z
from navstack.types import FloatArray

EXACT_UP_TO = 12  # clusters of which every pattern of signs is tried
SIGNS_AT_ONCE = 1_000_000  # of a block of patterns; bounds the memory
SURE = 0.05  # p value, adjusted for its family, below which a difference is called so
POWER = 0.8
# standard errors that a difference must measure to be found with the power
Z_OF_TEST = Z + NormalDist().inv_cdf(POWER)


@dataclass(frozen=True, slots=True)
class PairedDifference:
    """How much the second of two differs from the first."""

    difference: Interval
    p: float  # probability of a difference at least as large if there were none
    # pairs that would resolve the observed difference; None: it is zero, or all differ alike
    needed: int | None
    # smallest difference that these pairs resolve; None: all differ alike, or they are too few
    detectable: float | None
    # whether any pair does; where none does, no test can find a difference (Tarone 1990)
    differs: bool
    missions: int  # that the pairs are of

    def in_family(self, size: int) -> "PairedDifference":
        """The same, tested together with others, ``size`` in all (Holm): that takes more pairs."""
        fewest = fewest_missions(size)
        needed, detectable = self.needed, self.detectable
        if needed is not None:
            needed = max(needed, _pairs_of(fewest, self.difference.n, self.missions))
        if self.missions < fewest:
            detectable = None
        return replace(self, needed=needed, detectable=detectable)


def compare_pairs(
    first: FloatArray,
    second: FloatArray,
    clusters: IntArray,
    rng: np.random.Generator,
    is_share: bool = False,
    resolution: float = 0.0,
) -> PairedDifference:
    """Compare paired values, second minus first.

    The interval is the cluster bootstrap's; it has no bounds where all pairs differ alike, and
    nothing is said then of how many it takes: what is rare has not been seen. The test is the
    paired sign-flip permutation test; for shares of pairs that stand for themselves it is McNemar's
    exact test.

    Args:
        first: shape (n,), n of at least 1.
        second: shape (n,), of the same missions.
        clusters: number of each pair's mission, shape (n,).
        rng: source of resamples and of flipped signs.
        is_share: whether the values are 0 or 1.
        resolution: differences that are no farther apart are alike, and those that are no larger do
            not count in the test: a hundredth of a cent on every mission must not decide it.
    """
    differences = second - first
    interval = Interval(float(differences.mean()), None, None, differences.size)
    needed = detectable = None
    if np.ptp(differences) > resolution:
        interval = bootstrap_mean(differences, rng, clusters=clusters)
        needed = pairs_needed(differences, clusters)
        detectable = smallest_detectable(differences, clusters)
    stand_alone = len(np.unique(clusters)) == clusters.size
    if is_share and stand_alone:
        p = mcnemar_p(int((differences < 0.0).sum()), int((differences > 0.0).sum()))
    else:
        p = sign_flip_p(np.where(np.abs(differences) > resolution, differences, 0.0), rng, clusters)
    return PairedDifference(
        difference=interval,
        p=p,
        needed=needed,
        detectable=detectable,
        differs=bool(differences.any()),
        missions=len(np.unique(clusters)),
    )


def fewest_missions(family: int = 1) -> int:
    """The missions without which the sign-flip test finds nothing, however large it is.

    The least two-sided p value of n missions is 2 / 2^n, times the size of the family by Holm's
    method: five missions do not get below 0.0625.
    """
    return math.floor(math.log2(2.0 * max(family, 1) / SURE)) + 1


def _pairs_of(missions: int, pairs: int, own_missions: int) -> int:
    """The pairs of so many missions, each driven as often as the present ones."""
    return math.ceil(missions * pairs / own_missions)


def sign_flip_p(
    differences: FloatArray, rng: np.random.Generator, clusters: IntArray | None = None
) -> float:
    """Two-sided p value of the paired permutation test of no mean difference (Fisher 1935.

    Good 2005, section 3.2).

    Under no difference the signs of a mission's differences could as well be the other way round,
    all together. Up to twelve missions every pattern of signs is tried; above, random ones, the
    observed one counted in (Phipson and Smyth 2010), so that p is never below 1 / 10 001.
    """
    numbers = cluster_numbers(clusters, differences.size)
    sums = np.zeros(int(numbers.max()) + 1)
    np.add.at(sums, numbers, differences)
    least = abs(sums.sum()) - 1e-12 * np.abs(sums).sum()  # equal sums differ by rounding
    if sums.size <= EXACT_UP_TO:
        patterns = np.arange(2**sums.size)[:, np.newaxis] >> np.arange(sums.size) & 1
        return float((np.abs((1.0 - 2.0 * patterns) @ sums) >= least).mean())
    as_large = 0
    at_once = max(1, SIGNS_AT_ONCE // sums.size)
    for first in range(0, DRAWS, at_once):
        signs = kept_draw(_signs, rng, min(at_once, DRAWS - first), sums.size)
        as_large += int((np.abs(signs @ sums) >= least).sum())
    return (as_large + 1) / (DRAWS + 1)


def _signs(rng: np.random.Generator, rows: int, columns: int) -> FloatArray:
    signs: FloatArray = (2.0 * rng.integers(0, 2, (rows, columns)) - 1.0).astype(np.float64)
    return signs


def mcnemar_p(only_first: int, only_second: int) -> float:
    """Two-sided exact p value of McNemar's test (McNemar 1947).

    The sign test of the pairs that disagree.

    Args:
        only_first: pairs in which only the first succeeded.
        only_second: pairs in which only the second did.
    """
    disagree = only_first + only_second
    below = sum(math.comb(disagree, k) for k in range(min(only_first, only_second) + 1))
    return float(min(1.0, 2 * below / 2**disagree))


def pairs_needed(differences: FloatArray, clusters: IntArray | None = None) -> int | None:
    """Pairs that resolve the observed difference with a power of 0.8 (normal approximation).

    That is (z_confidence + z_power)^2 * variance / mean^2 (e.g. Chow et al. 2008, section 3.1), the
    variance that of clusters where missions repeat; but of :func:`fewest_missions` at least. For
    one comparison alone, without correction for a family.
    """
    mean, variance = float(differences.mean()), _pair_variance(differences, clusters)
    if variance is None or mean == 0.0:
        return None
    fewest = _pairs_of(fewest_missions(), differences.size, _missions(differences, clusters))
    return max(fewest, math.ceil(Z_OF_TEST * Z_OF_TEST * variance / (mean * mean)))


def smallest_detectable(differences: FloatArray, clusters: IntArray | None = None) -> float | None:
    """The smallest true difference that as many such pairs find with a power of 0.8.

    That is (z_confidence + z_power) * sqrt(variance / n), :func:`pairs_needed` solved for the
    difference (e.g. Bloom 1995, Evaluation Review 19(5), "minimum detectable effects"). None where
    the pairs tell nothing of their variance, or are of fewer than :func:`fewest_missions`.
    """
    variance = _pair_variance(differences, clusters)
    if variance and _missions(differences, clusters) >= fewest_missions():
        return math.sqrt(variance / differences.size) * Z_OF_TEST
    return None


def _missions(differences: FloatArray, clusters: IntArray | None) -> int:
    return int(cluster_numbers(clusters, differences.size).max()) + 1


def _pair_variance(differences: FloatArray, clusters: IntArray | None) -> float | None:
    """Variance of one pair's worth of information; None where there is one mission only."""
    numbers = cluster_numbers(clusters, differences.size)
    missions = _missions(differences, clusters)
    if missions < 2:
        return None
    deviations = np.zeros(missions)
    np.add.at(deviations, numbers, differences - differences.mean())
    return float((deviations**2).sum()) / differences.size * missions / (missions - 1)


def holm(p_values: Sequence[float]) -> list[float]:
    """P values adjusted by Holm's step-down method (Holm 1979), in the order given."""
    adjusted = [0.0] * len(p_values)
    largest = 0.0
    for rank, i in enumerate(sorted(range(len(p_values)), key=lambda i: p_values[i])):
        largest = max(largest, min(1.0, (len(p_values) - rank) * p_values[i]))
        adjusted[i] = largest
    return adjusted


def paired_slope(
    levels: FloatArray, values: FloatArray, clusters: IntArray, rng: np.random.Generator
) -> Interval:
    """Slope of values over levels by least squares, with an intercept for each mission.

    This is the fixed-effects ("within") estimator (e.g. Wooldridge 2010, Econometric Analysis of
    Cross Section and Panel Data, section 10.5). Where each mission meets every level it is the mean
    of the missions' own slopes, and these are resampled, whole missions at a time: the pairs
    cluster bootstrap (Cameron, Gelbach and Miller 2008).

    Args:
        levels: shape (k,), at least two different ones.
        values: shape (n, k), finite: of each delivery at each level.
        clusters: number of each delivery's mission, shape (n,).
        rng: source of the resamples.

    Raises:
        ValueError: levels that are all alike.
    """
    centred = levels - levels.mean()
    spread = float(centred @ centred)
    if spread == 0.0:
        raise ValueError("a slope needs two different levels at least")
    slopes = values @ centred / spread
    if slopes.size == 0 or np.ptp(slopes) == 0.0:
        return Interval(float(slopes.mean()) if slopes.size else None, None, None, slopes.size)
    return bootstrap_mean(slopes, rng, clusters=clusters)

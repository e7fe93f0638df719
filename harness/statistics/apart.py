"""The difference of two means whose values are not all of the same missions, nor as many."""

import math
from dataclasses import dataclass, replace

import numpy as np

from harness.statistics.bootstrap import DRAWS, TAIL, IntArray, blocks
from harness.statistics.interval import Interval
from harness.statistics.unseen import Reach, unseen_sizes
from navstack.types import FloatArray


@dataclass(frozen=True, slots=True)
class Sample:
    """Values of one of the two, none of which lies above a limit."""

    values: FloatArray  # shape (n,), finite, n of at least 1
    missions: IntArray  # of each, numbered for both samples together, shape (n,)
    most: float  # the limit
    reach: Reach  # how far below it a value can lie that has not been seen

    @property
    def spread(self) -> float:
        """Their standard deviation with one value more, which has not been seen.

        It lies in the middle of its limits, in the logarithm. So a sample whose values are all
        alike has a spread, too: the fewer they are, the greater.
        """
        sizes = unseen_sizes(self.most - self.values, self.reach, np.array([0.5]))
        return float(np.append(self.values, self.most - sizes).std(ddof=1))


def difference_apart(
    first: Sample, second: Sample, rng: np.random.Generator, draws: int = DRAWS
) -> Interval:
    """Mean of the second less that of the first, with a 95 % interval that admits unseen losses.

    Missions are weighed at random, as :func:`harness.statistics.unseen.admit_unseen` does; one that
    both have drives has the same weight for both. The other way round it is the same with the
    other sign.

    Args:
        first: n values.
        second: m values.
        rng: source of weights and sizes.
        draws: number of resamples.
    """
    if _place(second) < _place(first):
        return difference_apart(second, first, rng, draws).negated
    first, second = _renumbered(first, second)
    count = int(max(first.missions.max(), second.missions.max())) + 1
    low, high = [], []
    for block in blocks(count, draws):
        weights = rng.exponential(size=(block, count))
        fair_a, poor_a = _means(first, weights, rng)
        fair_b, poor_b = _means(second, weights, rng)
        low.append(poor_b - fair_a)
        high.append(fair_b - poor_a)
    return Interval(
        float(second.values.mean() - first.values.mean()),
        float(np.quantile(np.concatenate(low), TAIL)),
        float(np.quantile(np.concatenate(high), 1.0 - TAIL)),
        len(np.union1d(first.missions, second.missions)),
    )


def _place(sample: Sample) -> tuple[int, float]:
    """Decides which of two samples is drawn for first."""
    return sample.values.size, float(sample.values.sum())


def _renumbered(first: Sample, second: Sample) -> tuple[Sample, Sample]:
    """The same with missions numbered in the order in which both together have them."""
    together = np.concatenate((first.missions, second.missions))
    _, places, numbers = np.unique(together, return_index=True, return_inverse=True)
    found = places.argsort(kind="stable").argsort(kind="stable")[numbers]
    own, other = np.split(found, [first.values.size])
    return replace(first, missions=own), replace(second, missions=other)


def _means(
    sample: Sample, weights: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Weighted means with one value more at the limit, and with that value unseen far below it."""
    draws, count = weights.shape
    sums = np.bincount(sample.missions, weights=sample.values, minlength=count)
    sizes = np.bincount(sample.missions, minlength=count).astype(np.float64)
    more = rng.exponential(size=draws) * float(sizes[sizes > 0.0].mean())
    total, seen = weights @ sizes + more, weights @ sums
    below = unseen_sizes(sample.most - sample.values, sample.reach, rng.random((draws,)))
    return (seen + more * sample.most) / total, (seen + more * (sample.most - below)) / total


def cheapest_sizes(
    spreads: tuple[float, float], costs: tuple[float, float], error: float
) -> tuple[int, int]:
    """How many values of each give the difference a standard error at the least cost.

    n by spread / sqrt(cost) (Cochran 1977, Sampling Techniques, 5.5).

    Args:
        spreads: standard deviations.
        costs: of a value of each, above 0.
        error: standard error wanted.
    """
    total = sum(spread * math.sqrt(cost) for spread, cost in zip(spreads, costs, strict=True))
    first, second = (
        math.ceil(total * spread / math.sqrt(cost) / error**2)
        for spread, cost in zip(spreads, costs, strict=True)
    )
    return first, second

"""Intervals of a mean that admit one unseen value.

A sample without a rare disaster has no trace of it, and its bootstrap is too narrow where disasters
decide the mean. Here each resample weighs the values at random (the Bayesian bootstrap, Rubin
1981), and beside them one that has not been seen. Of its size only the limits are known: it is
drawn evenly in the logarithm between the farthest seen and the farthest possible. Were it always
the farthest possible, this would be Gaffke's bound, which holds for every distribution within
limits (Learned-Miller and Thomas 2020, "A new confidence interval for the mean of a bounded random
variable"), and is wider.
"""

from dataclasses import dataclass

import numpy as np

from harness.statistics.bootstrap import DRAWS, TAIL, IntArray, blocks, cluster_numbers
from harness.statistics.interval import Interval
from navstack.types import FloatArray


@dataclass(frozen=True, slots=True)
class Reach:
    """How far from a reference a value can lie that has not been seen."""

    least: float  # it lies at least so far, if nothing that far has been seen
    most: float  # it can lie so far, and farther only if something farther has been seen


def admit_unseen(
    values: FloatArray,
    reference: float,
    below: Reach,
    above: Reach | None,
    rng: np.random.Generator,
    draws: int = DRAWS,
    clusters: IntArray | None = None,
) -> Interval:
    """Mean of values (n,) with a 95 % interval that admits one more value on either side.

    Args:
        values: finite, n of at least 1.
        reference: from which distances are measured.
        below: how far below it the unseen value may lie.
        above: how far above; None: no farther than the reference, e.g. where that is the most that
            can be earned.
        rng: source of weights and sizes.
        draws: number of resamples.
        clusters: number of each value's cluster, shape (n,), from 0, which is weighed as a whole;
            None: each value is its own. The unseen value is a cluster of the mean size.

    Raises:
        ValueError: values that are not finite, or none.
    """
    if values.ndim != 1 or not values.size or not np.isfinite(values).all():
        raise ValueError(f"an interval needs a list of finite numbers; got shape {values.shape}")
    numbers = cluster_numbers(clusters, values.size)
    sums, sizes = np.bincount(numbers, weights=values), np.bincount(numbers).astype(np.float64)
    low, high = [], []
    for block in blocks(sums.size, draws):
        weights = rng.exponential(size=(block, sums.size))
        unseen = rng.exponential(size=block) * sizes.mean()
        places = rng.random(block)
        total, seen = weights @ sizes + unseen, weights @ sums
        low.append(
            (seen + unseen * (reference - unseen_sizes(reference - values, below, places))) / total
        )
        farther = np.zeros(block)
        if above:
            farther = unseen_sizes(values - reference, above, places)
        high.append((seen + unseen * (reference + farther)) / total)
    bounds = np.quantile(np.concatenate(low), TAIL), np.quantile(np.concatenate(high), 1.0 - TAIL)
    return Interval(float(values.mean()), float(bounds[0]), float(bounds[1]), values.size)


def unseen_sizes(distances: FloatArray, reach: Reach, places: FloatArray) -> FloatArray:
    """How far off the unseen value is (b,), at places (b,) between seen and possible.

    Args:
        distances: of the values seen, shape (n,).
        reach: of one that has not been seen.
        places: in 0..1, in the logarithm.
    """
    seen = max(float(distances.max()), reach.least)
    sizes: FloatArray = seen * (max(reach.most, seen) / seen) ** places
    return sizes

"""The percentile bootstrap over missions (Efron and Tibshirani 1993, 13.3).

Deliveries of one mission are alike, so missions are drawn, not deliveries: the cluster bootstrap
(Field and Welsh 2007). Where each mission occurs once, it is the plain bootstrap.
"""

import functools
import pickle
from collections.abc import Callable, Hashable, Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from harness.statistics.interval import CONFIDENCE, Interval
from navstack.types import FloatArray

IntArray = npt.NDArray[np.int64]

DRAWS = 10_000
TAIL = (1.0 - CONFIDENCE) / 2.0
LEAST_TAIL = 5  # values among the worst from which their mean has an interval
# weights drawn in all; resamples where that would be fewer
MOST_DRAWN, LEAST_DRAWS = 200_000_000, 1000
# resamples of a block, and the weights in it: they bound the memory
DRAWS_AT_ONCE, MOST_AT_ONCE = 500, 10_000_000
KEPT_DRAWS, MOST_KEPT = 32, 1_000_000  # blocks, enough for one comparison; numbers of a block


def number_clusters(labels: Sequence[Hashable]) -> IntArray:
    """Number the clusters that ``labels`` name, in order of appearance, shape (n,).

    One label for all says nothing of how different missions would go: the question is about this
    mission then, and each delivery stands for itself.
    """
    numbers: dict[Hashable, int] = {}
    for label in labels:
        numbers.setdefault(label, len(numbers))
    if len(numbers) == 1:
        return np.arange(len(labels))
    return np.array([numbers[label] for label in labels], dtype=np.int64)


def bootstrap_mean(
    values: npt.ArrayLike,
    rng: np.random.Generator,
    draws: int = DRAWS,
    clusters: IntArray | None = None,
) -> Interval:
    """Mean with its 95 % percentile bootstrap interval.

    One cluster has a mean but no interval.

    Args:
        values: shape (n,), finite.
        rng: source of the resamples.
        draws: number of resamples.
        clusters: number of each value's cluster, shape (n,), from 0; None: each value is its own.

    Raises:
        ValueError: values that are not finite or not one-dimensional.
    """
    sample, numbers = _checked(values, clusters)
    if sample.size == 0:
        return Interval(None, None, None, 0)
    mean = float(sample.mean())
    if numbers.max() == 0:
        return Interval(mean, None, None, sample.size)
    means = resampled_means(sample[:, np.newaxis], rng, draws, numbers)[:, 0]
    return percentile_interval(mean, means, sample.size)


def percentile_interval(value: float, resampled: FloatArray, n: int) -> Interval:
    """The 95 % interval between percentiles of ``resampled`` (draws,), NaN where undefined."""
    low, high = np.quantile(resampled[~np.isnan(resampled)], (TAIL, 1.0 - TAIL))
    return Interval(value, float(low), float(high), n)


def resampled_means(
    values: FloatArray,
    rng: np.random.Generator,
    draws: int = DRAWS,
    clusters: IntArray | None = None,
) -> FloatArray:
    """Means over resamples.

    Every column meets the same resamples, so that sums of columns stay sums.

    Args:
        values: shape (n, k), n of at least 1; NaN where a column is undefined.
        rng: source of the resamples.
        draws: number of resamples.
        clusters: as in :func:`bootstrap_mean`.

    Returns:
        Shape (draws, k); means over what is defined, NaN where a resample has nothing of the kind.
    """
    numbers = cluster_numbers(clusters, len(values))
    defined = ~np.isnan(values)
    number = int(numbers.max()) + 1
    sums, sizes = np.zeros((number, values.shape[1])), np.zeros((number, values.shape[1]))
    np.add.at(sums, numbers, np.where(defined, values, 0.0))
    np.add.at(sizes, numbers, defined)
    # most columns are defined alike
    distinct, which = np.unique(sizes, axis=1, return_inverse=True)
    with np.errstate(invalid="ignore"):
        return np.concatenate(
            [(w @ sums) / (w @ distinct)[:, which.ravel()] for w in _weights(number, rng, draws)]
        )


def cvar(values: npt.ArrayLike, level: float = 0.95) -> float:
    """Conditional value at risk: mean of the worst (largest) share 1 - ``level`` of the values.

    Where that share is no whole number of values, the last one counts in part (Rockafellar and
    Uryasev 2002, prop. 8).

    Raises:
        ValueError: no values, or values that are not finite.
    """
    sample, _ = _checked(values, None)
    if sample.size == 0:
        raise ValueError("the mean of the worst needs at least one value")
    return float(_tail_means(np.ones((1, sample.size)), -np.sort(-sample), 1.0 - level)[0])


def bootstrap_cvar(
    values: npt.ArrayLike,
    rng: np.random.Generator,
    draws: int = DRAWS,
    level: float = 0.95,
    clusters: IntArray | None = None,
) -> Interval:
    """:func:`cvar` with its percentile bootstrap interval.

    Arguments and errors as in :func:`bootstrap_mean`.

    There is no interval where fewer than five values are in the tail: they say too little of what
    is worse still. Also above it is too narrow; how much: docs/money.md.
    """
    sample, numbers = _checked(values, clusters)
    order = np.argsort(-sample, kind="stable")
    statistic = functools.partial(_tail_means, falling=sample[order], share=1.0 - level)
    return _of_order(statistic, numbers[order], 1.0 - level, rng, draws)


def bootstrap_quantile(
    values: npt.ArrayLike,
    level: float,
    rng: np.random.Generator,
    draws: int = DRAWS,
    clusters: IntArray | None = None,
) -> Interval:
    """A quantile with its bootstrap interval.

    That is the inverse of the empirical distribution function (Hyndman and Fan 1996, definition 1).
    Where fewer than five values are on either side there is no interval. Other arguments and errors
    as in :func:`bootstrap_mean`.
    """
    sample, numbers = _checked(values, clusters)
    order = np.argsort(sample, kind="stable")
    statistic = functools.partial(_quantiles, rising=sample[order], level=level)
    return _of_order(statistic, numbers[order], min(level, 1.0 - level), rng, draws)


def _of_order(
    statistic: Callable[[FloatArray], FloatArray],
    numbers: IntArray,
    share: float,
    rng: np.random.Generator,
    draws: int,
) -> Interval:
    """A statistic of weights (b, n) of ordered values, with its interval.

    ``numbers`` are the clusters of the values, in their order.
    """
    n = numbers.size
    if n == 0:
        return Interval(None, None, None, 0)
    value = float(statistic(np.ones((1, n)))[0])
    if numbers.max() == 0 or n * share < LEAST_TAIL - 1e-9:
        return Interval(value, None, None, n)
    weights = _weights(int(numbers.max()) + 1, rng, draws, n)
    return percentile_interval(
        value, np.concatenate([statistic(w[:, numbers]) for w in weights]), n
    )


def _quantiles(weights: FloatArray, rising: FloatArray, level: float) -> FloatArray:
    """Where the weight (b, n) of rising values (n,) first reaches its share ``level``, (b,)."""
    reached = np.cumsum(weights, axis=1)
    quantiles: FloatArray = rising[(reached >= level * reached[:, -1:] - 1e-9).argmax(axis=1)]
    return quantiles


def _tail_means(weights: FloatArray, falling: FloatArray, share: float) -> FloatArray:
    """Means over the first ``share`` of the weight (b, n) of falling values (n,), shape (b,)."""
    reached = np.cumsum(weights, axis=1)
    tail = share * reached[:, -1:]
    inside = np.diff(np.minimum(reached, tail), axis=1, prepend=0.0)
    means: FloatArray = (inside @ falling) / tail[:, 0]
    return means


def blocks(weights: int, draws: int) -> Iterator[int]:
    """How many resamples of so many weights to draw at a time.

    Beyond 20 000 there are fewer than ``draws`` in all.
    """
    left = min(draws, max(LEAST_DRAWS, MOST_DRAWN // weights))
    while left > 0:
        block = min(left, DRAWS_AT_ONCE, max(1, MOST_AT_ONCE // weights))
        yield block
        left -= block


def _weights(
    clusters: int,
    rng: np.random.Generator,
    draws: int,
    values: int = 0,
) -> Iterator[FloatArray]:
    """How often each cluster is in each resample, in blocks of shape (b, clusters).

    ``values`` are how many weights a resample becomes, where it is more than clusters.
    """
    for block in blocks(max(clusters, values), draws):
        yield kept_draw(_resample, rng, block, clusters)


def _resample(rng: np.random.Generator, block: int, clusters: int) -> FloatArray:
    drawn = (
        rng.integers(0, clusters, (block, clusters)) + clusters * np.arange(block)[:, np.newaxis]
    )
    return (
        np.bincount(drawn.ravel(), minlength=block * clusters)
        .reshape(block, clusters)
        .astype(np.float64)
    )


def kept_draw(
    draw: Callable[[np.random.Generator, int, int], FloatArray],
    rng: np.random.Generator,
    rows: int,
    columns: int,
) -> FloatArray:
    """What ``draw`` makes of a generator.

    Kept for the next that comes in the same state, as every metric's does.

    The generator leaves as if it had drawn. Large draws are not kept.
    """
    if rows * columns > MOST_KEPT:
        return draw(rng, rows, columns)
    drawn, after = _drawn(
        draw, pickle.dumps((rng.bit_generator.state, type(rng.bit_generator))), rows, columns
    )
    rng.bit_generator.state = after
    return drawn


@functools.lru_cache(maxsize=KEPT_DRAWS)
def _drawn(
    draw: Callable[[np.random.Generator, int, int], FloatArray],
    state: bytes,
    rows: int,
    columns: int,
) -> tuple[FloatArray, Any]:
    before, kind = pickle.loads(state)
    bits = kind()
    bits.state = before
    drawn = draw(np.random.Generator(bits), rows, columns)
    drawn.flags.writeable = False
    return drawn, bits.state


def cluster_numbers(clusters: IntArray | None, size: int) -> IntArray:
    """The number of each value's cluster, shape (size,); None: each value is its own."""
    if clusters is None:
        return np.arange(size)
    return clusters


def _checked(values: npt.ArrayLike, clusters: IntArray | None) -> tuple[FloatArray, IntArray]:
    sample = np.asarray(values, dtype=np.float64)
    if sample.ndim != 1 or not np.isfinite(sample).all():
        raise ValueError(f"bootstrap needs a list of finite numbers; got shape {sample.shape}")
    numbers = cluster_numbers(clusters, sample.size)
    if numbers.shape != sample.shape:
        raise ValueError(f"{numbers.size} clusters for {sample.size} values; each value needs one")
    return sample, numbers

"""Values with their uncertainty: intervals for shares and for means."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri

DRAWS_AT_ONCE = 500  # bootstrap draws per block; bounds the memory


@dataclass(frozen=True, slots=True)
class Interval:
    """A value and the interval it lies in; None where there are too few data to say."""

    value: float | None
    low: float | None
    high: float | None
    n: int  # sample size

    def as_json(self) -> dict[str, float | int | None]:
        """The quantity as one JSON object."""
        return {"value": self.value, "low": self.low, "high": self.high, "n": self.n}


def wilson_interval(successes: int, n: int, confidence: float = 0.95) -> Interval:
    """Share of successes with Wilson's score interval (Wilson 1927).

    Raises:
        ValueError: more successes than trials, a negative count, or a confidence outside 0..1.
    """
    _check_confidence(confidence)
    if not 0 <= successes <= n:
        raise ValueError(f"{successes} successes of {n} trials; successes must lie in 0..n")
    if n == 0:
        return Interval(None, None, None, 0)
    z = float(ndtri(0.5 + confidence / 2.0))
    share = successes / n
    middle = (share + z * z / (2.0 * n)) / (1.0 + z * z / n)
    half = z / (1.0 + z * z / n) * math.sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n))
    low = 0.0 if successes == 0 else middle - half
    high = 1.0 if successes == n else middle + half
    return Interval(share, low, high, n)


def bootstrap_mean(
    values: npt.ArrayLike, rng: np.random.Generator, draws: int = 10_000, confidence: float = 0.95
) -> Interval:
    """Mean with its percentile bootstrap interval (Efron and Tibshirani 1993, section 13.3).

    One value has a mean but no interval.

    Args:
        values: shape (n,), finite.
        rng: source of the resamples.
        draws: number of resamples.
        confidence: share of the resampled means inside the interval.

    Raises:
        ValueError: values that are not finite or not one-dimensional, or a confidence outside 0..1.
    """
    _check_confidence(confidence)
    sample = np.asarray(values, dtype=np.float64)
    if sample.ndim != 1 or not np.isfinite(sample).all():
        raise ValueError(f"bootstrap needs a list of finite numbers; got shape {sample.shape}")
    n = sample.size
    if n == 0:
        return Interval(None, None, None, 0)
    mean = float(sample.mean())
    if n == 1:
        return Interval(mean, None, None, 1)
    blocks = [min(DRAWS_AT_ONCE, draws - start) for start in range(0, draws, DRAWS_AT_ONCE)]
    means = np.concatenate([sample[rng.integers(0, n, (block, n))].mean(axis=1) for block in blocks])
    tail = (1.0 - confidence) / 2.0
    low, high = np.quantile(means, (tail, 1.0 - tail))
    return Interval(mean, float(low), float(high), n)


def _check_confidence(confidence: float) -> None:
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence {confidence} is not between 0 and 1; 0.95 is usual")

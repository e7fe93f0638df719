"""A value with its interval, and Wilson's interval for shares."""

import math
from dataclasses import dataclass
from statistics import NormalDist


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
    if not 0 <= successes <= n:
        raise ValueError(f"{successes} successes of {n} trials; successes must lie in 0..n")
    z = normal_quantile(confidence)
    if n == 0:
        return Interval(None, None, None, 0)
    share = successes / n
    middle = (share + z * z / (2.0 * n)) / (1.0 + z * z / n)
    half = z / (1.0 + z * z / n) * math.sqrt(share * (1.0 - share) / n + z * z / (4.0 * n * n))
    low = 0.0 if successes == 0 else middle - half
    high = 1.0 if successes == n else middle + half
    return Interval(share, low, high, n)


def normal_quantile(confidence: float) -> float:
    """How many standard deviations on both sides of a normal mean hold this share.

    Raises:
        ValueError: a confidence outside 0..1.
    """
    check_confidence(confidence)
    return NormalDist().inv_cdf(0.5 + confidence / 2.0)


def check_confidence(confidence: float) -> None:
    """Check that a confidence can be one.

    Raises:
        ValueError: it is not between 0 and 1.
    """
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence {confidence} is not between 0 and 1; 0.95 is usual")

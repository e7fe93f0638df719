"""A value with its interval, Wilson's interval for shares, and when either is significant."""

import dataclasses
import math
from dataclasses import dataclass
from statistics import NormalDist

CONFIDENCE = 0.95  # of all intervals
SIGNIFICANCE = 0.05  # p value, adjusted for its family, below which a difference is significant
# standard deviations on both sides of a normal mean that hold it
Z = NormalDist().inv_cdf(0.5 + CONFIDENCE / 2.0)


@dataclass(frozen=True, slots=True)
class Interval:
    """A value and the interval it lies in; None where there are too few data to say."""

    value: float | None
    low: float | None
    high: float | None
    n: int  # sample size

    def __str__(self) -> str:
        if self.value is None:
            return f"undefined (n = {self.n})"
        bounds = ""
        if self.low is not None and self.high is not None:
            bounds = f" [{self.low:.4g}, {self.high:.4g}]"
        return f"{self.value:.4g}{bounds} (n = {self.n})"

    @property
    def sign(self) -> int:
        """1: above zero as a whole; -1: below; 0: not significant, or of too few values."""
        if self.low is None or self.high is None or self.n < fewest_missions():
            return 0
        return int(self.low > 0.0) - int(self.high < 0.0)

    @property
    def negated(self) -> "Interval":
        """Of the same difference taken the other way round."""
        value, low, high = (
            None if end is None else 0.0 - end for end in (self.value, self.high, self.low)
        )
        return Interval(value, low, high, self.n)

    def as_json(self) -> dict[str, float | int | None]:
        """The quantity as one JSON object."""
        return {"value": self.value, "low": self.low, "high": self.high, "n": self.n}


def fewest_missions(tests: int = 1) -> int:
    """The missions without which no difference is significant, however large it is.

    The least two-sided p value of the sign-flip test with n missions is 2 / 2^n, and is multiplied
    by the number of tests (Holm): five missions do not get below 0.0625.
    """
    return math.floor(math.log2(2.0 * max(tests, 1) / SIGNIFICANCE)) + 1


NO_INTERVAL = Interval(None, None, None, 0)


def wider(found: Interval, other: Interval | None) -> Interval:
    """What was found, between the outer bounds of both; without bounds where it has none."""
    if other is None or found.low is None or found.high is None:
        return found
    if other.low is None or other.high is None:
        return found
    low, high = min(found.low, other.low), max(found.high, other.high)
    return dataclasses.replace(found, low=low, high=high)


def admitting(found: Interval, unseen: Interval | None) -> Interval:
    """What was found, between bounds that admit a loss nobody has seen, where these are known.

    Values that are all alike have no bounds of their own; what has not been seen is no less likely.
    """
    if unseen is None or unseen.low is None or unseen.high is None or found.value is None:
        return found
    if found.low is None or found.high is None:
        return dataclasses.replace(found, low=unseen.low, high=unseen.high)
    return wider(found, unseen)


def interval_json(interval: Interval | None) -> dict[str, float | int | None] | None:
    """The interval as one JSON object; None where there is none."""
    if interval is None:
        return None
    return interval.as_json()


def wilson_interval(successes: int, n: int) -> Interval:
    """Share of successes with Wilson's 95 % score interval (Wilson 1927).

    Raises:
        ValueError: more successes than trials, or a negative count.
    """
    if not 0 <= successes <= n:
        raise ValueError(f"{successes} successes of {n} trials; successes must lie in 0..n")
    if n == 0:
        return NO_INTERVAL
    share = successes / n
    middle = (share + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n)
    half = Z / (1.0 + Z * Z / n) * math.sqrt(share * (1.0 - share) / n + Z * Z / (4.0 * n * n))
    low = 0.0
    if successes != 0:
        low = middle - half
    high = 1.0
    if successes != n:
        high = middle + half
    return Interval(share, low, high, n)

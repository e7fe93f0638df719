"""Exact tests of two counts: shares of two samples, and rare events in two."""

import math


def fisher_p(first: int, first_n: int, second: int, second_n: int) -> float:
    """Two-sided p value of Fisher's exact test that two samples have the same share of successes (Fisher 1935).

    The probability, both margins given, of all tables that are no more probable than the observed one.

    Args:
        first: successes of the first sample.
        first_n: its size.
        second: successes of the second sample.
        second_n: its size.

    Raises:
        ValueError: a count that is negative or larger than its sample.
    """
    for successes, n in ((first, first_n), (second, second_n)):
        if not 0 <= successes <= n:
            raise ValueError(f"{successes} successes of {n} trials; successes must lie in 0..n")
    both = first + second
    ways = [math.comb(first_n, k) * math.comb(second_n, both - k) for k in range(both + 1)]  # exact whole numbers
    return sum(way for way in ways if way <= ways[first]) / sum(ways)


def rates_p(first: int, first_exposure: int, second: int, second_exposure: int) -> float:
    """Two-sided exact p value that two Poisson counts have the same rate (Przyborowski and Wilenski 1940).

    Given their sum, the first is binomial with its share of the exposure; summed are all counts that are no more
    probable than the observed one.

    Args:
        first: events of the first sample.
        first_exposure: its size, e.g. deliveries.
        second: events of the second sample.
        second_exposure: its size.

    Raises:
        ValueError: a negative count, or an exposure that is not positive.
    """
    if min(first, second) < 0 or min(first_exposure, second_exposure) <= 0:
        raise ValueError("counts must not be negative, exposures must be positive")
    both = first + second
    ways = [math.comb(both, k) * first_exposure**k * second_exposure ** (both - k) for k in range(both + 1)]
    return sum(way for way in ways if way <= ways[first]) / sum(ways)

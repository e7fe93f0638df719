"""What further trials may still bring."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.integrate import quad
from scipy.stats import norm

LEAST = 10  # trials before anything can be said
WIDEST = 8.0  # standard deviations up to which the integral goes


def expected_gain(values: Sequence[float], best: float, error: float, remaining: int) -> float | None:
    """How much the best of ``remaining`` further trials is expected to exceed ``best``, never below 0.

    As if they came from the normal distribution of the later half of what was tried, the noise of measuring a trial
    taken off its variance: the integral of 1 - Phi((x - mean) / sd)^remaining over all x above ``best`` (expected
    largest of normal variables: e.g. David and Nagaraja 2003, section 3.1). A sampler that still learns does better,
    one that has found the top worse; ``best`` was chosen for being large and so is too large itself.

    Args:
        values: what the sampler was told of each trial, in order.
        best: the incumbent's.
        error: standard error of a trial's value.
        remaining: number of trials.

    Returns:
        None: there are too few trials to say.
    """
    if len(values) < LEAST or remaining < 1:
        return None if remaining else 0.0
    later = np.asarray(values[len(values) // 2 :])
    mean, deviation = float(later.mean()), math.sqrt(max(float(later.var(ddof=1)) - error**2, 0.0))
    if deviation == 0.0:
        return max(mean - best, 0.0)
    end = max(best, mean) + WIDEST * deviation
    gain, _ = quad(lambda x: 1.0 - norm.cdf(x, mean, deviation) ** remaining, best, end)
    return float(gain)

"""Runs that end once their margin is known, in the proof of intervals."""

import math

import numpy as np
import pytest

from harness.ablation.precision import FIRST, GROWTH
from harness.statistics.interval import Interval, Z
from navstack.types import FloatArray
from tools.check_intervals import WITHIN, _until_known


def _normal(sample: FloatArray, rng: np.random.Generator) -> Interval:
    half = Z * float(sample.std(ddof=1)) / math.sqrt(len(sample))
    mean = float(sample.mean())
    return Interval(mean, mean - half, mean + half, len(sample))


@pytest.mark.parametrize("spread", [0.1, 10.0, 30.0])
def test_a_run_ends_once_its_interval_is_narrow(spread: float) -> None:
    rng = np.random.default_rng(0)
    needed = (Z * spread / WITHIN) ** 2
    span, count = _until_known(rng.normal(0.0, spread, 5000), _normal, rng)
    assert span.n == count
    assert span.high is not None and span.value is not None
    assert span.high - span.value <= WITHIN
    if needed < FIRST:
        assert count == FIRST
    else:
        assert 0.7 * needed < count < GROWTH * needed

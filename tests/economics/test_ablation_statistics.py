"""Quantiles and slopes against known answers."""

import numpy as np
import pytest

from harness.statistics.bootstrap import bootstrap_quantile
from harness.statistics.paired import paired_slope


def rng(seed):
    return np.random.default_rng(seed)


def test_quantiles_by_hand():
    values = [5.0, 1.0, 4.0, 2.0, 3.0, 6.0, 7.0, 8.0, 9.0, 10.0]
    assert bootstrap_quantile(values, 0.5, rng(0)).value == 5.0
    assert bootstrap_quantile(values, 0.95, rng(0)).value == 10.0
    assert bootstrap_quantile(values, 0.9, rng(0)).value == 9.0
    assert bootstrap_quantile([], 0.5, rng(0)).value is None


def test_a_quantile_has_an_interval_where_five_values_are_on_either_side():
    values = rng(7).normal(0.0, 1.0, 99)
    median, tail = (bootstrap_quantile(values, level, rng(0)) for level in (0.5, 0.95))
    assert median.low < median.value < median.high and median.n == 99
    assert tail.value is not None and tail.low is None
    assert bootstrap_quantile(np.append(values, 0.0), 0.95, rng(0)).low is not None


def test_the_interval_of_a_median_covers_it_about_as_often_as_it_says():
    covered = 0
    for seed in range(150):
        found = bootstrap_quantile(rng(seed).normal(0.0, 1.0, 60), 0.5, rng(seed), draws=500)
        covered += found.low <= 0.0 <= found.high
    assert 0.91 <= covered / 150 <= 0.99


def test_missions_move_a_quantile_together():
    values = rng(8).normal(0.0, 1.0, 40)
    once = bootstrap_quantile(values, 0.5, rng(0))
    thrice = bootstrap_quantile(
        np.repeat(values, 3), 0.5, rng(0), clusters=np.repeat(np.arange(40), 3)
    )
    assert (thrice.value, thrice.n) == (once.value, 120)
    assert (thrice.low, thrice.high) == pytest.approx((once.low, once.high), abs=0.1)


def test_a_slope_is_recovered_exactly_without_noise():
    levels, offsets = np.array([0.0, 0.1, 0.3, 1.0]), rng(9).normal(0.0, 50.0, 30)
    values = offsets[:, np.newaxis] - 0.7 * levels
    slope = paired_slope(levels, values, np.arange(30), rng(0))
    assert slope.value == pytest.approx(-0.7, abs=1e-12) and slope.n == 30


def test_a_slope_is_that_of_least_squares_with_an_intercept_per_mission():
    levels, n = np.array([0.0, 1.0, 2.5]), 25
    values = rng(10).normal(0.0, 1.0, (n, 3)) + rng(11).normal(0.0, 5.0, (n, 1)) + 0.4 * levels
    design = np.column_stack((np.tile(levels, n), np.kron(np.eye(n), np.ones((3, 1)))))
    by_least_squares = np.linalg.lstsq(design, values.ravel(), rcond=None)[0][0]
    assert paired_slope(levels, values, np.arange(n), rng(0)).value == pytest.approx(
        by_least_squares, abs=1e-12
    )


@pytest.mark.slow
def test_the_interval_of_a_slope_covers_it_about_as_often_as_it_says():
    levels, covered = np.array([0.0, 0.3, 1.0]), 0
    for seed in range(150):
        draws = rng(seed)
        # missions differ in how much an error harms them
        own = draws.normal(2.0, 1.5, (50, 1)) * levels
        found = paired_slope(
            levels, own + draws.normal(0.0, 3.0, (50, 3)), np.arange(50), rng(seed)
        )
        covered += found.low <= 2.0 <= found.high
    assert 0.90 <= covered / 150 <= 0.99


def test_a_slope_needs_two_levels():
    with pytest.raises(ValueError, match="two different levels"):
        paired_slope(np.array([1.0, 1.0]), np.zeros((3, 2)), np.arange(3), rng(0))

"""Probability of break-even against simulated deliveries."""

import numpy as np
import pytest
from scipy.special import log_ndtr, ndtr

from harness.economics.break_even import break_even_probability


def probability(runs, capex, mean, deviation):
    return break_even_probability(runs, capex, np.array([mean]), np.array([deviation]))


@pytest.mark.parametrize(("mean", "deviation"), [(0.5, 4.0), (0.0, 4.0), (-0.2, 6.0), (1.0, 2.0)])
def test_it_is_how_often_simulated_profits_reach_the_capex(mean, deviation):
    rng = np.random.default_rng(0)
    sums = np.cumsum(rng.normal(mean, deviation, (4000, 400)), axis=1)
    simulated = (sums.max(axis=1) >= 100.0).mean()
    assert probability(400, 100.0, mean, deviation) == pytest.approx(simulated, abs=0.04)


@pytest.mark.parametrize("runs", [10.0, 18_250.0, 1e6])
def test_it_is_the_inverse_gaussian_distribution_of_the_textbook(runs):
    """Chhikara and Folks' formula in logarithms, far tails included."""
    means, deviations = (
        grid.ravel() for grid in np.meshgrid(np.linspace(-40.0, 40.0, 41), [0.5, 4.0, 60.0])
    )
    scale = deviations * np.sqrt(runs)
    earlier = 2.0 * means * 13_000.0 / deviations**2 + log_ndtr((-means * runs - 13_000.0) / scale)
    expected = ndtr((means * runs - 13_000.0) / scale) + np.exp(earlier)
    found = [probability(runs, 13_000.0, *pair) for pair in zip(means, deviations, strict=True)]
    assert np.array(found) == pytest.approx(np.minimum(expected, 1.0), abs=1e-7)


def test_without_spread_it_is_the_break_even_point():
    assert probability(99, 100.0, 1.0, 0.0) == 0.0
    assert probability(100, 100.0, 1.0, 0.0) == 1.0
    assert probability(1e9, 100.0, -1.0, 0.0) == 0.0


def test_it_grows_with_the_runs_and_ends_at_one_if_the_mean_is_positive():
    chances = [
        probability(runs, 13_000.0, 1.0, 30.0) for runs in (100, 1000, 10_000, 13_000, 20_000, 1e6)
    ]
    assert chances == sorted(chances)
    assert chances[3] == pytest.approx(0.5, abs=0.06)
    assert chances[-1] == pytest.approx(1.0)


def test_a_losing_robot_never_pays_back_a_large_sum():
    assert probability(1e6, 13_000.0, -5.0, 40.0) == pytest.approx(
        np.exp(2 * -5.0 * 13_000.0 / 40.0**2), abs=1e-12
    )


def test_what_the_data_leave_open_is_averaged():
    both = break_even_probability(1e6, 1000.0, np.array([1.0, -1.0]), np.array([1.0, 1.0]))
    assert both == pytest.approx(0.5)

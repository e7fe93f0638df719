"""Intervals against published tables, scipy and their own promises."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from harness.statistics.bootstrap import bootstrap_mean
from harness.statistics.interval import Interval, admitting, wilson_interval


@pytest.mark.parametrize(
    ("successes", "n", "low", "high"),
    [  # Newcombe 1998, table I, method 3 (score without continuity correction)
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_equals_the_published_table(successes, n, low, high):
    interval = wilson_interval(successes, n)
    assert interval.value == pytest.approx(successes / n)
    assert (interval.low, interval.high) == pytest.approx((low, high), abs=5e-5)
    assert interval.n == n


@given(st.integers(1, 500).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_equals_scipy(case):
    successes, n = case
    interval, expected = (
        wilson_interval(successes, n),
        binomtest(successes, n).proportion_ci(method="wilson"),
    )
    assert (interval.low, interval.high) == pytest.approx((expected.low, expected.high), abs=1e-12)
    assert 0.0 <= interval.low <= interval.value <= interval.high <= 1.0


def test_nothing_tried_is_undefined():
    assert wilson_interval(0, 0) == Interval(None, None, None, 0)
    assert bootstrap_mean([], np.random.default_rng(0)) == Interval(None, None, None, 0)


def test_one_value_has_a_mean_and_no_interval():
    assert bootstrap_mean([2.5], np.random.default_rng(0)) == Interval(2.5, None, None, 1)


@pytest.mark.parametrize(("successes", "n"), [(5, 4), (-1, 4), (0, -1)])
def test_impossible_counts_are_refused(successes, n):
    with pytest.raises(ValueError, match="successes must lie in"):
        wilson_interval(successes, n)


def test_bootstrap_is_the_percentile_interval_of_resampled_means():
    values = np.random.default_rng(1).gamma(2.0, 3.0, 40)
    interval = bootstrap_mean(values, np.random.default_rng(7), draws=1200)
    rng, means = np.random.default_rng(7), []
    for block in (500, 500, 200):
        means += [
            float(np.mean([values[i] for i in row])) for row in rng.integers(0, 40, (block, 40))
        ]
    assert interval.value == pytest.approx(values.mean())
    assert (interval.low, interval.high) == pytest.approx(tuple(np.percentile(means, (2.5, 97.5))))


def test_bootstrap_is_as_wide_as_theory_says():
    values = np.random.default_rng(2).normal(10.0, 2.0, 400)
    interval = bootstrap_mean(values, np.random.default_rng(3))
    half = 1.96 * values.std() / 20.0
    assert (interval.low, interval.high) == pytest.approx(
        (values.mean() - half, values.mean() + half), abs=0.02
    )


def test_bootstrap_repeats_with_its_seed_and_not_with_another():
    values = np.arange(30.0) ** 1.5
    first, again, other = (
        bootstrap_mean(values, np.random.default_rng(seed)) for seed in (5, 5, 6)
    )
    assert first == again
    assert first != other


@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=30), st.integers(0, 10))
def test_bootstrap_stays_inside_the_data(values, seed):
    interval = bootstrap_mean(values, np.random.default_rng(seed), draws=50)
    slack = 1e-9 * max(map(abs, values))
    assert min(values) - slack <= interval.low <= interval.high <= max(values) + slack


@pytest.mark.parametrize("values", [[1.0, np.nan], [np.inf], [[1.0], [2.0]]])
def test_bootstrap_refuses_what_is_not_a_list_of_numbers(values):
    with pytest.raises(ValueError, match="finite numbers"):
        bootstrap_mean(values, np.random.default_rng(0))


def test_json_has_null_where_undefined():
    document = json.loads(json.dumps(wilson_interval(3, 8).as_json()))
    assert list(document) == ["value", "low", "high", "n"]
    assert document["value"] == 0.375
    assert Interval(None, None, None, 0).as_json() == {
        "value": None,
        "low": None,
        "high": None,
        "n": 0,
    }


@pytest.mark.parametrize(
    ("found", "unseen", "expected"),
    [
        ((7.0, None, None), (7.0, -17.0, 31.0), (7.0, -17.0, 31.0)),  # all alike: no less unsure
        ((7.0, 5.0, 9.0), (7.0, 6.0, 31.0), (7.0, 5.0, 31.0)),
        ((7.0, 5.0, 9.0), (7.0, None, None), (7.0, 5.0, 9.0)),
        ((7.0, None, None), None, (7.0, None, None)),
        ((None, None, None), (7.0, -17.0, 31.0), (None, None, None)),
    ],
)
def test_what_has_not_been_seen_is_admitted(found, unseen, expected):
    other = None if unseen is None else Interval(*unseen, 30)
    assert admitting(Interval(*found, 30), other) == Interval(*expected, 30)

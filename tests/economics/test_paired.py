"""Comparisons of paired values against textbook answers, scipy and brute force."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, ttest_1samp

from harness.statistics.paired import (
    SURE,
    compare_pairs,
    fewest_missions,
    holm,
    mcnemar_p,
    pairs_needed,
    sign_flip_p,
)


def rng(seed=0):
    return np.random.default_rng(seed)


def test_darwins_maize():
    """Fisher 1935, The Design of Experiments, section 21: 863 of the 32768 sign patterns are as far on one side."""
    eighths_of_an_inch = np.array(
        [49, -67, 8, 16, 6, 23, 28, 41, 14, 29, 56, 24, 75, 60, -48], dtype=float
    )
    assert sign_flip_p(eighths_of_an_inch, rng()) == pytest.approx(2 * 863 / 32768, abs=0.008)


@pytest.mark.parametrize("n", [2, 5, 9])
def test_few_missions_try_every_pattern(n):
    differences = rng(n).normal(0.6, 1.0, n)
    sums = [
        abs(sum(s * d for s, d in zip(signs, differences, strict=True)))
        for signs in itertools.product((1, -1), repeat=n)
    ]
    expected = np.mean([s >= abs(differences.sum()) - 1e-12 for s in sums])
    assert sign_flip_p(differences, rng()) == pytest.approx(expected, abs=0.0)


@pytest.mark.parametrize("n", [4, 40])
def test_losses_are_as_sure_as_gains(n):
    """A difference that all missions share is as far out as two of the patterns, or as no random one."""
    alike = np.full(n, 0.1)
    assert (
        sign_flip_p(alike, rng())
        == sign_flip_p(-alike, rng())
        == (2.0 / 16.0 if n == 4 else 1.0 / 10_001.0)
    )


def test_missions_flip_as_a_whole():
    """Ten differences of two missions have the four patterns of two values."""
    differences, missions = np.array([1.0] * 5 + [2.0] * 5), np.repeat([0, 1], 5)
    assert sign_flip_p(differences, rng(), missions) == 0.5
    assert sign_flip_p(differences, rng()) < 0.01


def test_p_is_near_the_t_tests_on_normal_data():
    differences = rng(3).normal(0.3, 1.0, 60)
    assert sign_flip_p(differences, rng()) == pytest.approx(
        ttest_1samp(differences, 0.0).pvalue, abs=0.01
    )


def test_p_is_uniform_where_there_is_no_difference():
    p = [sign_flip_p(rng(seed).normal(0.0, 1.0, 10), rng(seed)) for seed in range(400)]
    assert np.mean(np.array(p) <= 0.05) == pytest.approx(0.05, abs=0.03)
    assert np.mean(np.array(p) <= 0.5) == pytest.approx(0.5, abs=0.07)


def test_no_difference_at_all():
    zeros = np.zeros(20)
    result = compare_pairs(zeros, zeros, np.arange(20), rng())
    assert (result.p, result.needed) == (1.0, None)
    assert (result.difference.value, result.difference.low, result.difference.n) == (0.0, None, 20)


@given(st.integers(0, 60), st.integers(0, 60))
def test_mcnemar_is_the_sign_test_of_the_pairs_that_disagree(b, c):
    expected = binomtest(b, b + c, 0.5).pvalue if b + c else 1.0
    assert mcnemar_p(b, c) == pytest.approx(expected, rel=1e-9)


def test_sign_flips_of_shares_are_mcnemars():
    differences = np.array([1.0] * 8 + [-1.0] * 2 + [0.0] * 2)
    assert sign_flip_p(differences, rng()) == pytest.approx(mcnemar_p(2, 8), rel=1e-12)


def test_holm_by_hand():
    """Four tests, smallest times four, and so on; never below one before, in the order given."""
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.5, 0.9]) == [1.0, 1.0]
    assert holm([]) == []


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20))
def test_holm_lies_between_the_plain_p_and_bonferronis(p_values):
    for plain, adjusted in zip(p_values, holm(p_values), strict=True):
        assert plain - 1e-15 <= adjusted <= min(1.0, plain * len(p_values)) + 1e-15


def test_pairs_needed_by_hand():
    """(1.95996 + 0.84162)^2 * sd^2 / mean^2 = 7.8489 / effect^2.

    Half a deviation needs 32 pairs.
    """
    differences = rng(1).normal(0.0, 1.0, 50)
    standard = (differences - differences.mean()) / differences.std(ddof=1)
    assert pairs_needed(standard + 0.5) == 32
    assert pairs_needed(standard + 0.1) == 785
    assert pairs_needed(np.array([1.0])) is None
    assert pairs_needed(np.array([0.0, 3.0])) == 16  # 7.8489 * 4.5 / 2.25
    assert pairs_needed(np.array([9.0, 10.0])) == 6  # 0.04, but no test finds it with five


@pytest.mark.parametrize(("family", "fewest"), [(1, 6), (2, 7), (3, 7), (10, 9), (100, 12)])
def test_fewer_missions_find_nothing_however_large(family, fewest):
    """Differences of one sign have the least p value that there is."""
    least = [family * sign_flip_p(np.arange(1.0, n + 1.0), rng()) for n in (fewest - 1, fewest)]
    assert least[0] >= SURE > least[1]
    assert fewest_missions(family) == fewest


@pytest.mark.parametrize("repeats", [1, 3])
def test_of_too_few_missions_nothing_is_called_detectable(repeats):
    for n in (2, 5, 6, 8, 9):
        second = np.repeat(100.0 + np.arange(n), repeats)
        clusters = np.repeat(np.arange(n), repeats)
        alone = compare_pairs(np.zeros(n * repeats), second, clusters, rng())
        assert (alone.detectable is not None) == (n >= 6)
        assert alone.needed == 6 * repeats
        ten = alone.in_family(10)
        assert (ten.detectable is not None) == (n >= 9)
        assert ten.needed == 9 * repeats
        assert (ten.p, ten.difference) == (alone.p, alone.difference)


def test_pairs_needed_gives_the_power_it_says():
    template = rng(2).normal(0.0, 1.0, 500)
    template = (template - template.mean()) / template.std(ddof=1) + 0.4
    n = pairs_needed(template)
    draws = rng(3).normal(0.4, 1.0, (2000, n))
    t = draws.mean(axis=1) / (draws.std(axis=1, ddof=1) / np.sqrt(n))
    assert np.mean(np.abs(t) > 1.96) == pytest.approx(0.8, abs=0.03)


def test_repeated_missions_need_as_many_pairs_more():
    """Every mission driven twice alike: twice the pairs for the same knowledge."""
    differences = rng(4).normal(0.5, 1.0, 100)
    twice, missions = np.repeat(differences, 2), np.repeat(np.arange(100), 2)
    assert pairs_needed(twice, missions) == pytest.approx(2 * pairs_needed(differences), abs=2)


def test_interval_and_test_agree_on_a_clear_difference():
    first = rng(5).normal(10.0, 3.0, 80)
    result = compare_pairs(first, first + rng(6).normal(1.0, 0.5, 80), np.arange(80), rng())
    assert 0.8 < result.difference.low < result.difference.value < result.difference.high < 1.2
    assert result.p < 0.001
    assert result.needed < 10


def test_patterns_in_small_blocks_are_the_same_patterns(monkeypatch):
    differences = rng(3).normal(0.05, 1.0, 60)
    whole = sign_flip_p(differences, rng())
    monkeypatch.setattr("harness.statistics.paired.SIGNS_AT_ONCE", 1000)
    assert sign_flip_p(differences, rng()) == whole


def test_what_is_alike_within_the_resolution_does_not_decide_the_test():
    """Three of sixteen missions differ.

    Whatever the others' trifles, one in four patterns is as far out.
    """
    trifles = np.full(16, 1e-4)
    trifles[:3] = 70.0, 60.0, 30.0
    cents = compare_pairs(np.zeros(16), trifles, np.arange(16), rng(1), resolution=0.01)
    assert cents.p == pytest.approx(0.25, abs=0.02)
    assert compare_pairs(np.zeros(16), trifles, np.arange(16), rng(1)).p < 0.001
    assert cents.difference.value == pytest.approx(trifles.mean())

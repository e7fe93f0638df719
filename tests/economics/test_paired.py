"""Comparisons of paired values against textbook answers, scipy and brute force."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binomtest, t, ttest_1samp

from harness.statistics.interval import SIGNIFICANCE, fewest_missions
from harness.statistics.paired import compare_pairs, holm, together
from harness.statistics.sign_flips import flip_signs


def rng(seed=0):
    return np.random.default_rng(seed)


def sign_flip_p(differences, generator, clusters=None):
    return flip_signs(differences, generator, clusters).p


def compared(differences, clusters=None):
    numbers = np.arange(len(differences)) if clusters is None else clusters
    return compare_pairs(np.zeros(len(differences)), np.asarray(differences, float), numbers, rng())


def test_darwins_maize():
    """Fisher 1935, The Design of Experiments, section 21.

    863 of the 32768 sign patterns are as far on one side.
    """
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
    """A difference that all missions share is as far out as two patterns, or as no random one."""
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


@pytest.mark.parametrize(
    ("losses", "gains", "alike"), [(2, 8, 2), (0, 6, 3), (1, 9, 40), (9, 31, 0)]
)
def test_sign_flips_of_shares_are_mcnemars(losses, gains, alike):
    """The sign test of the pairs that disagree (McNemar 1947)."""
    differences = np.repeat([-1.0, 1.0, 0.0], (losses, gains, alike))
    expected = binomtest(losses, losses + gains, 0.5).pvalue
    is_exact = losses + gains <= 12
    tolerance = 1e-12 if is_exact else 0.002
    assert sign_flip_p(differences, rng()) == pytest.approx(expected, abs=tolerance)


def test_holm_by_hand():
    """Four tests, smallest times four, and so on; never below one before, in the order given."""
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.5, 0.9]) == [1.0, 1.0]
    assert holm([]) == []


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20))
def test_holm_lies_between_the_plain_p_and_bonferronis(p_values):
    for plain, adjusted in zip(p_values, holm(p_values), strict=True):
        assert plain - 1e-15 <= adjusted <= min(1.0, plain * len(p_values)) + 1e-15


def differences_of(kind, seed):
    """Paired differences of some missions, and the missions' numbers, as deliveries have them."""
    draws = rng(seed)
    n = int(draws.integers(1, 60))
    _, missions = np.unique(draws.integers(0, draws.integers(1, n + 1), n), return_inverse=True)
    shift = draws.uniform(-1.0, 1.0)
    made = {
        "normal": lambda: draws.normal(shift, 1.0, n),
        "shares": lambda: draws.choice([-1.0, 0.0, 1.0], n, p=(0.1, 0.4, 0.5)),
        "rare disasters": lambda: np.where(draws.random(n) < 0.1, -30.0, shift * draws.random(n)),
        "cents": lambda: 0.1 * draws.integers(-3, 5, n),
        "alike": lambda: np.full(n, round(shift, 1)),
    }
    return made[kind](), missions


@pytest.mark.parametrize("kind", ["normal", "shares", "rare disasters", "cents", "alike"])
def test_an_interval_includes_zero_exactly_where_nothing_is_significant(kind):
    for seed in range(25):
        differences, missions = differences_of(kind, seed)
        for clusters in (missions, np.arange(differences.size)):
            found = flip_signs(differences, rng(seed), clusters)
            for tests in (1, 2, 5):
                span = found.interval(tests)
                is_open = span.low is None or span.low <= 0.0 <= span.high
                assert is_open == (tests * found.p >= SIGNIFICANCE), (seed, tests, span)
                assert span.low is None or span.low <= span.value <= span.high


@pytest.mark.parametrize("n", [9, 40])
def test_a_mean_is_rejected_just_beyond_the_end_of_the_interval(n):
    """Rows whose p lies just above and just below 0.05."""
    differences = rng(n).normal(0.0, 1.0, n)
    for end in (compared(differences).difference.low, compared(differences).difference.high):
        away = 1e-9 * np.sign(end - differences.mean())
        inside, outside = compared(differences - end + away), compared(differences - end - away)
        assert inside.p >= SIGNIFICANCE > outside.p > 0.75 * SIGNIFICANCE
        assert (inside.is_significant, outside.is_significant) == (False, True)
        assert (inside.difference.sign == 0) and outside.difference.sign == -np.sign(away)


def test_the_interval_is_near_the_t_distributions_on_normal_data():
    differences = rng(3).normal(0.3, 1.0, 60)
    half = t.ppf(0.975, 59) * differences.std(ddof=1) / np.sqrt(60)
    span = compared(differences).difference
    ends = (differences.mean() - half, differences.mean() + half)
    assert (span.low, span.high) == pytest.approx(ends, abs=0.02)


def test_the_interval_of_few_missions_holds_the_mean_as_often_as_it_says():
    held = 0
    for seed in range(400):
        span = compared(rng(seed).normal(2.0, 1.0, 8)).difference
        held += span.low <= 2.0 <= span.high
    assert held / 400 == pytest.approx(0.95, abs=0.03)


@settings(deadline=None, max_examples=30)
@given(st.lists(st.floats(0.0, 4.0), min_size=1, max_size=8), st.integers(0, 100))
def test_a_familys_intervals_say_what_holms_method_does(shifts, seed):
    pairs = [compared(rng((seed, k)).normal(shift, 2.0, 15)) for k, shift in enumerate(shifts)]
    adjusted = holm([pair.p for pair in pairs])
    for pair, alone, p_holm in zip(together(pairs), pairs, adjusted, strict=True):
        assert (pair.p, pair.p_holm) == (alone.p, p_holm)
        assert pair.is_significant == (p_holm < SIGNIFICANCE) == bool(pair.difference.sign)
        assert pair.difference.low <= alone.difference.low
        assert pair.needed >= alone.needed and pair.detectable >= alone.detectable


def test_where_no_pair_differs_there_is_nothing_to_adjust_for():
    alike, found = compared(np.zeros(20)), compared(rng(1).normal(1.0, 1.0, 20))
    together_with_it = together([alike, found])
    assert [each.p_holm for each in together_with_it] == [1.0, found.p]
    assert not together_with_it[0].is_significant


def test_others_of_a_family_count_as_if_they_found_nothing():
    pairs = [compared(rng((seed, 9)).normal(1.0, 2.0, 15)) for seed in range(3)]
    dull = [compared(np.array([1.0, -1.0] * 8)) for _ in range(3)]
    found = together(pairs, others=3)
    assert [each.p_holm for each in found] == [
        each.p_holm for each in together([*pairs, *dull])[:3]
    ]
    assert together(pairs[:1], others=2)[0].p_holm == pytest.approx(min(1.0, 3.0 * pairs[0].p))


def standardized(seed, n):
    values = rng(seed).normal(0.0, 1.0, n)
    return (values - values.mean()) / values.std(ddof=1)


def test_pairs_needed_by_hand():
    """(1.95996 + 0.84162)^2 * sd^2 / mean^2 = 7.8489 / effect^2.

    Half a deviation needs 32 pairs.
    """
    standard = standardized(1, 50)
    assert compared(standard + 0.5).needed == 32
    assert compared(standard + 0.1).needed == pytest.approx(785, rel=0.2)
    assert compared([1.0]).needed is None
    assert compared(np.arange(9.0, 15.0)).needed == 6  # 0.2, but no test finds it with five


def test_what_is_not_significant_needs_more_missions_than_there_are():
    for seed in range(100):
        found = compared(rng(seed).normal(rng(seed).uniform(0.0, 2.0), 1.0, 7))
        assert found.is_significant or found.needed is None or found.needed > 7


def test_smallest_detectable_by_hand():
    """(1.95996 + 0.84162) * sd / sqrt(n)."""
    found = compared(3.0 * standardized(1, 50) + 7.0).detectable
    assert found == pytest.approx(2.801585 * 3.0 / np.sqrt(50.0), rel=1e-6)
    assert compared([1.0, 3.0] * 3).detectable == pytest.approx(2.801585 * np.sqrt(0.2), rel=1e-6)
    assert compared([1.0]).detectable is compared(np.full(20, 2.5)).detectable is None


def test_the_smallest_detectable_difference_needs_as_many_pairs_as_there_are():
    differences = standardized(2, 60)
    found = compared(differences).detectable
    assert compared(differences + 0.999 * found).needed == 61
    assert compared(differences + 1.001 * found).needed == 60


@pytest.mark.parametrize(("n", "effect"), [(50, 0.4), (100, 0.28)])
def test_power_is_what_it_says(n, effect):
    """As many pairs as are needed find a difference of the detectable size four times in five."""
    needed = compared(standardized(2, 500) + effect).needed
    assert needed == pytest.approx(n, abs=1)
    assert compared(standardized(3, needed)).detectable == pytest.approx(effect, rel=0.02)
    draws = rng(3).normal(effect, 1.0, (2000, needed))
    distances = draws.mean(axis=1) / (draws.std(axis=1, ddof=1) / np.sqrt(needed))
    assert np.mean(np.abs(distances) > 1.96) == pytest.approx(0.8, abs=0.03)


@pytest.mark.parametrize(("family", "fewest"), [(1, 6), (2, 7), (3, 7), (10, 9), (100, 12)])
def test_fewer_missions_find_nothing_however_large(family, fewest):
    """Differences of one sign have the least p value that there is."""
    assert fewest_missions(family) == fewest
    for n in (fewest - 1, fewest):
        found = flip_signs(np.arange(1.0, n + 1.0), rng())
        assert (family * found.p < SIGNIFICANCE) == (n == fewest)
        assert (found.interval(family).low is not None) == (n == fewest)


@pytest.mark.parametrize("repeats", [1, 3])
def test_of_too_few_missions_nothing_is_called_detectable(repeats):
    for n in (2, 5, 6, 8, 9):
        differences = np.repeat(100.0 + np.arange(n), repeats)
        alone = compared(differences, np.repeat(np.arange(n), repeats))
        assert (alone.detectable is not None) == alone.is_significant == (n >= 6)
        ten = together([alone] * 10)[0]  # the others are tested as fewer
        assert (ten.detectable is not None) == ten.is_significant == (n >= 9)
        assert ten.needed == 9 * repeats and alone.needed == 6 * repeats


def test_repeated_missions_need_as_many_pairs_more():
    """Every mission driven twice alike: twice the pairs for the same knowledge."""
    differences = rng(4).normal(0.5, 1.0, 100)
    once = compared(differences)
    twice = compared(np.repeat(differences, 2), np.repeat(np.arange(100), 2))
    assert twice.needed == pytest.approx(2 * once.needed, abs=2)
    assert twice.detectable == pytest.approx(once.detectable, rel=1e-12)
    assert twice.difference.low == pytest.approx(once.difference.low, rel=1e-12)


def test_patterns_in_small_blocks_are_the_same_patterns(monkeypatch):
    differences = rng(3).normal(0.05, 1.0, 60)
    whole = sign_flip_p(differences, rng())
    monkeypatch.setattr("harness.statistics.sign_flips.SIGNS_AT_ONCE", 1000)
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
    assert cents.difference.value == pytest.approx(10.0)

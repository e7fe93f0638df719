"""The cluster bootstrap, the mean of the worst, and what both promise."""

import numpy as np
import pytest

from harness.statistics.bootstrap import (
    blocks,
    bootstrap_cvar,
    bootstrap_mean,
    cvar,
    kept_draw,
    number_clusters,
    resampled_means,
)
from harness.statistics.interval import Interval


def rng(seed=0):
    return np.random.default_rng(seed)


def test_missions_that_occur_once_give_the_plain_bootstrap():
    values = rng(1).gamma(2.0, 3.0, 40)
    assert bootstrap_mean(values, rng(7), clusters=np.arange(40)) == bootstrap_mean(values, rng(7))


def test_clusters_are_drawn_as_a_whole():
    """Slow loop over the same draws: all deliveries of a drawn mission, of whatever number."""
    values, missions = np.array([1.0, 2.0, 4.0, 8.0, 16.0, 32.0]), np.array([0, 0, 1, 2, 2, 2])
    draws, expected = rng(3).integers(0, 3, (200, 3)), []
    for drawn in draws:
        resample = np.concatenate([values[missions == cluster] for cluster in drawn])
        expected.append(resample.mean())
    means = resampled_means(values[:, np.newaxis], rng(3), 200, missions)[:, 0]
    assert means == pytest.approx(np.array(expected))


def test_columns_share_their_resamples_and_skip_what_is_undefined():
    a, b = rng(1).normal(0.0, 1.0, (2, 30))
    holes = np.where(np.arange(30) < 20, a, np.nan)
    means = resampled_means(np.column_stack((a, b, a + b, holes)), rng(2), 100)
    assert means[:, 0] + means[:, 1] == pytest.approx(means[:, 2])
    drawn = rng(2).integers(0, 30, (100, 30))
    assert means[:, 3] == pytest.approx(np.array([np.nanmean(holes[row]) for row in drawn]))


def test_one_mission_for_all_lets_deliveries_stand_for_themselves():
    assert number_clusters(["x"] * 3).tolist() == [0, 1, 2]
    assert number_clusters(["b", "a", "b", "c"]).tolist() == [0, 1, 0, 2]
    assert number_clusters([]).size == 0


def test_each_value_needs_a_cluster():
    with pytest.raises(ValueError, match="2 clusters for 3 values"):
        bootstrap_mean([1.0, 2.0, 3.0], rng(), clusters=np.array([0, 1]))


@pytest.mark.parametrize(
    ("weights", "draws", "sizes"),
    [
        (40, 1200, [500, 500, 200]),
        (40, 0, []),
        # 200 million weights are 5000 resamples, 10 million of a block are 250
        (40_000, 10_000, [250] * 20),
        (10**6, 10_000, [10] * 100),  # 1000 are the least
        (10**6, 15, [10, 5]),
        (10**8, 2, [1, 1]),
    ],
)
def test_resamples_are_drawn_in_blocks_that_fit_into_the_memory(weights, draws, sizes):
    assert list(blocks(weights, draws)) == sizes


@pytest.mark.parametrize(("columns", "is_kept"), [(1000, True), (1001, False)])
def test_draws_of_up_to_a_million_numbers_are_kept(columns, is_kept):
    calls = []

    def draw(generator, rows, columns):
        calls.append((rows, columns))
        return generator.random((rows, columns))

    first, again = rng(5), rng(5)
    assert (kept_draw(draw, first, 1000, columns) == kept_draw(draw, again, 1000, columns)).all()
    assert calls == [(1000, columns)] * (1 if is_kept else 2)
    assert first.random() == again.random() != rng(5).random(), (
        "the generator leaves as if it had drawn"
    )


def test_cvar_by_hand():
    values = np.arange(1.0, 101.0)
    assert cvar(values) == pytest.approx(98.0)  # mean of 96..100
    assert cvar(values[:30]) == pytest.approx((30.0 + 0.5 * 29.0) / 1.5)  # 1.5 values
    assert cvar([5.0, 1.0]) == 5.0  # a tenth of a value
    assert cvar([3.0, 1.0, 2.0, 4.0], 0.5) == pytest.approx(3.5)


def test_cvar_of_the_normal_distribution():
    """phi(z) / 0.05 = 2.0627 standard deviations above the mean (Rockafellar and Uryasev 2000)."""
    assert cvar(rng(1).normal(0.0, 1.0, 400_000)) == pytest.approx(2.0627, abs=0.02)


def test_cvar_bootstrap_equals_a_slow_loop():
    values, missions = rng(1).gamma(1.0, 5.0, 60), np.repeat(np.arange(10), 6)
    interval = bootstrap_cvar(values, rng(4), draws=300, level=0.9, clusters=missions)
    drawn = rng(4).integers(0, 10, (300, 10))
    slow = [cvar(np.concatenate([values[missions == c] for c in row]), 0.9) for row in drawn]
    assert interval.value == pytest.approx(cvar(values, 0.9))
    assert (interval.low, interval.high) == pytest.approx(tuple(np.quantile(slow, (0.025, 0.975))))


@pytest.mark.parametrize(("n", "has_bounds"), [(1, False), (99, False), (100, True)])
def test_a_tail_of_a_few_deliveries_has_no_interval(n, has_bounds):
    interval = bootstrap_cvar(rng(1).gamma(2.0, 1.0, n), rng(2), draws=100)
    assert interval.value is not None
    assert (interval.low is not None) is has_bounds


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say():
    """100 missions of 1 to 4 deliveries that share a mission's luck, 1000 replications.

    In 93 to 97 of 100.
    """
    world = rng(8)
    sizes = world.integers(1, 5, 100)
    missions = np.repeat(np.arange(100), sizes)
    held = narrow = 0
    for _ in range(1000):
        values = 3.0 + world.normal(0.0, 1.0, 100)[missions] + world.normal(0.0, 0.5, missions.size)
        interval = bootstrap_mean(values, world, draws=400, clusters=missions)
        plain = bootstrap_mean(values, world, draws=400)
        held += interval.low <= 3.0 <= interval.high
        narrow += plain.low <= 3.0 <= plain.high
    assert 0.93 <= held / 1000 <= 0.97
    assert narrow / 1000 < 0.90  # deliveries taken for missions claim to know more than they do


def test_a_difference_taken_the_other_way_round_has_its_bounds_swapped():
    assert Interval(2.0, -1.0, 5.0, 9).negated == Interval(-2.0, -5.0, 1.0, 9)
    assert Interval(2.0, None, None, 9).negated == Interval(-2.0, None, None, 9)

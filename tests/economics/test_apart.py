"""The difference of means of unequal samples, and how many of each tell it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from harness.statistics.apart import Sample, cheapest_sizes, difference_apart
from harness.statistics.paired import z_of_power
from harness.statistics.unseen import Reach

REACH = Reach(3.5, 62.0)


def sample(values: np.ndarray, first: int = 0) -> Sample:
    """Deliveries of as many missions, numbered from ``first``; nothing earns more than 3.5."""
    return Sample(values, np.arange(first, first + len(values)), 3.5, REACH)


def hits(rng: np.random.Generator, count: int, rate: float = 0.1) -> np.ndarray:
    return 3.5 - 58.0 * (rng.random(count) < rate)


def width(first: Sample, second: Sample) -> float:
    found = difference_apart(first, second, np.random.default_rng(0))
    assert found.low is not None and found.high is not None
    return found.high - found.low


def test_it_is_the_difference_of_all_values() -> None:
    rng = np.random.default_rng(1)
    first, second = sample(hits(rng, 400)), sample(np.full(60, 3.5))
    found = difference_apart(first, second, rng)
    assert found.value == pytest.approx(3.5 - first.values.mean())
    assert found.low is not None and found.high is not None
    assert 0.0 < found.low < found.value < found.high
    assert found.n == 400


def test_a_mission_that_both_drove_weighs_alike_for_both() -> None:
    """What is common to both cancels where they are of the same missions."""
    rng = np.random.default_rng(2)
    common = hits(rng, 300)
    first, same, other = sample(common), sample(common - 1.0), sample(common - 1.0, first=300)
    narrow = Reach(1.0, 1.0)
    first, same, other = (
        Sample(each.values, each.missions, 3.5, narrow) for each in (first, same, other)
    )
    assert width(first, same) < 0.5 * width(first, other)


def test_a_sample_without_a_loss_admits_one() -> None:
    few, many = sample(np.full(20, 3.5)), sample(np.full(500, 3.5), first=20)
    found = difference_apart(many, few, np.random.default_rng(3))
    assert found.value == 0.0
    assert found.low is not None and found.high is not None
    assert -found.low > 5.0 * found.high > 0.0
    assert few.spread > 4.0 * many.spread > 0.0


def test_intervals_hold_the_difference() -> None:
    """Of 400 and 80 deliveries with hits, in 200 studies."""
    rng, held = np.random.default_rng(4), 0
    for _ in range(200):
        first, second = sample(hits(rng, 400, 0.1)), sample(hits(rng, 80, 0.05), first=200)
        found = difference_apart(first, second, rng, 1000)
        assert found.low is not None and found.high is not None
        held += found.low <= 58.0 * 0.05 <= found.high
    assert held >= 186


def test_dear_values_are_few() -> None:
    error = 1.0 / z_of_power()
    first, second = cheapest_sizes((20.0, 4.0), (2.0, 8.0), error)
    assert 400.0 / first + 16.0 / second == pytest.approx(error**2, rel=0.01)
    best = 2.0 * first + 8.0 * second
    for other in (first // 2, 2 * first):
        left = error**2 - 400.0 / other
        if left > 0.0:
            assert 2.0 * other + 8.0 * math.ceil(16.0 / left) > best


def test_the_other_way_round_it_has_the_other_sign() -> None:
    rng = np.random.default_rng(4)
    first, second = sample(hits(rng, 30)), sample(hits(rng, 40), first=10)
    found = difference_apart(first, second, np.random.default_rng(0), 500)
    assert difference_apart(second, first, np.random.default_rng(0), 500) == found.negated
    turned = [replace(each, missions=49 - each.missions) for each in (first, second)]
    assert difference_apart(*turned, np.random.default_rng(0), 500) == found, "other numbers"


def test_no_difference_has_no_sign_either_way_round() -> None:
    few, many = sample(np.full(20, 3.5)), sample(np.full(50, 3.5), first=20)
    for pair in ((few, many), (many, few)):
        value = difference_apart(*pair, np.random.default_rng(0), 500).value
        assert value == 0.0 and not np.signbit(value)

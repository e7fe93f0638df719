"""Deliveries of two arms against the closed formula, and against trying every number."""

import math

import numpy as np
import pytest

from harness.statistics.allocation import Sample, cheaper_design
from harness.statistics.paired import z_of_power

HITS = 3  # no floor is needed


@pytest.mark.parametrize(
    ("sds", "costs"),
    [((20.0, 2.0), (1.0, 1.0)), ((20.0, 5.0), (2.0, 18.0)), ((3.0, 3.0), (1.0, 9.0))],
)
def test_uncorrelated_arms_take_the_least_time(
    sds: tuple[float, float], costs: tuple[float, float]
) -> None:
    arms = [Sample(sd, cost, 100, HITS) for sd, cost in zip(sds, costs, strict=True)]
    found = cheaper_design(*arms, correlation=0.0, difference=1.0, loss=58.0)
    shared = (
        sum(sd * math.sqrt(cost) for sd, cost in zip(sds, costs, strict=True)) * z_of_power() ** 2
    )
    expected = [
        math.ceil(shared * sd / math.sqrt(cost)) for sd, cost in zip(sds, costs, strict=True)
    ]
    assert not found.is_paired and [found.first, found.second] == expected
    first = np.arange(1, 40_000)
    left = 1.0 / z_of_power() ** 2 - sds[0] ** 2 / first
    second = np.where(left > 0.0, sds[1] ** 2 / np.where(left > 0.0, left, 1.0), np.inf)
    least = (first * costs[0] + second * costs[1]).min()
    assert least <= found.seconds <= least + sum(costs)


def test_arms_that_vary_together_are_paired() -> None:
    arm = Sample(10.0, 2.0, 100, HITS)
    found = cheaper_design(arm, arm, correlation=0.9, difference=1.0, loss=58.0)
    pairs = math.ceil(20.0 * z_of_power() ** 2)  # 2 sd^2 (1 - 0.9)
    assert found.is_paired and found.first == found.second == pairs
    assert found.seconds == 4.0 * pairs


@pytest.mark.parametrize("n", [10, 100, 1000])
def test_an_arm_without_hits_has_those_that_may_be_missing(n: int) -> None:
    rate = 1.0 - 0.05 ** (1.0 / n)
    expected = math.sqrt(4.0 + 58.0**2 * rate * (1.0 - rate))
    assert Sample(2.0, 1.0, n, 0).floored(58.0) == pytest.approx(expected)
    assert rate == pytest.approx(3.0 / n, rel=0.15)
    assert Sample(2.0, 1.0, n, 1).floored(58.0) == 2.0


@pytest.mark.parametrize(("difference", "cost"), [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0)])
def test_nothing_to_find_or_to_pay_is_refused(difference: float, cost: float) -> None:
    arm = Sample(1.0, cost, 10, 1)
    with pytest.raises(ValueError, match="above 0"):
        cheaper_design(arm, arm, 0.0, difference, 58.0)

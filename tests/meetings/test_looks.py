"""The bound at all looks, and the missions at which there are any."""

import itertools

import numpy as np
import pytest

from harness.meetings.drive import ArmDrive, Weighed
from harness.meetings.looks import (
    FIRST,
    NUMBERS,
    MeetingLooks,
    bound_at,
    expected_bound,
    family_at,
)
from harness.meetings.mission import MissionDrive
from harness.meetings.results import unseen_loss
from harness.statistics.interval import Interval


def mission(episode: int, difference: float, weight: float = 0.01) -> MissionDrive:
    """A mission with one meeting in which the first arm loses ``difference`` [USD]."""
    old = ArmDrive({}, 3.0, 0.0, (Weighed(weight, difference / weight, 0, 0),))
    new = ArmDrive({}, 3.0, 0.0, (Weighed(weight, 0.0, 0, 0),))
    strata = np.zeros(1, dtype=np.int64)
    return MissionDrive(episode, np.ones(15), strata, np.array([weight]), (old, new))


def bounds(low: Interval) -> tuple[float, float]:
    assert low.low is not None and low.high is not None
    return low.low, low.high


def test_all_looks_together_err_with_five_percent() -> None:
    assert sum(1.0 / family_at(look) for look in range(1, len(NUMBERS) + 1)) <= 1.0
    assert NUMBERS[0] == FIRST and all(a < b for a, b in itertools.pairwise(NUMBERS))


def test_there_is_no_bound_before_the_first_look() -> None:
    looks = MeetingLooks(0)
    for episode in range(FIRST - 1):
        looks.add(mission(episode, -5.0 - episode))
        assert looks.bound.value is None
    looks.add(mission(FIRST, -5.0))
    assert looks.missions == looks.bound.n == FIRST
    low, high = bounds(looks.bound)
    assert low < -7.6 < high < 0.0
    looks.add(mission(FIRST + 1, 500.0))
    assert bounds(looks.bound) == (low, high)  # the next look comes later


def test_a_hit_that_nobody_has_seen_is_admitted() -> None:
    """However alike the arms were so far, heavy meetings may hide a difference."""
    light = bound_at(1, np.zeros(8), 0.001, 0)
    heavy = bound_at(1, np.zeros(8), 0.2, 0)
    assert bounds(heavy)[1] == pytest.approx(unseen_loss(0.2, 8, 2))
    assert bounds(heavy)[1] > 100.0 * bounds(light)[1] > 0.0


def test_no_difference_is_seldom_called_one() -> None:
    """The errors of all looks together, with differences as skewed as those of hits: 400 checks."""
    rng, wrong = np.random.default_rng(11), 0
    for _ in range(400):
        values = 3.0 - rng.gamma(0.5, 6.0, NUMBERS[6])
        looks = (
            bounds(bound_at(number, values[:size], 0.12, 0))
            for number, size in enumerate(NUMBERS[:7], 1)
        )
        wrong += any(low > 0.0 or high < 0.0 for low, high in looks)
    assert wrong <= 28  # 5 % and two standard deviations


def test_the_bound_to_expect_is_the_one_that_comes() -> None:
    rng = np.random.default_rng(3)
    values = rng.normal(-2.0, 3.0, 200)
    size = NUMBERS[10]
    ahead = bounds(expected_bound(size, values, 0.01))
    there = bounds(bound_at(11, values[:size], 0.01, 0))
    assert there[1] - there[0] == pytest.approx(ahead[1] - ahead[0], rel=0.25)

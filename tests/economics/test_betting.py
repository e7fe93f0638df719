"""The bound that holds at every look, on heavy-tailed differences of bounded reach."""

from collections.abc import Callable

import numpy as np
import pytest

from harness.statistics.betting import WON, bound_at_every_look, capital_after_each
from navstack.types import FloatArray

REACH = 100.0
Drawn = Callable[[np.random.Generator, int], FloatArray]


def hits(rng: np.random.Generator, n: int) -> FloatArray:
    """A rare hit of either side's robot, which costs 58; the mean is 0."""
    return -58.0 * (rng.random(n) < 0.11) + 58.0 * (rng.random(n) < 0.11)


def disasters(rng: np.random.Generator, n: int) -> FloatArray:
    """A small gain, and a loss of 95 in one of 20: the mean is 0, and is missed for long."""
    return np.where(rng.random(n) < 0.05, -95.0, 5.0)


def tails(rng: np.random.Generator, n: int) -> FloatArray:
    """Of infinite variance but for the reach, which both sides share: the mean is 0."""
    return rng.standard_t(1.5, n) * 10.0


@pytest.mark.parametrize("drawn", [hits, disasters, tails])
def test_looking_after_every_mission_misses_the_mean_in_at_most_one_check_of_twenty(
    drawn: Drawn,
) -> None:
    rng = np.random.default_rng(5)
    checks, missions = 500, 300
    missed = 0
    for values in drawn(rng, checks * missions).reshape(checks, missions):
        shares = (np.clip(values, -REACH, REACH) + REACH) / (2.0 * REACH)
        both = capital_after_each(shares, 0.5), capital_after_each(1.0 - shares, 0.5)
        missed += max(capital.max() for capital in both) > WON
    assert 0 < missed <= 0.05 * checks


@pytest.mark.parametrize("n", [3, 20, 100])
def test_the_bound_ends_where_the_capital_is_forty(n: int) -> None:
    values = hits(np.random.default_rng(n), n)
    bound = bound_at_every_look(values, REACH)
    shares = (values + REACH) / (2.0 * REACH)
    low, high = ((end + REACH) / (2.0 * REACH) for end in (bound.low, bound.high))
    assert capital_after_each(shares, low)[-1] == pytest.approx(WON, abs=1e-2)
    assert capital_after_each(1.0 - shares, 1.0 - high)[-1] == pytest.approx(WON, abs=1e-2)
    assert np.exp(WON) == pytest.approx(40.0)


def test_a_difference_is_found_and_its_bound_narrows() -> None:
    values = hits(np.random.default_rng(2), 900) - 5.0
    few, many = (bound_at_every_look(values[:n], REACH) for n in (60, 900))
    assert few.low < 0.0 < few.high and many.high < 0.0 and many.low < -5.0 < many.high
    assert many.high - many.low < 0.5 * (few.high - few.low)
    assert many.value == pytest.approx(values.mean())


def test_missions_without_a_difference_do_not_exclude_a_rare_disaster() -> None:
    """400 of them leave the rule of three's 3 / 400 of the reach, and a little for every look."""
    bound = bound_at_every_look(np.zeros(400), REACH)
    assert bound.low == pytest.approx(-bound.high)
    assert 0.75 < bound.high < 2.0


def test_what_lies_beyond_the_reach_counts_as_the_reach() -> None:
    values = np.array([5.0, -1000.0, 3.0, 250.0] * 10)
    assert bound_at_every_look(values, REACH) == bound_at_every_look(
        np.clip(values, -REACH, REACH), REACH
    )


def test_more_of_the_same_is_foreseen_exactly() -> None:
    values = hits(np.random.default_rng(1), 50)
    foreseen, driven = (
        bound_at_every_look(values, REACH, 4.0),
        bound_at_every_look(np.tile(values, 4), REACH),
    )
    assert (foreseen.low, foreseen.high) == pytest.approx((driven.low, driven.high), abs=1e-4)


@pytest.mark.parametrize("value", [-REACH, REACH])
def test_values_at_a_limit_leave_the_bound_there(value: float) -> None:
    bound = bound_at_every_look(np.full(30, value), REACH)
    assert bound.value == value
    end = bound.low if value < 0.0 else bound.high
    assert end == pytest.approx(value, abs=1e-3)


def test_no_value_has_no_bound() -> None:
    assert bound_at_every_look(np.empty(0), REACH).low is None

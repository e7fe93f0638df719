"""Margins of stored runs with intervals that admit an unseen loss."""

import math
from collections.abc import Callable, Iterable

import numpy as np

from harness.economics.accountings import PUBLISHED
from harness.economics.prices import Prices
from harness.economics.unseen import (
    contact_limits,
    difference_admitting_unseen,
    margin_admitting_unseen,
    reach_of_loss,
)
from harness.economics.valuation import has_too_few, margins, missions
from harness.statistics.bootstrap import IntArray
from harness.statistics.interval import Interval
from harness.statistics.unseen import Reach
from harness.study.stored_run import StoredRun, StoredStack
from navstack.types import FloatArray

FIRST_GUESS, GUESSES = 100, 5  # values of an interval, and steps of the search for their number


def reach_of(run: StoredRun, prices: Prices | None = None, accounting: str = PUBLISHED) -> Reach:
    """What a delivery of a run could lose, at its prices or others, and in its world."""
    rows = (stack.rows for stack in run.stacks)
    limits = contact_limits(run.kept_condition("world"), run.kept_condition("rules"), rows)
    return reach_of_loss(prices or run.prices(), limits, accounting)


def widest(reaches: Iterable[Reach]) -> Reach:
    """From the least of some to the most."""
    found = list(reaches)
    return Reach(min(each.least for each in found), max(each.most for each in found))


def margin_with_unseen(run: StoredRun, stack: StoredStack) -> Interval | None:
    """The mean margin of a stack [USD/run].

    None: it is undefined, as the cargo was not simulated, or too many deliveries have no result.
    """
    margin = None
    if stack.rows and not has_too_few(len(stack.rows), stack.errors):
        margin = margins(stack.rows, run.prices())
    if margin is None:
        return None
    return margin_admitting_unseen(margin, reach_of(run), missions(stack.rows), run.seed)


def difference_with_unseen(
    first: StoredRun,
    second: StoredRun,
    differences: FloatArray,
    clusters: IntArray,
) -> Interval:
    """The mean margin difference [USD/run] of two runs, by the wider reach of both."""
    known = ~np.isnan(differences)
    reach = _wider(first, second)
    return difference_admitting_unseen(differences[known], reach, clusters[known], first.seed)


def missions_that_exclude(size: float, first: StoredRun, second: StoredRun) -> int:
    """Missions without any difference that exclude a mean margin difference of ``size`` [USD]."""
    reach = _wider(first, second)

    def farthest(n: int) -> float:
        alike = difference_admitting_unseen(np.zeros(n), reach, np.arange(n), first.seed)
        return max(abs(bound or 0.0) for bound in (alike.low, alike.high))

    return _until_within(size, farthest)


def deliveries_that_prove(margin: Interval, run: StoredRun) -> int | None:
    """Deliveries that all earn ``margin`` whose interval lies above zero.

    None: it is not positive.
    """
    value = margin.value
    if value is None or value <= 0.0:
        return None
    reach = reach_of(run)

    def below(n: int) -> float:
        alike = margin_admitting_unseen(np.full(n, value), reach, np.arange(n), run.seed)
        return value - (alike.low or 0.0)

    return _until_within(value, below)


def _wider(first: StoredRun, second: StoredRun) -> Reach:
    return widest((reach_of(first), reach_of(second)))


def _until_within(size: float, reached: Callable[[int], float]) -> int:
    """How many values there must be for an interval that then reaches no farther than ``size``.

    What one unseen value adds falls about as 1 / n, so that a few steps suffice.
    """
    n = FIRST_GUESS
    for _ in range(GUESSES):
        n = max(1, math.ceil(n * reached(n) / size))
    return n

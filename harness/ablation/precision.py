"""How many deliveries each arm needs until its margin is known as well as it shall be."""

import math

from harness.analysis.rare import margin_with_unseen
from harness.economics.valuation import has_too_few
from harness.statistics.interval import Interval
from harness.study.stored_run import StoredRun
from navstack.errors import InputError

FIRST = 24  # deliveries of each arm, at which it is judged for the first time
GROWTH = 2  # times as many as an arm has driven, at most, until it is judged again


def check_within(within: float | None) -> None:
    """Check how well [USD] a margin shall be known.

    Raises:
        InputError: it is not positive and finite.
    """
    if within is not None and not 0.0 < within < math.inf:
        raise InputError(f"--within {within:g}: give more than 0 USD")


def half_width(margin: Interval | None) -> float | None:
    """How far [USD] a margin may lie from its value, on the side where that is more.

    None: it is undefined, or nothing bounds it.
    """
    if margin is None or margin.value is None or margin.low is None or margin.high is None:
        return None
    return max(margin.high - margin.value, margin.value - margin.low)


def counts_wanted(run: StoredRun, within: float, most: int) -> dict[str, int]:
    """How many deliveries each arm is to have next, those included that it has.

    What ended in an error counts as driven. An arm whose margin is undefined drives no more, but
    where so few errors among ``most`` deliveries would leave it defined.

    Args:
        run: the deliveries so far.
        within: [USD] that a margin may lie off.
        most: deliveries of an arm.
    """
    wanted = {}
    for stack in run.stacks:
        driven = len(stack.rows) + stack.errors
        wanted[stack.name] = driven
        width = half_width(margin_with_unseen(run, stack))
        if width is None and stack.rows and not has_too_few(most - stack.errors, stack.errors):
            width = math.inf
        if width is not None:
            wanted[stack.name] = count_wanted(driven, width, within, most)
    return wanted


def count_wanted(driven: int, width: float, within: float, most: int) -> int:
    """How many deliveries an arm is to have next, those included that it has.

    Widths shrink with the root of the number. So an arm whose margin spreads twice as much drives
    four times as often; one that has lost nothing drives until a loss that nobody has seen would
    matter less than ``within``.

    Args:
        driven: deliveries.
        width: [USD] of :func:`half_width` after them.
        within: [USD] at most.
        most: deliveries.
    """
    if width <= within:
        return driven
    needed = math.ceil(driven * min((width / within) ** 2, GROWTH))
    return min(max(needed, driven + 1), most)

"""Margins of several stacks, each held against each other: one family of tests."""

import contextlib
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

from harness.analysis.compare import Comparison, compare
from harness.analysis.pairing import missions_of
from harness.analysis.side import Side
from harness.economics.cost_terms import MARGIN
from harness.statistics.paired import PairedDifference, together
from navstack.errors import InputError

EVERY_PAIR_UP_TO = 4  # stacks; with more, pairs not reported count as not significant


@dataclass(frozen=True, slots=True)
class Family:
    """Differences of margins that are tested together."""

    pairs: list[PairedDifference]  # of the reported comparisons, adjusted
    size: int  # tests in the family: pairs that differ, and pairs that were not compared


def as_one_family(told: Sequence[Comparison], sides: Sequence[Side]) -> Family:
    """Differences of margins, adjusted for all pairs that sides can be compared in (Holm).

    The reported pairs may have been selected among all pairs, so all pairs count as tests.

    Args:
        told: the comparisons to report, each with a margin.
        sides: all that have one.
    """
    reported = {_pair_of(each.first, each.second) for each in told}
    candidates = [(side, missions_of(side)) for side in sides]
    rest = []
    for (first, of_first), (second, of_second) in itertools.combinations(candidates, 2):
        if _pair_of(first, second) not in reported and not of_first.isdisjoint(of_second):
            rest.append((first, second))
    found = [each.differences[MARGIN].paired for each in told]
    others = len(rest)
    if len(sides) <= EVERY_PAIR_UP_TO:
        for first, second in rest:
            margin = _difference(first, second)
            if margin is not None:
                found.append(margin)
        others = 0
    size = sum(pair.differs for pair in found) + others
    return Family(together(found, others)[: len(told)], size)


def _difference(first: Side, second: Side) -> PairedDifference | None:
    with contextlib.suppress(InputError):  # no margin on what both drove
        return compare(first, second, [MARGIN]).differences[MARGIN].paired
    return None


def _pair_of(first: Side, second: Side) -> frozenset[int]:
    return frozenset((id(first.stack), id(second.stack)))

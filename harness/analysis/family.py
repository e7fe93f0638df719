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

EVERY_PAIR_UP_TO = 4  # stacks; of more, pairs that are not told count as if they found nothing


@dataclass(frozen=True, slots=True)
class Family:
    """Differences of margins that are tested together."""

    pairs: list[PairedDifference]  # of the comparisons that are told, adjusted
    size: int  # of the family: pairs that differ, or of which nobody looked whether they do


def as_one_family(told: Sequence[Comparison], sides: Sequence[Side]) -> Family:
    """Differences of margins, adjusted for all pairs that sides can be compared in (Holm).

    Who looks at several stacks may pick the best and the worst: that is all pairs' best chance.

    Args:
        told: the comparisons that are told, each with a margin.
        sides: all that have one.
    """
    known = {_pair_of(each.first, each.second) for each in told}
    missions = [missions_of(side) for side in sides]
    rest = [
        (sides[first], sides[second])
        for first, second in itertools.combinations(range(len(sides)), 2)
        if _pair_of(sides[first], sides[second]) not in known
        and not missions[first].isdisjoint(missions[second])
    ]
    found = [each.differences[MARGIN].paired for each in told]
    others = len(rest)
    if len(sides) <= EVERY_PAIR_UP_TO:
        found += [margin for pair in rest if (margin := _difference(*pair))]
        others = 0
    size = sum(pair.differs for pair in found) + others
    return Family(together(found, others)[: len(told)], size)


def _difference(first: Side, second: Side) -> PairedDifference | None:
    with contextlib.suppress(InputError):  # no margin on what both drove
        return compare(first, second, [MARGIN]).differences[MARGIN].paired
    return None


def _pair_of(first: Side, second: Side) -> frozenset[int]:
    return frozenset((id(first.stack), id(second.stack)))

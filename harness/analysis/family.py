"""Margins of several stacks, each held against each other: one family of tests."""

import contextlib
import itertools
from collections.abc import Sequence

from harness.analysis.compare import Comparison, compare
from harness.analysis.pairing import have_common_missions
from harness.analysis.side import Side
from harness.economics.cost_terms import MARGIN
from harness.statistics.paired import PairedDifference, together
from navstack.errors import InputError

EVERY_PAIR_UP_TO = 4  # stacks; of more, pairs that are not told count as if they found nothing


def as_one_family(told: Sequence[Comparison], sides: Sequence[Side]) -> list[PairedDifference]:
    """Differences of margins, adjusted for all pairs that sides can be compared in (Holm).

    Who looks at several stacks may pick the best and the worst: that is all pairs' best chance.

    Args:
        told: the comparisons that are told, each with a margin.
        sides: all that have one.
    """
    known = {_pair_of(each.first, each.second) for each in told}
    rest = [
        (first, second)
        for first, second in itertools.combinations(sides, 2)
        if _pair_of(first, second) not in known and have_common_missions(first, second)
    ]
    found = [each.differences[MARGIN].paired for each in told]
    if len(sides) > EVERY_PAIR_UP_TO:
        return together(found, len(rest))
    for first, second in rest:
        with contextlib.suppress(InputError):  # no margin on what both drove
            found.append(compare(first, second, [MARGIN]).differences[MARGIN].paired)
    return together(found)[: len(told)]


def _pair_of(first: Side, second: Side) -> frozenset[int]:
    return frozenset((id(first.stack), id(second.stack)))

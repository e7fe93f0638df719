"""The deliveries of two sides that are of the same missions."""

from collections.abc import Iterable, Sequence
from typing import Any

from harness.analysis.side import Side
from harness.economics.valuation import MISSION
from harness.metrics.columns import Row
from harness.storage.rows import take, values
from navstack.errors import InputError

PAIR = ("seed", "episode", *MISSION)  # columns in which two deliveries of one mission agree


def paired_rows(first: Side, second: Side) -> tuple[Sequence[Row], Sequence[Row]]:
    """The rows of both on the missions that both finished, in the same order.

    Raises:
        InputError: there is none; the message says if one of them finished nothing.
    """
    for side in (first, second):
        if not side.stack.rows:
            failed = ""
            if side.stack.errors:
                failed = f" ({side.stack.errors} ended in an error)"
            raise InputError(
                f"{side.label} has no finished delivery{failed}; there is nothing to compare"
            )
    pairs = _pair(first.stack.rows, second.stack.rows)
    if not pairs:
        raise InputError(
            f"{first.label} and {second.label} have no finished mission in common; run both with "
            "the same --seed, "
            "--map and --missions"
        )
    own, other = zip(*pairs, strict=True)
    return take(first.stack.rows, own), take(second.stack.rows, other)


def missions_of(side: Side) -> frozenset[tuple[Any, ...]]:
    """What identifies the missions that a side drove."""
    return frozenset(_keys(side.stack.rows))


def have_common_missions(first: Side, second: Side) -> bool:
    """Whether both drove one mission at least."""
    return bool(_pair(first.stack.rows, second.stack.rows))


def _pair(first: Sequence[Row], second: Sequence[Row]) -> list[tuple[int, int]]:
    """The numbers of the rows of either side that are of one mission."""
    others = {key: number for number, key in enumerate(_keys(second))}
    return [(number, others[key]) for number, key in enumerate(_keys(first)) if key in others]


def _keys(rows: Sequence[Row]) -> Iterable[tuple[Any, ...]]:
    return zip(*(values(rows, key) for key in PAIR), strict=True)

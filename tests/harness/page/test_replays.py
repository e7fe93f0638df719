"""Which deliveries a page replays."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.analysis.dearest import earned_of
from harness.report.page.replays import Recorded, chosen, has_dearest


def entry(margins: list[float] | None, injuries: tuple[float, ...] = ()) -> Any:
    rows = [
        {"episode": n, "pedestrian_injury_usd": usd}
        for n, usd in enumerate(injuries or (0.0,) * len(margins or ()))
    ]
    margin = None if margins is None else np.array(margins)
    return SimpleNamespace(margin=margin, stack=SimpleNamespace(rows=rows))


def recorded(number: int, entry: Any, index: int, is_again: bool = False) -> Recorded:
    earned = earned_of(entry.stack.rows, entry.margin)[index]
    return Recorded(number, entry, index, Path(), earned, is_again)


def test_of_many_stacks_the_dearest_deliveries_are_kept() -> None:
    entries = [entry([-1.0]) for _ in range(24)] + [entry([-101.0])]
    each = [recorded(number, own, 0) for number, own in enumerate(entries)]
    assert 24 in [taken.number for taken in chosen(each, 20)]


def test_what_was_driven_again_for_the_page_is_on_it() -> None:
    first, second = entry([-9.0, -8.0, -7.0]), entry([-1.0, -2.0, -3.0])
    each = [recorded(0, first, index) for index in range(3)]
    each += [recorded(1, second, index, is_again=index == 0) for index in range(3)]
    taken = chosen(each, 2)
    assert [(one.number, one.index) for one in taken] == [(0, 0), (1, 0)]


def test_without_cargo_the_dearest_is_who_hurt_most() -> None:
    own = entry(None, (0.0, 0.0, 1000.0, 5.0))
    each = [recorded(0, own, index) for index in range(4)]
    assert [one.index for one in chosen(each, 2)] == [2, 3]


@pytest.mark.parametrize(("indices", "expected"), [((2, 0, 1), True), ((0, 1, 3), False)])
def test_a_page_knows_whether_it_has_the_dearest(indices: tuple[int, ...], expected: bool) -> None:
    own = entry([-3.0, -2.0, -50.0, 3.49])
    each = [recorded(0, own, index) for index in indices]
    assert has_dearest(each, [own], 3) == expected

"""Sentences that say what deliveries prove, and what they do not."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from harness.analysis.compare import side_of
from harness.report.verdict import Party, earnings, rankings
from harness.statistics.interval import Interval
from harness.study.stored_run import load_run

WriteRun = Callable[..., Path]


def late(every: int) -> Callable[[dict[str, Any]], None]:
    def change(row: dict[str, Any]) -> None:
        row["outcome"] = "timeout" if row["episode"] % every == 0 else "sla"

    return change


def party(run: Path, margin: float) -> Party:
    side = side_of(load_run(str(run)))
    return run.name, side, Interval(margin, margin - 1.0, margin + 1.0, len(side.stack.rows))


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [(0.1, 2.0, "it earns money"), (-2.0, -0.1, "it loses money"), (-1.0, 1.0, "these deliveries do not tell")],
)
def test_what_a_stack_earns_is_said_by_its_interval(low: float, high: float, said: str) -> None:
    (line,) = earnings([("mine", None, Interval(0.5, low, high, 20)), ("without cargo", None, None)])  # type: ignore[list-item]
    assert line.startswith(f"mine: 0.50 [{low:.2f}, {high:.2f}] USD a delivery (n = 20): {said}")


def test_where_all_deliveries_are_alike_nothing_is_said_of_what_is_rare() -> None:
    (line,) = earnings([("mine", None, Interval(3.49, None, None, 20))])  # type: ignore[list-item]
    assert line == "mine: 3.49 USD a delivery (n = 20), the same each time: what is rarer has not happened yet"


def test_the_best_is_ranked_where_the_missions_tell(write_run: WriteRun) -> None:
    good, bad, near = (write_run(name, change=late(every)) for name, every in (("good", 99), ("bad", 2), ("near", 98)))
    other = write_run("elsewhere", seed=9)
    parties = [party(bad, -1.0), party(good, 3.0), party(near, 2.9), party(other, 0.0)]
    first, second = rankings(parties)
    assert first.startswith("These deliveries cannot rank good and near: ")
    assert second.startswith("good earns more than bad: ") and second.endswith("over 40 missions, p <.001")
    assert rankings(parties[:1]) == []

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
    [
        (0.1, 2.0, "it earns money; a loss"),
        (-2.0, -0.1, "it loses money"),
        (-1.0, 1.0, "these deliveries do not tell"),
    ],
)
def test_what_a_stack_earns_is_said_by_its_interval(
    write_run: WriteRun, low: float, high: float, said: str
) -> None:
    side = side_of(load_run(str(write_run("one"))))
    (line,) = earnings(
        [("mine", side, Interval(0.5, low, high, 20)), ("without cargo", side, None)]
    )
    assert line.startswith(f"mine: 0.50 [{low:.2f}, {high:.2f}] USD a delivery (n = 20): {said}")


@pytest.mark.parametrize(("episodes", "doubts"), [(20, True), (4000, False)])
def test_a_gain_is_doubted_until_a_loss_that_has_not_happened_could_not_undo_it(
    write_run: WriteRun, episodes: int, doubts: bool
) -> None:
    def alike(row: dict[str, Any]) -> None:
        row.update(
            outcome="sla",
            pedestrian_injury_usd=0.0,
            collision_delta_v_mps=0.0,
            pedestrian_contacts=0,
        )
        row.update({key: 0 for key in row if key.endswith("_contacts")})

    run = load_run(str(write_run("one", episodes=episodes, change=alike, crowd=0.0)))
    (line,) = earnings([("mine", side_of(run), Interval(3.49, None, None, episodes))])
    start = f"mine: 3.49 USD a delivery (n = {episodes}), the same each time"
    assert line.startswith(start)
    assert (line != start) == doubts and (
        "; a loss that has not happened yet could undo that: [-" in line
    ) == doubts


def test_the_best_is_ranked_where_the_missions_tell(write_run: WriteRun) -> None:
    good, bad, near = (
        write_run(name, change=late(every))
        for name, every in (("good", 99), ("bad", 2), ("near", 98))
    )
    other = write_run("elsewhere", seed=9)
    parties = [party(bad, -1.0), party(good, 3.0), party(near, 2.9), party(other, 0.0)]
    first, second = rankings(parties)
    assert first.startswith("These deliveries cannot rank good and near: ")
    assert second.startswith("good earns more than bad: ")
    assert (
        "over 40 missions, p <.001; a loss that has not happened yet could undo that: [-" in second
    )
    assert rankings(parties[:1]) == []

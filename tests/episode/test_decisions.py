"""Decisions of a real delivery, on disk."""

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from harness.episode.episode import Delivery, run_episode
from harness.execution.workers import Finished
from harness.metrics.columns import EPISODE_COLUMNS, TIMING_COLUMNS
from harness.metrics.decisions import DECISION_COLUMNS, DecisionLog, NoDecisionLog
from harness.storage.tables import write_table
from harness.study.drive import record_of
from harness.task.study import make_study
from navstack.control.decision import CriticScore, DecisionRecord
from navstack.navigator import TickRecord
from navstack.safety.collision_monitor import MonitorAction
from navstack.types import Belief, Health, Pose2D, Twist2D


class Brain:
    """Tells what it is told to."""

    decision: TickRecord | None = None


def tick(*scores: CriticScore) -> TickRecord:
    decided = DecisionRecord(1.5, "DWBLocalPlanner", Twist2D(1.0), 9, 4, 3.5, scores)
    belief = Belief(Pose2D(1.0, 2.0, 3.0), health=Health.DEGRADED)
    return TickRecord(
        belief, decided, Twist2D(1.0), Twist2D(0.5), MonitorAction("slowdown", "Near")
    )


def test_a_row_holds_everything_and_only_critics_that_spoke_have_columns(tmp_path: Path) -> None:
    log, brain = DecisionLog(), Brain()
    for decision in (None, tick(), tick(CriticScore("Path Dist", 1.0, 2.0, 4))):
        brain.decision = decision
        log.record(brain)
    write_table(tmp_path / "decisions.parquet", log.columns, log.rows)
    table = pq.read_table(tmp_path / "decisions.parquet")
    assert table.column_names == [
        *DECISION_COLUMNS,
        "Path_Dist_raw",
        "Path_Dist_weighted",
        "Path_Dist_rejected",
    ]
    before, after = table.to_pylist()
    assert before["Path_Dist_raw"] is None
    assert (after["Path_Dist_raw"], after["Path_Dist_weighted"], after["Path_Dist_rejected"]) == (
        1.0,
        2.0,
        4,
    )
    assert (after["wanted_linear_x_mps"], after["command_linear_x_mps"]) == (1.0, 0.5)
    assert (after["monitor_action"], after["monitor_polygon"], after["health"]) == (
        "slowdown",
        "Near",
        "degraded",
    )
    assert (after["samples"], after["rejected"], after["total_score"]) == (9, 4, 3.5)


def test_without_being_asked_nothing_is_kept() -> None:
    log = NoDecisionLog()
    log.record(Brain())
    assert log.rows == []


@pytest.fixture(scope="module")
def deliveries() -> dict[str, Delivery]:
    """The same short delivery, with and without its decisions."""
    studies = {
        record: make_study(
            stacks=["nav2-gps"],
            episodes=1,
            start=START,
            goal=GOAL,
            pedestrians=2,
            workers=1,
            record=record,
        )
        for record in ("events", "decisions")
    }
    return {record: run_episode(next(iter(study.tasks()))) for record, study in studies.items()}


START, GOAL = (-67.875, -71.875, 0.0), (-67.875, -66.0, 0.0)


def test_rows_do_not_depend_on_what_is_recorded(deliveries: dict[str, Delivery]) -> None:
    assert deliveries["events"].row == deliveries["decisions"].row
    assert deliveries["events"].decisions is None


def test_a_delivery_fills_every_column(deliveries: dict[str, Delivery]) -> None:
    delivery = deliveries["decisions"]
    assert {*delivery.row, "error"} == set(EPISODE_COLUMNS)
    assert set(delivery.timing) == set(TIMING_COLUMNS)
    record = record_of(Finished(None, delivery))
    assert record["timing"]["planner_calls"] >= delivery.row["plans"] > 0
    assert 0.0 < delivery.timing["controller_median_ms"] <= delivery.timing["controller_p95_ms"]


def test_every_control_cycle_of_a_delivery_has_a_row(deliveries: dict[str, Delivery]) -> None:
    columns, rows = deliveries["decisions"].decisions
    duration = deliveries["decisions"].row["duration_s"]
    assert len(rows) == pytest.approx(30.0 * duration, abs=2)
    assert {"PathDist_raw", "GoalDist_weighted", "BaseObstacle_rejected"} <= set(columns)
    scored = [
        row
        for row in rows
        if row["decided_by"] == "DWBLocalPlanner" and row["total_score"] is not None
    ]
    assert len(scored) == deliveries["decisions"].timing["controller_cycles"] - sum(
        row["decided_by"] == "RotationShimController" or row["samples"] == row["rejected"] > 0
        for row in rows
    )
    for row in scored:
        weighted = sum(value for key, value in row.items() if key.endswith("_weighted"))
        assert row["total_score"] == pytest.approx(weighted, rel=1e-5)

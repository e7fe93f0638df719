"""Touches of people that do not count are told on a run's screen."""

from collections.abc import Callable
from pathlib import Path

from harness.metrics.columns import EVENT_COLUMNS, Row
from harness.report.short.touches import touches_line, uncounted_touches
from harness.storage.checksums import write_checksums
from harness.storage.shipped import shipped
from harness.storage.tables import write_table
from harness.study.stored_run import StoredRun, load_run

WriteRun = Callable[..., Path]


def event(stack: str, kind: str, stamp: float, **more: object) -> Row:
    usual = {"stack": stack, "episode": 0, "type": kind, "stamp_s": stamp, "duration_s": 0.1}
    whom = {"partner": "pedestrian", "kind": "pedestrian", "partner_id": 3, "impulse_ns": 60.0}
    place = {"x_m": 0.0, "y_m": 0.0, "robot_speed_mps": 1.0, "partner_speed_mps": 1.0}
    known = {**usual, **whom, **place, "cost_usd": 0.0, "fault": "robot_into_person"}
    known["peak_step_impulse_ns"] = 30.0
    return {**dict.fromkeys(EVENT_COLUMNS), **known, **more}


def run_with(write_run: WriteRun, events: list[Row], robots: dict[str, str]) -> StoredRun:
    folder = write_run("run", stacks=("a", "b"), episodes=2)
    for stack, robot in robots.items():
        text = (shipped("params") / "robots" / f"{robot}.yaml").read_text(encoding="utf-8")
        (folder / "params" / f"{stack}-robot.yaml").write_text(text, encoding="utf-8")
    write_table(folder / "events.parquet", EVENT_COLUMNS, events)
    write_checksums(folder)
    return load_run(str(folder))


def test_what_was_counted_or_was_no_person_is_no_such_touch(write_run: WriteRun) -> None:
    events = [
        event("a", "counted_contact", 5.05),
        event("a", "contact_event", 5.0),  # the same
        event("a", "contact_event", 5.0, partner_id=4),
        event("a", "contact_event", 5.0, episode=1),
        event("b", "contact_event", 5.0, partner="property"),
    ]
    run = run_with(write_run, events, {"a": "jackal", "b": "jackal"})
    assert dict(uncounted_touches(run)) == {"a": [30.0, 30.0]}
    assert touches_line(run) == (
        "touches of people that do not count: a 2, b 0; all below 50 N s in a step, 2.7 m/s of a "
        "robot of 18.4 kg"
    )


def test_touches_that_are_hard_and_do_not_count_are_not_called_soft(write_run: WriteRun) -> None:
    """Two points of 48 N s each count as none where a single point must reach 50 N s."""
    events = [
        event("a", "contact_event", 5.0),
        event("b", "contact_event", 5.0, peak_step_impulse_ns=96.0),
    ]
    assert touches_line(run_with(write_run, events, {})) == (
        "touches of people that do not count: a 1, b 1; 1 below 50 N s in a step, the others up to "
        "96 N s: no point of them counts, or they come right after one that does"
    )


def test_robots_of_two_masses_have_no_speed_in_common(write_run: WriteRun) -> None:
    events = [event("b", "contact_event", 5.0)]
    run = run_with(write_run, events, {"a": "jackal", "b": "segway_e1"})
    assert touches_line(run).endswith(": a 0, b 1; all below 50 N s in a step")


def test_nothing_is_said_where_nobody_was_touched(write_run: WriteRun) -> None:
    events = [event("a", "counted_contact", 5.05), event("a", "contact_event", 5.0)]
    assert touches_line(run_with(write_run, events, {})) == ""

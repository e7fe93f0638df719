"""What led to a costed event: moments, the seconds before, words, tables, figure and command, without a simulation."""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.cli import main
from harness.economics.prices import load_prices
from harness.explain.brains import Weighed
from harness.explain.evidence import RECORDING, Evidence
from harness.explain.moments import Moment, costliest, costs_of, moments_of
from harness.explain.seconds import seconds_before
from harness.explain.words import deciding_critics, paragraph, rejected_by, shares_of
from harness.metrics import EPISODE_COLUMNS, EVENT_COLUMNS
from harness.metrics.decisions import CRITIC_COLUMNS, DECISION_COLUMNS
from harness.metrics.encounters import Body
from harness.outcome import Rules
from harness.report.explain_figure import draw_seconds
from harness.resources import shipped
from harness.table_files import write_table
from navstack.control.decision import RUNNER_UP, SLOWER, Alternative, CriticScore
from navstack.errors import InputError
from navstack.types import Twist2D

END, HIT = 20.0, 8.0  # [s]
OFF = (0.3, 0.4)  # [m] of the belief: 0.5 m
RULES = Rules(2.0, 241.0, 0.5, 177.78, 0.05)
BODY = Body((0.0, 0.0), (0.5, 0.3), 0.25)
FOOTPRINT = np.array([[0.5, 0.3], [0.5, -0.3], [-0.5, -0.3], [-0.5, 0.3]])
STAMPS = np.arange(0.1, END + 0.05, 0.1)
CRITICS = {"PathDist": (2.0, 1.0, 0), "BaseObstacle": (10.0, 0.2, 7)}  # raw, weighted, rejected


def decision(stamp: float, **more: Any) -> dict[str, Any]:
    """A cycle in which DWB kept to 1 m/s."""
    row = {**dict.fromkeys(DECISION_COLUMNS), "stamp_s": stamp, "decided_by": "DWBLocalPlanner"}
    row |= {"wanted_linear_x_mps": 1.0, "wanted_angular_z_radps": 0.0, "monitor_action": "none", "health": "tracking"}
    row |= {"command_linear_x_mps": 1.0, "command_angular_z_radps": 0.0, "status": ""}
    row |= {"believed_x_m": stamp + OFF[0], "believed_y_m": OFF[1], "believed_yaw_rad": 0.0}
    row |= {"samples": 100, "rejected": 7, "total_score": 1.2}
    for name, values in CRITICS.items():
        row |= {f"{name}_{end}": value for end, value in zip(CRITIC_COLUMNS, values, strict=True)}
    return row | more


def contact(stamp: float, cost: float, person: int = 1) -> dict[str, Any]:
    row = {**dict.fromkeys(EVENT_COLUMNS), "stack": "mine", "episode": 0, "type": "counted_contact"}
    row |= {"stamp_s": stamp, "cost_usd": cost, "partner": "pedestrian", "kind": "pedestrian", "partner_id": person}
    speeds = {"robot_speed_mps": 1.0, "partner_speed_mps": 0.5}
    return row | speeds | {"impulse_ns": 80.0, "x_m": stamp + 0.5, "y_m": 0.0, "fault": "robot_into_person"}


def arrays() -> dict[str, Any]:
    """Along x at 1 m/s; person 1 comes at 0.5 m/s and is met at 8 s, person 0 stands 30 m aside; a tracker sees him
    from 5 s on, where the robot believes him to be."""
    rows = len(STAMPS)
    x = STAMPS
    met = HIT + BODY.half_size[0] + BODY.person_radius - 0.5 * (STAMPS - HIT)
    crowd = np.zeros((rows, 2, 2))
    crowd[:, 0] = (0.0, 30.0)
    crowd[:, 1, 0] = met
    zero = np.zeros(rows)
    trace = np.column_stack(
        (STAMPS, x, zero, zero, zero + 1.0, zero, x + OFF[0], zero + OFF[1], zero, zero + 1.0, zero)
    )
    seen = STAMPS > 5.05
    tracks = np.zeros((int(seen.sum()), 6))
    tracks[:, 1], tracks[:, 2] = met[seen] + OFF[0], OFF[1]
    return {
        "trace": trace,
        "crowd": crowd,
        "pieces_lost": (STAMPS > 12.05).astype(np.int32) * 3,
        "track_count": seen.astype(np.int32),
        "tracks": tracks.astype(np.float32),
        "plan_stamp": np.array([0.0]),
        "plan_size": np.array([2], dtype=np.int32),
        "plan_xy": np.array([[0.0, 0.0], [30.0, 0.0]], dtype=np.float32),
        "motion_energy_j": zero,
        "odometry": np.zeros((rows, 5)),
        "belief_covariance": np.zeros((rows, 3), dtype=np.float32),
        "scan_stamp": STAMPS,
        "scan_mm": np.zeros((rows, 4), dtype=np.uint16),
        "scan_geometry": np.zeros(7),
    }


def evidence(**more: Any) -> Evidence:
    given = arrays()
    row = {**dict.fromkeys(EPISODE_COLUMNS, 0.0), "stack": "mine", "map": "sidewalk", "seed": 0, "episode": 0}
    row |= {"outcome": "sla", "reason": "arrived", "duration_s": END, "pieces_at_start": 50, "pieces_lost": 3}
    row |= {"goal_x_m": 40.0, "goal_y_m": 0.0, "distance_m": END, "average_speed_mps": 1.0}
    made = Evidence(
        row=row | more.pop("row", {}),
        events=(contact(HIT, 20.0),),
        trace=given["trace"],
        crowd=given["crowd"],
        pieces_lost=given["pieces_lost"].astype(float),
        tracks=tuple(np.split(given["tracks"].astype(float), np.cumsum(given["track_count"])[:-1])),
        plans=((0.0, given["plan_xy"]),),
        decisions=tuple(decision(stamp) for stamp in np.arange(0.0, END, 0.05)),
        weighed=None,
        body=BODY,
        footprint=FOOTPRINT,
        source=RECORDING,
    )
    return dataclasses.replace(made, **more)


def moment_at(stamp: float = HIT, kind: str = "contact") -> Moment:
    return Moment(1, kind, stamp, 20.0, contact(stamp, 20.0) if kind == "contact" else None)


def test_the_seconds_before_hold_what_was_done_met_seen_and_believed() -> None:
    seconds = seconds_before(evidence(), moment_at(), 5.0)
    assert (seconds.at[0], seconds.at[-1]) == (pytest.approx(-5.0), pytest.approx(0.0))
    assert seconds.person == 1
    np.testing.assert_allclose(seconds.distance, -1.5 * seconds.at, atol=1e-9)
    np.testing.assert_allclose(seconds.closing, 1.5, atol=1e-6)
    np.testing.assert_allclose(seconds.position_error, 0.5, atol=1e-9)
    np.testing.assert_allclose(seconds.track_error[seconds.at > -2.9], 0.0, atol=1e-5)  # belief's error taken out
    assert seconds.tracked_since == pytest.approx(2.9, abs=0.11)
    assert [round(float(seconds.at[place]), 1) for place in seconds.instants()] == [-0.5 * k for k in range(10, -1, -1)]
    assert seconds.telling is not None
    assert seconds.telling["stamp_s"] == pytest.approx(HIT - 1.0)


def test_what_comes_early_is_told_from_the_start() -> None:
    seconds = seconds_before(evidence(), moment_at(1.0), 5.0)
    assert (seconds.since, seconds.at[0]) == (0.0, pytest.approx(-0.9))
    assert seconds_before(evidence(), moment_at(0.0), 5.0).at.size == 2


def test_a_delivery_that_was_over_at_once_is_not_told() -> None:
    given = evidence()
    with pytest.raises(InputError, match="over within 0.1 s"):
        seconds_before(dataclasses.replace(given, trace=given.trace[:1]), moment_at(0.05), 5.0)


def test_a_belief_that_is_turned_still_sees_the_person_where_he_is() -> None:
    given = evidence()
    turn = 0.3
    trace = given.trace.copy()
    trace[:, 8] = turn
    rotation = np.array(((np.cos(turn), np.sin(turn)), (-np.sin(turn), np.cos(turn))))
    tracks = tuple(
        np.column_stack((one[:, :1], (crowd[1:] - row[1:3]) @ rotation + row[6:8], one[:, 3:])) if len(one) else one
        for one, crowd, row in zip(given.tracks, given.crowd, trace, strict=True)
    )
    seconds = seconds_before(dataclasses.replace(given, trace=trace, tracks=tracks), moment_at(), 2.0)
    np.testing.assert_allclose(seconds.track_error, 0.0, atol=1e-9)


def test_moments_are_the_paid_contacts_and_the_costed_outcome() -> None:
    prices = load_prices("costnav")
    events = (contact(HIT, 20.0), contact(9.0, 0.0), {**contact(9.5, 5.0), "type": "contact_event"})
    spoiled = evidence(events=events, row={"outcome": "spoiled", "reason": "cargo lost"})
    found = moments_of(spoiled, RULES, prices)
    assert [(each.number, each.kind) for each in found] == [(1, "contact"), (2, "spoiled")]
    assert found[1].stamp == pytest.approx(12.1)  # the third of 50 pieces is more than 5 %
    assert found[1].cost == pytest.approx(prices.food_price)
    assert costliest(found) is max(found, key=lambda each: each.cost or 0.0)
    assert moments_of(evidence(events=()), RULES, prices) == []


def test_a_timeout_is_told_since_the_robot_was_stuck_or_from_its_end() -> None:
    prices, late = load_prices("costnav"), {"outcome": "timeout", "reason": "timeout"}
    (on_its_way,) = moments_of(evidence(events=(), row=late), RULES, prices)
    assert on_its_way.stamp == END
    trace = evidence().trace.copy()
    trace[trace[:, 0] > 6.0, 1] = 6.0
    (stuck,) = moments_of(evidence(events=(), row=late, trace=trace), RULES, prices)
    assert stuck.stamp == pytest.approx(4.0, abs=0.11)  # when it came to within 2 m of where it stayed
    assert stuck.cost == pytest.approx(prices.delivery_fee.value)


def test_needing_help_costs_the_fee_and_the_repair() -> None:
    prices = load_prices("costnav")
    hit = evidence(row={"outcome": "physical_assistance", "reason": "impulse", "collision_impulse_ns": 180.0})
    both = moments_of(hit, RULES, prices)
    assert [each.kind for each in both] == ["contact", "physical_assistance"]
    money = costs_of(hit.row, prices)
    assert both[1].cost == pytest.approx(money["service_compensation"] + money["repair"])
    assert both[1].person == 1  # the last contact used up what was left
    assert "needed help" in paragraph(hit, seconds_before(hit, both[1], 5.0))


def test_the_words_say_what_the_record_shows() -> None:
    given = evidence()
    words = paragraph(given, seconds_before(given, moment_at(), 5.0))
    for said in (
        "Event 1, 8.0 s, 20.00 USD: it hit person 1 with 80 N s",
        "the robot came with 1.00 m/s, the person with 0.50 m/s: the robot moved into the person",
        "drove 1.00 m/s and in the last second neither braked nor sped up",
        "was 7.5 m away at first and 0.00 m at the least; the gap closed at up to 1.5 m/s",
        "DWBLocalPlanner 101",
        "illegal were 7 of 100 (BaseObstacle 7)",
        "PathDist 83 %, BaseObstacle 17 %",
        "What else it weighed is not in the recording",
        "0.50 m from the truth on average",
        "had the person without a gap for the last 2.9 s",
        "no piece was lost",
    ):
        assert said in words, (said, words)


def test_the_words_follow_other_records() -> None:
    braking = evidence()
    braking.trace[STAMPS > 7.05, 9] = 0.2
    none = tuple(np.empty((0, 6)) for _ in STAMPS)
    illegal = tuple(
        decision(t, total_score=None, rejected=100, monitor_action="slowdown", health="lost")
        for t in np.arange(0.0, END, 0.05)
    )
    told = dataclasses.replace(braking, tracks=none, decisions=illegal)
    words = paragraph(told, seconds_before(told, moment_at(), 5.0))
    for said in ("in the last second braked", "This stack tracked nothing that moves", "no trajectory was legal"):
        assert said in words, words
    assert "found nothing legal (BaseObstacle 7)" in words
    assert "Collision monitor: slowdown in 101" in words
    assert "it called itself lost" in words
    nobody = dataclasses.replace(told, crowd=np.empty((len(STAMPS), 0, 2)), decisions=())
    words = paragraph(nobody, seconds_before(nobody, moment_at(12.0, "spoiled"), 5.0))
    assert "Nobody was within 10 m" in words
    assert "Nothing in this stack decides" in words


def alternative(kind: str, speed: float, path: float, obstacle: float) -> Alternative:
    scores = (CriticScore("PathDist", path, path, 0), CriticScore("BaseObstacle", obstacle, obstacle, 0))
    return Alternative(kind, Twist2D(speed), path + obstacle, scores)


def test_what_decided_are_the_critics_that_speak_against_slower_most_first() -> None:
    slower, second = alternative(SLOWER, 0.4, 1.1, 0.9), alternative(RUNNER_UP, 0.9, 1.3, 0.2)
    assert list(deciding_critics(decision(0.0), slower).items()) == [
        ("BaseObstacle", pytest.approx(0.7)),
        ("PathDist", pytest.approx(0.1)),
    ]
    given = evidence()
    stamp = given.decisions[140]["stamp_s"]
    given = dataclasses.replace(given, weighed=(Weighed(stamp, (second, slower)),))
    words = paragraph(given, seconds_before(given, moment_at(), 5.0))
    assert "at most half as fast (0.40 m/s) would have scored 0.8 more; what decided: BaseObstacle +0.7, Path" in words
    assert "Second came 0.90 m/s" in words
    only = dataclasses.replace(given, weighed=(Weighed(stamp, (second,)),))
    assert "Nothing legal was at most half as fast" in paragraph(only, seconds_before(only, moment_at(), 5.0))


def test_shares_and_rejections_come_largest_first() -> None:
    row = decision(0.0, PathDist_weighted=-3.0, BaseObstacle_weighted=1.0, PathDist_rejected=9)
    assert shares_of(row) == {"PathDist": 0.75, "BaseObstacle": 0.25}
    assert list(rejected_by(row).items()) == [("PathDist", 9), ("BaseObstacle", 7)]


@pytest.fixture
def folder(write_run: Callable[..., Path]) -> Path:
    """A run of two deliveries: the first recorded and with a contact that cost something, the second without cost."""

    def change(row: dict[str, Any]) -> None:
        row |= {"outcome": "sla", "reason": "arrived", "duration_s": END, "pieces_at_start": 50, "pieces_lost": 3}

    made = write_run("run", episodes=2, crowd=0.0, change=change)
    robot = (shipped("params") / "robots" / "segway_e1.yaml").read_text(encoding="utf-8")
    (made / "params" / "mine-robot.yaml").write_text(robot, encoding="utf-8")
    write_table(made / "events.parquet", EVENT_COLUMNS, [contact(HIT, 20.0), contact(15.0, 30.0, 0)])
    (made / "recordings").mkdir()
    np.savez_compressed(made / "recordings" / "mine-0.npz", **arrays())
    critics = {f"{name}_{end}": kind for name in CRITICS for end, kind in CRITIC_COLUMNS.items()}
    rows = [decision(stamp) for stamp in np.arange(0.0, END, 0.05)]
    write_table(made / "recordings" / "mine-0-decisions.parquet", DECISION_COLUMNS | critics, rows)
    return made


def explain(*arguments: str) -> Any:
    with pytest.raises(SystemExit) as ended:
        main(["explain", *arguments])
    return ended.value.code


def test_the_command_tells_and_draws_a_recorded_delivery(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, plot = tmp_path / "out", tmp_path / "one.svg"
    assert explain(str(folder), "0", "--plot", str(plot), "--out", str(out)) == 0
    printed = capsys.readouterr().out
    assert "from its recording" in printed
    assert "it hit person 1 with 80 N s" in " ".join(printed.split())
    head = next(line for line in printed.splitlines() if "v [m/s]" in line)
    assert "belief off [m]" in head
    assert len([line for line in printed.splitlines() if "DWBLocalPlanner" in line and line.startswith(" ")]) == 22
    names = {"explanation.json", "explanation.txt", *(f"event-{n}.{kind}" for n in (1, 2) for kind in ("png", "pdf"))}
    assert {path.name for path in out.iterdir()} == names
    assert all(path.stat().st_size > 500 for path in out.iterdir())
    assert "event 2: contact" in plot.read_text(encoding="utf-8")
    document = json.loads((out / "explanation.json").read_text(encoding="utf-8"))
    assert [event["cost_usd"] for event in document["events"]] == [20.0, 30.0]
    first = document["events"][0]["instants"][0]
    assert (first["time_to_event_s"], first["distance_m"]) == (pytest.approx(-5.0), pytest.approx(7.5, abs=0.6))
    assert first["track_error_m"] is None


def test_one_event_as_json(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert explain(f"{folder}:mine", "0", "--event", "2", "--before", "2", "--json") == 0
    document = json.loads(capsys.readouterr().out)
    (event,) = document["events"]
    assert (event["number"], len(event["instants"]), document["source"]) == (2, 5, "recording")
    assert document["rewind"] is None


def test_a_delivery_that_cost_nothing_points_to_others(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert explain(str(folder), "1") == 0
    out = capsys.readouterr().out
    assert out == "episode 1 of mine has no event that cost anything; episodes that have some: 0\n"
    assert explain(str(folder), "1", "--json") == 0
    assert json.loads(capsys.readouterr().out)["costly_episodes"] == [0]


def test_what_cannot_be_explained_is_said_in_one_line(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], write_run: Callable[..., Path]
) -> None:
    two = write_run("two", stacks=("a", "b"), episodes=2)
    (tmp_path / "file").write_text("")
    for arguments, said in (
        ((str(folder), "9"), "finished no episode 9"),
        ((str(folder), "0", "--event", "3"), "--event 3: the delivery has 2; give 1 to 2"),
        ((str(folder), "0", "--event", "0"), "0 is not in the range"),
        ((str(folder), "0", "--before", "0"), "range"),
        ((str(folder), "0", "--plot", str(tmp_path / "a.gif")), "give a name that ends with .png"),
        ((str(folder), "0", "--plot", str(tmp_path / "no" / "a.png")), "existing folder"),
        ((str(folder), "0", "--out", str(tmp_path / "file" / "x")), "cannot be made"),
        ((str(two), "0"), "has 2 stacks; choose one of"),
        ((str(two), "0", "--stack", "c"), "'c'"),
        ((str(tmp_path), "0"), "holds no run"),
    ):
        assert explain(*arguments) == 1
        err = capsys.readouterr().err
        assert (said in err, err.count("\n")) == (True, 1), err


def test_recordings_that_are_damaged_are_named(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "recordings" / "mine-0-decisions.parquet").write_bytes(b"nothing")
    assert explain(str(folder), "0") == 1
    err = capsys.readouterr().err
    assert "mine-0-decisions.parquet: is damaged" in err
    assert err.count("\n") == 1


def test_controllers_without_scores_or_samples_are_told_as_they_are() -> None:
    plain = {f"{name}_{end}": None for name in CRITICS for end in CRITIC_COLUMNS}
    for row, said in (
        ({"samples": 1, "rejected": 0}, "RegulatedPurePursuitController chose 1.00 m/s, +0.00 rad/s. It"),
        ({"samples": 1, "rejected": 1, "CollisionAhead_rejected": 1}, "found nothing legal (CollisionAhead 1)"),
        ({"samples": 1, "rejected": 1, "status": "failed"}, "found nothing legal (its optimiser failed)"),
        ({"samples": 1, "rejected": 1, "status": "failed"}, "Optimiser: failed in 101."),
    ):
        row = {**plain, "total_score": None, "decided_by": "RegulatedPurePursuitController", **row}
        told = evidence(decisions=tuple(decision(stamp, **row) for stamp in np.arange(0.0, END, 0.05)))
        assert said in paragraph(told, seconds_before(told, moment_at(), 5.0))


def test_who_is_absent_at_first_is_met_all_the_same(tmp_path: Path) -> None:
    crowd = arrays()["crowd"]
    crowd[STAMPS < 6.05, 1] = np.inf
    crowd[:, 0] = np.nan
    told = evidence(crowd=crowd)
    seconds = seconds_before(told, moment_at(), 5.0)
    assert seconds.person == 1
    assert "was 2.7 m away at first and 0.00 m at the least" in paragraph(told, seconds)
    draw_seconds(told, seconds, None, [tmp_path / "a.png"])
    assert (tmp_path / "a.png").stat().st_size > 10_000

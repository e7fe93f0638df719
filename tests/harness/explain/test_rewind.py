"""Rewinding: nothing changed, nothing happens.

Something changed, and only what comes after differs.
"""

import dataclasses
import json
import shutil

import numpy as np
import pytest

from harness.episode.episode import run_episode
from harness.episode.factory import Parts
from harness.execution.process_cache import forget
from harness.explain.brains import Watched
from harness.explain.rewind import changes_of, drive_changed
from harness.metrics.columns import EPISODE_COLUMNS
from harness.storage.checksums import CHECKSUMS
from harness.storage.tables import read_rows, write_table
from harness.task.study import make_study
from navbench.cli.app import main
from navstack.control.decision import RUNNER_UP
from navstack.errors import InputError
from navstack.navigation_status import Status

START, GOAL = (10.0, 20.0, 0.0), (50.0, 22.0, 0.0)  # in the hall
SECONDS = 5.0  # [s] of every delivery here
MOMENT = 2.0  # [s]
OWN_SPEED = "controller_server.FollowPath.max_speed"
SPEED, SCALE = (
    "controller_server.FollowPath.max_vel_x",
    "controller_server.FollowPath.BaseObstacle.scale",
)


@pytest.fixture(scope="module")
def rules(tmp_path_factory):
    """Rules by which time is up soon."""
    path = tmp_path_factory.mktemp("rules") / "soon.yaml"
    path.write_text(
        f"arrival_radius: 2.0\ntimeout: {SECONDS}\nmax_tilt: 0.5\nimpulse_health: "
        "177.78\nspoiled_fraction: 0.05\n"
    )
    return path


def task_for(stack, rules, hall):
    where = {"map_name": str(hall), "start": START, "goal": GOAL, "rules": str(rules)}
    study = make_study(stacks=[stack], episodes=1, pedestrians=3, workers=1, record="full", **where)
    return next(study.tasks())


def value_of(task, path):
    return changes_of(Parts(task).nav2, [f"{path}=1"])[0].place.value


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stack", "speed", "factor"),
    [("nav2-gps", SPEED, 1.0), ("nav2-amcl", SPEED, 1.0), ("evasive-gps-ekf", OWN_SPEED, 0.5)],
)
def test_with_nothing_changed_everything_comes_out_as_it_was(
    stack, speed, factor, rules, hall, tmp_path
):
    """Also where the study's prices, its timeout and its clock's rate decide how it drives."""
    own = tmp_path / "rules.yaml"
    own.write_text(f"{rules.read_text()}real_time_factor: {factor}\n")
    task = task_for(stack, own, hall)
    as_it_was = run_episode(task)
    forget()  # three brains at once are 1.5 GB
    rewound = drive_changed(task, [f"{speed}={value_of(task, speed)}"], MOMENT)
    forget()
    assert rewound.delivery.row == as_it_was.row
    assert rewound.delivery.events == as_it_was.events
    assert rewound.delivery.decisions == as_it_was.decisions
    for name, array in as_it_was.recording.items():
        np.testing.assert_array_equal(rewound.delivery.recording[name], array, err_msg=name)
    take_over = rewound.take_over
    assert (take_over.before, take_over.status, take_over.recoveries) == (
        take_over.after,
        Status.RUNNING,
        0,
    )
    assert take_over.stamp == pytest.approx(MOMENT, abs=0.05)


def test_to_be_asked_for_alternatives_changes_nothing(rules, hall):
    task, watched = task_for("nav2-gps", rules, hall), []

    def make(parts, world):
        watched.append(Watched(parts.brain(world)))
        return watched[0]

    asked, left_alone = run_episode(task, make), run_episode(task)
    assert (asked.row, asked.decisions) == (left_alone.row, left_alone.decisions)
    scored = {row["stamp_s"]: row for row in asked.decisions[1] if row["total_score"] is not None}
    assert watched[0].weighed.keys() == scored.keys()
    for stamp, alternatives in watched[0].weighed.items():
        row = scored[stamp]
        for other in alternatives:
            assert other.total >= row["total_score"]
            assert other.total == pytest.approx(
                sum(score.weighted for score in other.scores), rel=1e-5
            )
            assert other.kind == RUNNER_UP or abs(other.command.linear_x) <= 0.5 * abs(
                row["wanted_linear_x_mps"]
            )


def test_a_change_acts_from_its_moment_on_and_not_before(rules, hall):
    task = task_for("nav2-gps", rules, hall)
    same, slow = (
        drive_changed(task, [f"{SPEED}={speed}"], MOMENT) for speed in (value_of(task, SPEED), 0.5)
    )
    trace, other = (each.delivery.recording["trace"] for each in (same, slow))
    before = trace[:, 0] < slow.take_over.stamp - 1e-6
    np.testing.assert_array_equal(other[: before.sum()], trace[before])
    assert trace[~before, 4].max() > 1.0
    assert other[-1, 4] < 0.6
    assert slow.delivery.row["distance_m"] < same.delivery.row["distance_m"]
    assert slow.take_over.after.linear_x <= 0.5 < slow.take_over.before.linear_x


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ((f"{SPEED}",), "is not PATH=VALUE"),
        ((f"{SPEED}=fast",), "'fast' is not a finite number"),
        ((f"{SPEED}=inf",), "'inf' is not a finite number"),
        ((f"{SPEED}=1.0", f"{SPEED}=2.0"), "is given twice"),
        (
            ("controller_server.FollowPath.max_vel=1.0",),
            "did you mean 'controller_server.FollowPath.max_vel",
        ),
        (("controler_server.FollowPath.max_vel_x=1.0",), "did you mean 'controller_server'"),
        (
            ("controller_server.FollowPath.debug_trajectory_details=perhaps",),
            "FollowPath.debug_trajectory_details",
        ),
        (("controller_server.controller_frequency=37.0",), "ticks of another length"),
        (("controller_server.FollowPath.vx_samples=2.5",), "'2.5' is not a whole number"),
    ],
)
def test_what_cannot_be_changed_is_said_in_one_line(settings, said, rules, hall):
    with pytest.raises(InputError) as refused:
        drive_changed(task_for("nav2-gps", rules, hall), settings, MOMENT)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_moment_after_the_last_decision_is_refused(rules, hall):
    with pytest.raises(
        InputError, match="nothing is decided from 5.00 s on; give a larger --before"
    ):
        drive_changed(task_for("nav2-gps", rules, hall), [f"{SPEED}=1.0"], SECONDS)


def test_who_is_parked_has_nothing_to_change(rules, hall):
    with pytest.raises(InputError, match="how parked drives"):
        drive_changed(task_for("parked", rules, hall), [f"{SPEED}=1.0"], MOMENT)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, rules, hall, driven_in_process):
    """A run of one delivery that ran out of time, with nothing recorded."""
    path = tmp_path_factory.mktemp("runs") / "run"
    arguments = [
        "run",
        "--stack",
        "nav2-gps",
        "--episodes",
        "1",
        "--pedestrians",
        "3",
        "--workers",
        "1",
    ]
    arguments += [
        "--map",
        str(hall),
        "--start",
        ",".join(map(str, START)),
        "--goal",
        ",".join(map(str, GOAL)),
        "--rules",
        str(rules),
        "--out",
        str(path),
    ]
    with pytest.raises(SystemExit) as ended, driven_in_process():
        main(arguments)
    assert ended.value.code == 0
    return path


def explain(*arguments):
    with pytest.raises(SystemExit) as ended:
        main(["explain", *arguments])
    return ended.value.code


@pytest.mark.slow
def test_an_unrecorded_delivery_is_driven_again_and_rewound(folder, capsys):
    capsys.readouterr()
    assert explain(str(folder), "0", "--before", "2", "--rewind", f"{SPEED}=0.5", "--json") == 0
    captured = capsys.readouterr()
    assert "is driven again" in captured.err
    told = json.loads(captured.out)
    assert (told["source"], told["outcome"]) == ("driven again", "timeout")
    (event,) = told["events"]
    assert (event["kind"], event["stamp_s"]) == ("timeout", pytest.approx(SECONDS, abs=0.05))
    assert "still on its way" in event["words"]
    assert {each["kind"] for each in event["alternatives"]} == {"runner_up", "slower"}
    assert (
        min(each["total_score"] for each in event["alternatives"])
        >= event["decision"]["total_score"]
    )
    rewound = told["rewind"]
    assert rewound["changes"] == [{"path": SPEED, "from": 3.0, "to": 0.5}]
    assert rewound["take_over"]["stamp_s"] == pytest.approx(SECONDS - 2.0, abs=0.1)
    assert rewound["outcome"] == {"stored": "timeout", "rewound": "timeout"}
    for costs in rewound["costs_usd"].values():
        assert costs["difference"] == pytest.approx(costs["rewound"] - costs["stored"])
    assert rewound["costs_usd"]["electricity"]["difference"] < 0.0
    assert rewound["n"] == 1


@pytest.mark.slow
def test_a_delivery_that_comes_out_otherwise_is_not_explained(folder, tmp_path, capsys):
    other = tmp_path / "other"
    shutil.copytree(folder, other)
    rows = read_rows(other / "episodes.parquet", EPISODE_COLUMNS)
    changed = [{**row, "distance_m": row["distance_m"] + 0.001} for row in rows]
    write_table(other / "episodes.parquet", EPISODE_COLUMNS, changed)
    (other / CHECKSUMS).unlink()
    capsys.readouterr()
    assert explain(str(other), "0") == 1
    err = capsys.readouterr().err.splitlines()
    assert len(err) == 2
    assert "comes out otherwise when it is driven again (distance_m" in err[-1]


def test_settings_leave_the_task_alone(rules, hall):
    task = task_for("nav2-gps", rules, hall)
    before = dataclasses.asdict(task)
    changes = changes_of(Parts(task).nav2, [f"{SCALE}=0.5"])
    assert (changes[0].place.path, changes[0].value) == (SCALE, 0.5)
    assert dataclasses.asdict(task) == before
    assert value_of(task, SCALE) != 0.5

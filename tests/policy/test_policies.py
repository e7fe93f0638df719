"""Policies of the user's drive, each in a process of its own.

One that fails costs its own deliveries only.
"""

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

import navbench
from harness.episode.episode import run_episode
from harness.episode.factory import Parts
from harness.policy.interface import PolicyError
from harness.policy.process import PolicyProcess
from harness.study.manifest import load_study, version_notes
from harness.task.stack import PolicyParams, load_stack
from harness.task.study import EpisodeTask, make_study
from navbench.cli.app import main
from navstack.errors import InputError, ParameterError

Write = Callable[..., Path]
Task = Callable[..., EpisodeTask]
ENDS = {
    "Crashes": "act: RuntimeError: out of ideas",
    "Ends": "ended while it was asked to act, with status 7",
    "Hangs": "did not answer within 2 s",
    "Odd": r"an answer of shape \(3,\); a velocity has \(2,\), waypoints have \(k, 2\)",
    "Endless": "an answer that is not finite",
    "Far": r"policies.py:Far: act: .* an answer with the number 1e\+300",
    "Unreadable": r"act: ValueError: weights-\\udcff\.bin",
}


@pytest.fixture
def task_of(hall: Path) -> Task:
    """Make the task of a stack: a short delivery in a hall."""

    def make(stack: Path, **options: object) -> EpisodeTask:
        files = {"map_name": str(hall), "rules": str(stack.parent / "rules.yaml")}
        choices: dict[str, Any] = {"pedestrians": 0, **files, **options}
        return make_study(stacks=[str(stack)], episodes=1, workers=1, **choices).template

    return make


@pytest.mark.parametrize("name", ["Along", "Steer"])
def test_a_policy_drives_by_velocities_or_waypoints(name: str, stack: Write, task_of: Task) -> None:
    row = run_episode(task_of(stack(name))).row
    assert row["distance_m"] > 1.5  # in the four seconds that the rules allow
    assert row["plans"] == 1


def test_a_policy_is_shown_pictures(stack: Write, task_of: Task) -> None:
    row = run_episode(
        task_of(stack("Looks", more=", camera: {width: 40, height: 30}"), pedestrians=3)
    ).row
    assert row["distance_m"] > 1.5


def test_a_policy_repeats(stack: Write, task_of: Task) -> None:
    task = task_of(stack("Steer"), pedestrians=20)
    assert run_episode(task).row == run_episode(task).row


@pytest.mark.slow
def test_one_that_fails_has_failed_its_deliveries_and_nothing_else_is_lost(
    stack: Write,
    hall: Path,
    in_process: None,
    tmp_path: Path,
) -> None:
    stacks = [str(stack(name, limit=2.0)) for name in (*ENDS, "Steer")]
    rules = str(tmp_path / "rules.yaml")
    run = navbench.run(
        stacks,
        2,
        map=str(hall),
        pedestrians=0,
        rules=rules,
        workers=1,
        out=tmp_path / "run",
    )
    rows = run.table().to_pylist()
    assert len(rows) == 2 * len(stacks)
    for row in rows:
        is_sound = row["stack"] == "steer"
        assert row["error"] is None and (row["stack_error"] is None) == is_sound
        assert (row["reason"] == "stack failed") != is_sound
    for name, valuation in run.valuations.items():
        assert valuation.measured["physical_assistance"] == float(name != "steer")
        if name != "steer":
            assert valuation.economics.contribution_margin < 0.0


@pytest.mark.parametrize("name", ENDS)
def test_what_went_wrong_is_told_in_a_line(name: str, stack: Write, task_of: Task) -> None:
    row = run_episode(task_of(stack(name, limit=2.0))).row
    assert row["outcome"] == "physical_assistance" and row["duration_s"] < 2.0
    assert re.search(ENDS[name], row["stack_error"]) and "\n" not in row["stack_error"]


def test_a_lost_policy_is_loaded_again(stack: Write, task_of: Task) -> None:
    task = task_of(stack("Ends"))
    for _ in range(2):
        assert "status 7" in run_episode(task).row["stack_error"]


def test_a_policy_that_could_not_be_loaded_is_loaded_again(stack: Write, tmp_path: Path) -> None:
    """As when the memory that it needs is free a moment later."""
    (tmp_path / "gain.txt").write_text("much")
    loaded = load_stack(str(stack("Weighed", more=", file: gain.txt")))
    policy = PolicyProcess(loaded.navigator, loaded.policy)
    with pytest.raises(PolicyError, match="load: ValueError"):
        policy.reset(0)
    (tmp_path / "gain.txt").write_text("2.5")
    policy.reset(0)
    policy.close()


@pytest.mark.parametrize(
    ("policy", "told"),
    [("nowhere:Policy", "load: ModuleNotFoundError"), ("math:Policy", "load: AttributeError")],
)
def test_a_policy_that_cannot_be_loaded(policy: str, told: str) -> None:
    with pytest.raises(PolicyError, match=told):
        PolicyProcess(policy, PolicyParams()).start()


@pytest.mark.slow
def test_one_that_only_one_process_can_load_drives(
    stack: Write, hall: Path, tmp_path: Path
) -> None:
    """As one that binds a port, or takes a whole graphics card: the check lets go of it."""
    (tmp_path / "alone.txt").write_text(str(tmp_path))
    rules = str(tmp_path / "rules.yaml")
    given = {"map": str(hall), "pedestrians": 0, "rules": rules, "workers": 1}
    path = str(stack("Alone", more=", file: alone.txt"))
    run = navbench.run(path, 1, out=tmp_path / "run", **given)
    assert run.table()["stack_error"].to_pylist() == [None]
    (tmp_path / "alone.txt").write_text("taken")
    with pytest.raises(InputError, match="load: OSError: taken"):
        navbench.run(path, 1, out=tmp_path / "other", **given)
    assert not (tmp_path / "other").exists()


def test_one_whose_file_went_has_failed_no_delivery(
    stack: Write, task_of: Task, tmp_path: Path
) -> None:
    (tmp_path / "alone.txt").write_text("taken")
    with pytest.raises(PolicyError, match="load: OSError"):
        run_episode(task_of(stack("Alone", more=", file: alone.txt")))


def test_one_that_is_asked_more_often_than_the_nav2_file_ticks(stack: Write, task_of: Task) -> None:
    """The file's tick is 60 Hz."""
    path = stack("Steer")
    path.write_text(path.read_text().replace("policy: {", "policy: {rate: 120, "))
    steps, seconds = Parts(task_of(path)).world().tick
    assert steps * seconds == pytest.approx(1.0 / 120.0)


def test_a_policy_is_made_with_its_file(stack: Write, tmp_path: Path) -> None:
    (tmp_path / "gain.txt").write_text("2.5")
    loaded = load_stack(str(stack("Weighed", more=", file: gain.txt")))
    assert loaded.policy.file == str(tmp_path / "gain.txt")
    PolicyProcess(loaded.navigator, loaded.policy).start()
    (tmp_path / "gain.txt").write_text("much")
    with pytest.raises(PolicyError, match="load: ValueError"):
        PolicyProcess(loaded.navigator, loaded.policy).start()


def test_the_end_of_the_program_ends_the_policy(stack: Write) -> None:
    loaded = load_stack(str(stack("Steer")))
    policy = PolicyProcess(loaded.navigator, loaded.policy)
    policy.start()
    process = policy._process
    assert process is not None and process.poll() is None
    del policy
    assert process.poll() is not None


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("policies.py:Steer", "absent.py:Steer"), "absent.py is not there"),
        (("nav2_file: gps_ekf\n", ""), "key 'nav2_file' is missing; it has the localizer's"),
        (("time_limit: 60.0", "rate: 0.0"), "rate 0.0 must be more than 0 to 1000"),
        (("policies.py:Steer", "steered"), "unknown navigator 'steered'"),
    ],
)
def test_a_stack_that_names_no_policy(change: tuple[str, str], told: str, stack: Write) -> None:
    path = stack("Steer")
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(ParameterError if "unknown" not in told else InputError, match=told):
        load_stack(str(path))


def test_collected_data_are_paid_for(
    stack: Write,
    hall: Path,
    in_process: None,
    tmp_path: Path,
) -> None:
    path = stack("Along", more=", data_collection: true")
    run = navbench.run(
        str(path),
        1,
        map=str(hall),
        pedestrians=0,
        rules=str(tmp_path / "rules.yaml"),
        out=tmp_path / "run",
    )
    economics, prices = run.valuations["along"].economics, run.stored.prices()
    collected = prices.data_collector_wage.value * prices.data_collection_time.value
    assert economics.data_collection_usd == collected > 0.0
    assert economics.capex_usd == economics.hardware_usd + economics.data_collection_usd


def test_a_changed_policy_is_noted_when_a_run_goes_on(
    stack: Write,
    hall: Path,
    in_process: None,
    tmp_path: Path,
) -> None:
    path = stack("Along")
    navbench.run(
        str(path),
        1,
        map=str(hall),
        pedestrians=0,
        rules=str(tmp_path / "rules.yaml"),
        out=tmp_path / "run",
    )
    assert (
        load_study(tmp_path / "run").template.stack.navigator == f"{tmp_path / 'policies.py'}:Along"
    )
    assert version_notes(tmp_path / "run") == []
    (tmp_path / "policies.py").write_text(
        (tmp_path / "policies.py").read_text() + "# another version\n"
    )
    assert version_notes(tmp_path / "run") == [
        "the run began with other files of its policy: further rows may differ"
    ]


def test_a_policy_takes_another_planner_and_no_controller(stack: Write) -> None:
    given: dict[str, Any] = {"stacks": [str(stack("Steer"))], "episodes": 1}
    with pytest.raises(
        InputError, match="a policy drives stack 'steer', and the controller_server"
    ):
        make_study(**given, substitutes=["FollowPath=dwb_core::DWBLocalPlanner"])
    make_study(**given, substitutes=["GridBased=navstack::IncrementalNavfn"])


ODD = os.fsdecode(b"odd-\xff")  # a name of a file that is not UTF-8


@pytest.mark.parametrize("name", ["Steer", "Unreadable"])
def test_names_and_errors_that_are_not_utf_8_lock_no_run(
    name: str,
    stack: Write,
    hall: Path,
    in_process: None,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    odd = stack(name).rename(tmp_path / f"{ODD}.yaml")
    rules, out = str(tmp_path / "rules.yaml"), tmp_path / "run"
    arguments = ["--map", str(hall), "--pedestrians", "0", "--rules", rules, "--out", str(out)]
    arguments += ["--episodes", "1", "--stack", str(odd), "--workers", "1", "--record", "decisions"]
    for words in (["run", *arguments], ["run", "--resume", str(out)]):
        with pytest.raises(SystemExit) as leaving:
            main(words)
        assert leaving.value.code == (0 if name == "Steer" else 3)
        told = capsys.readouterr()
        assert "Traceback" not in told.err
        (told.out + told.err).encode()
    rows = pq.read_table(out / "episodes.parquet").to_pylist()
    error = None if name == "Steer" else r"PolicyError: .*weights-\\udcff\.bin"
    assert [row["stack"] for row in rows] == [r"odd-\udcff"]
    (row,) = rows
    assert row["error"] is None
    if error is None:
        assert row["stack_error"] is None
    else:
        assert re.match(error, row["stack_error"])

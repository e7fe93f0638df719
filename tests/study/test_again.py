"""Some deliveries by their numbers, and some driven once more to be looked at."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from harness.ablation.arms import arms_of, with_arms
from harness.execution.workers import Workers
from harness.study.again import PARTINGS, record_again, recorded_again
from harness.study.stored_run import load_run
from harness.task.study import Study, make_study
from navbench.cli.app import main
from navstack.errors import InputError
from tests.rules import short_rules

RULES = short_rules(1.0)


@pytest.fixture
def study(tmp_path: Path) -> Study:
    (tmp_path / "short.yaml").write_text(RULES)
    rules = str(tmp_path / "short.yaml")
    return make_study(stacks=["parked"], episodes=5, rules=rules, pedestrians=2, workers=1)


def drive(tmp_path: Path, name: str, *options: str) -> list[dict[str, object]]:
    fixed = (
        "--stack",
        "parked",
        "--rules",
        str(tmp_path / "short.yaml"),
        "--pedestrians",
        "2",
        "--workers",
        "1",
    )
    with pytest.raises(SystemExit) as ended:
        main(["run", *fixed, "--out", str(tmp_path / name), *options])
    assert ended.value.code == 0
    return list(load_run(str(tmp_path / name)).stacks[0].rows)


def test_a_delivery_by_its_number_is_the_one_of_the_whole_run(
    study: Study,
    in_process: None,
    tmp_path: Path,
) -> None:
    whole = drive(tmp_path, "whole", "--episodes", "5")
    some = drive(tmp_path, "some", "--only", "4", "--only", "1", "--only", "4")
    assert some == [whole[1], whole[4]]
    assert json.loads((tmp_path / "some" / "run.json").read_text())["only"] == [1, 4]
    with pytest.raises(SystemExit) as ended:
        main(["run", "--resume", str(tmp_path / "some")])  # it lacks nothing
    assert ended.value.code == 0
    assert list(load_run(str(tmp_path / "some")).stacks[0].rows) == some


def test_a_manifest_that_contradicts_itself_is_refused(
    study: Study,
    in_process: None,
    tmp_path: Path,
) -> None:
    from harness.storage.checksums import write_checksums
    from harness.study.manifest import load_study

    drive(tmp_path, "some", "--only", "1", "--only", "3")
    file = tmp_path / "some" / "run.json"
    content = json.loads(file.read_text())
    for only, said in (
        ([1], "has 1 deliveries, but episodes says 2"),
        (["1", 3], "not a list of numbers"),
    ):
        file.write_text(json.dumps({**content, "only": only}))
        write_checksums(tmp_path / "some")
        with pytest.raises(InputError, match=said):
            load_study(tmp_path / "some")


def test_numbers_out_of_range_are_refused() -> None:
    with pytest.raises(InputError, match="--only -1"):
        make_study(stacks=["parked"], episodes=5, only=[3, -1])


@pytest.mark.slow
def test_what_is_recorded_again_is_the_same_and_is_driven_once(
    study: Study,
    in_process: None,
    tmp_path: Path,
) -> None:
    whole = drive(tmp_path, "whole", "--episodes", "5")
    parent = tmp_path / PARTINGS
    with Workers(1) as workers:
        folder = record_again(parent, "these", study.stacks, study.template, (3, 0), workers)
        assert list(load_run(str(folder)).stacks[0].rows) == [whole[0], whole[3]]
        recordings = {
            file.name: file.stat().st_mtime_ns for file in (folder / "recordings").glob("*.npz")
        }
        assert set(recordings) == {"parked-0.npz", "parked-3.npz"}
        assert (
            record_again(parent, "these", study.stacks, study.template, (3, 0), workers) == folder
        )
        assert recordings == {
            file.name: file.stat().st_mtime_ns for file in (folder / "recordings").glob("*.npz")
        }
        other = record_again(parent, "these", study.stacks, study.template, (2,), workers)
    assert list(load_run(str(other)).stacks[0].rows) == [whole[2]]
    assert not folder.exists() and list(recorded_again(parent)) == [other]


def test_other_parameters_are_driven_anew(study: Study, in_process: None, tmp_path: Path) -> None:
    fewer = dataclasses.replace(study.template, pedestrians=0)
    with Workers(1) as workers:
        first = record_again(
            tmp_path / PARTINGS,
            "these",
            study.stacks,
            study.template,
            (1,),
            workers,
        )
        crowd = np.load(first / "recordings" / "parked-1.npz")["crowd"]
        other = record_again(tmp_path / PARTINGS, "these", study.stacks, fewer, (1,), workers)
    assert (
        crowd.shape[1] == 2
        and np.load(other / "recordings" / "parked-1.npz")["crowd"].shape[1] == 0
    )


def test_arms_of_an_ablation_drive_the_chosen_deliveries() -> None:
    study = make_study(stacks=["nav2-gps"], episodes=5, only=[7, 2], workers=1)
    driven = with_arms(study, arms_of(study.stacks[0], ("ground_truth", "gps"), ()), 1)
    assert [(task.stack.name, task.episode) for task in driven.tasks()] == [
        *(("ground_truth", 2), ("ground_truth", 7)),
        *(("gps", 2), ("gps", 7)),
    ]

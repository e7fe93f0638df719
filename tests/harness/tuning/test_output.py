"""What a study leaves in its folder, file by file."""

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from harness.storage.shipped import shipped
from harness.storage.tables import read_rows
from harness.task.stack import Stack, load_stack
from harness.tuning.declaration import StudyDeclaration
from harness.tuning.evaluation import Candidate, Value, unseen_seed
from harness.tuning.output import (
    DIFF,
    FRONT,
    STACK,
    TRIALS,
    TUNED,
    run_command,
    study_document,
    write_files,
)
from harness.tuning.output import test_command as command_of_the_test
from harness.tuning.result import COMPLETE, FAILED, PRUNED, Finalist, StudyResult, Trial
from harness.tuning.space.file import OF_TRIAL
from harness.tuning.space.space import Parameter, Space
from navstack.params.nav2_file.file import Nav2File, load_nav2
from navstack.params.strict import load_dataclass

SCALE, SAMPLES = (
    "controller_server.FollowPath.PathAlign.scale",
    "controller_server.FollowPath.vx_samples",
)
SPACE = Space(
    "own",
    "",
    (
        Parameter("scale", (SCALE,), 32.0, 1.0, 64.0, is_log=True),
        Parameter("samples", (SAMPLES,), 20, choices=(10, 20)),
    ),
)
DECLARATION = StudyDeclaration(
    "stock.yaml",
    "own",
    "margin",
    "tpe",
    2,
    8,
    4,
    True,
    0,
    None,
    "lidar",
    "segway",
    ("--strict", "--map", "hall"),
)


def trial(number: int, state: str, missions: int, told: float | None, **point: Value) -> Trial:
    candidate = Candidate(f"trial-{number}", SPACE.values({**SPACE.original, **point}))
    values = () if told is None else (told, -50.0)
    return Trial(
        *(
            number,
            candidate,
            {**SPACE.original, **point},
            state,
            tuple(range(missions)),
            values,
            values[:1],
        ),
        *(0.25 if state == PRUNED else None, "it died" if state == FAILED else ""),
    )


TRIALS_DRIVEN = (
    trial(0, COMPLETE, 8, 1.0),
    trial(1, PRUNED, 4, 0.5, samples=10),
    trial(2, COMPLETE, 8, 2.0, scale=7.5),
    trial(3, FAILED, 2, None, scale=9.0, samples=10),
)


def result(*objectives: str) -> StudyResult:
    incumbent = Candidate("incumbent", TRIALS_DRIVEN[2].candidate.values)
    original, rows, final = (
        Candidate("original", {}),
        ((), ()),
        (Finalist(2, incumbent, 16, 1.75, 0.0),),
    )
    missions = tuple(range(8))
    return StudyResult(
        original,
        incumbent,
        objectives,
        SPACE,
        TRIALS_DRIVEN,
        (0, 2),
        3,
        missions,
        (),
        rows,
        (),
        final,
    )


@pytest.fixture(scope="module")
def stock() -> Nav2File:
    return load_nav2(shipped("params") / "nav2" / "stock.yaml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, stock: Nav2File) -> Path:
    """Of a study with two objectives, in which a trial was on the front before."""
    path = tmp_path_factory.mktemp("study")
    (path / FRONT).mkdir()
    (path / FRONT / "trial-9.nav2.yaml").write_text("beaten since")
    write_files(result("margin", "-duration_s"), stock, load_stack("nav2-stock"), DECLARATION, path)
    return path


def test_the_tuned_file_its_stack_and_the_front(folder: Path, stock: Nav2File) -> None:
    stack, tuned = load_stack("nav2-stock"), (folder / TUNED).read_text()
    assert tuned == stock.with_values({SCALE: 7.5}, False).document.text != stock.document.text
    changed = [line for line in (folder / DIFF).read_text().splitlines()[2:] if line[0] in "+-"]
    assert len(changed) == 2 and changed[1].strip("+ ") == "PathAlign.scale: 7.5"
    driven = load_dataclass(Stack, folder / STACK)
    title = f"{stack.title}; tuned for margin in the space own"
    own: dict[str, Any] = {
        "name": "",
        "title": title,
        "nav2_file": TUNED,
        "sensors": "lidar",
        "robot": "segway",
    }
    assert driven == dataclasses.replace(stack, **own)
    assert {file.name for file in (folder / FRONT).iterdir()} == {
        "trial-0.nav2.yaml",
        "trial-2.nav2.yaml",
    }
    assert (folder / FRONT / "trial-0.nav2.yaml").read_text() == stock.document.text
    assert (folder / FRONT / "trial-2.nav2.yaml").read_text() == tuned


def test_one_objective_has_no_front(tmp_path: Path, stock: Nav2File) -> None:
    write_files(result("margin"), stock, load_stack("nav2-stock"), DECLARATION, tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == {TUNED, DIFF, STACK, TRIALS}


def test_the_table_of_the_trials(folder: Path) -> None:
    objectives = {"objective_margin": "double", "objective_-duration_s": "double"}
    rows = list(
        read_rows(
            folder / TRIALS, {**OF_TRIAL, **objectives, "scale": "double", "samples": "double"}
        )
    )
    assert [tuple(row.values()) for row in rows] == [
        (0, "complete", 8, 1.0, None, "", 1.0, -50.0, 32.0, 20.0),
        (1, "pruned", 4, 0.5, 0.25, "", 0.5, -50.0, 32.0, 10.0),
        (2, "complete", 8, 2.0, None, "", 2.0, -50.0, 7.5, 20.0),
        (3, "failed", 2, None, None, "it died", None, None, 9.0, 10.0),
    ]


def test_the_document(stock: Nav2File) -> None:
    folder = Path("there")
    found = study_document(
        result("margin", "-duration_s"),
        stock,
        DECLARATION,
        {"train": 1},
        {"errors": 0},
        folder,
    )
    scale = {"low": 1.0, "high": 64.0, "log": True, "step": None}
    command = command_of_the_test(DECLARATION, 3, folder)
    assert (
        command == f"navbench run --stack there/tuned.yaml --strict --map hall --seed "
        f"{unseen_seed(3)} --episodes 4"
    )
    untested = dataclasses.replace(DECLARATION, test_episodes=0)
    assert command_of_the_test(untested, 3, folder).endswith(" --seed 3 --episodes 8")
    assert run_command(DECLARATION, folder)[-2:] == ("--map", "hall")
    assert found == {
        **{
            "schema": 1,
            "stack": "stock.yaml",
            "objectives": ["margin", "-duration_s"],
            "sampler": "tpe",
        },
        "space": {
            "name": "own",
            "parameters": [
                {"name": "scale", "paths": [SCALE], "original": 32.0, **scale},
                {"name": "samples", "paths": [SAMPLES], "original": 20, "choices": [10, 20]},
            ],
        },
        **{"seed": 3, "test_seed": unseen_seed(3), "trials_asked": 2},
        "sizes": {"test_episodes": 4, "final_episodes": 0, "waterfall_missions": 0},
        "trials": {"complete": 2, "failed": 1, "pruned": 1},
        "training_episodes": {"missions": 8, "driven": 22, "without_racing": 24},
        "incumbent": {"trial": 2, "changes": [{"path": SCALE, "from": 32.0, "to": 7.5}]},
        "finals": [{"trial": 2, "missions": 16, "value": 1.75}],
        "front": [{"trial": 0, "values": [1.0, -50.0]}, {"trial": 2, "values": [2.0, -50.0]}],
        **{"train": 1, "lint": {"errors": 0}, "command": command, "folder": "there"},
        "files": {"tuned": TUNED, "stack": STACK, "diff": DIFF, "trials": TRIALS},
    }

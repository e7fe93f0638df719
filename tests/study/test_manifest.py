"""What run.json says of a run."""

from pathlib import Path

import pytest

from harness.study.manifest import about
from harness.task.study import make_study

WALK = "id,t,x,y\n1,0,-60,-70\n1,9,-50,-70\n"


@pytest.mark.parametrize(
    ("arguments", "typed"),
    [
        (["/home/me/.venv/bin/navbench", "run"], ["navbench", "run"]),
        (
            ["/home/me/navbench/tools/calibrate.py", "verify"],
            ["python", "tools/calibrate.py", "verify"],
        ),
        (["-c", "run"], ["navbench", "run"]),
        ([], ["navbench"]),
    ],
)
def test_the_command_is_what_one_types_anywhere(arguments: list[str], typed: list[str]) -> None:
    assert about(make_study(stacks=["parked"], episodes=1), arguments)["command"] == typed


def test_a_recording_is_named_without_the_folder_that_it_came_from(tmp_path: Path) -> None:
    (tmp_path / "walk.csv").write_text(WALK)
    study = make_study(stacks=["parked"], episodes=1, people=str(tmp_path / "walk.csv"))
    assert about(study, [])["people"] == "walk.csv"
    assert (
        about(make_study(stacks=["parked"], episodes=1, people="social_force"), [])["people"]
        == "social_force"
    )

"""What run.json says of a run."""

from pathlib import Path

import pytest

from harness.storage.manifest_file import share_out, shared_within
from harness.storage.new_run import create_run
from harness.study.manifest import about, load_study, parameters
from harness.task.study import Study, make_study
from navstack.errors import InputError

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


def two_stacks(folder: Path, **more: object) -> Study:
    """A run of two stacks that has driven nothing yet; ``more`` entries are in its manifest."""
    study = make_study(stacks=["parked", "nav2-gps"], episodes=4)
    create_run(folder, {**about(study, []), **more}, parameters(study))
    return load_study(folder)


def test_stacks_can_have_different_numbers_of_deliveries(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    whole = two_stacks(folder)
    assert whole.counts == () and whole.total == 8
    assert shared_within(folder) is None
    share_out(folder, {"nav2-gps": 3, "parked": 1}, 0.5)
    assert shared_within(folder) == 0.5
    study = load_study(folder)
    assert study.counts == (1, 3) and study.total == 4
    driven = [(0, 0), (1, 0), (1, 1), (1, 2)]
    assert [(task.stack_number, task.episode) for task in study.tasks()] == driven
    for block in (1, 2, 5):
        turns = [(task.stack_number, task.episode) for task in study.tasks_in_turns(block)]
        assert sorted(turns) == driven


@pytest.mark.parametrize(
    "counts", [{"parked": 1}, {"parked": 1, "nav2-gps": 5}, {"parked": 0, "nav2-gps": 1}, [1, 2]]
)
def test_a_manifest_with_other_numbers_is_refused(tmp_path: Path, counts: object) -> None:
    with pytest.raises(InputError, match="episodes_of: .* has n"):
        two_stacks(tmp_path / "run", episodes_of=counts)

"""What a stack's file names is looked for beside that file.

What a user names, where the user is.
"""

import dataclasses
import os
from pathlib import Path

import pytest

from harness.storage.new_run import create_run
from harness.storage.shipped import shipped
from harness.study.manifest import about, load_study, parameters
from harness.task.stack import Stack, load_stack, policy_module
from harness.task.study import make_study
from navstack.errors import InputError
from navstack.params.strict import dump_dataclass

FILES = {
    "nav2_file": ("nav2", "tuned"),
    "sensors": ("sensors", "rtk_urban"),
    "robot": ("robots", "segway_e1"),
}
SHIPPED = load_stack("nav2-gps")


@pytest.fixture
def mine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a stack and what it names.

    Files of the same names, but damaged, are where the user is.
    """
    for folder in ("mine", "mine/parts", "here", "here/parts"):
        (tmp_path / folder).mkdir()
    for kind, name in FILES.values():
        text = (shipped("params") / kind / f"{name}.yaml").read_text(encoding="utf-8")
        for file in (f"{kind}.yaml", f"parts/{kind}.yaml"):
            (tmp_path / "mine" / file).write_text(text, encoding="utf-8")
            (tmp_path / "here" / file).write_text("damaged: true\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "mine"


def write(folder: Path, **files: str) -> Path:
    given = {"nav2_file": "gps_ekf", "sensors": "rtk_good", "robot": "segway_e1", **files}
    stack = dataclasses.replace(SHIPPED, name="", **given)
    (folder / "stack.yaml").write_text(dump_dataclass(stack), encoding="utf-8")
    return folder / "stack.yaml"


def files_of(stack: Stack) -> list[str]:
    return [getattr(stack, key) for key in FILES]


@pytest.mark.parametrize("place", ["", "./", "parts/", "../mine/parts/"])
def test_files_are_found_beside_the_stacks_own(mine: Path, place: str) -> None:
    file = write(mine, **{key: f"{place}{kind}.yaml" for key, (kind, _) in FILES.items()})
    expected = [str((mine / place / f"{kind}.yaml").resolve()) for kind, _ in FILES.values()]
    assert files_of(load_stack(str(file))) == expected
    assert files_of(load_stack(os.path.relpath(file))) == expected


def test_a_comment_makes_no_nav2_file_of_a_stack(tmp_path: Path) -> None:
    text = (shipped("params") / "stacks" / "nav2-gps-ekf.yaml").read_text(encoding="utf-8")
    file = tmp_path / "mine.yaml"
    file.write_text(f"# ros__parameters are those of gps_ekf\n{text}", encoding="utf-8")
    assert load_stack(str(file)).nav2_file == load_stack("nav2-gps-ekf").nav2_file
    nav2 = (shipped("params") / "nav2" / "starter.yaml").read_text(encoding="utf-8")
    file.write_text(nav2.replace("ros__parameters:", '"ros__parameters":  # here', 1))
    assert load_stack(str(file)).nav2_file == str(file)
    file.write_text('{"node#1": {"ros__parameters": {"a": 1}}}')
    with pytest.raises(InputError, match="no node of Nav2 in it"):
        load_stack(str(file))


@pytest.mark.parametrize(
    ("navigator", "found"),
    [
        ("my_policy:Along", ["my_policy.py"]),
        ("my_package.way:Along", ["my_package/way.py"]),
        ("my_package.more:Along", ["my_package/more/__init__.py"]),
        ("my_package:Along", ["my_package/__init__.py"]),
        ("my_package.none:Along", []),
        ("no_such_one:Along", []),
        ("sys:Along", []),
        (":Along", []),
        ("nav2", []),
    ],
)
def test_a_policy_of_a_module_has_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, navigator: str, found: list[str]
) -> None:
    """Which is found without running anything of the package."""
    (tmp_path / "my_package" / "more").mkdir(parents=True)
    for name in ("my_policy.py", "my_package/__init__.py", "my_package/more/__init__.py"):
        (tmp_path / name).write_text("raise RuntimeError('no GPU')")
    (tmp_path / "my_package" / "way.py").touch()
    monkeypatch.syspath_prepend(tmp_path)
    stack = dataclasses.replace(SHIPPED, navigator=navigator)
    assert policy_module(stack) == [tmp_path / name for name in found]


def test_names_are_those_of_the_program(mine: Path) -> None:
    for name in ("gps_ekf", "rtk_good", "segway_e1"):
        (mine / name).write_text("a file of that name\n")
    assert files_of(load_stack(str(write(mine)))) == files_of(SHIPPED)


@pytest.mark.parametrize(
    ("key", "what"), [("sensors", "sensor preset"), ("robot", "robot"), ("nav2_file", "Nav2")]
)
def test_a_file_that_is_only_where_the_user_is_is_not_the_stacks(
    mine: Path, key: str, what: str
) -> None:
    (mine.parent / "here" / "only.yaml").write_text("x: 1\n")
    with pytest.raises(
        InputError,
        match=f"{what} file '{mine / 'only.yaml'}' does not exist; give a YAML file or a name",
    ):
        load_stack(str(write(mine, **{key: "only.yaml"})))


def test_what_the_user_names_is_where_the_user_is(mine: Path) -> None:
    here = mine.parent / "here"
    stack = load_stack(
        str(write(mine, robot="gone.yaml")), robot="robots.yaml", sensors="parts/sensors.yaml"
    )
    assert (stack.robot, stack.sensors) == (
        str(here / "robots.yaml"),
        str(here / "parts" / "sensors.yaml"),
    )
    assert load_stack("../mine/nav2.yaml").nav2_file == str(mine / "nav2.yaml")


def test_a_run_goes_on_from_its_own_copies(mine: Path) -> None:
    file = write(mine, **{key: f"parts/{kind}.yaml" for key, (kind, _) in FILES.items()})
    study = make_study(stacks=[os.path.relpath(file)], episodes=1)
    texts = parameters(study)
    create_run(mine / "run", about(study, ["navbench"]), texts)
    for kind, _ in FILES.values():
        (mine / "parts" / f"{kind}.yaml").unlink()
    stored = load_study(mine / "run")
    assert all(str(mine / "run" / "params") in each for each in files_of(stored.stacks[0]))
    assert all(
        parameters(stored)[name] == text for name, text in texts.items() if name.endswith(".yaml")
    )


@pytest.mark.parametrize(
    "text", ["", "- a\n", "<robot name='a'/>\n", "controller_server: {controller_frequency: 9.0}\n"]
)
def test_a_file_that_is_neither_a_stack_nor_nav2s_is_not_taken_for_a_stack(
    tmp_path: Path, text: str
) -> None:
    file = tmp_path / "given.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match="neither a Nav2 parameter file, .* nor a stack file"):
        load_stack(str(file))


@pytest.mark.parametrize(
    "given", [{"map_name": "a\0b.yaml"}, {"people": "a\0b.csv"}, {"people": "\ud800.csv"}]
)
def test_a_name_that_no_file_can_have_is_one_line(given: dict[str, str]) -> None:
    with pytest.raises(InputError, match="no file here has such a name"):
        make_study(stacks=["nav2-gps"], episodes=1, **given)

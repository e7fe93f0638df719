"""Algorithms of other packages, found through the entry-point group navstack.plugins."""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from harness.task.stack import load_stack
from navstack.build import build_localizer
from navstack.control.dwb.critics import build_critics
from navstack.errors import ParameterError
from navstack.params.dwb import DwbParams, TwirlingParams
from navstack.params.extensions import (
    Extension,
    algorithms,
    extensions,
    localizers,
    plugin_packages,
    uses_map,
)
from navstack.params.nav2_file.file import Nav2File, inspect_nav2, load_nav2
from navstack.params.nav2_file.ros_yaml import ParameterEntry
from navstack.params.nav2_file.values import read_values
from navstack.params.nav2_file.views import read_controller

MODULE = """
from dataclasses import dataclass
from navstack.control.dwb.critics.twirling import TwirlingCritic
from navstack.params.extensions import Extension

@dataclass(frozen=True)
class Params:
    scale: float = 1.0
    limit: float = 0.5

CRITIC = Extension("dwb_critics", "mine::Calm", Params, TwirlingCritic)
CONTROLLER = Extension("controllers", "mine::Slow", Params, lambda *given: given)
LOCALIZER = Extension(
    "localizers", "mine::Still", Params, lambda *given: given, inputs=("odometry", "scan")
)
"""
DWB = """
controller_server:
  ros__parameters:
    controller_plugins: ["FollowPath"]
    FollowPath:
      plugin: "dwb_core::DWBLocalPlanner"
      critics: ["PathDist", "Calm", "mine::Calm"]
      Calm: {class: "mine::Calm", scale: 2.0, limit: 0.25}
"""
OWN = DWB.split("plugin:")[0] + 'plugin: "mine::Slow"\n      limit: 0.125\n'

Install = Callable[..., None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Put a package with entry points where Python finds it."""

    def put(name: str, *points: str, module: str = MODULE) -> None:
        folder = tmp_path / name
        (folder / f"{name}-1.0.dist-info").mkdir(parents=True)
        (folder / f"{name}.py").write_text(module, encoding="utf-8")
        info = folder / f"{name}-1.0.dist-info"
        (info / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8"
        )
        lines = ["[navstack.plugins]", *(f"{point.lower()} = {name}:{point}" for point in points)]
        (info / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
        monkeypatch.syspath_prepend(str(folder))
        extensions.cache_clear()

    yield put
    monkeypatch.undo()
    for name in ("mine", "yours"):
        sys.modules.pop(name, None)
    extensions.cache_clear()


@pytest.fixture
def load(tmp_path: Path) -> Callable[[str], Nav2File]:
    """Load a file of this text."""

    def read(text: str) -> Nav2File:
        path = tmp_path / "robot.yaml"
        path.write_text(text, encoding="utf-8")
        return load_nav2(path)

    return read


def test_a_critic_of_another_package_scores_with_its_parameters(
    install: Install, load: Any
) -> None:
    install("mine", "CRITIC")
    params = read_controller(load(DWB)).params
    assert list(build_critics(params)) == ["PathDist", "Calm", "mine::Calm"]
    calm, by_type = (params.named_critics[name] for name in ("Calm", "mine::Calm"))
    assert calm.type == by_type.type == "mine::Calm"
    assert (calm.params.scale, calm.params.limit, by_type.params.limit) == (2.0, 0.25, 0.5)


def test_a_controller_of_another_package_is_read_and_written_merged(
    install: Install, load: Any
) -> None:
    install("mine", "CONTROLLER")
    file = load(OWN)
    plugin = read_controller(file)
    assert (plugin.type, plugin.params.limit) == ("mine::Slow", 0.125)
    merged = file.merged()["controller_server"]["ros__parameters"]["FollowPath"]
    assert merged == {"plugin": "mine::Slow", "limit": 0.125, "scale": 1.0}
    parts = dict.fromkeys(("footprint", "control_frequency", "xy_goal_tolerance"), 2.0)
    assert algorithms("controllers")["mine::Slow"].create(1, parts=parts) == (1, 2.0, 2.0, 2.0)


def test_a_localizer_of_another_package_reads_its_node_and_drives_a_stack(
    install: Install, load: Any
) -> None:
    install("mine", "LOCALIZER")
    file = load("localizer: {ros__parameters: {limit: 0.125}}\n")
    grid = object()
    params, given = build_localizer("mine::Still", file, grid)
    assert (params.limit, given) == (0.125, grid)
    assert uses_map("mine::Still") and not file.notices and not file.ignored
    assert load_stack("nav2-gps", localizer="mine::Still").localizer == "mine::Still"


def test_a_factory_that_fails_is_named_in_one_line(install: Install) -> None:
    install("mine", "CONTROLLER", module=MODULE.replace("lambda *given: given", "lambda: None"))
    parts = dict.fromkeys(("footprint", "control_frequency", "xy_goal_tolerance"), 2.0)
    with pytest.raises(
        ParameterError, match="'mine::Slow' cannot be made .*TypeError.*; mend its package"
    ):
        algorithms("controllers")["mine::Slow"].create(1, parts=parts)


@pytest.mark.parametrize("text", [DWB.replace("limit", "limt"), OWN.replace("limit", "limt")])
def test_a_misspelt_parameter_of_it_is_an_error_with_a_hint(
    install: Install,
    tmp_path: Path,
    text: str,
) -> None:
    install("mine", "CRITIC", "CONTROLLER")
    path = tmp_path / "robot.yaml"
    path.write_text(text, encoding="utf-8")
    (error,) = inspect_nav2(path).errors
    assert "limt" in error and "did you mean 'limit'?" in error


def test_without_the_package_its_types_are_unknown(load: Any) -> None:
    with pytest.raises(ParameterError, match="unknown plugin 'mine::Calm'"):
        load(DWB)
    assert not any("::" in kind for kind in (*algorithms("dwb_critics"), *localizers()))


@pytest.mark.parametrize(
    ("module", "complaint"),
    [
        (
            "import nowhere",
            r"'critic = mine:CRITIC' of package mine cannot be loaded "
            r"\(ModuleNotFoundError.*uninstall",
        ),
        ("CRITIC = 3", "of package mine is int; it has to be an Extension"),
        (
            MODULE.replace("dwb_critics", "critics"),
            "unknown family 'critics'; known: controllers, dwb_",
        ),
    ],
)
def test_a_package_that_cannot_be_used_is_one_line(
    install: Install,
    load: Any,
    module: str,
    complaint: str,
) -> None:
    install("mine", "CRITIC", module=module)
    with pytest.raises(ParameterError, match=complaint) as raised:
        load(DWB)
    assert "\n" not in str(raised.value)


def test_two_packages_with_one_type_are_refused(install: Install, load: Any) -> None:
    install("mine", "CRITIC")
    install("yours", "CRITIC")
    assert plugin_packages() == ["mine", "yours"]
    with pytest.raises(ParameterError, match="'mine::Calm' is there twice"):
        load(DWB)


@pytest.mark.parametrize(
    "name", ["Twirling", "dwb_core::DWBLocalPlanner", "Calm", "::Calm", "mine::"]
)
def test_a_plug_in_has_a_name_of_its_own(name: str) -> None:
    family = "controllers" if "DWB" in name else "dwb_critics"
    with pytest.raises(ParameterError, match=r"give package::Class"):
        Extension(family, name, TwirlingParams, DwbParams)


def test_parameters_are_a_dataclass() -> None:
    with pytest.raises(ParameterError, match="give a dataclass of its parameters"):
        Extension("dwb_critics", "mine::Calm", dict, DwbParams)


@dataclass(frozen=True)
class Listed:
    gains: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class Wanted:
    gain: float


@dataclass(frozen=True)
class Moody:
    gain: float = 1.0
    names: tuple[str, ...] = ()
    limit: float | None = None

    def __post_init__(self) -> None:
        if self.gain > 2.0:
            raise ValueError("gain is too high")


def test_parameters_can_be_set_and_left_out() -> None:
    with pytest.raises(ParameterError, match=r"Listed.gains is list.*; give float, int, bool, str"):
        Extension("controllers", "mine::Slow", Listed, DwbParams)
    with pytest.raises(ParameterError, match=r"Wanted.gain has no default; give it one"):
        Extension("controllers", "mine::Slow", Wanted, DwbParams)
    assert Extension("controllers", "mine::Slow", Moody, DwbParams).params is Moody


def test_what_a_package_refuses_is_one_line() -> None:
    entries = {"Own.gain": ParameterEntry(3.0, 7, 6, 9, 4)}
    with pytest.raises(ParameterError, match="Moody: ValueError: gain is too high"):
        read_values(Moody, entries, "Own.", {})

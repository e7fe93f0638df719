"""Deliveries driven over ROS 2 by other processes give the same rows."""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

import navbench
from harness.metrics.columns import Row
from harness.study.places import Where
from harness.study.verification import ELSEWHERE, verify_run
from navbench.api.ros2 import serve
from navstack.errors import InputError

STACK = """
title: "A law"
navigator: {navigator}
nav2_file: gps_ekf
localizer: {localizer}
planning_map: navigation_mesh
sensors: {sensors}
carries: [lidar, gps]
robot: segway_e1
"""
SAME = {"seed": 3, "pedestrians": 2, "world": "easy", "episodes": 1}


@contextlib.contextmanager
def peer(*arguments: str) -> Iterator["subprocess.Popen[bytes]"]:
    program = Path(__file__).with_name("law_node.py")
    with subprocess.Popen(
        [sys.executable, str(program), *arguments], stderr=subprocess.DEVNULL
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def stack_file(folder: Path, name: str, navigator: str, localizer: str, more: str = "") -> str:
    """A stack whose sensors measure what messages carry."""
    sensors, file = folder / "sensors.yaml", folder / f"{name}.yaml"
    shipped = Path(navbench.__file__).parents[1] / "params" / "sensors" / "rtk_good.yaml"
    sensors.write_text(shipped.read_text() + "as_messages: true\n")
    text = STACK.format(navigator=navigator, localizer=localizer, sensors=sensors)
    file.write_text(text + more)
    return str(file)


@pytest.fixture
def rules(tmp_path: Path) -> str:
    return short_rules(tmp_path)


def short_rules(folder: Path) -> str:
    file = folder / "short.yaml"
    shipped = Path(navbench.__file__).parents[1] / "params" / "rules" / "costnav.yaml"
    lines = [
        line if not line.startswith("timeout") else "timeout: 6.0"
        for line in shipped.read_text().splitlines()
    ]
    file.write_text("\n".join(lines))
    return str(file)


def rows_of(folder: Path) -> list[Row]:
    rows: list[Row] = navbench.load(str(folder)).table().to_pylist()
    return rows


def driven(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """What the world says: not who drove, nor what its brain counts or believes."""
    own = ("stack", "stack_number", "plans", "navigator_history")
    return [
        {
            key: value
            for key, value in row.items()
            if key not in own and not key.startswith(("localization_error", "heading_error"))
        }
        for row in rows
    ]


@pytest.fixture(scope="module")
def in_own_process(
    hall: Path,
    tmp_path_factory: pytest.TempPathFactory,
    driven_in_process: Callable[[], contextlib.AbstractContextManager[None]],
) -> dict[str, list[dict[str, Any]]]:
    """Deliveries by the law as a policy, and by our brain."""
    folder, law = tmp_path_factory.mktemp("own"), Path(__file__).with_name("law.py")
    stacks = {
        "law": stack_file(folder, "law", f"{law}:Law", "gps-ekf", "policy: {rate: 60}\n"),
        "brain": stack_file(folder, "brain", "nav2", "gps-ekf"),
    }
    same = {**SAME, "rules": short_rules(folder), "map": str(hall), "workers": 1}
    found = {}
    with driven_in_process():
        for name, stack in stacks.items():
            navbench.run(stack, out=folder / f"run_{name}", **same)
            found[name] = driven(rows_of(folder / f"run_{name}"))
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "quality"),
    [("Twist", "reliable"), ("TwistStamped", "best_effort"), ("TwistStamped", "latched")],
)
def test_a_law_over_ros_2_drives_as_in_the_own_process(
    tmp_path: Path,
    hall: Path,
    rules: str,
    in_process: None,
    in_own_process: dict[str, list[dict[str, Any]]],
    kind: str,
    quality: str,
) -> None:
    with peer(kind, quality):
        serve(
            "law",
            stack=stack_file(tmp_path, "over", "ros2", "peer"),
            settings={"controller_frequency": 0.0, "wait": 20.0, "settle": 0.3},
            out=tmp_path / "second",
            rules=rules,
            map=str(hall),
            **SAME,
        )
    assert driven(rows_of(tmp_path / "second")) == in_own_process["law"]
    assert in_own_process["law"][0]["distance_m"] > 1.0
    found = verify_run(tmp_path / "second", 1, 0)
    assert found.reasons == [ELSEWHERE] and found.is_sound is None and not found.other


def test_what_cannot_be_served_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="navigator 'nav2'; serve needs ros2"):
        serve(stack="nav2-gps")
    with pytest.raises(InputError, match="--workers 2 is given, give --workers 1"):
        serve(where=Where(workers=2), episodes=1, out=tmp_path / "two")
    with pytest.raises(InputError, match="ros2 has no speed"):
        serve(settings={"speed": 2.0})


@pytest.mark.slow
def test_our_brain_in_another_process_drives_the_same(
    tmp_path: Path,
    hall: Path,
    rules: str,
    in_process: None,
    in_own_process: dict[str, list[dict[str, Any]]],
) -> None:
    """To the last bit, as its sensors measure what messages carry."""
    command = [sys.executable, "-m", "navbench", "drive", "--params", "gps_ekf"]
    told = tmp_path / "told.txt"
    with (
        told.open("w") as text,
        subprocess.Popen(
            [*command, "--laser", "-0.23", "0", "0"], stderr=text, env=os.environ
        ) as process,
    ):
        serve(
            "ours",
            stack=stack_file(tmp_path, "over", "ros2", "peer"),
            settings={"controller_frequency": 0.0, "wait": 60.0, "settle": 0.3},
            out=tmp_path / "second",
            rules=rules,
            map=str(hall),
            **SAME,
        )
        process.send_signal(signal.SIGTERM)  # SIGINT may be ignored here
        try:
            assert process.wait(120.0) == 130
        finally:
            process.kill()
    assert driven(rows_of(tmp_path / "second")) == in_own_process["brain"]
    assert in_own_process["brain"][0]["distance_m"] > 2.0
    assert "stopped: leaving" in told.read_text()

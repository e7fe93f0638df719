"""What the user is told before a study begins."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.episode.factory import Parts
from harness.storage.shipped import shipped
from harness.study import preflight
from harness.study.preflight import (
    crowd_notes,
    default_notes,
    footprint_notes,
    lidar_notes,
    notes_on_file,
    sensor_notes,
    start_notes,
)
from harness.task.stack import load_stack
from harness.task.study import make_study
from harness.world.map.extrude import extrude
from harness.world.map.scene_io import load_scene
from harness.world.physics.robot import RobotParams
from navstack.costmap.map_io import save_map
from navstack.costmap.occupancy_grid import OCCUPIED, OccupancyGrid
from navstack.errors import NavstackError
from navstack.params.nav2_file.file import inspect_nav2
from navstack.params.strict import load_dataclass
from navstack.types import Pose2D


@pytest.mark.parametrize("preset", ["rtk_urban", "consumer_gps"])
def test_errors_that_buildings_make_are_missed_on_a_map_without_them(preset: str) -> None:
    stack, scene = load_stack("nav2-gps", sensors=preset), load_scene("sidewalk_1")
    assert sensor_notes(stack, scene) == []
    flat = dataclasses.replace(
        scene, obstacles=extrude(scene.geometry, scene.geometry.data >= OCCUPIED)
    )
    (note,) = sensor_notes(stack, flat)
    assert all(words in note for words in ("hides satellites", "of glass", preset))
    assert sensor_notes(load_stack("nav2-gps", sensors="rtk_good"), flat) == []


def test_a_lidar_that_does_not_stand_where_its_file_says_is_told(tmp_path: Path) -> None:
    def notes(robot: str, sensors: str) -> list[str]:
        stack = load_stack("nav2-gps", robot=robot, sensors=sensors)
        return lidar_notes(stack, load_dataclass(RobotParams, Path(stack.robot)))

    assert notes("segway_e1", "rtk_good") == notes("jackal", "ust10") == []
    (note,) = notes("jackal", "rtk_good")
    assert note == (
        "nav2-gps: rtk_good is made for another robot than jackal, whose lidar stands in its middle"
    )
    own = tmp_path / "own.yaml"
    own.write_text((shipped("params") / "sensors" / "rtk_good.yaml").read_text())
    (note,) = notes("jackal", str(own))
    assert "the lidar of own stands beside jackal, at -0.23 m ahead and 0 m to the left" in note


@pytest.mark.parametrize(
    ("side", "is_told"), [("0.25", False), ("0.5", False), ("0.21", False), ("0.15", True)]
)
def test_a_robot_that_reaches_beyond_the_files_is_told(
    tmp_path: Path, side: str, is_told: bool
) -> None:
    """A Segway is 0.25 m wide on each side."""
    text = (shipped("params") / "nav2" / "stock.yaml").read_text()
    assert text.count("0.25]") >= 8
    path = tmp_path / "own.yaml"
    path.write_text(text.replace("0.25]", f"{side}]"))
    robot = load_dataclass(RobotParams, shipped("params") / "robots" / "segway_e1.yaml")
    notes = footprint_notes(inspect_nav2(path), robot, "own")
    assert any("it may touch what its costmap shows free" in note for note in notes) == is_told
    assert len(notes) == is_told


def test_bad_input_is_found_before_kernels_are_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled: list[object] = []
    monkeypatch.setattr(preflight, "compile_ahead", compiled.append)
    stock = Path(load_stack("nav2-stock").nav2_file).read_text()
    vast = tmp_path / "vast.yaml"
    vast.write_text(
        stock.replace("width: 6", "width: 1000000").replace("height: 6", "height: 1000000")
    )
    with pytest.raises(NavstackError, match="costmap"):
        preflight.check(make_study(stacks=[str(vast)], episodes=1, seed=0, workers=1))
    assert not compiled
    study = make_study(stacks=["parked"], episodes=1, seed=0, workers=1)
    preflight.check(study)
    assert compiled == [study.stacks]


def test_a_crowded_map_is_told(tmp_path: Path) -> None:
    hall = OccupancyGrid(np.zeros((200, 600), dtype=np.int8), 0.05, Pose2D())  # 30 m by 10 m
    save_map(hall, tmp_path / "hall.yaml")

    def notes(**choice: Any) -> list[str]:
        study = make_study(stacks=["parked"], episodes=1, workers=1, **choice)
        return crowd_notes(study, Parts(study.template))

    (note,) = notes(map_name=str(tmp_path / "hall.yaml"))
    assert (
        note.startswith("on this map 20 people share 300 m2, 42 times as densely")
        and "--pedestrians 1 " in note
    )
    assert notes(map_name=str(tmp_path / "hall.yaml"), pedestrians=20) == [] == notes()


GRACEFUL = """
controller_server:
  ros__parameters:
    progress_checker_plugin: progress_checker
    FollowPath: {plugin: "nav2_graceful_controller::GracefulController", %s}
velocity_smoother: {ros__parameters: {odom_topic: odom}}
"""


def test_defaults_of_another_distribution_are_told(tmp_path: Path) -> None:
    file = tmp_path / "humble.yaml"
    file.write_text(GRACEFUL % "k_phi: 2.5")
    (note,) = default_notes(inspect_nav2(file), "mine")
    assert note == (
        "mine: reads like a file of Nav2 humble, whose defaults are taken: controller_server: "
        "FollowPath.beta 0.2, controller_server: FollowPath.k_delta 2.0"
    )
    file.write_text(GRACEFUL % "k_phi: 2.5, k_delta: 1.0, beta: 0.4")
    assert default_notes(inspect_nav2(file), "mine") == []


def test_a_file_has_one_line_of_notes_and_a_shipped_one_none(tmp_path: Path) -> None:
    own = shipped("params") / "nav2" / "starter.yaml"
    assert inspect_nav2(own).ignored and notes_on_file(inspect_nav2(own), "starter") == []
    file = tmp_path / "mine.yaml"
    text = own.read_text(encoding="utf-8")
    file.write_text(text, encoding="utf-8")
    (note,) = notes_on_file(inspect_nav2(file), "mine")
    assert note.startswith("mine: not modelled here: ")
    misspelt = text.replace("    failure_tolerance:", "    failure_tolerence:", 1)
    file.write_text(misspelt, encoding="utf-8")
    nav2 = inspect_nav2(file, allow_unknown=True)
    (note,) = notes_on_file(nav2, "mine")
    told = f"mine: navbench lint {file} --full lists what is read otherwise than by Nav2 "
    before, _, misspelt = note.partition("; ")
    assert before == f"{told}(1) and what has no effect here ({len(nav2.ignored)})"
    assert "failure_tolerence" in misspelt and "failure_tolerance" in misspelt


def test_a_long_robot_is_told_where_its_missions_may_begin() -> None:
    params = shipped("params") / "robots"
    robot = load_dataclass(RobotParams, params / "segway_e1.yaml")
    stacks = [load_stack(name) for name in ("nav2-gps", "parked")]
    assert start_notes(stacks, [robot, robot]) == []
    long = ((0.9, 0.5), (0.9, -0.5), (-1.34, -0.5), (-1.34, 0.5))
    (note,) = start_notes(stacks, [robot, dataclasses.replace(robot, footprint=long)])
    assert note.startswith("the robot of parked reaches 1.43 m from where it starts")

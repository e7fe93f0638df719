"""Costmap filters whose info and mask servers stand in the Nav2 file.

From the mask's image to the robot's motion.
"""

import math

import numpy as np
import pytest
from PIL import Image

from harness.storage.shipped import shipped
from navstack.build import _build_costmap, build_navigator
from navstack.params.nav2_file.file import load_nav2
from navstack.types import Pose2D

SERVERS = """
{name}_costmap_filter_info_server:
  ros__parameters:
    type: {type}
    filter_info_topic: {name}_costmap_filter_info
    mask_topic: {name}_filter_mask
    base: {base}
    multiplier: {multiplier}
{name}_filter_mask_server:
  ros__parameters:
    topic_name: {name}_filter_mask
    yaml_filename: masks/{name}.yaml
"""


MASK = """\
image: {name}.png
mode: raw
resolution: 0.2
origin: [0.0, 0.0, 0.0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""


@pytest.fixture
def nav2_with_mask(tmp_path):
    """The shipped stock file with a mask of 0.2 m cells; its values stand at 0..16 m, 0..8 m."""

    def _make(name, values, insert="", type=0, base=0.0, multiplier=1.0):
        (tmp_path / "masks").mkdir()
        # 'raw': the values themselves
        shades = np.where(values < 0, 255, values).astype(np.uint8)[::-1]
        Image.fromarray(shades).save(tmp_path / "masks" / f"{name}.png")
        (tmp_path / "masks" / f"{name}.yaml").write_text(MASK.format(name=name))
        text = (shipped("params") / "nav2" / "stock.yaml").read_text()
        head, anchor, tail = text.partition("\nmap_server:")
        text = head + insert + anchor + tail
        text += SERVERS.format(name=name, type=type, base=base, multiplier=multiplier)
        (tmp_path / "robot.yaml").write_text(text)
        return load_nav2(tmp_path / "robot.yaml")

    return _make


def test_a_keepout_mask_is_driven_around(room, make, drive, nav2_with_mask) -> None:
    grid = room()
    _, localizer = make(grid)
    values = np.zeros((40, 80), dtype=np.int8)
    values[:25, 35:45] = 100  # x 7 to 9 m, y 0 to 5 m, across the straight way
    navigator = build_navigator(nav2_with_mask("keepout", values), localizer, grid, None)
    driven = drive(navigator, localizer, Pose2D(3.0, 2.0, 0.5), Pose2D(13.0, 2.0, 0.0), 40.0)
    assert math.hypot(driven.pose.x - 13.0, driven.pose.y - 2.0) < 0.4
    assert not any(7.0 <= pose.x <= 9.0 and pose.y <= 5.0 for pose in driven.poses)
    assert navigator.counts.failed_plans == 0


def test_a_turned_mask_stands_as_a_turned_map_would(tmp_path, room, nav2_with_mask) -> None:
    """A wall along its x axis lies along the y axis after a quarter turn."""
    values = np.zeros((4, 10), dtype=int)
    values[0] = 100
    nav2 = nav2_with_mask("keepout", values)
    path = tmp_path / "masks" / "keepout.yaml"
    path.write_text(path.read_text().replace("[0.0, 0.0, 0.0]", f"[8.0, 2.0, {math.pi / 2}]"))
    costmap = _build_costmap(nav2, "global_costmap", room(), None)
    costmap.update(Pose2D(4.0, 4.0, 0.0), None, 0.0)
    # the wall's cells are x from 7.8 to 8.0 m, y from 2.0 to 4.0 m
    assert [costmap.master.cost_at(7.9, y) for y in (2.1, 3.9)] == [254, 254]
    assert costmap.master.cost_at(9.9, 2.1) < 253


def test_a_speed_mask_slows_the_robot_and_lets_it_go_again(
    room, make, drive, nav2_with_mask
) -> None:
    grid = room(30.0)
    _, localizer = make(grid)
    values = np.zeros((40, 150), dtype=np.int8)
    values[:, 50:85] = 70  # x 10 to 17 m: 100 - 70 = 30 % of 2 m/s
    insert = """      filters: ["speed_filter"]
      speed_filter:
        plugin: "nav2_costmap_2d::SpeedFilter"
        filter_info_topic: "/speed_costmap_filter_info"
"""
    nav2 = nav2_with_mask("speed", values, insert, type=1, base=100.0, multiplier=-1.0)
    navigator = build_navigator(nav2, localizer, grid, None)
    driven = drive(navigator, localizer, Pose2D(2.0, 4.0, 0.0), Pose2D(28.0, 4.0, 0.0), 30.0)
    speeds = np.array([command.linear_x for command in driven.commands])
    x = np.array([pose.x for pose in driven.poses])
    assert speeds[(x > 5.0) & (x < 10.0)].min() > 1.1  # the 2 m of plan that DWB sees, in sim_time
    # The global costmap, and with it the filter, is updated once per second; then the robot brakes.
    assert speeds[(x > 12.0) & (x < 17.0)].max() == pytest.approx(0.6, abs=0.01)
    assert speeds[(x > 19.0) & (x < 25.0)].min() > 1.1
    assert not nav2.errors

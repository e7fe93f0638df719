"""What the user is told before a study begins."""

import dataclasses

import pytest

from harness.preflight import sensor_notes
from harness.stack import load_stack
from harness.world.extrude import extrude
from harness.world.scene_io import load_scene
from navstack.costmap.occupancy_grid import OCCUPIED


@pytest.mark.parametrize("preset", ["rtk_urban", "consumer_gps"])
def test_errors_that_buildings_make_are_missed_on_a_map_without_them(preset: str) -> None:
    stack, scene = load_stack("nav2-gps", sensors=preset), load_scene("sidewalk_1")
    assert sensor_notes(stack, scene) == []
    flat = dataclasses.replace(scene, obstacles=extrude(scene.geometry, scene.geometry.data >= OCCUPIED))
    (note,) = sensor_notes(stack, flat)
    assert all(words in note for words in ("hides satellites", "of glass", preset))
    assert sensor_notes(load_stack("nav2-gps", sensors="rtk_good"), flat) == []

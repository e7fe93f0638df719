"""Real map_server maps become worlds.

What is occupied stands there, and a robot can be put into them.
"""

import os
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from harness.episode.factory import Parts, scene_of
from harness.task.mission import Mission
from harness.task.study import EpisodeTask, make_study
from harness.world.map.scene import Scene
from harness.world.map.scene_io import load_scene
from harness.world.map.shapes import polygon_area
from harness.world.map.statistics import measure, measure_edges
from navstack.costmap.occupancy_grid import FREE, OCCUPIED
from navstack.errors import MapError
from navstack.types import Pose2D, Twist2D

DATA = os.environ.get("NAVSTACK_DATA")
MAPS = sorted((Path(DATA) / "ros_maps").glob("*/*.yaml")) if DATA else []
# Nowhere in these is a robot of 0.62 m x 0.89 m a metre away from walls: worlds of desk robots, and
# test images.
WITHOUT_ROOM = {"map", "map_circular", "epuck_world_map", "testmap", "testmap2"}

pytestmark = pytest.mark.skipif(
    not MAPS, reason="NAVSTACK_DATA is not set or has no ros_maps: real maps are not there"
)


def parked_task(file: Path) -> EpisodeTask:
    study = make_study(stacks=["parked"], episodes=1, map_name=str(file), pedestrians=2, workers=1)
    return next(study.tasks())


def roomiest_place(scene: Scene) -> Pose2D:
    grid = scene.walkable
    clearance = ndimage.distance_transform_edt(np.pad(grid.data == FREE, 1))[1:-1, 1:-1]
    row, column = np.unravel_index(clearance.argmax(), clearance.shape)
    r = grid.resolution
    return Pose2D(grid.origin.x + (float(column) + 0.5) * r, grid.origin.y + (float(row) + 0.5) * r)


@pytest.mark.parametrize("file", MAPS, ids=lambda file: file.stem)
def test_what_is_occupied_stands_there(file: Path) -> None:
    scene = load_scene(file)
    assert scene.geometry.origin.yaw == 0.0
    assert scene.navigation_mesh is scene.walkable
    solid = (scene.geometry.data == OCCUPIED).sum() * scene.geometry.resolution**2
    assert sum(polygon_area(obstacle.polygon) for obstacle in scene.obstacles) == pytest.approx(
        solid
    )
    assert {obstacle.kind for obstacle in scene.obstacles} == {"unknown"}
    measured, edges = measure(scene), measure_edges(scene)
    assert measured.walkable_area == pytest.approx(
        (scene.walkable.data == FREE).sum() * scene.geometry.resolution**2
    )
    assert measured.pieces == 0
    assert edges is not None and 0.0 <= edges.open_metre <= edges.open_half_metre <= 1.0


@pytest.mark.parametrize("file", MAPS, ids=lambda file: file.stem)
def test_a_parked_robot_stands_and_scans_in_it(file: Path) -> None:
    task = parked_task(file)
    generators = task.generators()
    if file.stem in WITHOUT_ROOM:
        with pytest.raises(MapError, match="no room to draw missions"):
            Parts(task).mission(generators["mission"])
        place = roomiest_place(scene_of(task.map_name))
        mission = Mission(place, place, 0.0)
    else:
        mission = Parts(task).mission(generators["mission"])
        assert mission.shortest_path > 0.0
    world = Parts(task).world()
    observation = world.reset(mission, generators)
    for _ in range(20):
        observation = world.step(Twist2D())
    assert observation.scan is not None
    assert np.isfinite(observation.scan.ranges).any() or file.stem in WITHOUT_ROOM
    assert world.truth.stamp == pytest.approx(20 * 6 / 120)

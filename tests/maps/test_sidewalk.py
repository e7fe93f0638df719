"""The sidewalk world: the same for the same seed, and as large, wide and furnished as it is meant to be."""

import hashlib

import numpy as np
import pytest
from scipy import ndimage

from harness.world.map_statistics import MapStatistics, measure, medial_widths
from harness.world.scene import Scene
from harness.world.scene_io import load_scene
from harness.world.shapes import fill_convex, polygon_area
from harness.world.sidewalk import generate, rasterise
from navstack.costmap.occupancy_grid import FREE, OCCUPIED
from navstack.types import Pose2D

# What is known of the paper's world: area [m2], medial-axis widths [m], furniture and its spacing [m].
AREA, PIECES, MEDIUM_SHARE = 12_600.0, 330, 0.5
WIDTHS = (0.5, 0.8, 1.8, 2.9, 4.1, 7.0, 9.4)
SPACINGS = (1.6, 3.1, 6.6)
PRICED = {"mailbox", "trash_bin", "bollard", "plant", "fence"}
UNPRICED = {"hydrant", "lamp", "traffic_light", "newspaper_box", "bus_stop", "barrier"}


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene("sidewalk")


@pytest.fixture(scope="module")
def measured(scene: Scene) -> MapStatistics:
    return measure(scene)


def digest(scene: Scene) -> str:
    content = hashlib.sha256(scene.geometry.data.tobytes() + scene.walkable.data.tobytes())
    for obstacle in scene.obstacles:
        content.update(f"{obstacle.kind} {obstacle.height} {obstacle.polygon.tolist()}".encode())
    for zone in scene.zones:
        content.update(f"{zone.kind} {zone.polygon.tolist()}".encode())
    return content.hexdigest()


def test_the_shipped_world_is_that_of_seed_0(scene: Scene) -> None:
    assert digest(generate(0)) == digest(scene)


def test_another_seed_is_another_world(scene: Scene) -> None:
    other = generate(1)
    assert digest(other) != digest(scene)
    assert digest(generate(1)) == digest(other)


def test_frame(scene: Scene) -> None:
    for grid in (scene.geometry, scene.walkable):
        assert grid.data.shape == (4000, 4000)
        assert (grid.resolution, grid.origin) == (0.05, Pose2D(-100.0, -100.0, 0.0))
        assert set(np.unique(grid.data)) == {FREE, OCCUPIED}


def test_area_and_widths(measured: MapStatistics) -> None:
    assert measured.walkable_area == pytest.approx(AREA, rel=0.05)
    assert measured.connected_parts == 1
    assert measured.widths == pytest.approx(WIDTHS, rel=0.15)


def test_furniture(measured: MapStatistics) -> None:
    assert measured.pieces == pytest.approx(PIECES, rel=0.15)
    assert measured.medium_share == pytest.approx(MEDIUM_SHARE, rel=0.15)
    assert measured.spacings == pytest.approx(SPACINGS, rel=0.15)


def test_other_seeds_are_alike() -> None:
    measured = measure(generate(5))
    assert measured.walkable_area == pytest.approx(AREA, rel=0.12)
    assert measured.widths[2:] == pytest.approx(WIDTHS[2:], rel=0.25)
    assert measured.pieces == pytest.approx(PIECES, rel=0.25)


def test_kinds_and_zones(scene: Scene) -> None:
    assert {o.kind for o in scene.obstacles} == PRICED | UNPRICED | {"building_glass"}
    assert {z.kind for z in scene.zones} == {"road", "sidewalk", "crosswalk", "plaza", "construction", "work_area"}
    assert sum(z.kind == "sidewalk" for z in scene.zones) >= 8
    assert min(o.height for o in scene.obstacles if o.kind == "building_glass") >= 6.0
    for obstacle in scene.obstacles:
        edges = np.roll(obstacle.polygon, -1, axis=0) - obstacle.polygon
        turns = edges[:, 0] * np.roll(edges, -1, axis=0)[:, 1] - edges[:, 1] * np.roll(edges, -1, axis=0)[:, 0]
        assert (turns > 0).all()  # convex and counter-clockwise
        assert polygon_area(obstacle.polygon) > 0.04


def test_the_maps_agree_with_the_bodies(scene: Scene) -> None:
    visible = tuple(o for o in scene.obstacles if o.height >= 0.7)
    assert np.array_equal(scene.geometry.data == OCCUPIED, rasterise(visible))
    walkable = scene.walkable.data == FREE
    assert not (walkable & rasterise(scene.obstacles)).any()
    for zone in scene.zones:
        inside = np.zeros_like(walkable)
        fill_convex(inside, zone.polygon, True, 0.05, -100.0, -100.0)
        if zone.kind in ("construction", "work_area"):
            assert not (inside & walkable).any()
        elif zone.kind == "crosswalk":
            assert walkable[inside].all()
    free_road = (scene.geometry.data == FREE) & ~walkable
    assert free_road.mean() > 0.2  # a lidar sees across the roads


def test_the_robot_gets_from_everywhere_to_everywhere(scene: Scene) -> None:
    clearance = ndimage.distance_transform_edt(scene.walkable.data == FREE) * 0.05
    labels, _ = ndimage.label(clearance >= 0.4)
    sizes = np.bincount(labels.ravel())[1:]
    assert sizes.max() > 0.999 * sizes.sum()
    assert sizes.sum() > 0.75 * (clearance > 0).sum()


def test_furniture_does_not_overlap(scene: Scene) -> None:
    furniture = [o for o in scene.obstacles if o.kind != "building_glass"]
    padded = np.zeros((4240, 4240), dtype=np.uint8)
    for obstacle in furniture:
        column, row = ((obstacle.polygon.mean(axis=0) + 100.0) / 0.05).astype(int) - 120
        window = np.zeros((240, 240), dtype=bool)
        fill_convex(window, obstacle.polygon, True, 0.05, -100.0 + column * 0.05, -100.0 + row * 0.05)
        assert window.sum() * 0.0025 == pytest.approx(polygon_area(obstacle.polygon), rel=0.25)
        padded[row + 120 : row + 360, column + 120 : column + 360] += window
    assert padded.max() == 1


def test_widths_of_a_corridor_and_a_disc() -> None:
    corridor = np.zeros((60, 400), dtype=bool)
    corridor[20:41] = True
    widths = medial_widths(corridor)
    assert np.percentile(widths, 50) == pytest.approx(22.0, abs=1.0)
    y, x = np.indices((121, 121)) - 60
    disc = np.hypot(x, y) < 40.0
    assert medial_widths(disc).max() == pytest.approx(80.0, abs=2.0)

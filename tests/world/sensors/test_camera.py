"""The camera: what stands where is seen where it stands, by the pinhole's geometry."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from harness.task.camera_params import CameraParams
from harness.world.map.scene import Obstacle, Scene, Zone
from harness.world.physics.engine import bullet
from harness.world.sensors.camera import CLOTHES, COLORS, OTHER, SKIN, Camera
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import ParameterError
from navstack.types import Pose2D

GRID = OccupancyGrid(np.zeros((60, 60), dtype=np.int8), 0.5, Pose2D(-15.0, -15.0))
NOBODY = np.empty((0, 4))
PARAMS = CameraParams(width=160, height=120, fov=math.pi / 2, position=(0.0, 0.0, 1.0))


def square(x: float, y: float, half: float) -> np.ndarray:
    return np.array(((-half, -half), (half, -half), (half, half), (-half, half))) + (x, y)


def scene(*obstacles: Obstacle) -> Scene:
    return Scene("made-up", obstacles, (Zone("sidewalk", square(0.0, 0.0, 15.0)),), GRID, GRID)


def has_hue(image: np.ndarray, color: tuple[float, float, float]) -> np.ndarray:
    """Where a picture has a color, whatever light is on it."""
    given = image / np.maximum(image.max(axis=2, keepdims=True), 1.0)
    return np.abs(given - np.divide(color, max(color))).max(axis=2) < 0.06


def test_a_box_is_where_the_pinhole_puts_it():
    """4 m ahead, 2 m to the left, 1 m wide, 0.5 m to 2 m high: columns and rows by x / z."""
    box = Obstacle("plant", square(4.5, 2.0, 0.5), 2.0)
    image = Camera(scene(box), PARAMS, 0.3, 1.7).picture(Pose2D(), NOBODY)
    assert image.shape == (120, 160, 3) and image.dtype == np.uint8
    rows, columns = np.nonzero(has_hue(image, COLORS["plant"]))
    # its near left, its far right edge
    left, right = 80.0 * (1.0 - 2.5 / 4.0), 80.0 * (1.0 - 1.5 / 5.0)
    assert columns.min() == pytest.approx(left, abs=1.5) and columns.max() == pytest.approx(
        right, abs=1.5
    )
    top, bottom = 60.0 - 80.0 * (2.0 - 1.0) / 4.0, 60.0 + 80.0 * 1.0 / 4.0
    assert rows.min() == pytest.approx(top, abs=1.5) and rows.max() == pytest.approx(
        bottom, abs=1.5
    )


def test_it_turns_and_moves_with_the_robot():
    box = Obstacle("plant", square(0.0, 5.0, 0.5), 2.0)
    camera = Camera(scene(box), PARAMS, 0.3, 1.7)
    seen = [
        has_hue(camera.picture(pose, NOBODY), COLORS["plant"]).sum()
        for pose in (Pose2D(), Pose2D(yaw=math.pi / 2), Pose2D(0.0, 2.0, math.pi / 2))
    ]
    assert seen[0] == 0 < seen[1] < seen[2]


def test_a_camera_that_looks_down_sees_the_ground():
    down = CameraParams(width=80, height=60, pitch=1.2)
    image = Camera(scene(), down, 0.3, 1.7).picture(Pose2D(), NOBODY)
    assert has_hue(image, COLORS["sidewalk"]).all()


def test_people_are_where_they_are_and_nowhere_else():
    camera = Camera(scene(), PARAMS, 0.3, 1.7)
    people = np.array(((3.0, 0.0, 0.0, 0.0), (np.nan, np.nan, 0.0, 0.0)))
    image = camera.picture(Pose2D(), people)
    columns = np.nonzero(has_hue(image, CLOTHES[0]))[1]
    assert columns.mean() == pytest.approx(79.5, abs=1.0)
    assert columns.max() - columns.min() + 1 == pytest.approx(160.0 * 0.3 / 3.0, abs=2.5)
    assert not has_hue(image, CLOTHES[1]).any()
    rows, (head, across) = (
        np.nonzero(has_hue(image, CLOTHES[0]))[0],
        np.nonzero(has_hue(image, SKIN)),
    )
    # the head is 0.22 m high
    assert rows.min() == pytest.approx(60.0 - 80.0 * (1.48 - 1.0) / 2.7, abs=1.5)
    assert rows.max() == pytest.approx(60.0 + 80.0 * 1.0 / 2.7, abs=2.0)
    assert head.min() == pytest.approx(60.0 - 80.0 * (1.7 - 1.0) / 3.0, abs=1.5)
    assert across.max() - across.min() + 1 == pytest.approx(160.0 * 0.11 / 3.0, abs=1.5)
    assert across.mean() == pytest.approx(79.5, abs=1.0)
    assert not has_hue(camera.picture(Pose2D(), NOBODY), CLOTHES[0]).any()


def test_pictures_repeat_and_what_is_far_is_not_kept():
    boxes = [Obstacle("plant", square(2.0 * k, 3.0, 0.5), 1.0) for k in range(100)]
    camera = Camera(scene(*boxes), CameraParams(width=40, height=30, range=10.0), 0.3, 1.7)
    first = camera.picture(Pose2D(), NOBODY)
    for x in range(0, 200, 4):
        camera.picture(Pose2D(float(x)), NOBODY)
        assert len(camera._bodies) <= 27
    np.testing.assert_array_equal(camera.picture(Pose2D(), NOBODY), first)


def test_the_projection_is_that_of_a_pinhole_between_two_planes():
    """OpenGL's matrix, column by column; planes at 0.05 m and at the range."""
    params = CameraParams(width=160, height=120, fov=1.2, range=20.0)
    across, near, far = math.tan(0.6), 0.05, 20.0
    depth = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    expected = [
        1.0 / across,
        0,
        0,
        0,
        0,
        160 / 120 / across,
        0,
        0,
        0,
        0,
        depth[0],
        -1.0,
        0,
        0,
        depth[1],
        0,
    ]
    assert Camera(scene(), params, 0.3, 1.7)._projection == pytest.approx(expected, rel=1e-4)


def test_the_ground_goes_on_beyond_the_map_and_below_the_zones(monkeypatch):
    laid = []
    monkeypatch.setattr(Camera, "_prism", lambda camera, *given: laid.append(given))
    grid = OccupancyGrid(np.zeros((40, 60), dtype=np.int8), 0.25, Pose2D(-5.0, 10.0))
    zones = (Zone("road", square(0.0, 0.0, 4.0), -0.12), Zone("plaza", square(1.0, 2.0, 3.0)))
    Camera(Scene("made-up", (), zones, grid, grid), PARAMS, 0.3, 1.7)
    (around, *below, color), *others = laid
    assert around.tolist() == [[-55.0, -40.0], [60.0, -40.0], [60.0, 75.0], [-55.0, 75.0]]
    assert below == pytest.approx([-0.62, -0.121]) and color == OTHER
    assert [each[0].tolist() for each in others] == [zone.polygon.tolist() for zone in zones]
    assert [each[1:3] for each in others] == [
        pytest.approx((-0.62, -0.12)),
        pytest.approx((-0.62, 0.0005)),
    ]
    assert [each[3] for each in others] == [COLORS["road"], COLORS["plaza"]]


def test_a_prism_is_closed_but_for_its_bottom_and_looks_outwards(monkeypatch):
    """An L of 5 m2 and a perimeter of 12 m, 2 m high.

    Its volume by the divergence theorem, from within its bottom.
    """
    made = []
    monkeypatch.setattr(bullet, "createVisualShape", lambda kind, **given: made.append(given) or 4)
    corners = np.array(((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0))) + (
        10.0,
        20.0,
    )
    camera = SimpleNamespace(_client=6, _body=lambda *given: given)
    shape, place = Camera._prism(camera, corners, -0.5, 1.5, (0.1, 0.2, 0.3))
    assert shape == 4 and place == pytest.approx((*corners.mean(axis=0), 0.0))
    assert (made[0]["rgbaColor"], made[0]["physicsClientId"]) == ((0.1, 0.2, 0.3, 1.0), 6)
    triangles = (np.array(made[0]["vertices"])[made[0]["indices"]] + place).reshape(-1, 3, 3)
    assert {tuple(corner) for corner in triangles.reshape(-1, 3).round(9)} == {
        (*corner, height) for corner in corners.tolist() for height in (-0.5, 1.5)
    }
    a, b, c = triangles.transpose(1, 0, 2)
    areas = 0.5 * np.cross(b - a, c - a)  # with their directions
    volume, of_sides = (
        (areas * (a - (10.2, 20.2, -0.5))).sum() / 3.0,
        np.hypot(*areas[:, :2].T).sum(),
    )
    assert (volume, of_sides) == pytest.approx((10.0, 24.0))
    assert (areas[:, 2] >= -1e-12).all() and areas.sum(axis=0) == pytest.approx((0.0, 0.0, 5.0))


def test_policies_see_the_colours_that_they_have_learned_from():
    hexadecimal = {
        kind: "".join(f"{round(255 * part):02x}" for part in color)
        for kind, color in COLORS.items()
    }
    assert hexadecimal == {
        **{
            "building_glass": "8c9eb2",
            "mailbox": "1a40a6",
            "trash_bin": "335940",
            "plant": "33802e",
        },
        **{"fence": "735940", "bollard": "bfa626", "hydrant": "bf1f1a", "barrier": "e6731a"},
        **{
            "traffic_light": "262626",
            "road": "404045",
            "sidewalk": "a8a69e",
            "crosswalk": "d9d9d9",
        },
        **{"plaza": "b2a894", "lawn": "598c40", "construction": "998059"},
    }
    others = [
        "".join(f"{round(255 * part):02x}" for part in color) for color in (OTHER, SKIN, *CLOTHES)
    ]
    assert others == ["808080", "d9a680", "bf3333", "334cb2", "d9bf4c", "404047"]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"width": 64}, "width and height"),
        ({"width": 4000, "height": 10}, "width 4000"),
        ({"width": 64, "height": 48, "fov": 3.2}, "fov"),
        ({"width": 64, "height": 48, "pitch": -1.6}, "pitch"),
        ({"width": 64, "height": 48, "range": 0.5}, "range"),
        ({"width": 64, "height": 48, "position": (0.0, 0.0, 99.0)}, "position"),
    ],
)
def test_what_is_no_camera_is_refused(given: dict, said: str):
    with pytest.raises(ParameterError, match=said):
        CameraParams(**given)

import math

import numpy as np
import pytest

from harness.world.map.scene import Obstacle
from harness.world.map.scene_io import load_scene
from harness.world.map.shapes import Rect
from harness.world.sensors.sky import MASK, Sky

AREA = Rect(-400.0, -400.0, 400.0, 400.0)


def wall(x0, y0, x1, y1, height):
    return Obstacle("building_glass", Rect(x0, y0, x1, y1).polygon, height)


def hidden_by_walls(walls):
    """The hidden share between endless walls along y, by quadrature.

    Each wall is (signed distance along x, height). The antenna is 1 m above the ground.
    """
    azimuths = 2.0 * np.pi * (np.arange(20_000) + 0.5) / 20_000
    floor = math.sin(MASK)
    sines = np.full(azimuths.shape, floor)
    for distance, height in walls:
        facing = np.cos(azimuths) * np.sign(distance)
        slope = (height - 1.0) * np.maximum(facing, 0.0) / abs(distance)
        sines = np.maximum(sines, slope / np.sqrt(1.0 + slope**2))
    return float(np.mean((sines - floor) / (1.0 - floor)))


@pytest.mark.parametrize(
    "walls",
    [
        [(2.0, 3.0)],
        [(4.0, 12.0)],
        [(10.0, 20.0)],
        [(5.0, 15.0), (-3.0, 9.0)],
        [(1.0, 20.0), (-1.0, 20.0)],
    ],
)
def test_the_sky_between_walls_is_that_of_the_formula(walls):
    far = 300.0
    obstacles = [
        wall(min(d, d + math.copysign(2.0, d)), -far, max(d, d + math.copysign(2.0, d)), far, h)
        for d, h in walls
    ]
    found = np.mean([Sky(obstacles, AREA).hidden(x, 0.1) for x in (-0.25, 0.25)])
    assert found == pytest.approx(hidden_by_walls(walls), abs=0.03)


def test_open_sky_and_low_things_hide_nothing():
    assert Sky((), AREA).hidden(3.0, 4.0) == 0.0
    low = Sky([wall(1.0, -5.0, 2.0, 5.0, 2.5)], AREA)
    assert low.hidden(0.0, 0.0) == 0.0
    far = Sky([wall(300.0, -5.0, 302.0, 5.0, 20.0)], AREA)
    assert far.hidden(0.0, 0.0) == 0.0  # below the mask


def test_a_low_wall_before_a_high_one_does_not_hide_it():
    high = wall(20.0, -300.0, 22.0, 300.0, 30.0)
    low = wall(3.0, -300.0, 4.0, 300.0, 4.0)
    assert (
        Sky([high, low], AREA).hidden(0.0, 0.0)
        >= Sky([high], AREA).hidden(0.0, 0.0)
        > Sky([low], AREA).hidden(0.0, 0.0)
    )


def test_the_shipped_city_has_open_places_and_canyons():
    scene = load_scene("sidewalk")
    sky, mesh = Sky(scene.obstacles, Rect(-100.0, -100.0, 100.0, 100.0)), scene.navigation_mesh
    rows, columns = np.nonzero(mesh.data == 0)
    chosen = np.random.default_rng(0).choice(len(rows), 500, replace=False)
    xs, ys = (
        mesh.origin.x + columns[chosen] * mesh.resolution,
        mesh.origin.y + rows[chosen] * mesh.resolution,
    )
    shares = np.array([sky.hidden(x, y) for x, y in zip(xs, ys, strict=True)])
    assert 0.0 <= shares.min() < 0.3
    assert 0.8 < shares.max() < 1.0
    # worked out once
    assert [sky.hidden(x, y) for x, y in zip(xs, ys, strict=True)] == shares.tolist()


def test_a_huge_map_gets_coarse_heights_and_what_stands_outside_hides_nothing():
    huge = Rect(-20_000.0, -20_000.0, 20_000.0, 20_000.0)
    assert Sky([wall(30.0, -3000.0, 60.0, 3000.0, 100.0)], huge).hidden(0.0, 0.0) > 0.2
    assert Sky([wall(1e7, 1e7, 2e7, 2e7, 100.0)], huge).hidden(0.0, 0.0) == 0.0

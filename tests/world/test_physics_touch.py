"""Which obstacles are near the robot."""

import math

import numpy as np
import pytest
import shapely

from harness.world.bodies import StaticIndex
from harness.world.scene import Obstacle


def random_polygons(rng, number):
    polygons = []
    while len(polygons) < number:
        hull = shapely.MultiPoint(rng.normal(size=(6, 2)) * 0.5 + rng.uniform(-2.5, 2.5, 2)).convex_hull
        polygons.append(shapely.geometry.polygon.orient(hull))
    return polygons


def test_obstacles_are_found_by_their_distance():
    rng = np.random.default_rng(9)
    polygons = random_polygons(rng, 30)
    index = StaticIndex(tuple(Obstacle("bench", np.array(each.exterior.coords)[:-1], 1.0) for each in polygons))
    found = 0
    for x, y, radius in rng.uniform((-4, -4, 0.1), (4, 4, 2.0), (500, 3)).tolist():
        distances = shapely.distance(np.array(polygons, dtype=object), shapely.Point(x, y))
        numbers, nearest = index.near(x, y, radius)
        assert numbers == np.flatnonzero(distances <= radius).tolist()
        assert nearest == (pytest.approx(distances.min(), abs=1e-12) if numbers else math.inf)
        found += len(numbers)
    assert found > 1000
    assert StaticIndex(()).near(0.0, 0.0, 5.0) == ([], math.inf)

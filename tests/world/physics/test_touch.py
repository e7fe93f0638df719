"""Which obstacles the contacts of a step are asked for."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
import shapely

from harness.world.map.scene import Obstacle
from harness.world.map.shapes import Rect, box
from harness.world.physics.bodies import (
    FIXED,
    PERSON,
    ROBOT,
    NearObstacles,
    StaticIndex,
    fixed_body,
    is_rectangle,
    make_prism,
)
from harness.world.physics.contacts import Touched
from harness.world.physics.engine import Server, bullet
from harness.world.physics.touch_kernels import may_touch
from harness.world.truth import Partner

HALF_LENGTH, HALF_WIDTH, MARGIN = 0.4, 0.3, 0.15  # [m]


def rectangle(x, y, yaw):
    cos, sin = math.cos(yaw), math.sin(yaw)
    corners = np.array(((1, 1), (-1, 1), (-1, -1), (1, -1))) * (HALF_LENGTH, HALF_WIDTH)
    return shapely.Polygon(corners @ np.array(((cos, sin), (-sin, cos))) + (x, y))


def random_polygons(rng, number):
    polygons = []
    while len(polygons) < number:
        hull = shapely.MultiPoint(
            rng.normal(size=(6, 2)) * 0.5 + rng.uniform(-2.5, 2.5, 2)
        ).convex_hull
        polygons.append(shapely.geometry.polygon.orient(hull))
    return polygons


def asked(polygons, x, y, yaw):
    corners = [np.array(polygon.exterior.coords)[:-1] for polygon in polygons]
    first = np.cumsum([0, *(len(each) for each in corners)])
    flat = np.concatenate(corners) if corners else np.empty((0, 2))
    return may_touch(
        x,
        y,
        math.cos(yaw),
        math.sin(yaw),
        HALF_LENGTH,
        HALF_WIDTH,
        MARGIN,
        flat,
        first,
    )


def test_nothing_within_the_margin_is_missed_and_little_else_is_asked_for():
    rng = np.random.default_rng(4)
    near, far, idle = 0, 0, 0
    for _ in range(1500):
        polygons = random_polygons(rng, rng.integers(1, 4))
        x, y, yaw = rng.uniform((-3, -3, -4), (3, 3, 4))
        distance = min(shapely.distance(polygon, rectangle(x, y, yaw)) for polygon in polygons)
        is_asked = asked(polygons, x, y, yaw)
        assert is_asked or distance > MARGIN - 1e-9
        near, far, idle = (
            near + (distance <= MARGIN),
            far + (distance > MARGIN),
            idle + (is_asked > (distance <= MARGIN)),
        )
    assert near > 200 and far > 200
    assert idle < 0.02 * far  # only near corners


@pytest.mark.parametrize("yaw", [0.0, 0.5, -2.0])
@pytest.mark.parametrize("side", [(1, 0), (-1, 0), (0, 1), (0, -1)])
@pytest.mark.parametrize(("gap", "expected"), [(MARGIN - 1e-9, True), (MARGIN + 1e-9, False)])
def test_a_corner_that_points_at_a_side_is_kept_off_by_the_margin(yaw, side, gap, expected):
    """A square on its corner: only the rectangle's own axes tell that they are apart."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    middle = np.multiply(side, (HALF_LENGTH + gap + 1.0, HALF_WIDTH + gap + 1.0))
    corners = (middle + ((1, 0), (0, 1), (-1, 0), (0, -1))) @ np.array(((cos, sin), (-sin, cos)))
    assert asked([shapely.Polygon(corners + (5.0, 6.0))], 5.0, 6.0, yaw) is expected


def test_without_obstacles_and_with_repeated_corners():
    assert not asked([], 0.0, 0.0, 0.0)
    square = np.array(((1.0, -0.5), (2.0, -0.5), (2.0, 0.5), (2.0, 0.5), (1.0, 0.5)))
    for x, expected in ((0.4, False), (0.5, True)):  # its front at 0.8 m and 0.9 m
        assert (
            may_touch(x, 0.0, 1.0, 0.0, HALF_LENGTH, HALF_WIDTH, MARGIN, square, np.array((0, 5)))
            == expected
        )


def test_obstacles_are_found_by_their_distance():
    rng = np.random.default_rng(9)
    polygons = random_polygons(rng, 30)
    index = StaticIndex(
        tuple(Obstacle("bench", np.array(each.exterior.coords)[:-1], 1.0) for each in polygons)
    )
    found = 0
    for x, y, radius in rng.uniform((-4, -4, 0.1), (4, 4, 2.0), (500, 3)).tolist():
        distances = shapely.distance(np.array(polygons, dtype=object), shapely.Point(x, y))
        numbers, nearest = index.near(x, y, radius)
        assert numbers == np.flatnonzero(distances <= radius).tolist()
        assert nearest == (pytest.approx(distances.min(), abs=1e-12) if numbers else math.inf)
        found += len(numbers)
    assert found > 1000
    assert StaticIndex(()).near(0.0, 0.0, 5.0) == ([], math.inf)


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        (((0, 0), (3, 0), (3, 1), (0, 1)), True),
        (((0, 0), (4, 3), (1, 7), (-3, 4)), True),
        (((0, 0), (3, 0), (4, 1), (1, 1)), False),
        (((0, 0), (3, 0), (3, 1), (0, 2)), False),
        (((0, 0), (3, 0), (3, 3)), False),
        (((0, 0), (3, 0), (3, 1), (1, 2), (0, 1)), False),
    ],
)
def test_four_right_angles_make_a_rectangle(corners, expected):
    assert is_rectangle(np.array(corners, dtype=float)) is expected


def test_collision_groups_have_no_bit_in_common():
    assert ROBOT & FIXED == ROBOT & PERSON == FIXED & PERSON == 0


@pytest.mark.parametrize(
    "corners", [((0, 0), (2, -1), (3, 0), (1, 1.5)), ((0, -1), (3, -1), (3, 1.5), (0, 1.5))]
)
def test_a_prism_reaches_as_far_as_its_polygon_and_its_height(corners):
    server = Server()
    prism = make_prism(server.client, np.array(corners, dtype=float), 0.6)
    body = fixed_body(server.client, prism.shape, prism.center, 0.5)
    low, high = bullet.getAABB(body, physicsClientId=server.client)
    server.close()
    assert low == pytest.approx((0.0, -1.0, 0.0), abs=1e-9)
    assert high == pytest.approx((3.0, 1.5, 0.6))


@pytest.mark.parametrize(
    ("clearance", "moved", "reach", "free"),
    [
        (2.0, 0.0, 0.5, 1.0),
        (2.0, 0.75, 0.5, 0.25),
        (2.0, 0.25, 1.5, 0.25),
        (2.0, 0.5, 1.5, 0.0),
        (2.0, 0.5, 2.0, -0.5),
        (2.0, 1.0, 0.5, 0.0),  # the choice is due beyond 1 m
        (2.0, 1.25, 0.5, 1.0),
        (math.inf, 0.0, 3.0, 0.5),  # nothing is known of what is farther than 3.5 m
    ],
)
def test_obstacles_say_how_far_the_robot_may_go(robot, clearance, moved, reach, free):
    index = SimpleNamespace(obstacles=(), near=lambda x, y, radius: ([], clearance))
    obstacles = NearObstacles(0, index, 0.5, robot)
    obstacles.follow(3.0, 4.0, reach)
    assert obstacles.follow(3.0, 4.0 - moved, reach) == free
    assert not obstacles.can_touch(3.0, 4.0, 0.0)


def test_bodies_stand_for_the_obstacles_within_three_and_a_half_metres(robot):
    rects = [Rect(x, -0.5, x + 1.0, 0.5) for x in (1.0, 3.0, 5.0)]
    index = StaticIndex(
        tuple(Obstacle(f"kind {x}", rect.polygon, 0.8) for x, rect in enumerate(rects))
    )
    server = Server()
    obstacles = NearObstacles(server.client, index, 0.6, robot)
    for x, numbers, free in (
        (0.0, [0, 1], 0.5),
        (7.0, [1, 2], 0.5),
        (30.0, [], 1.0),
        (0.0, [0, 1], 0.5),
    ):
        assert obstacles.follow(x, 0.0, 0.5) == free
        assert sorted(touched.number for touched in obstacles.touchable.values()) == numbers
        assert bullet.getNumBodies(server.client) == len(numbers)
        assert obstacles.can_touch(3.5, 0.0, 1.0) is bool(numbers)
        for body, touched in obstacles.touchable.items():
            assert touched == Touched(Partner.PROPERTY, f"kind {touched.number}", touched.number)
            assert bullet.getDynamicsInfo(body, -1, server.client)[1] == 0.6
            low, high = bullet.getAABB(body, physicsClientId=server.client)
            rect = rects[touched.number]
            assert (*low, *high) == pytest.approx((rect.x0, -0.5, 0.0, rect.x1, 0.5, 0.8), abs=1e-9)
    server.close()


@pytest.mark.parametrize(("gap", "can_touch"), [(0.15 - 1e-6, True), (0.15 + 1e-6, False)])
@pytest.mark.parametrize("side", [(1, 0), (-1, 0), (0, 1), (0, -1)])
def test_what_is_nearer_than_the_margin_to_the_robots_box_may_be_touched(
    robot,
    side,
    gap,
    can_touch,
):
    """Its centre of mass is 0.1 m ahead of its middle.

    The obstacle is a box of 1 m turned as the robot is.
    """
    robot = dataclasses.replace(robot, center_of_mass_x=robot.center[0] + 0.1)
    yaw, cos, sin = -2.0, math.cos(-2.0), math.sin(-2.0)
    along, across = np.multiply(side, np.add(robot.half_size, gap + 0.5)) - (0.1, 0.0)
    there = 2.0 + cos * along - sin * across, 3.0 + sin * along + cos * across
    server = Server()
    index = StaticIndex((Obstacle("bench", box(*there, yaw, 1.0, 1.0), 0.8),))
    obstacles = NearObstacles(server.client, index, 0.6, robot)
    obstacles.follow(2.0, 3.0, 0.5)
    assert obstacles.can_touch(2.0, 3.0, yaw) is can_touch
    server.close()

"""Ground with steps: what lies where, and how the robot leaves it, through real contact."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
import shapely

from harness.world.map.scene import Zone
from harness.world.map.shapes import Rect
from harness.world.physics.contacts import Motion
from harness.world.physics.drive_kernels import LEVEL
from harness.world.physics.elevation import Elevation
from harness.world.physics.engine import Server, bullet
from harness.world.physics.footing import Feet, Footing, Scrape
from harness.world.physics.ground import Ground
from navstack.types import Pose2D

CURB = 0.12  # [m]
ROAD = Zone("road", Rect(-30.0, -30.0, 30.0, 30.0).polygon, -CURB)
SIDEWALK = Zone("sidewalk", Rect(-20.0, -20.0, 1.0, 20.0).polygon)
CROSSING = Zone("crosswalk", Rect(1.0, -1.5, 9.0, 1.5).polygon)
STREET = (ROAD, SIDEWALK, CROSSING)
EDGE = (ROAD, SIDEWALK)  # the sidewalk ends at x = 1


def test_the_later_zone_counts_and_the_rest_lies_at_zero():
    ground = Elevation(STREET)
    assert ground.level(0.0, 0.0) == 0.0
    assert ground.level(3.0, 0.0) == 0.0
    assert ground.level(3.0, 5.0) == -CURB
    assert ground.level(100.0, 0.0) == 0.0


def test_the_clearance_is_the_distance_to_the_nearest_step():
    ground = Elevation(STREET)
    assert ground.clearance(1.0, 0.0) == pytest.approx(1.5)  # no step between sidewalk and crossing
    assert ground.clearance(-2.0, 10.0) == pytest.approx(3.0)
    assert ground.clearance(4.0, 2.5) == pytest.approx(1.0)
    assert Elevation((SIDEWALK,)).clearance(0.0, 0.0) == math.inf


def test_the_pieces_around_a_place_are_convex_and_fill_the_window():
    ground = Elevation(
        (ROAD, SIDEWALK, CROSSING, Zone("plaza", Rect(-5.0, -5.0, -2.0, -2.0).polygon, 0.3))
    )
    pieces = ground.around(0.5, 0.5, 5.0)
    assert list(pieces) == [-CURB, 0.0, 0.3]
    area = 0.0
    for height, polygons in pieces.items():
        for polygon in polygons:
            shape = shapely.Polygon(polygon)
            area += shape.area
            assert shape.convex_hull.area == pytest.approx(shape.area)
            assert shapely.LinearRing(polygon).is_ccw
            inner = shape.representative_point()
            assert ground.level(inner.x, inner.y) == height
    assert area == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("moved", "reach", "free"),
    [
        (0.0, 2.0, 0.0),
        (0.0, 1.5, 0.5),
        (0.0, 0.5, 1.0),
        (0.75, 1.0, 0.25),
        (0.75, 0.5, 0.25),
        (0.75, 1.25, 0.0),
    ],
)
def test_far_from_steps_the_ground_is_a_plane_and_says_how_far_it_will_do(moved, reach, free):
    """The next step is 2 m away, and is looked up anew after 1 m."""
    made = SimpleNamespace(
        clearance=lambda x, y: 2.0,
        level=lambda x, y: 0.5,
        around=lambda *window: {0.5: []},
    )
    server = Server()
    ground = Ground(server.client, made, 3.0, 4.0, 0.45)
    assert ground.follow(3.0 + moved, 4.0, reach) == free
    (plane,) = ground.bodies
    assert bullet.getBasePositionAndOrientation(plane, server.client)[0] == (0.0, 0.0, 0.5)
    assert ground.follow(3.0 + moved, 4.0, 2.1 - moved) == -1.0
    server.close()


def test_plane_and_slabs_have_no_friction(lab, robot, params):
    slanting = Zone("plaza", np.array(((1.0, 0.0), (2.0, -1.0), (1.6, 1.4))), 0.05)
    with lab.world(robot, params, zones=(*EDGE, slanting), start=Pose2D(0.9, 0.0)) as world:
        lab.drive(world, 2)
        frictions = [
            bullet.getDynamicsInfo(body, -1, world._client)[1]
            for body in sorted(world._ground.bodies)
        ]
    assert frictions == [0.0] * 3


def test_flat_zones_leave_everything_as_it_is(lab, robot, params):
    flat = (dataclasses.replace(SIDEWALK), dataclasses.replace(ROAD, elevation=0.0))
    with lab.world(robot, params) as bare, lab.world(robot, params, zones=flat) as zoned:
        for world in (bare, zoned):
            lab.drive(world, 60, v=1.0, w=0.3)
        assert bare._position == zoned._position
        assert bare._orientation == zoned._orientation


def test_along_a_curb_it_drives_as_on_a_plane(lab, any_robot, params):
    """The body's side is 0.05 m from the step: the ground is slabs all the way, seam after seam."""
    start = Pose2D(0.7, -6.0, 0.5 * math.pi)
    with (
        lab.world(any_robot, params, zones=STREET, start=start) as world,
        lab.world(any_robot, params) as plane,
    ):
        along_curb, on_plane = lab.drive(world, 480, v=1.5), lab.drive(plane, 480, v=1.5)
    assert max(t.tilt for t in along_curb) < 1e-3
    driven = [(t.pose.y + 6.0, 0.7 - t.pose.x, t.pose.yaw - 0.5 * math.pi) for t in along_curb]
    assert np.array(driven) == pytest.approx(
        np.array([(t.pose.x, t.pose.y, t.pose.yaw) for t in on_plane]), abs=5e-3
    )


def test_on_the_road_it_stands_a_curb_lower(lab, robot, params):
    with lab.world(robot, params, zones=STREET, start=Pose2D(15.0, 10.0, 0.0)) as world:
        lab.drive(world, 60, v=1.0)
        assert world._position[2] == pytest.approx(robot.center_of_mass_height - CURB, abs=1e-4)
        assert world._ground.follow(*world._position[:2], 1.0) >= 0.0


def test_slowly_over_the_curb_it_hangs_on_its_belly(lab, robot, params):
    with lab.world(robot, params, zones=EDGE) as world:
        truth = lab.drive(world, 300, v=0.4)[-1]
        assert world._footing.scrapes
        assert world._footing.left_load == world._footing.right_load == 0.0
    assert 0.05 < truth.tilt < 0.5
    assert truth.pose.x == pytest.approx(1.0, abs=0.1)  # the wheels turn in the air
    assert abs(truth.twist.linear_x) < 0.02


def test_at_walking_speed_over_the_curb_it_falls(lab, robot, params):
    with lab.world(robot, params, zones=EDGE) as world:
        assert max(t.tilt for t in lab.drive(world, 200, v=1.26)) > 0.5


def test_one_wheel_over_the_curb_leans_to_that_side(lab, robot, params):
    start = Pose2D(0.84, 0.0, 0.5 * math.pi - 0.15)  # drifts towards the step on its right
    with lab.world(robot, params, zones=EDGE, start=start) as world:
        truths = lab.drive(world, 120, v=1.0)
    assert max(t.tilt for t in truths) > 0.1


@pytest.mark.parametrize("speed", [0.5, 1.0, 1.5])
def test_a_curb_stops_it_on_the_way_up(lab, any_robot, params, speed):
    with lab.world(any_robot, params, zones=EDGE, start=Pose2D(2.5, 0.0, math.pi)) as world:
        truth = lab.drive(world, 300, v=speed)[-1]
    assert 1.1 < truth.pose.x < 1.3
    assert truth.tilt < 0.2
    assert not truth.contacts and not truth.counted_contacts  # ground is nobody's property


def test_touched_by_something_its_wheels_grip_with_what_the_axle_carries(robot, params):
    """Balance of moments about the casters (textbook).

    Free of touch, the drive's assumption holds.
    """
    feet, gravity = Feet(robot, params.physics.gravity), params.physics.gravity
    touched = feet.level_footing(is_touched=True)
    axle = robot.mass * gravity * (robot.wheelbase + robot.center_of_mass_x) / robot.wheelbase
    assert (touched.left_load, touched.right_load) == pytest.approx((0.5 * axle, 0.5 * axle))
    assert feet.level_footing(is_touched=False).left_load == LEVEL


def test_the_weight_stands_on_four_feet(lab, robot, params):
    with lab.world(robot, params, zones=EDGE, start=Pose2D(0.7, 0.0, 0.5 * math.pi)) as world:
        lab.drive(world, 60)
        contacts = bullet.getContactPoints(bodyA=world._body, physicsClientId=world._client)
        footing = world._feet.footing(contacts, world._position, world._orientation)
    axle = robot.axle_share * robot.mass * params.physics.gravity
    assert footing.left_load + footing.right_load == pytest.approx(axle, rel=0.01)
    assert footing.is_whole and not footing.scrapes


def leaning(robot, *points):
    """Contacts with the ground, as PyBullet lists them.

    Body-frame places from the base, distances and loads.
    """
    orientation, position = bullet.getQuaternionFromEuler((0.1, -0.05, 0.7)), (3.0, -2.0, 0.4)
    contacts = [[None] * 10 for _ in points]
    for contact, (place, distance, load) in zip(contacts, points, strict=True):
        offset = bullet.rotateVector(orientation, np.subtract(place, robot.center_of_mass).tolist())
        contact[5], contact[8], contact[9] = (
            tuple(np.add(position, offset).tolist()),
            distance,
            load,
        )
    return contacts, position, orientation


@pytest.mark.parametrize(
    ("left", "right", "is_whole"),
    [
        (0.0, 0.9e-3, True),
        (0.9e-3, 0.0, True),
        (1e-3, 0.0, False),
        (0.0, 1e-3, False),
        (0.01, 0.01, False),
    ],
)
def test_a_wheel_stands_on_the_ground_below_a_millimetre(robot, params, left, right, is_whole):
    feet = [(*foot, 0.0) for foot in robot.feet]
    nearest = zip(feet, (left, right, 0.0, 0.0), (10.0, 20.0, 30.0, 40.0), strict=True)
    # and one of each far above the ground
    given = leaning(robot, *nearest, *((foot, 0.5, 1.0) for foot in feet))
    footing = Feet(robot, params.physics.gravity).footing(*given)
    assert footing == Footing(11.0, 21.0, (), is_whole)


@pytest.mark.parametrize(
    ("shift", "load", "is_foot"),
    [
        ((0.039, 0.0, 0.0), 5.0, True),
        ((0.0, -0.041, 0.0), 5.0, False),  # a tread's radius of 0.03 m and 0.01 m around it
        ((0.0, 0.0, 0.039), 5.0, True),
        ((0.0, 0.0, 0.041), 5.0, False),
        ((0.0, 0.1, 0.0), 0.0, None),  # of the body, but without load
    ],
)
def test_what_is_no_foot_scrapes_where_it_carries_something(robot, params, shift, load, is_foot):
    """Feet of all four stand; the point in question lies beside the left caster."""
    feet = [(*foot, 0.0) for foot in robot.feet]
    given = leaning(
        robot, *((foot, 0.0, 10.0) for foot in feet), (np.add(feet[2], shift), 0.0, load)
    )
    footing = Feet(robot, params.physics.gravity).footing(*given)
    scrapes = (Scrape(given[0][-1][5], 5.0),) if is_foot is False else ()
    assert footing == Footing(10.0, 10.0, scrapes, not scrapes)


def test_scraping_is_braked_by_friction_and_never_turned_round():
    footing = Footing(0.0, 0.0, (Scrape((0.0, 0.0, 0.0), 100.0), Scrape((0.0, 1.0, 0.0), 50.0)))
    fast = footing.friction(Motion((0.0, 0.0, 0.3), (3.0, 4.0, 0.0)), 0.4, 6000.0)
    assert fast[0][1] == pytest.approx((-0.4 * 100.0 * 0.6, -0.4 * 100.0 * 0.8, 0.0))
    slow = footing.friction(Motion((0.0, 0.0, 0.3), (1e-4, 0.0, 0.0)), 0.4, 6000.0)
    assert sum(force[0] for _, force in slow) == pytest.approx(-6000.0 * 1e-4)
    assert footing.friction(Motion((0.0, 0.0, 0.3), (0.0, 0.0, 0.0)), 0.4, 6000.0) == []

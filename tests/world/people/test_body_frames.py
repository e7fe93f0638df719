"""People shown in frames, met ahead of touching, limited: PhysX's rules against closed forms."""

import dataclasses
import math

import numpy as np
import pytest

from harness.storage.shipped import shipped
from harness.world.people.body_frames import BodyFrames
from harness.world.people.person_bodies import add_person, person_shape
from harness.world.physics.bodies import add_robot
from harness.world.physics.engine import Server
from harness.world.world_params import WorldParams
from navstack.errors import ParameterError
from navstack.params.strict import load_dataclass
from navstack.types import Pose2D, Twist2D

from ..laboratory import bullet

FRONT, RADIUS = 0.14, 0.3  # [m] of the robot ahead of its base origin, of a person
FRAME = 1.0 / 30.0  # [s]
WALK = 1.0  # [m/s]


def framed(params, frame_steps=4, most=0.0, parting=1.0, per="point"):
    bodies = dataclasses.replace(
        params.pedestrian_bodies,
        frame_steps=frame_steps,
        max_contact_impulse=most,
        max_depenetration_speed=parting if frame_steps > 1 else 0.0,
        friction=0.0,
    )
    contacts = dataclasses.replace(params.contacts, per=per)
    return dataclasses.replace(params, pedestrian_bodies=bodies, contacts=contacts)


def ahead(gap, yaw=0.0, speed=WALK):
    """Somebody who walks head-on at a robot in the origin, ``gap`` [m] from it."""
    distance, cos, sin = FRONT + RADIUS + gap, math.cos(yaw), math.sin(yaw)
    return distance * cos, distance * sin, -speed * cos, -speed * sin


def pair(server, robot, params, yaw=0.0):
    """Frames, a robot's and a person's body, and how far apart they touch [m].

    The middle of the robot's body stands in the origin.
    """
    client = server.client
    body = add_robot(client, robot)
    ahead, height = robot.center[0] - robot.center_of_mass_x, robot.center_of_mass_height
    place = -ahead * math.cos(yaw), -ahead * math.sin(yaw), height
    bullet.resetBasePositionAndOrientation(
        body, place, bullet.getQuaternionFromEuler((0.0, 0.0, yaw)), client
    )
    person = add_person(client, person_shape(client, RADIUS, 1.7, robot.height), 1e6, 0.0)
    frames = BodyFrames(client, params.pedestrian_bodies, params.physics.rate)
    return frames, body, person, robot.half_size[0] + RADIUS


def state(server, body):
    """Place [m] and velocity [m/s] of a body."""
    place, _ = bullet.getBasePositionAndOrientation(body, server.client)
    velocity, _ = bullet.getBaseVelocity(body, server.client)
    return np.array(place), np.array(velocity)


@pytest.mark.parametrize(
    ("way", "shown", "speed"), [(0.999, 2.0, 119.88), (1.0, 3.0, 0.0), (1.4, 3.4, 0.0)]
)
def test_who_goes_a_metre_in_a_frame_appears_there(robot, params, way, shown, speed):
    server = Server()
    frames, _, person, _ = pair(server, robot, framed(params))
    frames.add(person, 2.0, 5.0)
    assert frames.show(person, 2.0 + way, 5.0, 0) == pytest.approx((shown, 5.0))
    place, velocity = state(server, person)
    assert (*place, *velocity) == pytest.approx((shown, 5.0, 0.0, speed, 0.0, 0.0))
    # until the next frame
    assert frames.show(person, 9.0, 5.0, 3) == pytest.approx((2.0 + way, 5.0))
    assert state(server, person)[1].tolist() == [0.0, 0.0, 0.0]
    server.close()


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.0])
@pytest.mark.parametrize(
    ("gap", "parting", "closing"),
    [(0.01, 1.0, 1.2), (-0.002, 1.0, -0.192), (-0.02, 1.0, -1.0), (0.01, 0.0, 1.2)],
)
def test_who_may_be_reached_is_put_in_touch_and_comes_no_nearer(
    robot,
    params,
    gap,
    parting,
    closing,
    yaw,
):
    """The gap over the step comes off the way in.

    Who overlaps parts with 0.8 of it, at most with the speed allowed.
    """
    server = Server()
    frames, body, person, touching = pair(server, robot, framed(params, parting=parting), yaw)
    x, y = ((touching + gap) * math.cos(yaw), (touching + gap) * math.sin(yaw))
    frames.add(person, x, y)
    frames.show(person, x + 0.02, y - 0.01, 0)
    frames.meet(person, body)
    place, velocity = state(server, person)
    towards = np.array((-math.cos(yaw), -math.sin(yaw), 0.0))
    assert place == pytest.approx(np.array((x, y, 0.0)) + (gap + 1e-4) * towards, abs=2e-6)
    assert velocity == pytest.approx(np.array((2.4, -1.2, 0.0)) - closing * towards, abs=1e-3)
    assert frames.gaps == {person: pytest.approx(gap, abs=2e-6)}
    server.close()


@pytest.mark.parametrize(("excess", "is_near"), [(-1e-4, True), (1e-4, False)])
def test_only_who_can_be_reached_in_the_step_is_put_in_touch(robot, params, excess, is_near):
    """Within the way of both in it, the robot's spin at 1 m, and 0.1 m/s that forces may add."""
    server = Server()
    frames, body, person, touching = pair(server, robot, framed(params))
    bullet.resetBaseVelocity(body, (0.3, 0.4, 0.0), (0.0, 0.0, -0.2), server.client)
    x = touching + (1.2 + 0.5 + 0.2 + 0.1) / 120.0 + excess
    frames.add(person, x, 0.0)
    frames.show(person, x - 0.01, 0.0, 0)
    frames.meet(person, body)
    assert (person in frames.gaps) is is_near
    assert state(server, person)[0][0] == pytest.approx(touching - 1e-4 if is_near else x, abs=2e-6)
    server.close()


def test_who_overlaps_where_the_engine_parts_them_is_left_to_it(robot, params):
    server = Server()
    frames, body, person, touching = pair(server, robot, framed(params, parting=0.0))
    frames.add(person, touching - 0.01, 0.0)
    frames.show(person, touching - 0.01, 0.0, 0)
    frames.meet(person, body)
    assert not frames.gaps and state(server, person)[0][0] == pytest.approx(touching - 0.01)
    server.close()


def momentum(world, robot):
    """Of the robot's centre of mass, horizontal [N s]."""
    (vx, vy, _), _ = bullet.getBaseVelocity(world._body, world._client)
    return robot.mass * math.hypot(vx, vy)


def test_a_walker_acts_with_four_times_the_speed_for_one_step_and_then_stands(lab, robot, params):
    with lab.world(robot, framed(params), people=[ahead(0.5)], steps_per_tick=1) as world:
        speeds, places = [], []
        for _ in range(12):
            world.step(Twist2D())
            (body,) = world._crowd.touchable
            speeds.append(bullet.getBaseVelocity(body, world._client)[0][0])
            places.append(bullet.getBasePositionAndOrientation(body, world._client)[0][0])
    assert speeds == pytest.approx(
        [0.0, 0.0, 0.0, 0.0, -4.0, 0.0, 0.0, 0.0, -4.0, 0.0, 0.0, 0.0], abs=1e-6
    )
    shown = 0.94 - np.repeat((0.0, FRAME, 2 * FRAME), 4)
    assert places == pytest.approx(shown, abs=1e-6)


@pytest.mark.parametrize("yaw", [0.0, 0.7])
@pytest.mark.parametrize("gap", [0.0005, 0.005, 0.012, 0.02, 0.03])
def test_an_impact_brings_the_bodies_to_touch_at_the_steps_end(lab, robot, params, yaw, gap):
    """PhysX: a point's closing speed after a step is at most its gap over the step."""
    people = [ahead(gap + WALK * FRAME, yaw)]  # the first frame leaves the gap, the second strikes
    ice = lab.without_drive(robot)
    with lab.world(
        ice,
        framed(params, per="partner"),
        people=people,
        steps_per_tick=1,
        start=Pose2D(yaw=yaw),
    ) as world:
        for _ in range(9):
            world.step(Twist2D())
        given = momentum(world, ice)
        (event,) = world.close_episode().contacts
    theory = ice.mass * (4.0 * WALK - gap * 120.0)
    assert given == pytest.approx(theory, abs=0.5)
    assert event.impulse == pytest.approx(theory, abs=0.5)
    # what is told of people is how they walk
    assert event.partner_speed == pytest.approx(WALK, rel=1e-6)


def test_driving_into_somebody_who_stands_gives_the_same_momentum_as_without_frames(
    lab,
    robot,
    params,
):
    ice = lab.without_drive(robot)
    impulses = []
    for frame_steps in (1, 4):
        with lab.world(
            ice, framed(params, frame_steps), people=[ahead(0.303, speed=0.0)], steps_per_tick=1
        ) as world:
            lab.fling(world, 1.5)
            for _ in range(60):
                world.step(Twist2D())
            (event,) = world.close_episode().contacts
        impulses.append(event.impulse)
    assert impulses == pytest.approx([ice.mass * 1.5] * 2, rel=0.02)


def test_no_point_gives_more_than_the_limit_and_the_robot_gets_what_the_points_give(
    lab,
    robot,
    params,
):
    ice = lab.without_drive(robot)
    free, capped = (framed(params, most=most, per="point") for most in (0.0, 100.0))
    counted, given, merged = [], [], []
    for settings in (free, capped):
        with lab.world(
            ice, settings, people=[ahead(0.0005 + WALK * FRAME)], steps_per_tick=1
        ) as world:
            for _ in range(9):
                world.step(Twist2D())
            counted.append(world.truth.counted_contacts[0].impulse)
            given.append(momentum(world, ice))
            merged.append(world.close_episode().contacts[0].impulse)
    assert counted[0] > 150.0 and counted[1] == 100.0
    assert given[0] == pytest.approx(ice.mass * (4.0 - 0.0005 * 120.0), abs=0.5)
    assert given[1] == pytest.approx(merged[1], abs=0.5)  # momentum: the sum of the limited points
    assert merged[0] - merged[1] == pytest.approx(counted[0] - 100.0, abs=0.5)


def test_the_limit_takes_back_the_way_made_in_the_step_too(lab, robot, params):
    ice = lab.without_drive(robot)
    with lab.world(
        ice, framed(params, most=100.0), people=[ahead(0.0005 + WALK * FRAME)], steps_per_tick=1
    ) as world:
        for _ in range(8):
            world.step(Twist2D())
        before, _ = bullet.getBasePositionAndOrientation(world._body, world._client)
        world.step(Twist2D())
        after, _ = bullet.getBasePositionAndOrientation(world._body, world._client)
        (vx, _, _), _ = bullet.getBaseVelocity(world._body, world._client)
    assert after[0] - before[0] == pytest.approx(vx / 120.0, rel=1e-6)


@pytest.mark.parametrize(
    ("overlap", "speed"), [(0.002, 0.192), (0.005, 0.48), (0.05, 1.0), (0.15, 1.0)]
)
def test_bodies_that_overlap_part_by_physx_share_and_no_faster_than_allowed(
    lab,
    robot,
    params,
    overlap,
    speed,
):
    """0.8 of the overlap per step, at most 1 m/s (DyContactPrep, maxDepenetrationVelocity)."""
    ice = lab.without_drive(robot)
    with lab.world(
        ice, framed(params), people=[ahead(-overlap, speed=0.0)], steps_per_tick=1
    ) as world:
        world.step(Twist2D())
        assert momentum(world, ice) / ice.mass == pytest.approx(speed, abs=0.01)


def test_without_a_limit_overlaps_part_by_the_engines_share(lab, robot, params):
    ice = lab.without_drive(robot)
    with lab.world(
        ice, framed(params, parting=0.0), people=[ahead(-0.02, speed=0.0)], steps_per_tick=1
    ) as world:
        world.step(Twist2D())
        # contact_erp
        assert momentum(world, ice) / ice.mass == pytest.approx(0.01 * 0.02 * 120.0, abs=0.005)


def test_frames_do_not_hang_on_the_tick(lab, robot, params):
    """Ticks of 1, 2 and 4 physics steps show the same frames."""
    events = []
    for steps in (1, 2, 4):
        people = [ahead(0.4), (-1.5, 0.3, 1.1, 0.0)]
        with lab.world(
            robot, framed(params, most=100.0), people=people, steps_per_tick=steps
        ) as world:
            for _ in range(240 // steps):
                world.step(Twist2D())
            events.append(world.close_episode().contacts)
    assert events[0] and events[0] == events[1] == events[2]


def test_who_appears_elsewhere_does_not_fly_there(lab, robot, params):
    with lab.world(
        robot, framed(params), people=[ahead(0.5, speed=0.0)], steps_per_tick=1
    ) as world:
        world.step(Twist2D())
        # 2.4 m away, beyond the robot
        world._pedestrians._states = np.array([(-1.5, 0.0, 0.0, 0.0)])
        for _ in range(8):
            world.step(Twist2D())
        assert world.close_episode().contacts == ()


@pytest.mark.parametrize(
    "change",
    [
        {"frame_steps": 0},
        {"frame_steps": 121},
        {"frame_steps": 4, "kind": "dynamic"},
        {"max_contact_impulse": -1.0},
        {"max_depenetration_speed": -1.0},
    ],
)
def test_impossible_frames_are_refused(params, change):
    dataclasses.replace(params.pedestrian_bodies, frame_steps=120, kind="kinematic")
    with pytest.raises(ParameterError, match=next(iter(change))):
        dataclasses.replace(params.pedestrian_bodies, **change)


def test_version_2_has_the_published_frames_and_limits(robot):
    """Frames of 1/30 s; and nobody stands in the robot when a delivery begins."""
    world = load_dataclass(WorldParams, shipped("params") / "worlds" / "published_2.yaml")
    bodies = world.pedestrian_bodies
    assert bodies.frame_steps / world.physics.rate == pytest.approx(FRAME)
    assert (bodies.max_contact_impulse, bodies.max_depenetration_speed, world.contacts.per) == (
        100.0,
        1.0,
        "point",
    )
    assert (world.people.goals, world.people.goal_choice, world.people.beginning) == (
        200,
        "in_turn",
        "stationary",
    )
    corner = max(math.hypot(x, y) for x, y in robot.footprint)
    assert (
        corner + world.people.radius
        < world.people.start_clearance
        < corner + world.people.radius + 0.1
    )

"""Collisions and tipping against mechanics: momentum, energy, time step."""

import dataclasses
import math

import numpy as np
import pytest

from harness.world.map.scene import Obstacle
from harness.world.map.shapes import box
from harness.world.physics.contacts import ContactBook
from harness.world.physics.engine import bullet
from harness.world.truth import Partner
from navstack.types import Pose2D, Twist2D

from ..laboratory import (
    bollard,
    collide,
    greatest_tilt,
    mechanical_energy,
    post,
    stepping_at,
    tipping_speed,
    wall,
)

FRONT = 0.14  # [m] of the robot's body ahead of the base origin
PERSON_RADIUS = 0.3  # [m]


@pytest.mark.parametrize("obstacle", [wall(1.0), post(1.1, height=1.2)], ids=["wall", "post"])
@pytest.mark.parametrize("speed", [0.5, 1.26, 2.0, 3.5])
def test_the_impulse_on_something_fixed_is_the_lost_momentum(lab, robot, params, obstacle, speed):
    with lab.world(lab.without_drive(robot), params, [obstacle], steps_per_tick=1) as world:
        lab.fling(world, speed)
        after = speed
        for _ in range(400):
            world.step(Twist2D())
            after = min(after, world._velocity[0])
        (event,) = world.close_episode().contacts
    assert event.partner is Partner.PROPERTY and event.kind == obstacle.kind
    assert event.impulse == pytest.approx(robot.mass * (speed - after), rel=0.03)
    assert event.impulse == pytest.approx(robot.mass * speed, rel=0.03)  # without rebound
    assert event.robot_speed + event.partner_speed == pytest.approx(speed, rel=1e-3)
    assert event.robot_speed == pytest.approx(speed, rel=1e-3)
    assert event.partner_speed == 0.0
    assert event.x == pytest.approx(1.0, abs=0.04)


@pytest.mark.parametrize("yaw", [0.0, 1.0, math.pi, -2.0])
def test_a_wall_ahead_is_met_by_the_front_wherever_the_robot_looks(lab, robot, params, yaw):
    cos, sin, speed, farthest = math.cos(yaw), math.sin(yaw), 1.0, 0.0
    ahead = Obstacle("building_glass", box(1.5 * cos, 1.5 * sin, yaw, 1.0, 4.0), 1.5)
    with lab.world(
        lab.without_drive(robot), params, [ahead], steps_per_tick=1, start=Pose2D(0.0, 0.0, yaw)
    ) as world:
        lab.fling(world, speed * cos, speed * sin)
        for _ in range(150):
            world.step(Twist2D())
            farthest = max(farthest, cos * world.truth.pose.x + sin * world.truth.pose.y)
        (event,) = world.close_episode().contacts
    assert farthest == pytest.approx(1.0 - FRONT, abs=0.01)
    assert event.impulse == pytest.approx(robot.mass * speed, rel=0.03)


def test_a_contact_point_tells_how_far_apart_the_bodies_were(lab, robot, params, monkeypatch):
    told = []
    with lab.world(robot, params, [wall(0.3)], steps_per_tick=1) as world:
        record = world._book.record
        monkeypatch.setattr(
            ContactBook,
            "record",
            lambda book, stamp, points, robot: told.extend(points) or record(stamp, points, robot),
        )
        lab.drive(world, 120, v=0.5)
    assert max(point.impulse for point in told) > 1.0
    assert max(abs(point.distance) for point in told) < 0.03


def partners(params, kind):
    """World, obstacles, people and the mass [kg] that the partner lends to the impact (inf.

    It cannot give way).
    """
    if kind in ("kinematic", "dynamic"):
        # A dynamic person's steering is all but off: what acts is the impact.
        bodies = dataclasses.replace(
            params.pedestrian_bodies,
            kind=kind,
            push_force=1e-6,
            friction=0.0,
        )
        mass = bodies.mass if kind == "dynamic" else math.inf
        return (
            dataclasses.replace(params, pedestrian_bodies=bodies),
            (),
            ((1.303, 0.0, 0.0, 0.0),),
            mass,
        )
    furniture = Obstacle("mailbox", box(1.257, 0.0, 0.0, 0.5, 0.5), 1.2)
    return params, {"wall": (wall(1.003),), "furniture": (furniture,)}[kind], (), math.inf


@pytest.mark.parametrize("kind", ["wall", "furniture", "kinematic", "dynamic"])
@pytest.mark.parametrize("speed", [0.5, 1.0, 1.5, 2.0, 2.5])
def test_impacts_are_those_of_mechanics_whatever_the_step(any_robot, params, kind, speed):
    """Plastic central impact: speed times the reduced mass (textbook)."""
    world, obstacles, people, mass = partners(params, kind)
    theory = speed / (1.0 / any_robot.mass + 1.0 / mass)
    impulse, halved = (
        collide(any_robot, stepping_at(world, rate), speed, obstacles, people).impulse
        for rate in (120.0, 240.0)
    )
    assert impulse == pytest.approx(theory, rel=0.03)
    assert halved == pytest.approx(impulse, rel=0.03)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.57, 3.14])
def test_being_walked_into_does_not_hang_on_the_step(lab, robot, params, angle):
    """The robot holds its place by its wheels, the person walks on.

    The push is long, the impact the same.
    """
    x, cos, sin = robot.center_of_mass_x, math.cos(angle), math.sin(angle)
    person = (x + 1.2 * cos, 1.2 * sin, -cos, -sin)
    impulses = []
    for rate in (120.0, 240.0):
        with lab.world(
            robot, stepping_at(params, rate), people=[person], steps_per_tick=1
        ) as world:
            lab.drive(world, round(1.5 * rate))
            (event,) = world.close_episode().contacts
        impulses.append(event.impulse)
        assert event.delta_v == pytest.approx(event.impulse / robot.mass)
    assert impulses[1] == pytest.approx(impulses[0], rel=0.03)


def test_an_oblique_wall_takes_the_momentum_along_its_normal(lab, robot, params):
    with lab.world(
        lab.without_drive(robot), params, [wall(1.0)], steps_per_tick=1, start=Pose2D(0.0, 0.0, 1.0)
    ) as world:
        before = np.array((1.5, 0.3))
        lab.fling(world, *before)
        while world._velocity[0] == pytest.approx(before[0], abs=1e-6):
            world.step(Twist2D())
        lab.drive(world, 2)
        after = np.array(world._velocity[:2])
        (event,) = world.close_episode().contacts
    assert after[1] == pytest.approx(before[1], abs=1e-3)  # frictionless: nothing along the wall
    assert event.impulse == pytest.approx(robot.mass * (before[0] - after[0]), rel=0.03)
    a, b = robot.half_size
    # [m] of the touching corner beside the centre of mass
    lever = a * math.sin(1.0) - b * math.cos(1.0)
    # off-centre impact, textbook
    effective_mass = 1.0 / (1.0 / robot.mass + lever**2 / robot.inertia[2])
    assert event.impulse == pytest.approx(effective_mass * before[0], rel=0.03)


def test_momentum_is_conserved_with_a_dynamic_person(lab, robot, params):
    # The person's steering is all but off: what acts is the impact.
    bodies = dataclasses.replace(
        params.pedestrian_bodies,
        kind="dynamic",
        push_force=1e-6,
        friction=0.0,
    )
    speed = 1.2
    with lab.world(
        lab.without_drive(robot),
        dataclasses.replace(params, pedestrian_bodies=bodies),
        people=[(1.0, 0.0, 0.0, 0.0)],
        steps_per_tick=1,
    ) as world:
        lab.fling(world, speed)
        lab.drive(world, 90)
        (event,) = world.close_episode().contacts
        truth = world.truth
        robot_after, person_after = world._velocity[0], truth.pedestrians[0, 2]
    total = robot.mass + bodies.mass
    common = robot.mass * speed / total
    assert robot.mass * robot_after + bodies.mass * person_after == pytest.approx(
        robot.mass * speed, rel=1e-3
    )
    assert person_after == pytest.approx(common, rel=0.03)
    assert event.impulse == pytest.approx(bodies.mass * common, rel=0.03)
    assert event.partner is Partner.PEDESTRIAN


def test_a_kinematic_person_walks_into_the_standing_robot(lab, robot, params):
    start_x = FRONT + PERSON_RADIUS + 0.5
    with lab.world(robot, params, people=[(start_x, 0.0, -1.0, 0.0)]) as world:
        truths = lab.drive(world, 120)
        (event,) = world.close_episode().contacts
    assert event.stamp == pytest.approx(0.5, abs=0.03)
    assert event.robot_speed == pytest.approx(0.0, abs=1e-3)
    assert event.partner_speed == pytest.approx(1.0, abs=1e-3)
    # Nothing stops the person: the robot is taken along, and the first impact gives it the person's
    # speed.
    assert truths[-1].twist.linear_x == pytest.approx(-1.0, abs=0.1)
    assert truths[-1].pedestrians[0, 0] == pytest.approx(start_x - 2.0, abs=1e-6)
    # the wheels' resistance during the impact included
    assert event.impulse == pytest.approx(50.0, rel=0.03)
    assert event.duration > 1.0


def test_a_dynamic_person_gives_way_and_returns_to_the_way(lab, robot, params):
    bodies = dataclasses.replace(params.pedestrian_bodies, kind="dynamic")
    people = [(2.0, 0.1, 0.0, 0.0)]
    with lab.world(
        robot, dataclasses.replace(params, pedestrian_bodies=bodies), people=people
    ) as world:
        truths = lab.drive(world, 100, v=1.5)
        pushed = max(t.pedestrians[0, 0] for t in truths)
        back = lab.drive(world, 240, v=-1.5)[-1].pedestrians[0]
    assert pushed > 2.05
    assert back[:2] == pytest.approx((2.0, 0.1), abs=0.06)


def test_a_hard_hit_counts_once_until_the_cool_down_is_over(lab, robot, params):
    start_x = FRONT + PERSON_RADIUS + 0.3
    with lab.world(lab.without_drive(robot), params, people=[(start_x, 0.0, -1.8, 0.0)]) as world:
        lab.drive(world, 60)
        (counted,) = world.close_episode().counted_contacts
        (event,) = world.truth.contacts
    assert counted.partner is Partner.PEDESTRIAN and counted.partner_id == 0
    assert counted.impulse == pytest.approx(event.peak_step_impulse)
    assert counted.impulse == pytest.approx(robot.mass * 1.8, rel=0.03)
    assert counted.partner_speed == pytest.approx(1.8) and counted.robot_speed == pytest.approx(
        0.0, abs=1e-6
    )
    assert (counted.x, counted.y) == pytest.approx((FRONT, 0.0), abs=0.05)


@pytest.mark.parametrize(("speed", "contacts"), [(0.9, 0), (1.1, 1)])
def test_somebody_walking_into_the_standing_robot_counts_from_1_mps(
    lab,
    robot,
    params,
    speed,
    contacts,
):
    """50 kg x 1 m/s is the least that counts (published)."""
    start_x = FRONT + PERSON_RADIUS + 0.3
    with lab.world(robot, params, people=[(start_x, 0.0, -speed, 0.0)]) as world:
        lab.drive(world, 30)
        assert len(world.close_episode().counted_contacts) == contacts


def test_energy_never_grows_without_drive(lab, robot, params):
    obstacles = [wall(1.5), post(-2.0, 0.1, height=0.3), wall(-3.0, yaw=math.pi)]
    with lab.world(lab.without_drive(robot), params, obstacles, steps_per_tick=1) as world:
        lab.fling(world, 2.5, 0.2, (0.0, 0.3, 0.8))
        energies = []
        for _ in range(600):
            world.step(Twist2D())
            energies.append(mechanical_energy(world, robot, params.physics.gravity))
    growth = np.diff(energies)
    assert growth.max() < 0.5  # [J] of about 390; potential energy is first order in the step
    assert energies[-1] <= energies[0] + 1e-6


@pytest.mark.parametrize("kind", ["wall", "furniture", "dynamic"])
def test_a_passive_impact_leaves_no_more_energy_than_there_was(any_robot, params, kind):
    world, obstacles, people, mass = partners(params, kind)
    contact = collide(any_robot, stepping_at(world, 120.0), 2.0, obstacles, people)
    before = 0.5 * any_robot.mass * 2.0**2
    robot_after = 0.5 * any_robot.mass * (2.0 - contact.delta_v) ** 2
    partner_after = 0.0 if math.isinf(mass) else 0.5 * contact.impulse**2 / mass
    assert robot_after + partner_after <= before


def test_without_motors_no_command_and_no_friction_adds_energy(lab, robot, params):
    """A long drive of a robot whose wheels turn freely, thrown about and commanded at random."""
    rng = np.random.default_rng(3)
    unpowered = dataclasses.replace(robot, max_wheel_torque=1e-9)
    with lab.world(unpowered, params, steps_per_tick=1) as world:
        for _ in range(20):
            lab.fling(world, *rng.normal(0.0, 1.0, 2), (0.0, 0.0, rng.normal(0.0, 1.0)))
            energies = [mechanical_energy(world, robot, params.physics.gravity)]
            for _ in range(60):
                world.step(Twist2D(rng.normal(0.0, 2.0), 0.0, rng.normal(0.0, 2.0)))
                energies.append(mechanical_energy(world, robot, params.physics.gravity))
            assert np.diff(energies).max() < 0.1  # [J] of about 50; shrinks with the step
            assert energies[-1] < energies[0]
        assert world.truth.motion_energy < 400.0  # the rolling resistance alone


def test_its_energy_never_exceeds_the_motors_work(lab, robot, params):
    rng = np.random.default_rng(4)
    with lab.world(robot, params, steps_per_tick=1) as world:
        rest = mechanical_energy(world, robot, params.physics.gravity)
        for _ in range(30):
            speed, turn = rng.uniform(-1.0, 3.0), rng.uniform(-1.5, 1.5)
            for _ in range(40):
                world.step(Twist2D(speed, 0.0, turn))
                gained = mechanical_energy(world, robot, params.physics.gravity) - rest
                assert gained <= world.truth.motion_energy + 0.5  # [J] of up to 100


def test_it_stands_still_on_level_ground(lab, robot, params):
    with lab.world(robot, params) as world:
        truth = lab.drive(world, 600)[-1]
    assert math.hypot(truth.pose.x, truth.pose.y) < 1e-6
    assert truth.tilt < 1e-4
    assert abs(truth.twist.linear_x) < 1e-9


def test_it_tips_over_a_low_edge_when_fast_and_not_when_slow(lab, robot, params):
    """A step of 0.12 m trips the body.

    The threshold is the lever of the centre of mass (textbook).
    """
    kerb = wall(1.0, height=0.12)
    tilts = {}
    for speed in (0.5, 3.5):
        with lab.world(lab.without_drive(robot), params, [kerb]) as world:
            lab.fling(world, speed)
            tilts[speed] = max(t.tilt for t in lab.drive(world, 180))
    assert tilts[0.5] < 0.1
    assert tilts[3.5] > 0.5


def test_a_push_high_up_tips_it_and_a_low_one_does_not(lab, robot, params):
    tilts = {}
    for height in (0.1, 1.1):
        with lab.world(robot, params, steps_per_tick=1) as world:
            worst = 0.0
            for step in range(150):
                if step < 60:
                    x, y, z = world._position
                    bullet.applyExternalForce(
                        world._body,
                        -1,
                        (0.0, 330.0, 0.0),
                        (x, y, height),
                        bullet.WORLD_FRAME,
                        physicsClientId=world._client,
                    )
                world.step(Twist2D())
                worst = max(worst, world.truth.tilt)
            tilts[height] = worst
    assert tilts[0.1] < 0.02
    assert tilts[1.1] > 0.5


def test_tipping_does_not_hang_on_the_time_step(lab, robot, params):
    tilts = [
        greatest_tilt(robot, stepping_at(params, rate), 1.5, wall(1.0, height=0.12))
        for rate in (120.0, 240.0)
    ]
    assert tilts[0] == pytest.approx(tilts[1], rel=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("height", [0.15, 0.3])
def test_the_speed_that_tips_it_over_a_low_bollard_is_that_of_a_fine_step(robot, params, height):
    coarse, fine = (
        tipping_speed(robot, stepping_at(params, rate), bollard(1.0, height))
        for rate in (120.0, 960.0)
    )
    assert coarse == pytest.approx(fine, rel=0.03)


def test_somebody_who_keeps_pushing_from_the_side_shifts_the_robot(lab, robot, params):
    with lab.world(robot, params, people=[(0.0, 1.0, 0.0, -0.5)]) as world:
        truths = lab.drive(world, 240)
    assert max(t.tilt for t in truths) < 0.1
    assert truths[-1].pose.y < -0.3

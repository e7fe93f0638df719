"""The physical world against mechanics: momentum, friction, energy, tipping, determinism."""

import dataclasses
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from harness import resources
from harness.mission import Mission
from harness.truth import Partner
from harness.world.engine import bullet
from harness.world.pedestrians import PedestrianModel
from harness.world.pybullet_world import PyBulletWorld
from harness.world.robot import RobotParams
from harness.world.scene import Obstacle, Scene
from harness.world.shapes import box, octagon
from harness.world.world_params import WorldParams
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import ParameterError, UnknownNameError
from navstack.params.strict import load_dataclass
from navstack.types import Observation, Pose2D, Twist2D

FRONT = 0.14  # [m] of the robot's body ahead of the base origin
PERSON_RADIUS = 0.3  # [m]


class Marchers(PedestrianModel):
    """People who walk straight on for ever."""

    def __init__(self, *states):
        self._start = np.array(states, dtype=float).reshape(-1, 4)
        self._states = self._start

    def reset(self, rng, robot):
        self._states = self._start

    def step(self, dt):
        states = self._states.copy()
        states[:, :2] += dt * states[:, 2:]
        self._states = states

    @property
    def states(self):
        return self._states


class NoSensors:
    """Delivers nothing."""

    def reset(self, body, generators):
        pass

    def measure(self, body, pedestrians, stamp):
        return Observation(stamp)


@pytest.fixture(scope="module")
def robot() -> RobotParams:
    return load_dataclass(RobotParams, resources.shipped("params") / "robots" / "segway_e1.yaml")


@pytest.fixture(scope="module")
def params() -> WorldParams:
    loaded = load_dataclass(WorldParams, resources.shipped("params") / "worlds" / "costnav.yaml")
    return dataclasses.replace(loaded, cargo=dataclasses.replace(loaded.cargo, pieces=0))


@contextmanager
def world_of(robot, params, obstacles=(), people=(), steps_per_tick=2, start=None) -> Iterator[PyBulletWorld]:
    grid = OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 1.0, Pose2D())
    scene = Scene("test", tuple(obstacles), (), grid, grid)
    world = PyBulletWorld(scene, robot, params, Marchers(*people), NoSensors(), steps_per_tick)
    try:
        restart(world, start or Pose2D())
        yield world
    finally:
        world.close()


def restart(world, start):
    generators = {name: np.random.default_rng(1) for name in ("pedestrians", "cargo")}
    world.reset(Mission(start, start, 0.0), generators)


def fling(world, vx, vy=0.0, vz=0.0, spin=(0.0, 0.0, 0.0)):
    """Set the robot in motion without its drive."""
    bullet.resetBaseVelocity(world._body, (vx, vy, vz), spin, physicsClientId=world._client)
    world._read_robot()


def drive(world, ticks, v=0.0, w=0.0):
    """The truth after each tick."""
    truths = []
    for _ in range(ticks):
        world.step(Twist2D(v, 0.0, w))
        truths.append(world.truth)
    return truths


def without_drive(robot):
    return dataclasses.replace(robot, wheel_friction=0.0, body_friction=0.0)


def wall(x, yaw=0.0, height=1.5):
    return Obstacle("building_glass", box(x + 0.5 * math.cos(yaw), 0.5 * math.sin(yaw), yaw, 1.0, 4.0), height)


def post(x, y=0.0, height=0.9, radius=0.1):
    return Obstacle("bollard", octagon(x, y, radius), height)


def with_physics(params, **changes):
    return dataclasses.replace(params, physics=dataclasses.replace(params.physics, **changes))


# Driving


def test_it_reaches_and_holds_the_commanded_speed_on_a_straight_line(robot, params):
    with world_of(robot, params, start=Pose2D(3.0, -2.0, 0.7)) as world:
        truth = drive(world, 240, v=1.5)[-1]
    assert truth.twist.linear_x == pytest.approx(1.5, abs=1e-6)
    off_line = -math.sin(0.7) * (truth.pose.x - 3.0) + math.cos(0.7) * (truth.pose.y + 2.0)
    assert abs(off_line) < 1e-6
    assert truth.pose.yaw == pytest.approx(0.7, abs=1e-9)
    # Constant acceleration until the servo's exponential approach takes over.
    acceleration, lag = robot.max_acceleration, robot.servo_time_constant
    ramp = 1.5 / acceleration - lag
    missed = 1.5 * ramp - 0.5 * acceleration * ramp**2 + acceleration * lag**2
    assert math.hypot(truth.pose.x - 3.0, truth.pose.y + 2.0) == pytest.approx(1.5 * 4.0 - missed, abs=0.01)


def test_it_turns_in_place_about_the_axle(robot, params):
    with world_of(robot, params, start=Pose2D(1.0, 1.0, 0.0)) as world:
        truths = drive(world, 300, w=1.0)
    assert truths[-1].twist.angular_z == pytest.approx(1.0, abs=1e-6)
    assert max(math.hypot(t.pose.x - 1.0, t.pose.y - 1.0) for t in truths) < 0.01
    assert max(abs(t.twist.linear_y) for t in truths) < 0.01


def test_it_drives_the_commanded_circle(robot, params):
    with world_of(robot, params) as world:
        truths = drive(world, 600, v=1.0, w=0.5)[120:]
    points = np.array([(t.pose.x, t.pose.y) for t in truths])
    # Circle through the points by linear least squares: x^2 + y^2 = 2 a x + 2 b y + c.
    system = np.column_stack((2.0 * points, np.ones(len(points))))
    a, b, c = np.linalg.lstsq(system, (points**2).sum(axis=1), rcond=None)[0]
    assert math.sqrt(c + a * a + b * b) == pytest.approx(2.0, rel=0.01)


def test_braking_is_limited_by_the_drive_and_by_friction(robot, params):
    for friction, expected in ((robot.wheel_friction, robot.max_deceleration), (0.3, 0.3 * params.physics.gravity)):
        slippery = dataclasses.replace(robot, wheel_friction=friction)
        with world_of(slippery, params) as world:
            x0 = drive(world, 240, v=2.0)[-1].pose.x
            distance = drive(world, 200)[-1].pose.x - x0
        shortest = 2.0**2 / (2.0 * expected) - 2.0 / params.physics.rate
        # The servo's last, exponential part costs at most two time constants more.
        assert shortest <= distance < shortest + 2.0 * 2.0 * robot.servo_time_constant


def test_commands_beyond_the_robots_limits_are_clipped(robot, params):
    with world_of(robot, params) as world:
        truth = drive(world, 300, v=10.0)[-1]
        assert truth.twist.linear_x == pytest.approx(robot.max_speed, abs=1e-3)


def test_wheels_resist_a_sideways_shove_by_friction_only(robot, params):
    with world_of(robot, params) as world:
        fling(world, 0.0, vy=1.0)
        truths = drive(world, 60)
    # Friction mu g stops the slide of the axle within mu g t = v; 0.3 s is ample, and 0.02 s would be a rail.
    assert abs(truths[0].twist.linear_y) > 0.5
    assert abs(truths[30].twist.linear_y) < 0.02


# Collisions


@pytest.mark.parametrize("obstacle", [wall(1.0), post(1.1, height=1.2)], ids=["wall", "post"])
@pytest.mark.parametrize("speed", [0.5, 1.26, 2.0, 3.5])
def test_the_impulse_on_something_fixed_is_the_lost_momentum(robot, params, obstacle, speed):
    with world_of(without_drive(robot), params, [obstacle], steps_per_tick=1) as world:
        fling(world, speed)
        after = speed
        for _ in range(400):
            world.step(Twist2D())
            after = min(after, world._velocity[0])
        (event,) = world.close_episode().contacts
    assert event.partner is Partner.PROPERTY and event.kind == obstacle.kind
    assert event.impulse == pytest.approx(robot.mass * (speed - after), rel=0.03)
    assert event.impulse == pytest.approx(robot.mass * speed, rel=0.03)  # without rebound
    assert event.closing_speed == pytest.approx(speed, rel=1e-3)
    assert event.robot_speed == pytest.approx(speed, rel=1e-3)
    assert event.partner_speed == 0.0
    assert event.x == pytest.approx(1.0, abs=0.04)


def test_an_oblique_wall_takes_the_momentum_along_its_normal(robot, params):
    with world_of(without_drive(robot), params, [wall(1.0, yaw=0.0)], start=Pose2D(0.0, 0.0, 0.5)) as world:
        before = np.array((1.5, 0.3))
        fling(world, *before)
        drive(world, 120)
        after = np.array(world._velocity[:2])
        events = world.close_episode().contacts
    assert after[1] == pytest.approx(before[1], abs=1e-3)  # frictionless: nothing along the wall
    assert sum(event.impulse for event in events) == pytest.approx(robot.mass * (before[0] - after[0]), rel=0.03)
    assert len(events) == 2  # the front corner, then, swung round by it, another one
    assert events[0].impulse < 0.8 * robot.mass * before[0]  # off-centre: part of the motion goes into turning


def test_momentum_is_conserved_with_a_dynamic_person(robot, params):
    # The person's steering is all but off: what acts is the impact.
    bodies = dataclasses.replace(params.pedestrian_bodies, kind="dynamic", push_force=1e-6, friction=0.0)
    speed = 1.2
    with world_of(
        without_drive(robot),
        dataclasses.replace(params, pedestrian_bodies=bodies),
        people=[(1.0, 0.0, 0.0, 0.0)],
        steps_per_tick=1,
    ) as world:
        fling(world, speed)
        drive(world, 90)
        (event,) = world.close_episode().contacts
        truth = world.truth
        robot_after, person_after = world._velocity[0], truth.pedestrians[0, 2]
    total = robot.mass + bodies.mass
    common = robot.mass * speed / total
    assert robot.mass * robot_after + bodies.mass * person_after == pytest.approx(robot.mass * speed, rel=1e-3)
    assert person_after == pytest.approx(common, rel=0.03)
    assert event.impulse == pytest.approx(bodies.mass * common, rel=0.03)
    assert event.partner is Partner.PEDESTRIAN


def test_a_kinematic_person_walks_into_the_standing_robot(robot, params):
    start_x = FRONT + PERSON_RADIUS + 0.5
    with world_of(robot, params, people=[(start_x, 0.0, -1.0, 0.0)]) as world:
        truths = drive(world, 120)
        (event,) = world.close_episode().contacts
    assert event.stamp == pytest.approx(0.5, abs=0.03)
    assert event.robot_speed == pytest.approx(0.0, abs=1e-3)
    assert event.partner_speed == pytest.approx(1.0, abs=1e-3)
    # Nothing stops the person: the robot is taken along, and the first impact gives it the person's speed.
    assert truths[-1].twist.linear_x == pytest.approx(-1.0, abs=0.1)
    assert truths[-1].pedestrians[0, 0] == pytest.approx(start_x - 2.0, abs=1e-6)
    assert event.impulse == pytest.approx(50.0, rel=0.25)  # 3 steps of the wheels' resistance included
    assert event.duration > 1.0


def test_a_dynamic_person_gives_way_and_returns_to_the_way(robot, params):
    bodies = dataclasses.replace(params.pedestrian_bodies, kind="dynamic")
    people = [(2.0, 0.1, 0.0, 0.0)]
    with world_of(robot, dataclasses.replace(params, pedestrian_bodies=bodies), people=people) as world:
        truths = drive(world, 100, v=1.5)
        pushed = max(t.pedestrians[0, 0] for t in truths)
        back = drive(world, 240, v=-1.5)[-1].pedestrians[0]
    assert pushed > 2.05
    assert back[:2] == pytest.approx((2.0, 0.1), abs=0.06)


def test_a_hard_hit_counts_once_until_the_cool_down_is_over(robot, params):
    start_x = FRONT + PERSON_RADIUS + 0.3
    with world_of(without_drive(robot), params, people=[(start_x, 0.0, -1.8, 0.0)]) as world:
        drive(world, 60)
        (counted,) = world.close_episode().counted_contacts
        (event,) = world.truth.contacts
    assert counted.partner is Partner.PEDESTRIAN and counted.partner_id == 0
    assert counted.impulse == pytest.approx(event.peak_step_impulse)
    assert 50.0 <= counted.impulse < 90.0  # two contact points share 90 N s


# Energy and tipping


def test_energy_never_grows_without_drive(robot, params):
    gravity, inertia = params.physics.gravity, np.array(robot.inertia)
    obstacles = [wall(1.5), post(-2.0, 0.1, height=0.3), wall(-3.0, yaw=math.pi)]
    with world_of(without_drive(robot), params, obstacles, steps_per_tick=1) as world:
        fling(world, 2.5, 0.2, 0.0, (0.0, 0.3, 0.8))
        energies = []
        for _ in range(600):
            world.step(Twist2D())
            rotation = np.array(bullet.getMatrixFromQuaternion(world._orientation)).reshape(3, 3)
            spin = rotation.T @ world._spin
            kinetic = 0.5 * robot.mass * np.dot(world._velocity, world._velocity) + 0.5 * spin @ (inertia * spin)
            energies.append(kinetic + robot.mass * gravity * world._position[2])
    growth = np.diff(energies)
    assert growth.max() < 0.5  # [J] of about 390; potential energy is first order in the step
    assert energies[-1] <= energies[0] + 1e-6


def test_it_stands_still_on_level_ground(robot, params):
    with world_of(robot, params) as world:
        truth = drive(world, 600)[-1]
    assert math.hypot(truth.pose.x, truth.pose.y) < 1e-6
    assert truth.tilt < 1e-4
    assert abs(truth.twist.linear_x) < 1e-9


def test_it_tips_over_a_low_edge_when_fast_and_not_when_slow(robot, params):
    """A step of 0.12 m trips the body; the threshold is the lever of the centre of mass (textbook)."""
    kerb = wall(1.0, height=0.12)
    tilts = {}
    for speed in (0.5, 3.5):
        with world_of(without_drive(robot), params, [kerb]) as world:
            fling(world, speed)
            tilts[speed] = max(t.tilt for t in drive(world, 180))
    assert tilts[0.5] < 0.1
    assert tilts[3.5] > 0.5


def test_a_push_high_up_tips_it_and_a_low_one_does_not(robot, params):
    tilts = {}
    for height in (0.1, 1.1):
        with world_of(robot, params, steps_per_tick=1) as world:
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


def test_tipping_does_not_hang_on_the_time_step(robot, params):
    tilts = []
    for rate in (120.0, 240.0):
        with world_of(without_drive(robot), with_physics(params, rate=rate), [wall(1.0, height=0.12)]) as world:
            fling(world, 1.5)
            tilts.append(max(t.tilt for t in drive(world, 240)))
    assert tilts[0] == pytest.approx(tilts[1], rel=0.2)


# Bookkeeping


def test_two_fresh_worlds_agree_bit_for_bit(robot, params):
    loaded = dataclasses.replace(params, cargo=dataclasses.replace(params.cargo, pieces=20))
    obstacles = [wall(3.0), post(1.5, 0.3), post(1.5, -1.0, height=0.3)]
    people = [(2.0, -0.2, -1.0, 0.05), (-2.0, 0.1, 1.1, 0.0)]

    def journey(world):
        return [
            (*dataclasses.astuple(t.pose), t.tilt, *dataclasses.astuple(t.twist), t.cargo.pieces_outside)
            for t in drive(world, 150, v=1.8, w=0.2)
        ], world.close_episode()

    with world_of(robot, loaded, obstacles, people) as first, world_of(robot, loaded, obstacles, people) as second:
        trace, truth = journey(first)
        again, truth_again = journey(second)
        restart(first, Pose2D())  # nothing is left of an earlier episode
        third, truth_third = journey(first)
    assert trace == again == third
    assert truth.contacts == truth_again.contacts == truth_third.contacts
    assert truth.counted_contacts == truth_again.counted_contacts == truth_third.counted_contacts
    assert truth.contacts


def test_obstacles_far_ahead_are_met_when_the_robot_gets_there(robot, params):
    with world_of(robot, params, [wall(14.0)]) as world:
        truth = drive(world, 900, v=2.0)[-1]
    assert 14.0 - FRONT - 0.01 < truth.pose.x < 14.0 - FRONT + 0.03


def test_the_reported_acceleration_is_that_of_the_base(robot, params):
    with world_of(robot, params) as world:
        drive(world, 12, v=3.0)
        assert world.body_state.ax == pytest.approx(robot.max_acceleration, rel=0.01)
        drive(world, 600, v=1.0, w=0.5)
        assert world.body_state.ax == pytest.approx(0.0, abs=0.02)
        assert world.body_state.ay == pytest.approx(1.0 * 0.5, abs=0.02)


def test_bad_parameters_are_named(robot, params):
    with pytest.raises(ParameterError, match="mass"):
        dataclasses.replace(robot, mass=0.0)
    with pytest.raises(UnknownNameError, match="kinematic"):
        dataclasses.replace(params.pedestrian_bodies, kind="kinematik")
    with pytest.raises(ParameterError, match="contact_erp"):
        with_physics(params, contact_erp=0.9)


def test_nothing_is_written_to_standard_output(robot, params, capfd):
    with world_of(robot, params, [wall(2.0)]) as world:
        drive(world, 120, v=2.0)
        restart(world, Pose2D())
    assert capfd.readouterr().out == ""
    assert Path(bullet.__file__).exists()

"""The physical world: driving, determinism and bookkeeping."""

import dataclasses
import math
import os
import threading

import numpy as np
import pytest

from harness.world.physics.engine import quiet
from navstack.errors import ParameterError, UnknownNameError
from navstack.types import Pose2D

from ..laboratory import post, wall

GENTLE = 2.0  # [m/s2] that friction allows both robots
FRONT = 0.14  # [m] of the robot's body ahead of the base origin


def test_it_reaches_and_holds_the_commanded_speed_on_a_straight_line(lab, any_robot, params):
    robot = dataclasses.replace(any_robot, max_acceleration=GENTLE)
    with lab.world(robot, params, start=Pose2D(3.0, -2.0, 0.7)) as world:
        truth = lab.drive(world, 240, v=1.5)[-1]
    assert truth.twist.linear_x == pytest.approx(1.5, abs=1e-6)
    off_line = -math.sin(0.7) * (truth.pose.x - 3.0) + math.cos(0.7) * (truth.pose.y + 2.0)
    assert abs(off_line) < 1e-5
    assert truth.pose.yaw == pytest.approx(0.7, abs=1e-5)
    # Constant acceleration until the servo's exponential approach takes over.
    acceleration, lag = GENTLE, robot.servo_time_constant
    ramp = 1.5 / acceleration - lag
    missed = 1.5 * ramp - 0.5 * acceleration * ramp**2 + acceleration * lag**2
    assert math.hypot(truth.pose.x - 3.0, truth.pose.y + 2.0) == pytest.approx(
        1.5 * 4.0 - missed, abs=0.01
    )


def test_it_turns_in_place_about_the_axle(lab, any_robot, params):
    with lab.world(any_robot, params, start=Pose2D(1.0, 1.0, 0.0)) as world:
        truths = lab.drive(world, 300, w=1.0)
    assert truths[-1].twist.angular_z == pytest.approx(1.0, abs=1e-6)
    assert max(math.hypot(t.pose.x - 1.0, t.pose.y - 1.0) for t in truths) < 0.01
    assert max(abs(t.twist.linear_y) for t in truths) < 0.01


def test_it_drives_the_commanded_circle(lab, robot, params):
    with lab.world(robot, params) as world:
        truths = lab.drive(world, 600, v=1.0, w=0.5)[120:]
    points = np.array([(t.pose.x, t.pose.y) for t in truths])
    # Circle through the points by linear least squares: x^2 + y^2 = 2 a x + 2 b y + c.
    system = np.column_stack((2.0 * points, np.ones(len(points))))
    a, b, c = np.linalg.lstsq(system, (points**2).sum(axis=1), rcond=None)[0]
    assert math.sqrt(c + a * a + b * b) == pytest.approx(2.0, rel=0.01)


@pytest.mark.parametrize("friction", [None, 0.2])
def test_braking_is_limited_by_the_drive_and_by_friction(lab, any_robot, params, friction):
    robot = (
        any_robot if friction is None else dataclasses.replace(any_robot, wheel_friction=friction)
    )
    expected = robot.max_deceleration
    if friction is not None:
        expected = friction * params.physics.gravity
    with lab.world(robot, params) as world:
        x0 = lab.drive(world, 480, v=2.0)[-1].pose.x
        truths = lab.drive(world, 200)
        distance, tilt = truths[-1].pose.x - x0, max(t.tilt for t in truths)
    shortest = 2.0**2 / (2.0 * expected) - 2.0 / params.physics.rate
    # The servo's last, exponential part costs at most two time constants more.
    assert shortest <= distance < shortest + 2.0 * 2.0 * robot.servo_time_constant
    assert tilt < 0.01  # the casters stay on the ground


def test_a_brake_beyond_the_balance_of_moments_lifts_the_casters(lab, robot, params):
    """The centre of mass ahead of which the axle stands lifts off at g b / h (textbook)."""
    balance = params.physics.gravity * abs(robot.center_of_mass_x) / robot.center_of_mass_height
    tilts = []
    for deceleration in (0.97 * balance, 1.1 * balance):
        hard = dataclasses.replace(robot, max_deceleration=deceleration)
        with lab.world(hard, params) as world:
            lab.drive(world, 240, v=2.0)
            tilts.append(max(t.tilt for t in lab.drive(world, 60)))
    assert tilts[0] < 1e-3 < 1e-2 < tilts[1]


def test_while_the_casters_are_lifted_the_wheels_carry_the_whole_weight(lab, robot, params):
    balance = params.physics.gravity * abs(robot.center_of_mass_x) / robot.center_of_mass_height
    loads = []
    with lab.world(dataclasses.replace(robot, max_deceleration=1.1 * balance), params) as world:
        lab.drive(world, 240, v=2.0)
        for _ in range(60):
            if lab.drive(world, 1)[-1].tilt > 1e-2:
                loads.append(world._footing.left_load + world._footing.right_load)
    assert np.mean(loads) == pytest.approx(robot.mass * params.physics.gravity, rel=0.1)


def test_commands_beyond_the_robots_limits_are_clipped(lab, any_robot, params):
    with lab.world(any_robot, params) as world:
        truth = lab.drive(world, 400, v=10.0)[-1]
        assert truth.twist.linear_x == pytest.approx(any_robot.max_speed, abs=1e-3)


def test_the_motors_energy_is_the_kinetic_energy_and_the_rolling_resistance(lab, any_robot, params):
    with lab.world(any_robot, params) as world:
        truth = lab.drive(world, 600, v=1.5)[-1]
    weight = any_robot.mass * params.physics.gravity
    expected = 0.5 * any_robot.mass * 1.5**2 + any_robot.rolling_resistance * weight * truth.pose.x
    assert truth.motion_energy == pytest.approx(expected, rel=0.005)


def test_wheels_resist_a_sideways_shove_by_friction_only(lab, robot, params):
    with lab.world(robot, params) as world:
        lab.fling(world, 0.0, vy=1.0)
        truths = lab.drive(world, 60)
    # Friction mu g stops the slide of the axle within mu g t = v; 0.3 s is ample, and 0.02 s would
    # be a rail.
    assert abs(truths[0].twist.linear_y) > 0.5
    assert abs(truths[30].twist.linear_y) < 0.02


def test_two_fresh_worlds_agree_bit_for_bit(lab, robot, params):
    loaded = dataclasses.replace(params, cargo=dataclasses.replace(params.cargo, pieces=20))
    obstacles = [wall(3.0), post(1.5, 0.3), post(1.5, -1.0, height=0.3)]
    people = [(2.0, -0.2, -1.0, 0.05), (-2.0, 0.1, 1.1, 0.0)]

    def journey(world):
        return [
            (
                *dataclasses.astuple(t.pose),
                t.tilt,
                *dataclasses.astuple(t.twist),
                t.cargo.pieces_outside,
            )
            for t in lab.drive(world, 150, v=1.8, w=0.2)
        ], world.close_episode()

    with (
        lab.world(robot, loaded, obstacles, people) as first,
        lab.world(robot, loaded, obstacles, people) as second,
    ):
        trace, truth = journey(first)
        again, truth_again = journey(second)
        lab.restart(first, Pose2D())  # nothing is left of an earlier episode
        third, truth_third = journey(first)
    assert trace == again == third
    assert truth.contacts == truth_again.contacts == truth_third.contacts
    assert truth.counted_contacts == truth_again.counted_contacts == truth_third.counted_contacts
    assert truth.contacts


def test_obstacles_far_ahead_are_met_when_the_robot_gets_there(lab, robot, params):
    with lab.world(robot, params, [wall(14.0)]) as world:
        truth = lab.drive(world, 900, v=2.0)[-1]
    assert 14.0 - FRONT - 0.01 < truth.pose.x < 14.0 - FRONT + 0.03


def test_the_reported_acceleration_is_that_of_the_base(lab, robot, params):
    robot = dataclasses.replace(robot, max_acceleration=GENTLE)
    with lab.world(robot, params) as world:
        lab.drive(world, 12, v=3.0)
        assert world.body_state.ax == pytest.approx(GENTLE, rel=0.01)
        lab.drive(world, 600, v=1.0, w=0.5)
        assert world.body_state.ax == pytest.approx(0.0, abs=0.02)
        assert world.body_state.ay == pytest.approx(1.0 * 0.5, abs=0.02)


@pytest.mark.parametrize("aside", [0.0, 0.08])
def test_a_robot_turns_about_the_middle_between_its_wheels(lab, robot, params, aside):
    """Also where its body lies to one side."""
    footprint = tuple((x, y + aside) for x, y in robot.footprint)
    shifted = dataclasses.replace(robot, footprint=footprint)
    with lab.world(shifted, params) as world:
        places = []
        for _ in range(40):
            lab.drive(world, 12, w=1.0)
            places.append((world.truth.pose.x, world.truth.pose.y))
    assert np.ptp(places, axis=0).max() < 0.01


def test_people_and_walls_in_front_of_a_long_robot_have_bodies(lab, robot, params):
    """Its front is 4 m from its centre of mass."""
    long = dataclasses.replace(
        robot, footprint=((3.9, 0.3), (3.9, -0.3), (-0.6, -0.3), (-0.6, 0.3))
    )
    with lab.world(long, params, [wall(4.2)]) as world:
        lab.drive(world, 400, v=0.5)
        assert world.close_episode().contacts[0].stamp < 1.3, "0.3 m at 0.5 m/s"
    with lab.world(long, params, people=[(4.3, 0.0, 0.0, 0.0)]) as world:
        lab.drive(world, 240, v=0.5)
        assert world.close_episode().contacts[0].stamp < 0.9, "0.1 m at 0.5 m/s"


def test_bad_parameters_are_named(robot, params):
    with pytest.raises(ParameterError, match="max_depenetration_speed 1 has no effect"):
        dataclasses.replace(params.pedestrian_bodies, max_depenetration_speed=1.0)
    with pytest.raises(ParameterError, match="mass"):
        dataclasses.replace(robot, mass=0.0)
    with pytest.raises(ParameterError, match="center_of_mass_x"):
        dataclasses.replace(robot, center_of_mass_x=0.1)
    with pytest.raises(UnknownNameError, match="kinematic"):
        dataclasses.replace(params.pedestrian_bodies, kind="kinematik")
    with pytest.raises(ParameterError, match="contact_erp"):
        dataclasses.replace(params.physics, contact_erp=0.9)


def test_nothing_is_written_to_standard_output(lab, robot, params, capfd):
    with lab.world(robot, params, [wall(2.0)]) as world:
        lab.drive(world, 120, v=2.0)
        lab.restart(world, Pose2D())
    assert capfd.readouterr().out == ""


def test_threads_that_make_worlds_leave_the_streams_where_they_were():
    before = [os.readlink(f"/proc/self/fd/{stream}") for stream in (1, 2)]
    is_inside, is_over = threading.Event(), threading.Event()

    def silence():
        with quiet():
            is_inside.set()
            is_over.wait(10.0)

    other = threading.Thread(target=silence)
    with quiet():
        other.start()
        is_inside.wait(0.3)  # without a lock it would be, and leave last
    is_over.set()
    other.join()
    assert [os.readlink(f"/proc/self/fd/{stream}") for stream in (1, 2)] == before


def test_worlds_that_nobody_holds_free_their_servers(lab, robot, params):
    loaded = dataclasses.replace(params, cargo=dataclasses.replace(params.cargo, pieces=2))
    clients = set()
    for _ in range(20):
        with lab.world(robot, loaded) as world:
            clients.add(world._client)
            world.close()  # closing twice is no harm
    assert len(clients) <= 2

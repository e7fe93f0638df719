"""The drive's forces and the kinematics of points on the robot.

Both against slow twins and textbook cases.
"""

import dataclasses
import math

import numpy as np
import pytest

from harness.storage import shipped as resources
from harness.world.physics.body_state import BodyState
from harness.world.physics.drive_kernels import (
    LEVEL,
    drive_constants,
    drive_forces,
    grip,
    mechanical_power,
    motor_forces,
    step_towards,
    within_friction,
)
from harness.world.physics.motion_kernels import base_state, point_velocity
from harness.world.physics.robot import RobotParams
from navstack.errors import ParameterError
from navstack.params.strict import load_dataclass

DT, GRAVITY = 1.0 / 120.0, 9.81


@pytest.fixture(scope="module")
def robot():
    return load_dataclass(RobotParams, resources.shipped("params") / "robots" / "segway_e1.yaml")


def quaternion(axis, angle):
    return (
        *(math.sin(0.5 * angle) * np.asarray(axis, dtype=float)).tolist(),
        math.cos(0.5 * angle),
    )


def matrix(q):
    x, y, z, w = q
    skew = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    return np.eye(3) + 2.0 * w * skew + 2.0 * skew @ skew


def wrench(
    robot,
    v=(0.0, 0.0),
    w=0.0,
    command=(0.0, 0.0),
    q=(0.0, 0.0, 0.0, 1.0),
    loads=(LEVEL, LEVEL),
):
    """Force, torque and power."""
    constants = drive_constants(robot, GRAVITY, DT)
    force, torque, power = drive_forces(q, (*v, 0.0), (0.0, 0.0, w), *loads, *command, constants)
    return np.array(force), np.array(torque), power


def sticky(robot):
    """Wheels that friction does not limit."""
    return dataclasses.replace(robot, wheel_friction=100.0, max_wheel_torque=1e4)


def test_a_robot_is_a_box_on_four_feet(robot):
    """By hand: a box of 1.2 m x 0.5 m x 2 m and 24 kg.

    Its middle is 0.1 m behind the axle, 0.05 m to the right.
    """
    footprint = ((0.5, 0.2), (0.5, -0.3), (-0.7, -0.3), (-0.7, 0.2))
    made = dataclasses.replace(
        robot,
        footprint=footprint,
        mass=24.0,
        height=2.0,
        center_of_mass_x=-0.22,
    )
    assert made.half_size == pytest.approx((0.6, 0.25))
    assert made.center == pytest.approx((-0.1, -0.05))
    assert made.center_of_mass == pytest.approx((-0.22, 0.0, 0.45))
    assert made.inertia == pytest.approx(
        (2.0 * (0.25 + 4.0), 2.0 * (1.44 + 4.0), 2.0 * (1.44 + 0.25))
    )
    assert made.reach == pytest.approx(math.hypot(0.72, 0.3))
    assert made.max_drive_force == pytest.approx(400.0)
    assert made.axle_share == pytest.approx(0.6)
    assert made.feet == ((0.0, 0.21), (0.0, -0.21), (-0.55, 0.2), (-0.55, -0.2))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"center_of_mass_x": -0.55}, "between -0.55 m and 0, where it stands"),
        ({"center_of_mass_x": 0.0}, "between -0.55 m and 0, where it stands"),
        ({"height": 0.45}, "must exceed center_of_mass_height"),
        ({"height": 0.46, "ground_clearance": 0.46}, "and ground_clearance"),
        ({"wheelbase": -0.55}, "between 0 m and 0.55, where it stands"),
        ({"wheelbase": 0.0}, "wheelbase 0.0 must be other than 0, and up to 1.494 m long"),
        ({"track": 50.0}, "track 50.0 must be at most 1 m, twice the body"),
        ({"caster_track": 300.0}, "caster_track 300.0 must be at most 1 m, twice the body"),
        ({"wheel_radius": 9.0}, "wheel_radius 9.0 must be at most 0.3735 m, half the body"),
        ({"foot_radius": 3.0}, "foot_radius 3.0 must be at most 0.3735 m, half the body"),
        ({"bucket": (0.0, 0.0, -3.0)}, "must be at 0 m above the ground or higher"),
    ],
)
def test_a_robot_that_cannot_stand_or_whose_parts_are_larger_is_refused(
    robot,
    change,
    message,
):
    with pytest.raises(ParameterError, match=message):
        dataclasses.replace(robot, **change)


def test_casters_may_go_in_front_of_the_axle(robot):
    turned = dataclasses.replace(
        robot, wheelbase=-robot.wheelbase, center_of_mass_x=-robot.center_of_mass_x
    )
    assert turned.axle_share == robot.axle_share
    assert turned.feet == tuple((-x, y) for x, y in robot.feet)


def test_at_rest_it_only_carries_the_weight(robot):
    force, torque, power = wrench(robot)
    assert force == pytest.approx((0.0, 0.0, -robot.mass * GRAVITY))
    assert torque == pytest.approx((0.0, 0.0, 0.0))
    assert power == 0.0


def test_full_throttle_gives_the_greatest_acceleration_and_pitches(robot):
    force, torque, _ = wrench(sticky(robot), command=(3.0, 0.0))
    assert force[0] == pytest.approx(robot.mass * robot.max_acceleration)
    assert torque[1] == pytest.approx(-robot.center_of_mass_height * force[0])  # lifts the front


def test_friction_limits_speeding_up_and_braking(robot):
    slippery = dataclasses.replace(robot, wheel_friction=0.2)
    for v, command, sign in (((0.0, 0.0), (3.0, 0.0), 1.0), ((2.0, 0.0), (0.0, 0.0), -1.0)):
        force, _, _ = wrench(slippery, v=v, command=command)
        assert force[0] == pytest.approx(sign * 0.2 * robot.mass * GRAVITY)


def test_each_wheel_stays_within_its_own_circle_of_friction(robot):
    rng = np.random.default_rng(5)
    constants = drive_constants(robot, GRAVITY, DT)
    limit = 0.5 * robot.wheel_friction * robot.mass * GRAVITY
    limited = 0
    for _ in range(500):
        asked_left, asked_right, sideways = rng.normal(0.0, (200.0, 200.0, 300.0))
        la, ls, ra, rs = grip(asked_left, asked_right, sideways, LEVEL, LEVEL, constants)
        assert max(math.hypot(la, ls), math.hypot(ra, rs)) <= limit * (1.0 + 1e-12)
        assert abs(la) <= abs(asked_left) and abs(ra) <= abs(asked_right)
        limited += math.hypot(la, ls) > limit * (1.0 - 1e-12)
    assert limited > 100


@pytest.mark.parametrize(
    ("asked", "loads", "friction", "given"),
    [
        ((3.0, 0.0, 8.0), (50.0, 150.0), 1.0, (3.0, 2.0, 0.0, 6.0)),  # sideways as the loads are
        # 3-4-5: 50 N into 25, 150 into 75
        ((40.0, -120.0, 120.0), (100.0, 300.0), 0.25, (20.0, 15.0, -60.0, 45.0)),
        ((0.6, 0.0, 0.0), (0.5, 0.5), 0.8, (0.4, 0.0, 0.0, 0.0)),  # however small
        ((0.0, -0.6, 0.0), (0.5, 0.5), 0.8, (0.0, 0.0, -0.4, 0.0)),
        ((5.0, 5.0, 6.0), (0.0, 100.0), 1.0, (0.0, 0.0, 5.0, 6.0)),  # the left one in the air
        ((5.0, 5.0, 6.0), (0.0, 0.0), 1.0, (0.0, 0.0, 0.0, 0.0)),
        ((0.0, 0.0, 0.0), (10.0, 10.0), 1.0, (0.0, 0.0, 0.0, 0.0)),
    ],
)
def test_what_friction_lets_through(asked, loads, friction, given):
    assert within_friction(*asked, *loads, friction) == pytest.approx(given)


def test_off_level_ground_the_treads_are_held_though_the_body_rolls(robot):
    """One explicit step: the force at the ground moves the body and rolls it.

    It stops the treads' way sideways.
    """
    half = 0.5 * robot.mass * GRAVITY
    force, torque, _ = wrench(sticky(robot), v=(1.0, 0.3), command=(1.0, 0.0), loads=(half, half))
    rolling = DT * torque[0] / robot.inertia[0]  # [rad/s]
    assert 0.3 + DT * force[
        1
    ] / robot.mass + rolling * robot.center_of_mass_height == pytest.approx(0.0, abs=1e-12)
    assert (force[0], torque[2]) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_a_free_step_leads_to_the_servos_next_speed_without_slip(robot):
    """One explicit integration step of the rigid body in the plane is the oracle."""
    yaw, speed, turn = 0.8, 1.0, 0.4
    lever = abs(robot.center_of_mass_x)
    cos, sin = math.cos(yaw), math.sin(yaw)
    velocity = np.array((cos * speed + sin * turn * lever, sin * speed - cos * turn * lever))
    force, torque, _ = wrench(robot, velocity, turn, (1.1, 0.45), quaternion((0.0, 0.0, 1.0), yaw))
    after = velocity + DT * force[:2] / robot.mass
    turn_after = turn + DT * torque[2] / robot.inertia[2]
    heading = yaw + DT * turn_after
    axle = after + turn_after * lever * np.array((-math.sin(heading), math.cos(heading)))
    assert turn_after == pytest.approx(0.4 + 0.05 * DT / robot.servo_time_constant)
    assert axle @ (math.cos(heading), math.sin(heading)) == pytest.approx(
        1.0 + 0.1 * DT / robot.servo_time_constant
    )
    assert axle @ (-math.sin(heading), math.cos(heading)) == pytest.approx(0.0, abs=1e-12)


def test_wheels_in_the_air_pull_nothing(robot):
    tilted = quaternion((1.0, 0.0, 0.0), 0.6)
    force, torque, _ = wrench(robot, v=(1.0, 1.0), command=(3.0, 1.0), q=tilted, loads=(0.0, 0.0))
    assert force == pytest.approx((0.0, 0.0, -robot.mass * GRAVITY))
    assert not torque.any()


def test_a_wheel_alone_on_the_ground_pulls_at_its_own_place(robot):
    force, torque, _ = wrench(robot, command=(3.0, 0.0), loads=(0.0, 200.0))
    assert math.hypot(*force[:2]) <= 0.8 * 200.0 + 1e-9
    # right wheel
    lever = np.array((-robot.center_of_mass_x, -0.5 * robot.track, -robot.center_of_mass_height))
    assert torque == pytest.approx(np.cross(lever, (force[0], force[1], 0.0)))


def test_forces_within_all_limits_pass_unchanged(robot):
    left, right = motor_forces(50.0, 5.0, 0.2, 300.0)
    assert (left + right, 0.2 * (right - left)) == pytest.approx((50.0, 5.0))
    la, ls, ra, rs = grip(left, right, 20.0, LEVEL, LEVEL, drive_constants(robot, GRAVITY, DT))
    assert (la, ra, ls + rs) == pytest.approx((left, right, 20.0))


def test_a_weak_motor_limits_each_wheel():
    # Asked for: left 150, right 350; each motor gives at most 200.
    assert motor_forces(500.0, 40.0, 0.2, 200.0) == pytest.approx((150.0, 200.0))


def test_weak_motors_leave_the_axle_without_slip(robot):
    """One explicit step of the rigid body.

    What the motors cannot turn, the ground still holds sideways.
    """
    weak = dataclasses.replace(sticky(robot), max_wheel_torque=1e-9)
    lever = abs(robot.center_of_mass_x)
    velocity, turn = np.array((1.0, 0.3)), 0.7
    force, torque, _ = wrench(weak, velocity, turn, (2.0, -1.5))
    after, turn_after = (
        velocity + DT * force[:2] / robot.mass,
        turn + DT * torque[2] / robot.inertia[2],
    )
    # to first order in the step
    assert after[1] + turn_after * lever == pytest.approx(0.0, abs=0.02)
    assert force[0] == pytest.approx(0.0, abs=1e-6)
    before = 0.5 * robot.mass * velocity @ velocity + 0.5 * robot.inertia[2] * turn**2
    assert 0.5 * robot.mass * after @ after + 0.5 * robot.inertia[2] * turn_after**2 <= before


def test_power_is_force_times_speed_and_rolling_resistance_and_braking_gives_nothing_back(robot):
    rolling = robot.rolling_resistance * robot.mass * GRAVITY
    assert wrench(robot, v=(2.0, 0.0), command=(2.0, 0.0))[2] == pytest.approx(2.0 * rolling)
    force, _, power = wrench(robot, v=(1.0, 0.0), command=(1.1, 0.0))
    middle = 1.0 + 0.5 * DT * force[0] / robot.mass
    assert power == pytest.approx((force[0] + rolling) * middle)
    assert wrench(robot, v=(2.0, 0.0), command=(0.0, 0.0))[2] == 0.0


@pytest.mark.parametrize(
    ("forces", "motion", "along", "power"),
    [
        # wheels at 0.5 and 2.5 m/s
        ((10.0, -1.0), (1.0, 2.0), 4.0, 10.0 * 0.5 + 5.0 * 0.5 - 2.5 + 5.0 * 2.5),
        ((-10.0, 0.0), (1.0, 2.0), 4.0, 5.0 * 2.5),  # the left one brakes
        # backwards
        ((-6.0, -20.0), (-1.0, 2.0), -4.0, 6.0 * 2.5 + 5.0 * 2.5 + 20.0 * 0.5 + 5.0 * 0.5),
    ],
)
def test_each_wheel_takes_its_force_and_half_of_the_rolling_resistance(
    forces,
    motion,
    along,
    power,
):
    """By hand: 2 kg, steps of 0.5 s, wheels 1 m apart, 5 N of resistance each.

    The middle of the step counts.
    """
    constants = np.full(15, np.nan)
    constants[[0, 1, 5, 6, 9]] = 0.5, 2.0, 100.0, 0.5, 0.1
    assert mechanical_power(*forces, *motion, along, constants) == pytest.approx(power)


@pytest.mark.parametrize(
    ("now", "target", "after"),
    [
        (1.0, 1.2, 1.1),  # half of the way in half of the time constant
        (1.0, 9.0, 1.5),  # speeding up, at most 2 m/s2
        (-1.0, -9.0, -1.5),
        (0.0, -9.0, -0.5),
        (3.0, 0.0, 2.0),  # slowing down, at most 4 m/s2
        (-3.0, 9.0, -2.0),
    ],
)
def test_a_servo_goes_towards_its_target_within_its_rates(now, target, after):
    assert step_towards(now, target, 0.25, 0.5, 2.0, 4.0) == pytest.approx(after)


def test_motion_kernels_equal_matrix_algebra():
    rng = np.random.default_rng(2)
    for _ in range(50):
        axis = rng.normal(size=3)
        q = quaternion(axis / np.linalg.norm(axis), rng.uniform(-1.0, 1.0))
        position, velocity, spin, offset = (tuple(row) for row in rng.normal(size=(4, 3)).tolist())
        before = BodyState(0.0, 0.0, *rng.normal(size=3).tolist())
        rotation = matrix(q)
        expected = velocity + np.cross(spin, rotation @ offset)
        assert point_velocity(q, velocity, spin, *offset) == pytest.approx(expected)
        state = BodyState(
            *base_state(position, q, velocity, spin, offset, before.yaw, before.vx, before.vy, 0.02)
        )
        yaw = state.yaw
        assert (state.x, state.y) == pytest.approx((position + rotation @ offset)[:2])
        assert yaw == pytest.approx(math.atan2(rotation[1, 0], rotation[0, 0]))
        assert state.vx == pytest.approx(math.cos(yaw) * expected[0] + math.sin(yaw) * expected[1])
        assert state.vy == pytest.approx(-math.sin(yaw) * expected[0] + math.cos(yaw) * expected[1])
        assert state.tilt == pytest.approx(math.acos(rotation[2, 2]))
        assert state.yaw_rate == spin[2]
        turn = yaw - before.yaw
        backwards = np.array(((math.cos(turn), math.sin(turn)), (-math.sin(turn), math.cos(turn))))
        change = np.array((state.vx, state.vy)) - backwards @ (before.vx, before.vy)
        assert (state.ax, state.ay) == pytest.approx(tuple(change / 0.02))

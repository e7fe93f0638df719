"""The drive's forces and the kinematics of points on the robot, against slow twins and textbook cases."""

import math

import numpy as np
import pytest

from harness import resources
from harness.world.drive_kernels import drive_constants, drive_wrench, wheel_forces
from harness.world.motion_kernels import base_motion, point_velocity
from harness.world.robot import RobotParams
from navstack.params.strict import load_dataclass

DT, GRAVITY = 1.0 / 120.0, 9.81


@pytest.fixture(scope="module")
def robot():
    return load_dataclass(RobotParams, resources.shipped("params") / "robots" / "segway_e1.yaml")


def quaternion(axis, angle):
    return (*(math.sin(0.5 * angle) * np.asarray(axis, dtype=float)).tolist(), math.cos(0.5 * angle))


def matrix(q):
    x, y, z, w = q
    skew = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    return np.eye(3) + 2.0 * w * skew + 2.0 * skew @ skew


def wrench(robot, v=(0.0, 0.0), w=0.0, command=(0.0, 0.0), q=(0.0, 0.0, 0.0, 1.0)):
    constants = drive_constants(robot, GRAVITY, DT)
    result = drive_wrench(*q, *v, w, robot.center_of_mass_height, *command, constants)
    return np.array(result[:3]), np.array(result[3:])


def test_at_rest_it_only_carries_the_weight(robot):
    force, torque = wrench(robot)
    assert force == pytest.approx((0.0, 0.0, -robot.mass * GRAVITY))
    assert torque == pytest.approx((0.0, 0.0, 0.0))


def test_full_throttle_gives_the_greatest_acceleration_and_pitches(robot):
    force, torque = wrench(robot, command=(3.0, 0.0))
    assert force[0] == pytest.approx(robot.mass * robot.max_acceleration)
    assert torque[1] == pytest.approx(-robot.center_of_mass_height * force[0])  # lifts the front


def test_force_never_exceeds_friction(robot):
    rng = np.random.default_rng(5)
    grip = robot.wheel_friction * robot.mass * GRAVITY
    for _ in range(500):
        q = quaternion((0.0, 0.0, 1.0), rng.uniform(-3.0, 3.0))
        force, torque = wrench(robot, rng.normal(0.0, 2.0, 2), rng.normal(0.0, 2.0), rng.normal(0.0, 2.0, 2), q)
        assert math.hypot(*force[:2]) <= grip * (1.0 + 1e-12)
        lever = abs(robot.center[0])
        assert abs(torque[2]) <= grip * (lever + 0.5 * robot.track) * (1.0 + 1e-12)


def test_a_free_step_leads_to_the_servos_next_speed_without_slip(robot):
    """One explicit integration step of the rigid body in the plane is the oracle."""
    yaw, speed, turn = 0.8, 1.0, 0.4
    lever = abs(robot.center[0])
    cos, sin = math.cos(yaw), math.sin(yaw)
    velocity = np.array((cos * speed + sin * turn * lever, sin * speed - cos * turn * lever))
    force, torque = wrench(robot, velocity, turn, (1.1, 0.45), quaternion((0.0, 0.0, 1.0), yaw))
    after = velocity + DT * force[:2] / robot.mass
    turn_after = turn + DT * torque[2] / robot.inertia[2]
    heading = yaw + DT * turn_after
    axle = after + turn_after * lever * np.array((-math.sin(heading), math.cos(heading)))
    assert turn_after == pytest.approx(0.4 + 0.05 * DT / robot.servo_time_constant)
    assert axle @ (math.cos(heading), math.sin(heading)) == pytest.approx(1.0 + 0.1 * DT / robot.servo_time_constant)
    assert axle @ (-math.sin(heading), math.cos(heading)) == pytest.approx(0.0, abs=1e-12)


def test_wheels_in_the_air_pull_nothing(robot):
    force, torque = wrench(robot, v=(1.0, 1.0), command=(3.0, 1.0), q=quaternion((1.0, 0.0, 0.0), 0.6))
    assert force == pytest.approx((0.0, 0.0, -robot.mass * GRAVITY))
    assert not torque.any()


def test_wheel_forces_within_all_limits_pass_unchanged():
    assert wheel_forces(50.0, 20.0, 5.0, 400.0, 300.0, 0.2) == pytest.approx((50.0, 20.0, 5.0))


def test_a_weak_motor_limits_each_wheel():
    along, _, couple = wheel_forces(500.0, 0.0, 40.0, 1e6, 300.0, 0.2)
    # Asked for: left 150, right 350; each motor gives at most 150.
    assert (along, couple) == pytest.approx((300.0, 0.0))


def test_motion_kernels_equal_matrix_algebra():
    rng = np.random.default_rng(2)
    for _ in range(50):
        axis = rng.normal(size=3)
        q = quaternion(axis / np.linalg.norm(axis), rng.uniform(-1.0, 1.0))
        position, velocity, spin, offset = rng.normal(size=(4, 3))
        rotation = matrix(q)
        expected = velocity + np.cross(spin, rotation @ offset)
        assert point_velocity(*q, *velocity, *spin, *offset) == pytest.approx(expected)
        x, y, yaw, forward, left, tilt = base_motion(*position, *q, *velocity, *spin, *offset)
        assert (x, y) == pytest.approx((position + rotation @ offset)[:2])
        assert yaw == pytest.approx(math.atan2(rotation[1, 0], rotation[0, 0]))
        assert forward == pytest.approx(math.cos(yaw) * expected[0] + math.sin(yaw) * expected[1])
        assert left == pytest.approx(-math.sin(yaw) * expected[0] + math.cos(yaw) * expected[1])
        assert tilt == pytest.approx(math.acos(rotation[2, 2]))

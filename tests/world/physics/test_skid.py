"""A skid-steered robot turns about the middle of its four wheels, as far as they slide."""

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.storage import shipped as resources
from harness.world.map.scene import Obstacle
from harness.world.map.shapes import box
from harness.world.physics.drive_kernels import LEVEL
from harness.world.physics.robot import SKID, RobotParams
from harness.world.physics.skid_kernels import skid_constants, skid_forces, sliding_force
from navstack.errors import InputError, ParameterError
from navstack.params.strict import load_dataclass
from navstack.types import Pose2D

DT, GRAVITY = 1.0 / 120.0, 9.81


@pytest.fixture(scope="module")
def jackal() -> RobotParams:
    folder: Path = resources.shipped("params") / "robots"
    return load_dataclass(RobotParams, folder / "jackal.yaml")


def balanced(robot: RobotParams) -> RobotParams:
    """The same robot with its weight in the middle."""
    return dataclasses.replace(robot, center_of_mass_x=0.0)


def drive(
    robot: RobotParams,
    speed: float,
    yaw_rate: float,
    seconds: float,
    start: float = 0.0,
) -> np.ndarray:
    """Motions (n, 6) on level ground: x, y, yaw of the centre of mass, and their rates."""
    constants = skid_constants(robot, GRAVITY, DT)
    x = y = yaw = vy = turn = 0.0
    vx, rows = start, []
    constants[-2] = start
    for _ in range(round(seconds / DT)):
        orientation = (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
        (fx, fy, _), (_, _, tz), power = skid_forces(
            orientation,
            (vx, vy, 0.0),
            (0.0, 0.0, turn),
            LEVEL,
            LEVEL,
            speed,
            yaw_rate,
            constants,
        )
        assert power >= 0.0
        vx, vy = vx + fx * DT / robot.mass, vy + fy * DT / robot.mass
        turn += tz * DT / robot.inertia[2]
        x, y, yaw = x + vx * DT, y + vy * DT, yaw + turn * DT
        rows.append((x, y, yaw, vx, vy, turn))
    return np.array(rows)


@pytest.mark.parametrize("rate", [0.3, 1.2, -2.0])
@pytest.mark.parametrize("multiplier", [1.0, 1.5, 2.0])
def test_it_turns_by_the_share_that_sliding_leaves(
    jackal: RobotParams,
    rate: float,
    multiplier: float,
) -> None:
    robot = dataclasses.replace(balanced(jackal), track_multiplier=multiplier)
    motion = drive(robot, 0.0, rate, 3.0)
    wider = 1.0 + (robot.wheelbase / robot.track) ** 2  # Coulomb's law, equal loads
    assert motion[-1, 5] == pytest.approx(rate * multiplier / wider, rel=0.01)
    assert np.hypot(*motion[:, :2].T).max() < 1e-6  # about its middle


def test_on_a_curve_it_slides_outward(jackal: RobotParams) -> None:
    motion = drive(balanced(jackal), 1.5, 1.5, 4.0)[-120:]
    yaw = motion[:, 2]
    left = -np.sin(yaw) * motion[:, 3] + np.cos(yaw) * motion[:, 4]
    assert left.max() < -0.02  # to the right of a curve to the left


def test_it_stops_no_faster_than_its_wheels_grip(jackal: RobotParams) -> None:
    motion = drive(jackal, 0.0, 0.0, 1.0, start=2.0)
    slowing = -np.diff(motion[:, 3]) / DT
    assert slowing.max() <= jackal.wheel_friction * GRAVITY * (1.0 + 1e-9)
    assert slowing.max() > 0.95 * jackal.wheel_friction * GRAVITY
    assert abs(motion[-1, 3]) < 1e-3
    assert motion[-1, 0] == pytest.approx(
        2.0**2 / (2.0 * jackal.wheel_friction * GRAVITY), rel=0.03
    )


@pytest.mark.parametrize("rate", [0.0, 2.0])
def test_wheels_without_grip_move_nothing(jackal: RobotParams, rate: float) -> None:
    motion = drive(dataclasses.replace(jackal, wheel_friction=0.0), 1.0, rate, 0.5)
    assert np.abs(motion).max() == 0.0


def test_friction_acts_against_the_slip_and_never_turns_it_round() -> None:
    along, aside = sliding_force(3.0, -4.0, 100.0, 1e3, 0.5)
    assert (along, aside) == (pytest.approx(30.0), pytest.approx(-40.0))
    assert sliding_force(0.003, -0.004, 100.0, 1e3, 0.5) == (
        pytest.approx(3.0),
        pytest.approx(-4.0),
    )
    assert sliding_force(0.0, 0.0, 100.0, 1e3, 0.5) == (0.0, 0.0)


def test_a_skid_steer_stands_on_its_four_wheels(jackal: RobotParams) -> None:
    assert jackal.steering == SKID
    assert jackal.axle_share == 1.0
    assert jackal.feet == ((0.131, 0.188), (0.131, -0.188), (-0.131, 0.188), (-0.131, -0.188))
    with pytest.raises(ParameterError, match="between -0.131 m and 0.131"):
        dataclasses.replace(jackal, center_of_mass_x=0.14)
    with pytest.raises(InputError, match="steering 'tracks'; known: differential, skid"):
        dataclasses.replace(jackal, steering="tracks")


def test_in_the_world_it_turns_about_the_middle_of_its_wheels(
    lab: Any,
    jackal: RobotParams,
    params: Any,
) -> None:
    with lab.world(jackal, params, start=Pose2D(1.0, 1.0, 0.0)) as world:
        truths = lab.drive(world, 300, w=1.0)
    assert truths[-1].twist.angular_z == pytest.approx(1.5 / 1.486, rel=0.02)
    places = [(truth.pose.x - 1.0, truth.pose.y - 1.0) for truth in truths]
    assert np.hypot(*np.array(places).T).max() < 0.03
    assert max(truth.tilt for truth in truths) < 0.01


def test_in_the_world_a_wall_stops_it_and_it_backs_away(
    lab: Any,
    jackal: RobotParams,
    params: Any,
) -> None:
    wall = Obstacle("building_glass", box(2.0, 0.0, 0.0, 1.0, 4.0), 1.5)
    with lab.world(jackal, params, [wall]) as world:
        met = lab.drive(world, 360, v=1.0)[-1]
        back = lab.drive(world, 240, v=-0.5)[-1]
    assert met.pose.x == pytest.approx(1.5 - jackal.half_size[0], abs=0.02)
    assert back.pose.x == pytest.approx(met.pose.x - 2.0, abs=0.1)  # in 4 s

"""A user's Nav2 file drives the robot that it describes."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from harness.storage.shipped import shipped
from harness.study.preflight import check
from harness.task.stack import load_stack
from harness.task.study import make_study
from harness.world.physics.robot import RobotParams
from harness.world.sensors.suite import SensorParams
from navbench.api.run import make_world
from navstack.errors import ParameterError
from navstack.params.strict import load_dataclass
from navstack.types import Twist2D

TEXT = """
local_costmap: {{local_costmap: {{ros__parameters: {{{shape}, rolling_window: true}}}}}}
controller_server: {{ros__parameters: {{FollowPath: {{plugin: {plugin}, {limits}}}}}}}
amcl: {{ros__parameters: {{laser_max_range: {reach}}}}}
"""
DWB = "dwb_core::DWBLocalPlanner"
SLOW = "max_vel_x: 0.22, max_speed_xy: 0.22, acc_lim_x: 2.5, max_vel_theta: 1.0"
SEGWAY = 'footprint: "[[0.14, 0.25], [0.14, -0.25], [-0.607, -0.25], [-0.607, 0.25]]"'
HUSKY = 'footprint: "[[0.5, 0.33], [0.5, -0.33], [-0.5, -0.33], [-0.5, 0.33]]"'
OCTAGON = (
    'footprint: "[[0.3, 0.12], [0.12, 0.3], [-0.12, 0.3], [-0.3, 0.12], '
    '[-0.3, -0.12], [-0.12, -0.3], [0.12, -0.3], [0.3, -0.12]]"'
)
# its left front corner is cut: a box of 0.95 of its size fits behind and to the right
CUT_CORNERS = 'footprint: "[[0.5, 0.2], [0.4, 0.25], [-0.5, 0.25], [-0.5, -0.25], [0.5, -0.25]]"'
RIGHT_ANGLE = 'footprint: "[[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2]]"'
POINTED = 'footprint: "[[0.5, 0.0], [-0.5, 0.3], [-0.5, -0.3]]"'
ON_A_LINE = 'footprint: "[[0.3, 0.2], [0.0, 0.0], [-0.3, -0.2]]"'
FROM_THE_END = 'footprint: "[[1.0, 0.3], [1.0, -0.3], [0.0, -0.3], [0.0, 0.3]]"'
FROM_THE_REAR = 'footprint: "[[0.6, 0.2], [0.6, -0.2], [-0.1, -0.2], [-0.1, 0.2]]"'


@pytest.fixture
def file(tmp_path: Path):
    def _file(shape: str, limits: str = SLOW, plugin: str = DWB, reach: float = 100.0) -> str:
        path = tmp_path / "mine.yaml"
        path.write_text(TEXT.format(shape=shape, limits=limits, plugin=plugin, reach=reach))
        return str(path)

    return _file


def body(stack) -> RobotParams:
    return load_dataclass(RobotParams, Path(stack.robot))


@pytest.mark.parametrize(
    ("shape", "half", "mass", "said"),
    [
        ("robot_radius: 0.1", (0.1 / math.sqrt(2.0),) * 2, 2.0, "a radius of 0.10 m"),
        ("robot_radius: 0.189", (0.189 / math.sqrt(2.0),) * 2, 7.1, "a radius of 0.19 m"),
        (HUSKY, (0.5, 0.33), 66.0, "1.00 m x 0.66 m"),
        (FROM_THE_REAR, (0.35, 0.2), 28.0, "0.70 m x 0.40 m,"),
        (OCTAGON, (0.21,) * 2, 17.6, "0.42 m x 0.42 m, a box within its outline,"),
        (CUT_CORNERS, (0.475, 0.2375), 45.1, "0.95 m x 0.47 m, a box within its outline,"),
        (RIGHT_ANGLE, (0.15, 0.1), 6.0, "0.30 m x 0.20 m, a box within its outline,"),
        (POINTED, (0.25, 0.15), 15.0, "0.50 m x 0.30 m, a box within its outline,"),
        (ON_A_LINE, (0.3, 0.2), 24.0, "0.60 m x 0.40 m,"),
    ],
    ids=[
        "burger",
        "turtlebot4",
        "husky",
        "base at the rear",
        "octagon",
        "cut corners",
        "right angle",
        "pointed",
        "line",
    ],
)
def test_the_robot_has_the_files_outline(file, shape, half, mass, said):
    stack = load_stack(file(shape))
    robot = body(stack)
    assert robot.half_size == pytest.approx(half, abs=1e-6)
    assert robot.mass == pytest.approx(mass, abs=0.1)
    assert (robot.max_speed, robot.max_yaw_rate) == (0.22, 1.0)
    assert said in stack.body and f"weighs {mass:.1f} kg" in stack.body
    lidar = load_dataclass(SensorParams, Path(stack.sensors)).lidar
    assert (lidar.mount.x, lidar.mount.y) == pytest.approx(robot.center)
    assert lidar.self_filter.x_max == pytest.approx(robot.polygon[:, 0].max())


@pytest.mark.parametrize("shape", [FROM_THE_REAR, FROM_THE_END])
def test_a_body_ahead_of_its_axle_stands_on_casters_in_front(file, shape):
    robot = body(load_stack(file(shape)))
    front = robot.polygon[:, 0].max()
    assert -robot.wheelbase == pytest.approx(0.85 * front)
    assert 0.3 * front < robot.center_of_mass_x < 0.6 * front
    assert 0.4 < robot.axle_share < 0.7


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        ("robot_radius: 0.0", "mine.yaml: local_costmap: robot_radius 0 m has room for a box of 0"),
        ("robot_radius: 30.0", "allowed are 0.02 to 20 m on each side: give it in metres"),
        ('footprint: "[[0.2, 0.1], [0.2, 0.1], [0.2, 0.1]]"', "footprint has room for a box of 0"),
        ('footprint: "[[0.3, 0.0], [0.0, 0.0], [-0.3, 0.0]]"', "a box of 0.6 m x 0 m"),
        (
            'footprint: "[[0.3, 0.9], [0.3, 0.4], [-0.3, 0.4], [-0.3, 0.9]]"',
            "x from -0.3 to 0.3 m and y from 0.4 to 0.9 m, does not hold the base frame's origin",
        ),
    ],
)
def test_the_outline_of_no_robot_is_refused_where_it_stands(file, shape, said):
    with pytest.raises(ParameterError, match="mine.yaml: local_costmap: ") as raised:
        load_stack(file(shape))
    assert said in str(raised.value)
    assert "--robot NAME" in str(raised.value) and "\n" not in str(raised.value)
    assert Path(load_stack(file(shape), robot="jackal").robot).stem == "jackal"


def test_a_negative_radius_is_as_long(file):
    assert body(load_stack(file("robot_radius: -0.3"))) == body(
        load_stack(file("robot_radius: 0.3"))
    )


@pytest.mark.parametrize("preset", ["rtk_urban", "ust10"])
def test_the_lidar_of_a_preset_stands_on_the_body(file, preset):
    stack = load_stack(file(FROM_THE_REAR), sensors=preset)
    lidar = load_dataclass(SensorParams, Path(stack.sensors)).lidar
    assert (lidar.mount.x, lidar.mount.y) == pytest.approx((0.25, 0.0))
    assert lidar.self_filter.x_min == pytest.approx(-0.1)


@pytest.mark.parametrize(
    ("robot", "preset", "place"),
    [
        ("jackal", "rtk_good", (0.0, 0.0)),  # behind the Jackal, where the Segway has it
        ("jackal", "ust10", (0.055, 0.0)),
        ("nova_carter", "rtk_good", (-0.23, 0.0)),
        ("segway_e1", "rtk_good", (-0.23, 0.0)),
    ],
)
def test_the_lidar_of_a_preset_stands_on_another_robot(robot, preset, place):
    stack = load_stack("nav2-gps-ekf", robot=robot, sensors=preset)
    lidar = load_dataclass(SensorParams, Path(stack.sensors)).lidar
    assert (lidar.mount.x, lidar.mount.y) == pytest.approx(place)
    assert Path(stack.sensors).stem == preset


@pytest.mark.parametrize("content", ["lidarr: 3", "", "[1, 2]", "lidar: {range_max: 30 m}"])
def test_a_users_own_sensors_are_taken_as_they_are(file, tmp_path, content):
    own = tmp_path / "own.yaml"
    own.write_text(content)
    assert load_stack(file("robot_radius: 0.3"), sensors=str(own)).sensors == str(own)
    assert load_stack("nav2-gps-ekf", robot="jackal", sensors=str(own)).sensors == str(own)


def test_the_lidar_sees_as_far_as_amcl_says(file):
    sensors = load_stack(file("robot_radius: 0.1", reach=3.5)).sensors
    assert load_dataclass(SensorParams, Path(sensors)).lidar.range_max == 3.5


@pytest.mark.parametrize(
    ("limits", "plugin", "speed"),
    [
        (SLOW, DWB, None),
        ("max_vel_x: 5.0, acc_lim_x: 2.5, max_vel_theta: 1.0", DWB, 5.0),
        ("vx_max: 6.0", "nav2_mppi_controller::MPPIController", 6.0),
    ],
    ids=["slower", "faster", "faster with MPPI"],
)
def test_a_body_that_is_there_drives_unless_it_is_too_slow(file, limits, plugin, speed):
    stack = load_stack(file(SEGWAY, limits, plugin))
    if speed is None:
        assert (Path(stack.robot).stem, stack.body) == ("segway_e1", "")
    else:
        assert body(stack).max_speed == speed
        assert body(stack).half_size == pytest.approx((0.3735, 0.25))


def test_a_robot_that_is_asked_for_drives(file):
    stack = load_stack(file("robot_radius: 0.1"), robot="jackal")
    assert (Path(stack.robot).stem, stack.body) == ("jackal", "")


@pytest.mark.parametrize(
    ("limits", "plugin", "speed"),
    [
        (f"{SLOW}, max_vel_y: 0.3", DWB, "0.3 m/s"),
        ("motion_model: Omni, vy_max: 0.4", "nav2_mppi_controller::MPPIController", "0.4 m/s"),
        ("motion_model: DiffDrive, vy_max: 0.4", "nav2_mppi_controller::MPPIController", ""),
    ],
)
def test_a_robot_that_drives_sideways_is_told_that_it_cannot(file, limits, plugin, speed):
    note = load_stack(file("robot_radius: 0.3", limits, plugin)).body
    assert ("does not drive sideways" in note) == bool(speed)
    assert speed in note


def test_it_is_the_first_thing_said(file):
    notes = check(make_study(stacks=[file("robot_radius: 0.4")], episodes=1, workers=1))
    assert notes[0].startswith("mine drives the robot that the file describes: a radius of 0.40 m")
    assert "--robot NAME" in notes[0]
    assert not any("it may touch" in note for note in notes)


def test_stacks_that_come_with_the_program_keep_their_robots():
    robots = {path.stem for path in (shipped("params") / "robots").iterdir()}
    for path in (shipped("params") / "stacks").iterdir():
        stack = load_stack(path.stem)
        assert Path(stack.robot).stem in robots and not stack.body


@settings(
    max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    length=st.floats(0.05, 3.0),
    width=st.floats(0.05, 3.0),
    ahead=st.floats(0.0, 1.0),
    speed=st.floats(0.01, 20.0),
    braking=st.floats(0.01, 50.0),
)
def test_every_outline_gives_a_robot_that_stands_and_does_not_tip_over(
    file, length, width, ahead, speed, braking
):
    front, back, side = ahead * length, (ahead - 1.0) * length, 0.5 * width
    shape = (
        f'footprint: "[[{front}, {side}], [{front}, -{side}], [{back}, -{side}], [{back}, {side}]]"'
    )
    limits = f"max_vel_x: {speed}, acc_lim_x: 2.5, max_vel_theta: 1.0, decel_lim_x: -{braking}"
    stack = load_stack(file(shape, limits))
    if not stack.body:
        return  # it is the Segway
    robot = body(stack)
    rearmost, foremost = sorted((-robot.wheelbase, 0.0))
    rounded = 1e-3
    assert back - rounded <= rearmost < robot.center_of_mass_x < foremost <= front + rounded
    tipping = 9.81 / robot.center_of_mass_height  # [1/s2] acceleration per metre of support
    assert robot.max_deceleration < tipping * (foremost - robot.center_of_mass_x)
    assert robot.max_acceleration < tipping * (robot.center_of_mass_x - rearmost)
    assert robot.max_yaw_rate * robot.max_speed < tipping * 0.5 * robot.track
    assert robot.max_drive_force > robot.mass * 5.0
    assert np.ptp(robot.polygon, axis=0) == pytest.approx((length, width), rel=1e-3)


@pytest.mark.parametrize(
    "shape", ["robot_radius: 0.037", "robot_radius: 0.1", HUSKY, FROM_THE_REAR, FROM_THE_END]
)
def test_it_drives_and_stays_upright(file, shape):
    delivery = make_world(file(shape), pedestrians=0)
    begin = delivery.truth.pose
    for _ in range(180):
        delivery.drive(Twist2D(linear_x=0.2))
    end = delivery.truth.pose
    assert delivery.verdict is None
    assert math.hypot(end.x - begin.x, end.y - begin.y) > 0.2


def test_files_of_one_name_drive_each_their_own_robot(file) -> None:
    old = load_stack(file("robot_radius: 0.1"))
    new = load_stack(file("robot_radius: 0.4"))
    assert Path(old.robot).name == Path(new.robot).name == "mine-robot.yaml"
    assert body(old).half_size[0] == pytest.approx(0.1 / math.sqrt(2.0), abs=1e-6)
    assert body(new).half_size[0] == pytest.approx(0.4 / math.sqrt(2.0), abs=1e-6)

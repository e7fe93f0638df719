"""Sensors that tell of different motions."""

import math

import numpy as np
import pytest

from harness.recorded.consistency import Consistency
from navstack.types import Imu, LaserScan, Odometry, Pose2D, Twist2D

TURN, SPEED = 0.2, 1.0  # [rad/s], [m/s] of a robot on a circle


def doubts(
    speed: float = 1.0,
    turn: float = 1.0,
    gyro: float = 1.0,
    heading: float = 1.0,
    gap: float = 0.0,
    jump: float = 0.0,
    is_world_frame: bool = False,
    set_on: float = 0.0,
) -> list[str]:
    """Of a minute on a circle, each sensor with a factor; halfway the odometry may jump by [m].

    The clock may be set forward by ``set_on`` [s] then.
    """
    consistency = Consistency()
    for stamp in np.arange(0.0, 60.0, 0.05):
        if 20.0 < stamp < 20.0 + gap:
            continue
        yaw = TURN * stamp
        x, y = SPEED / TURN * math.sin(yaw), -SPEED / TURN * math.cos(yaw)
        twist = Twist2D(speed * SPEED, 0.0, turn * TURN)
        if is_world_frame:
            twist = Twist2D(SPEED * math.cos(yaw), SPEED * math.sin(yaw), TURN)
        pose = Pose2D(x + jump * (stamp > 30.0), y, math.remainder(yaw, math.tau))
        told = stamp + set_on * (stamp > 30.0)
        consistency.take(Odometry(told, pose, twist))
        heading_now = math.remainder(heading * yaw, math.tau)
        consistency.take(Imu(told, heading_now, gyro * TURN, 0.0, 0.0))
    return consistency.doubts()


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"set_on": 1.6e9},
        {"speed": 1.1},
        {"gyro": 0.7},
        {"heading": math.nan},
        {"gap": 10.0},
        {"jump": 500.0},
    ],
)
def test_what_real_sensors_differ_by_is_no_doubt(given):
    assert doubts(**given) == []


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"speed": 1000.0}, "the velocities of the odometry are 1e+03 times"),
        ({"is_world_frame": True}, "the velocities of the odometry are"),
        ({"turn": -1.0}, "the yaw rates of the odometry are -1 times"),
        ({"gyro": math.degrees(1.0)}, "the gyro turns 57.3 times as far as the odometry"),
        ({"heading": -1.0}, "the heading of the inertial unit turns -1 times as far as its gyro"),
    ],
)
def test_wrong_units_axes_and_frames_are_told(given, said):
    assert doubts(**given)[0].startswith(said)


@pytest.mark.parametrize(("unit", "is_told"), [(1.0, False), (1000.0, True)])
def test_scans_without_a_return_are_told(unit, is_told):
    consistency = Consistency()
    for stamp in range(20):
        ranges = unit * np.array((2.0, 5.0, math.inf, math.nan))
        consistency.take(LaserScan(stamp, ranges, 0.0, 0.1, 0.1, 30.0, Pose2D()))
    said = consistency.doubts()
    assert [line.startswith("none of the 20 scans") for line in said] == [True] * is_told


def test_too_little_decides_nothing():
    assert Consistency().doubts() == []

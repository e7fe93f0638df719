"""A drive over a hill: what wheels and inertial unit measure, and where the robot exactly is."""

import math

import numpy as np

from navstack.types import Pose2D

from .writing import START, Entry, fix, imu, odometry, quaternion_of

STEP = 0.02  # [s]
SPEED = 1.0  # [m/s] along the ground
GRAVITY = 9.80665  # [m/s2]
TURNS = ((40.0, 46.0, math.pi / 2), (66.0, 72.0, -math.pi / 2))  # [s] from, to, [rad] by
DURATION = 140.0  # [s]


def _ramp(value: float, begin: float, end: float) -> float:
    """From 0 to 1, without a step in its derivative."""
    share = min(max((value - begin) / (end - begin), 0.0), 1.0)
    return share * share * (3.0 - 2.0 * share)


def _grade(x: float, slope: float) -> float:
    """dz/dx: up from x = 10 m, down from 60 m, level beyond 100 m."""
    return slope * (_ramp(x, 9.0, 11.0) - 2.0 * _ramp(x, 58.0, 62.0) + _ramp(x, 99.0, 101.0))


def _yaw(t: float) -> float:
    return sum(by * _ramp(t, begin, end) for begin, end, by in TURNS)


def drive(slope: float, seed: int = 0) -> tuple[list[Entry], tuple[float, float, float]]:
    """Odometry and inertial unit at 50 Hz, fixes at 1 Hz, x, y [m] and the way [m] at the end."""
    rng = np.random.default_rng(seed)
    x, y, t = 0.0, 0.0, 0.0
    poses = []
    while t < DURATION:
        yaw, grade = _yaw(t), _grade(x, slope)
        ahead = np.array((math.cos(yaw), math.sin(yaw), grade * math.cos(yaw)))
        ahead /= np.linalg.norm(ahead)
        up = np.array((-grade, 0.0, 1.0)) / math.hypot(grade, 1.0)
        poses.append((t, x, y, yaw, np.column_stack((ahead, np.cross(up, ahead), up))))
        x, y, t = x + SPEED * STEP * ahead[0], y + SPEED * STEP * ahead[1], t + STEP
    entries = []
    for (t, at_x, at_y, yaw, axes), (*_, after) in zip(poses, poses[1:], strict=False):
        change = axes.T @ after  # of the axes, seen from the base
        rates = np.array((change[2, 1], change[0, 2], change[1, 0])) / STEP
        force = axes.T @ (SPEED * (after[:, 0] - axes[:, 0]) / STEP + np.array((0.0, 0.0, GRAVITY)))
        unit = imu(START + t, yaw, 0.0)
        unit.fields["orientation"] = dict(zip("xyzw", quaternion_of(axes), strict=True))
        unit.fields["angular_velocity"] = dict(
            zip("xyz", rates + 0.002 * rng.standard_normal(3), strict=True)
        )
        unit.fields["linear_acceleration"] = dict(
            zip("xyz", force + 0.05 * rng.standard_normal(3), strict=True)
        )
        wheels = odometry(START + t, Pose2D(), SPEED + 0.01 * rng.standard_normal(), rates[2])
        entries += [wheels, unit]
        if round(t / STEP) % 50 == 0:
            entries.append(
                fix(START + t, at_x + rng.standard_normal(), at_y + rng.standard_normal(), std=1.0)
            )
    return entries, (x, y, SPEED * DURATION)

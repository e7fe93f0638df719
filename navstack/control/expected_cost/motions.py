"""The motions that are compared: a few in an empty street, many among people, variations.

A motion (FIELDS,) has three parts, one after the other. Each part has a speed and either an angle
off the way that the cost-to-go field points (kind WAY) or a yaw rate (kind TWIST).
"""

import math

import numpy as np

from navstack.types import FloatArray

# [-], [m/s], [rad] or [rad/s], [s], ...
KIND, SPEED, TURN, TIME, KIND_2, SPEED_2, TURN_2, TIME_2, SPEED_3 = range(9)
FIELDS = 9
WAY = 0.0
TWIST = 1.0
_LONG = 99.0  # [s] longer than any horizon
_ANGLES = np.radians((0.0, 8.0, 18.0, 32.0, 50.0, 75.0))
_STANDING = 0.05  # [m/s] below which a motion is said to wait or to turn
_STRAIGHT = math.radians(5.0)  # off the way, below which a motion is said to go on
_VARIED = np.array((0.0, 0.25, 0.2, 0.25, 0.0, 0.25, 0.15, 0.0, 0.0))  # standard deviations


def _both(values: FloatArray) -> list[float]:
    return [*(-values[:0:-1]).tolist(), *values.tolist()]


def few(max_speed: float) -> FloatArray:
    """Motions (n, FIELDS) for an empty street.

    Along the field, or a little beside it, at four speeds.
    """
    speeds = (0.0, 0.35 * max_speed, 0.7 * max_speed, max_speed)
    angles = np.radians((-30.0, -10.0, 0.0, 10.0, 30.0))
    return np.array([(WAY, v, a, 0.8, WAY, v, 0.0, _LONG, v) for v in speeds for a in angles])


def many(max_speed: float, max_reverse_speed: float, max_yaw_rate: float) -> FloatArray:
    """All motions (n, FIELDS): swerve, come back, wait and go, turn freely, reverse."""
    rows: list[tuple[float, ...]] = []
    for v in max_speed * np.array((0.0, 0.175, 0.35, 0.5, 0.65, 0.8, 1.0)):
        for angle in _both(_ANGLES):
            if not angle:
                rows.append((WAY, v, angle, _LONG, WAY, v, 0.0, _LONG, v))
                continue
            for time in (0.8, 1.6, 2.6):
                rows.append((WAY, v, angle, time, WAY, v, 0.0, _LONG, v))
                rows.append((WAY, v, angle, 0.6 * time, WAY, v, -0.6 * angle, 0.5 * time, v))
    for v in max_speed * np.array((0.0, 0.175, 0.35, 0.5)):
        rows += [
            (WAY, v, angle, time, WAY, max_speed, 0.0, _LONG, max_speed)
            for time in (0.7, 1.4, 2.2, 3.2)
            for angle in (-_ANGLES[3], 0.0, _ANGLES[3])
        ]
    backward: list[float] = []
    if max_reverse_speed > 0.0:
        backward = [-share * max_reverse_speed for share in (1.0, 0.65, 0.35)]
    for v in (*backward, 0.0, 0.35 * max_speed, 0.7 * max_speed, max_speed):
        for turn in max_yaw_rate * np.array((-1.0, -0.5, -0.22, 0.0, 0.22, 0.5, 1.0)):
            for time in (0.5, 1.0, 1.8):
                rows += [
                    (TWIST, v, turn, time, TWIST, v, 0.0, _LONG, 0.0),  # and straight on
                    (TWIST, v, turn, time, TWIST, 0.0, 0.0, _LONG, 0.0),  # and stop
                    (TWIST, v, turn, time, WAY, max_speed, 0.0, _LONG, max_speed),  # and go on
                ]
    return np.array(rows)


def varied(
    motions: FloatArray,
    count: int,
    max_speed: float,
    max_reverse_speed: float,
    rng: np.random.Generator,
) -> FloatArray:
    """``count`` random variations of each of some motions (n, FIELDS), as (n * count, FIELDS)."""
    new = np.repeat(motions, count, axis=0)
    new += _VARIED * rng.standard_normal(new.shape)
    for speed in (SPEED, SPEED_2):
        np.clip(new[:, speed], -max_reverse_speed, max_speed, out=new[:, speed])
    np.maximum(new[:, TIME], 0.0, out=new[:, TIME])
    return new


def later(motion: FloatArray, time: float) -> FloatArray:
    """What is left of a motion (FIELDS,) after ``time`` [s]."""
    left = motion.copy()
    left[TIME] = max(motion[TIME] - time, 0.0)
    if motion[TIME_2] < _LONG:
        left[TIME_2] = max(motion[TIME_2] - max(time - motion[TIME], 0.0), 0.0)
    return left


def name_of(motion: FloatArray) -> str:
    """What a motion is, in a word or two."""
    speed = motion[SPEED]
    if motion[KIND] == WAY:
        if abs(speed) < _STANDING:
            return "wait"
        if abs(motion[TURN]) < _STRAIGHT:
            return "go"
        return "swerve"
    if speed < -_STANDING:
        return "reverse"
    if speed < _STANDING:
        return "turn"
    return "drive"

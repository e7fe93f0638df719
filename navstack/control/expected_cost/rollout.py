"""How the robot drives a motion, and how long it has to drive on from its end."""

import math
from typing import NamedTuple

from navstack.control.contact_risk import COS, OMEGA, SIN, YAW, V, X, Y
from navstack.control.expected_cost.field import CostToGoField, blend, corner_of
from navstack.control.expected_cost.motions import (
    KIND,
    KIND_2,
    SPEED,
    SPEED_2,
    SPEED_3,
    TIME,
    TIME_2,
    TURN,
    TURN_2,
    TWIST,
    WAY,
)
from navstack.jit import njit
from navstack.types import FloatArray

# of the lateral limit: what a turn that is under way may have while the robot slows down for it
_OVERTURN = 1.3
_HEADSTART = 0.3  # [s] of driving on that speed at the end is worth
_AFTERWARDS = 0.1  # of the way back to the goal that counts after arrival
_AT_GOAL = 3.0  # [m] of cost to go below which the direction at the end counts less


class MotionLimits(NamedTuple):
    """What the robot can do; fields as in ``ExpectedCostParams``."""

    max_speed: float
    max_reverse_speed: float
    max_acceleration: float
    max_deceleration: float
    max_yaw_rate: float
    max_yaw_acceleration: float
    max_lateral_acceleration: float
    turn_gain: float
    goal_radius: float  # [m] within which it has arrived


@njit(inline="always")
def wrapped(angle: float) -> float:
    """The same angle in [-pi, pi], from one in [-2 pi, 2 pi]."""
    if angle > math.pi:
        angle -= 2.0 * math.pi
    elif angle < -math.pi:
        angle += 2.0 * math.pi
    return angle


@njit(inline="always")
def limited(speed: float, turn: float, limits: MotionLimits) -> tuple[float, float]:
    """Speed [m/s] and yaw rate [rad/s] within the limits; the turn goes before the speed."""
    turn = min(max(turn, -limits.max_yaw_rate), limits.max_yaw_rate)
    if abs(speed * turn) > limits.max_lateral_acceleration:
        speed = math.copysign(limits.max_lateral_acceleration / abs(turn), speed)
    return min(max(speed, -limits.max_reverse_speed), limits.max_speed), turn


@njit(inline="always")
def step_of(
    v: float,
    omega: float,
    speed: float,
    turn: float,
    limits: MotionLimits,
    dt: float,
) -> tuple[float, float]:
    """By how much speed and yaw rate change within a step towards what is wanted."""
    dv = speed - v
    most = limits.max_deceleration * dt
    if dv * v >= 0.0:
        most = limits.max_acceleration * dt
    dv = min(max(dv, -most), most)
    most = limits.max_yaw_acceleration * dt
    dw = min(max(turn - omega, -most), most)
    lateral = abs(v) * abs(omega + dw)
    if lateral > _OVERTURN * limits.max_lateral_acceleration and abs(omega + dw) > abs(omega):
        dw = 0.0
    return dv, dw


@njit(inline="always")
def turned(cos: float, sin: float, angle: float) -> tuple[float, float]:
    """A unit vector turned by a small angle [rad]: Taylor's series, to 1e-7 up to 0.2 rad."""
    squared = angle * angle
    c = 1.0 - 0.5 * squared * (1.0 - squared / 12.0)
    s = angle * (1.0 - squared / 6.0 * (1.0 - squared / 20.0))
    return c * cos - s * sin, s * cos + c * sin


@njit(inline="always")
def part_at(motion: FloatArray, t: float) -> tuple[float, float, float]:
    """Kind, speed and turn of the part of a motion that is driven at ``t`` [s]."""
    if t < motion[TIME]:
        return motion[KIND], motion[SPEED], motion[TURN]
    if t < motion[TIME] + motion[TIME_2]:
        return motion[KIND_2], motion[SPEED_2], motion[TURN_2]
    return WAY, motion[SPEED_3], 0.0


@njit()
def roll_out(
    motion: FloatArray,
    start: FloatArray,
    field: CostToGoField,
    limits: MotionLimits,
    dt: float,
    states: FloatArray,
) -> float:
    """Roll a motion out; returns what its accelerations shake [m2/s3].

    ``states`` (N, 7) receives x, y [m], yaw [rad], v [m/s], omega [rad/s], cosine and sine of the
    yaw after each step.
    """
    # arrays taken out of tuples in the loop cost as much as the rest
    slope_x = field.slope_x
    slope_y = field.slope_y
    origin_x = field.origin_x
    origin_y = field.origin_y
    cell = field.cell
    gain = limits.turn_gain
    x = start[0]
    y = start[1]
    yaw = start[2]
    v = start[3]
    w = start[4]
    cos = math.cos(yaw)
    sin = math.sin(yaw)
    shaken = 0.0
    for k in range(len(states)):
        kind, speed, turn = part_at(motion, k * dt)
        if kind != TWIST:
            row, column, up, right = corner_of(slope_x, origin_x, origin_y, cell, x, y)
            gx = blend(slope_x, row, column, up, right)
            gy = blend(slope_y, row, column, up, right)
            off = math.atan2(gy * cos - gx * sin, gx * cos + gy * sin) + turn
            ahead = max(0.0, math.cos(off))
            speed = speed * ahead * ahead * ahead
            turn = gain * wrapped(off)
        speed, turn = limited(speed, turn, limits)
        dv, dw = step_of(v, w, speed, turn, limits, dt)
        half = 0.5 * (w + 0.5 * dw) * dt  # of the step's turn
        cos, sin = turned(cos, sin, half)
        x += (v + 0.5 * dv) * cos * dt
        y += (v + 0.5 * dv) * sin * dt
        cos, sin = turned(cos, sin, half)
        yaw = yaw + 2.0 * half
        v = v + dv
        w = w + dw
        lateral = v * w
        shaken += dv * dv / dt + lateral * lateral * dt
        states[k, X] = x
        states[k, Y] = y
        states[k, YAW] = yaw
        states[k, V] = v
        states[k, OMEGA] = w
        states[k, COS] = cos
        states[k, SIN] = sin
    return shaken


@njit()
def time_left(states: FloatArray, field: CostToGoField, limits: MotionLimits, dt: float) -> float:
    """Seconds from the end of a motion to the goal.

    More where the robot looks elsewhere, less at speed. Reaching the goal early is credited.
    """
    cost = field.cost
    slope_x = field.slope_x
    slope_y = field.slope_y
    last = len(states) - 1
    row, column, up, right = corner_of(
        cost, field.origin_x, field.origin_y, field.cell, states[last, X], states[last, Y]
    )
    left = blend(cost, row, column, up, right)
    gx = blend(slope_x, row, column, up, right)
    gy = blend(slope_y, row, column, up, right)
    cos = states[last, COS]
    sin = states[last, SIN]
    off = abs(math.atan2(gy * cos - gx * sin, gx * cos + gy * sin))
    far = min(1.0, left / _AT_GOAL)
    least = left / limits.max_speed + far * (0.5 * off - _HEADSTART * states[last, V])
    if left > _AT_GOAL + limits.max_speed * dt * len(states):
        return float(least)
    for k in range(len(states)):
        row, column, up, right = corner_of(
            cost, field.origin_x, field.origin_y, field.cell, states[k, X], states[k, Y]
        )
        there = blend(cost, row, column, up, right)
        if there <= limits.goal_radius:
            return float(
                min(least, (there + _AFTERWARDS * left) / limits.max_speed - (last - k) * dt)
            )
    return float(least)

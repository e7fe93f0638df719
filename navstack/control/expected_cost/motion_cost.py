"""What a motion is expected to cost, in US dollars: the compiled heart of the controller.

A motion is rolled out with the robot's limits, and every step is held against people, obstacles and
the cost-to-go field. Terms only ever grow along the way, so that a motion is given up as soon as it
cannot become the best any more.
"""

import math
from typing import NamedTuple

import numpy as np

from navstack.control.contact_risk import (
    COS,
    OMEGA,
    SIN,
    UNLIKELY,
    YAW,
    Body,
    ContactRates,
    V,
    X,
    Y,
    chance,
    closing_speed,
    gap_to,
    seen_from,
    touch_price,
)
from navstack.control.expected_cost.clearance import FAR, Clearance, distance_at, distance_off_map
from navstack.control.expected_cost.field import Field, blend, corner_of
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
from navstack.control.expected_cost.people import People
from navstack.jit import njit
from navstack.types import Float32Array, FloatArray, FloatMatrix, FloatVector

# of a motion's cost, all in [USD]
TERMS = ("contact", "squeeze", "wall", "inside", "shake", "delay")
CONTACT, SQUEEZE, WALL, INSIDE, SHAKE, DELAY = range(6)
_NEAR = 3.0  # [m] between centres beyond which nobody is touched
# of the lateral limit: what a turn that is under way may have while the robot slows down for it
_OVERTURN = 1.3
_HEADSTART = 0.3  # [s] of driving on that speed at the end is worth
_AFTERWARDS = 0.1  # of the way back to the goal that counts after arrival
_AT_GOAL = 3.0  # [m] of cost to go below which the direction at the end counts less


class Limits(NamedTuple):
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


class Rates(NamedTuple):
    """What things cost; fields as in ``ExpectedCostParams``."""

    second_usd: float
    squeeze_usd: float
    squeeze_width: float
    wall_usd: float
    inside_usd: float
    shake_usd: float
    wall_std: float


class Scene(NamedTuple):
    """Everything that the motions of one cycle have in common."""

    start: FloatVector  # (5,) x, y [m], yaw [rad], v [m/s], omega [rad/s]
    field: Field
    clearance: Clearance
    people: People
    body: Body
    # (C,) [m] centres on the base frame's x axis of circles that cover the robot
    circles: FloatVector
    circle_radius: float  # [m]
    limits: Limits
    rates: Rates
    touch: ContactRates
    contact_usd: FloatVector  # (S,) [USD] of a counted contact at 0, 1, .. m/s
    care: FloatVector  # (N,) how much what may happen at each step counts
    step: float  # [s]


@njit(inline="always")
def wrapped(angle: float) -> float:
    """The same angle in [-pi, pi], from one in [-2 pi, 2 pi]."""
    if angle > math.pi:
        angle -= 2.0 * math.pi
    elif angle < -math.pi:
        angle += 2.0 * math.pi
    return angle


@njit(inline="always")
def limited(speed: float, turn: float, limits: Limits) -> tuple[float, float]:
    """Speed [m/s] and yaw rate [rad/s] within the limits; the turn goes before the speed."""
    turn = min(max(turn, -limits.max_yaw_rate), limits.max_yaw_rate)
    if abs(speed * turn) > limits.max_lateral_acceleration:
        speed = math.copysign(limits.max_lateral_acceleration / abs(turn), speed)
    return min(max(speed, -limits.max_reverse_speed), limits.max_speed), turn


@njit(inline="always")
def step_of(
    v: float, omega: float, speed: float, turn: float, limits: Limits, dt: float
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


@njit()
def roll_out(
    motion: FloatArray,
    start: FloatArray,
    field: Field,
    limits: Limits,
    dt: float,
    states: FloatArray,
) -> float:
    """Roll a motion out; returns what its accelerations shake [m2/s3].

    ``states`` (N, 7) receives x, y [m], yaw [rad], v [m/s], omega [rad/s], cosine and sine of the
    yaw after each step.
    """
    # arrays taken out of tuples in the loop cost as much as the rest
    slope_x, slope_y = field.slope_x, field.slope_y
    origin_x, origin_y, cell, gain = field.origin_x, field.origin_y, field.cell, limits.turn_gain
    x, y, yaw, v, w = start[0], start[1], start[2], start[3], start[4]
    first, second = motion[TIME], motion[TIME] + motion[TIME_2]
    cos, sin, shaken = math.cos(yaw), math.sin(yaw), 0.0
    for k in range(len(states)):
        t = k * dt
        if t < first:
            kind, speed, turn = motion[KIND], motion[SPEED], motion[TURN]
        elif t < second:
            kind, speed, turn = motion[KIND_2], motion[SPEED_2], motion[TURN_2]
        else:
            kind, speed, turn = WAY, motion[SPEED_3], 0.0
        if kind != TWIST:
            row, column, up, right = corner_of(slope_x, origin_x, origin_y, cell, x, y)
            gx, gy = blend(slope_x, row, column, up, right), blend(slope_y, row, column, up, right)
            off = math.atan2(gy * cos - gx * sin, gx * cos + gy * sin) + turn
            ahead = max(0.0, math.cos(off))
            speed, turn = speed * ahead * ahead * ahead, gain * wrapped(off)
        speed, turn = limited(speed, turn, limits)
        dv, dw = step_of(v, w, speed, turn, limits, dt)
        half = 0.5 * (w + 0.5 * dw) * dt  # of the step's turn
        cos, sin = turned(cos, sin, half)
        x += (v + 0.5 * dv) * cos * dt
        y += (v + 0.5 * dv) * sin * dt
        cos, sin = turned(cos, sin, half)
        yaw, v, w = yaw + 2.0 * half, v + dv, w + dw
        lateral = v * w
        shaken += dv * dv / dt + lateral * lateral * dt
        states[k, X], states[k, Y], states[k, YAW], states[k, V], states[k, OMEGA] = x, y, yaw, v, w
        states[k, COS], states[k, SIN] = cos, sin
    return shaken


@njit()
def time_left(states: FloatArray, field: Field, limits: Limits, dt: float) -> float:
    """Seconds from the end of a motion to the goal.

    More where the robot looks elsewhere, less at speed. Reaching the goal early is credited.
    """
    cost, slope_x, slope_y = field.cost, field.slope_x, field.slope_y
    last = len(states) - 1
    row, column, up, right = corner_of(
        cost, field.origin_x, field.origin_y, field.cell, states[last, X], states[last, Y]
    )
    left = blend(cost, row, column, up, right)
    gx, gy = blend(slope_x, row, column, up, right), blend(slope_y, row, column, up, right)
    cos, sin = states[last, COS], states[last, SIN]
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


@njit(inline="always")
def least_distance(
    state: FloatArray,
    circles: FloatArray,
    metres: Float32Array,
    grid: tuple[float, float, float],
    beyond: float,
) -> float:
    """Distance [m] that a grid has from the middles of the circles that cover the robot."""
    least = math.inf
    for along in circles:
        x, y = state[X] + along * state[COS], state[Y] + along * state[SIN]
        least = min(least, distance_at(metres, grid, beyond, x, y))
    return least


@njit()
def risk_of(
    states: FloatArray, scene: Scene, total: float, bound: float, terms: FloatArray
) -> float:
    """Add what people and obstacles may cost on the way.

    Args:
        states: (N, 7) of :func:`roll_out`.
        scene: what they are held against.
        total: [USD] that the motion costs otherwise.
        bound: [USD] from which on it is given up.
        terms: (6,) the terms CONTACT to INSIDE are written.

    Returns:
        All that it costs [USD]; infinite where it is given up.
    """
    body, rates, touch, dt = scene.body, scene.rates, scene.touch, scene.step
    # out of their tuples, as above
    circles, care, contact_usd = scene.circles, scene.care, scene.contact_usd
    people = scene.people
    motion, std, weight, radius = people.motion, people.std, people.weight, people.radius
    mapped, mapped_grid = scene.clearance.mapped, scene.clearance.mapped_grid
    seen, seen_grid = scene.clearance.seen, scene.clearance.seen_grid
    off_map = distance_off_map(scene.clearance)
    worst, squeezed = np.zeros(len(weight)), np.zeros(len(weight))
    for k in range(len(states)):
        if total >= bound:
            return math.inf
        state = states[k]
        room = least_distance(state, circles, mapped, mapped_grid, off_map) - scene.circle_radius
        if len(seen):
            room = min(
                room, least_distance(state, circles, seen, seen_grid, FAR) - scene.circle_radius
            )
        if room < UNLIKELY * rates.wall_std:
            worse = max(0.0, care[k] * rates.wall_usd * chance(room / rates.wall_std) - terms[WALL])
            deeper = care[k] * rates.inside_usd * max(0.0, -room) * dt
            terms[WALL] += worse
            terms[INSIDE] += deeper
            total += worse + deeper
        for h in range(len(weight)):
            rx, ry = seen_from(state, motion[h, k, 0], motion[h, k, 1], body)
            if rx * rx + ry * ry > _NEAR * _NEAR:
                continue
            gap, nx, ny = gap_to(rx, ry, body.half_length, body.half_width)
            gap -= radius[h]
            if gap > UNLIKELY * std[h, k]:
                continue
            closing = closing_speed(state, motion[h, k, 2], motion[h, k, 3], rx, ry, nx, ny, body)
            price = touch_price(closing, touch, contact_usd)
            wall = rates.squeeze_usd * max(0.0, 1.0 - max(room, 0.0) / rates.squeeze_width)
            likely = care[k] * weight[h] * chance(gap / std[h, k])
            if likely * (price + wall) > worst[h]:
                total += likely * (price + wall) - worst[h]
                terms[CONTACT] += likely * price - worst[h] + squeezed[h]
                terms[SQUEEZE] += likely * wall - squeezed[h]
                worst[h], squeezed[h] = likely * (price + wall), likely * wall
            if gap < 0.0:
                terms[INSIDE] -= care[k] * weight[h] * rates.inside_usd * gap * dt
                total -= care[k] * weight[h] * rates.inside_usd * gap * dt
    return total


@njit()
def follow(
    motion: FloatArray, scene: Scene, bound: float, terms: FloatArray, states: FloatArray
) -> float:
    """Roll a motion out and price it.

    Args:
        motion: (FIELDS,) of :mod:`motions`.
        scene: what it is held against.
        bound: [USD] from which on it is given up.
        terms: (6,) output: what each of TERMS comes to.
        states: (N, 7) output of :func:`roll_out`.

    Returns:
        Its cost [USD]; infinite where it is given up.
    """
    terms[:] = 0.0
    shaken = roll_out(motion, scene.start, scene.field, scene.limits, scene.step, states)
    terms[SHAKE] = scene.rates.shake_usd * shaken
    terms[DELAY] = scene.rates.second_usd * time_left(states, scene.field, scene.limits, scene.step)
    return risk_of(states, scene, terms[SHAKE] + terms[DELAY], bound, terms)


@njit(ahead=True)
def price_all(
    motions: FloatMatrix, scene: Scene, bound: float, costs: FloatVector, risks: FloatVector
) -> int:
    """Price motions (M, FIELDS) one after the other.

    Returns the best one's number, the first among equals; -1: none.

    Args:
        motions: to price.
        scene: what they are held against.
        bound: [USD] which the best has to go below.
        costs: (M,) output [USD]; infinite: given up as no better than the best so far.
        risks: (M,) output [USD] what people and walls make of each cost, of those that are not
            given up.
    """
    terms, states, best = np.empty(len(TERMS)), np.empty((len(scene.care), 7)), -1
    for i in range(len(motions)):
        costs[i] = follow(motions[i], scene, bound, terms, states)
        risks[i] = terms[CONTACT] + terms[SQUEEZE] + terms[WALL] + terms[INSIDE]
        if costs[i] < bound:
            bound, best = costs[i], i
    return best


@njit(ahead=True)
def price_one(motion: FloatVector, scene: Scene, terms: FloatVector, states: FloatMatrix) -> float:
    """The cost [USD] of one motion.

    ``terms`` (6,) and ``states`` (N, 7) are written as by :func:`follow`.
    """
    return follow(motion, scene, math.inf, terms, states)

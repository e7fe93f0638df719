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
    SIN,
    UNLIKELY,
    ContactRates,
    RobotBox,
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
from navstack.control.expected_cost.field import CostToGoField
from navstack.control.expected_cost.people import People
from navstack.control.expected_cost.rollout import MotionLimits, roll_out, time_left
from navstack.jit import njit
from navstack.types import Float32Array, FloatArray, FloatMatrix, FloatVector

# of a motion's cost, all in [USD]
TERMS = ("contact", "squeeze", "wall", "inside", "shake", "delay")
CONTACT, SQUEEZE, WALL, INSIDE, SHAKE, DELAY = range(6)
_NEAR = 3.0  # [m] between centres beyond which nobody is touched


class Rates(NamedTuple):
    """What things cost; fields as in ``ExpectedCostParams``."""

    second_usd: float
    squeeze_usd: float
    squeeze_width: float
    wall_usd: float
    inside_usd: float
    shake_usd: float
    wall_std: float


class MotionScene(NamedTuple):
    """Everything that the motions of one cycle have in common."""

    start: FloatVector  # (5,) x, y [m], yaw [rad], v [m/s], omega [rad/s]
    field: CostToGoField
    clearance: Clearance
    people: People
    body: RobotBox
    # (C,) [m] centres on the base frame's x axis of circles that cover the robot
    circles: FloatVector
    circle_radius: float  # [m]
    limits: MotionLimits
    rates: Rates
    touch: ContactRates
    contact_usd: FloatVector  # (S,) [USD] of a counted contact at 0, 1, .. m/s
    care: FloatVector  # (N,) how much what may happen at each step counts
    step: float  # [s]


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
        x = state[X] + along * state[COS]
        y = state[Y] + along * state[SIN]
        least = min(least, distance_at(metres, grid, beyond, x, y))
    return least


@njit(inline="always")
def within(offset: float, half: float, std: float) -> float:
    """Probability that a normal variable of mean ``offset`` [m] is within ``half`` [m] of 0."""
    away = abs(offset)
    return chance((away - half) / std) - chance((away + half) / std)


@njit(inline="always")
def overlap_chance(rx: float, ry: float, radius: float, std: float, body: RobotBox) -> float:
    """Probability that somebody predicted at (rx, ry) [m] from the box's middle overlaps it."""
    along = within(rx, body.half_length + radius, std)
    return along * within(ry, body.half_width + radius, std)


@njit()
def risk_of(
    states: FloatArray,
    scene: MotionScene,
    total: float,
    bound: float,
    terms: FloatArray,
) -> float:
    """Add to ``total`` what people and obstacles may cost in ``states`` (N, 7) [USD].

    Infinite where that reaches ``bound``. The terms CONTACT to INSIDE of ``terms`` (6,) are
    written.
    """
    body = scene.body
    rates = scene.rates
    dt = scene.step
    # out of their tuples: arrays taken out in the loop cost as much as the rest
    circles = scene.circles
    care = scene.care
    contact_usd = scene.contact_usd
    motion, std, weight, radius = scene.people
    mapped, mapped_grid, seen, seen_grid = scene.clearance
    off_map = distance_off_map(scene.clearance)
    worst = np.zeros(len(weight))
    squeezed = np.zeros(len(weight))
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
            price = touch_price(closing, scene.touch, contact_usd)
            wall = rates.squeeze_usd * max(0.0, 1.0 - max(room, 0.0) / rates.squeeze_width)
            counted = care[k] * weight[h, k]
            likely = counted * overlap_chance(rx, ry, radius[h], std[h, k], body)
            usd = likely * (price + wall)
            squeeze = likely * wall
            if usd > worst[h]:
                total += usd - worst[h]
                terms[CONTACT] += likely * price - worst[h] + squeezed[h]
                terms[SQUEEZE] += squeeze - squeezed[h]
                worst[h] = usd
                squeezed[h] = squeeze
            if gap < 0.0:
                deeper = counted * rates.inside_usd * gap * dt
                terms[INSIDE] -= deeper
                total -= deeper
    return total


@njit()
def follow(
    motion: FloatArray,
    scene: MotionScene,
    bound: float,
    terms: FloatArray,
    states: FloatArray,
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
    motions: FloatMatrix,
    scene: MotionScene,
    bound: float,
    costs: FloatVector,
    risks: FloatVector,
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
    terms = np.empty(len(TERMS))
    states = np.empty((len(scene.care), 7))
    best = -1
    for i in range(len(motions)):
        costs[i] = follow(motions[i], scene, bound, terms, states)
        risks[i] = terms[CONTACT] + terms[SQUEEZE] + terms[WALL] + terms[INSIDE]
        if costs[i] < bound:
            bound = costs[i]
            best = i
    return best


@njit(ahead=True)
def price_one(
    motion: FloatVector, scene: MotionScene, terms: FloatVector, states: FloatMatrix
) -> float:
    """The cost [USD] of one motion.

    ``terms`` (6,) and ``states`` (N, 7) are written as by :func:`follow`.
    """
    return follow(motion, scene, math.inf, terms, states)


@njit(ahead=True)
def price_each(
    motions: FloatMatrix, scene: MotionScene, totals: FloatVector, speeds: FloatVector
) -> None:
    """The cost (M,) [USD] of each motion, none given up, and its speed after a step (M,) [m/s]."""
    terms = np.empty(len(TERMS))
    states = np.empty((len(scene.care), 7))
    for i in range(len(motions)):
        totals[i] = follow(motions[i], scene, math.inf, terms, states)
        speeds[i] = states[0, V]

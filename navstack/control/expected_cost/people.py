"""Where people may be in the seconds to come.

Hypotheses of each, with a weight and a growing spread.
"""

import math
from typing import NamedTuple

import numpy as np

from navstack.control.expected_cost.clearance import FAR, Clearance, clearance_at
from navstack.jit import njit
from navstack.types import FloatArray, FloatCube, FloatMatrix, FloatVector

_EDGE = 0.35  # [m] from the walkable ground's edge nobody goes on straight
_CORNER = 0.85  # [m] from an edge beside which a corner is passed
_HIDDEN = 0.3  # [s] before the edge from which on somebody may have turned
_TURNS = (math.radians(35.0), math.radians(70.0))  # round a corner
_LEAST_SPEED = 0.4  # [m/s] of who may turn round a corner
_CORNER_RANGE = 9.0  # [m] from the robot up to which corners are looked at
_CORNER_PEOPLE = 5  # the nearest, for whom they are
_CORNER_STEPS = 22  # of the prediction in which a corner counts
_STEPS_AFTER = 8  # of the prediction that have to follow a corner
_PROBE = 3.0  # [cells] from a place to where the direction of the nearest edge is measured
_KNOWN = 0.25  # [s] over which the track's velocity variance counts, as measured
_TURNED_DRIFT = 0.12  # [m/s] by which the place after a turn gets less sure


class Spread(NamedTuple):
    """How sure predictions are; fields as in ``ExpectedCostParams``."""

    position_std: float
    drift_std: float
    standing_std: float
    standing_speed: float
    turning_std: float
    corner_weight: float
    deviating_weight: float
    deviating_std: float
    yielding_time: float


class People(NamedTuple):
    """Predicted people, in the map frame; one hypothesis per row."""

    motion: FloatCube  # (H, N, 4) x, y [m], vx, vy [m/s] after each step
    std: FloatMatrix  # (H, N) [m] of the place, along any direction
    weight: FloatMatrix  # (H, N) how much the hypothesis counts
    radius: FloatVector  # (H,) [m]


@njit(ahead=True)
def predict(
    people: FloatMatrix,
    yielding: FloatVector,
    x: float,
    y: float,
    steps: int,
    step: float,
    spread: Spread,
    clearance: Clearance,
) -> People:
    """The hypotheses of people (n, 7), rows of ``contact_risk.nearest``; the robot is at (x, y).

    Everybody goes on straight up to the edge of the walkable ground, where only the spread grows
    on. Some of those who walk deviate: the same way, with a spread that grows faster. Whoever
    passes a corner may turn round it by either of two angles.

    ``yielding`` (n,) is how likely each makes way. By that much all hypotheses of a person weigh
    less from ``yielding_time`` on, and before that in proportion to the time.
    """
    most = 4 * len(people)
    motion = np.zeros((most, steps, 4))
    std = np.empty((most, steps))
    weight = np.empty((most, steps))
    radius = np.empty(most)
    count = len(people)
    for i in range(len(people)):
        go_on(people[i], step, spread, clearance, motion[i], std[i])
        weigh(1.0, yielding[i], step, spread, weight[i])
        radius[i] = people[i, 4]
        if spread.deviating_weight == 0.0 or stands(people[i], spread):
            continue
        weigh(1.0 - spread.deviating_weight, yielding[i], step, spread, weight[i])
        motion[count] = motion[i]
        for n in range(steps):
            std[count, n] = std[i, n] + spread.deviating_std * step * (n + 1)
        weigh(spread.deviating_weight, yielding[i], step, spread, weight[count])
        radius[count] = people[i, 4]
        count += 1
    for i in range(min(len(people), _CORNER_PEOPLE)):
        near = math.hypot(people[i, 0] - x, people[i, 1] - y) < _CORNER_RANGE
        fast = math.hypot(people[i, 2], people[i, 3]) >= _LEAST_SPEED
        if spread.corner_weight == 0.0 or not (near and fast):
            continue
        k, side = corner_ahead(people[i], motion[i], clearance)
        if k < 0:
            continue
        for angle in _TURNS:
            motion[count] = motion[i]
            turn(people[i], k, side * angle, step, motion[count])
            for n in range(steps):
                std[count, n] = spread.position_std + _TURNED_DRIFT * step * (n + 1)
            weigh(spread.corner_weight, yielding[i], step, spread, weight[count])
            radius[count] = people[i, 4]
            count += 1
    return People(motion[:count], std[:count], weight[:count], radius[:count])


@njit(inline="always")
def stands(person: FloatArray, spread: Spread) -> bool:
    """Whether a person (FIELDS,) stands."""
    return math.hypot(person[2], person[3]) < spread.standing_speed


@njit()
def weigh(share: float, yielding: float, step: float, spread: Spread, weight: FloatArray) -> None:
    """Write the ``weight`` (N,) of a hypothesis that has a ``share`` of its person."""
    for n in range(len(weight)):
        gone = min(step * (n + 1) / spread.yielding_time, 1.0)
        weight[n] = share * (1.0 - yielding * gone)


@njit(inline="always")
def walk_std(person: FloatArray, t: float, spread: Spread) -> float:
    """Standard deviation [m] of a person (FIELDS,) who walks on straight for ``t`` [s]."""
    known = math.sqrt(spread.position_std**2 + person[5] + person[6] * _KNOWN**2)
    return known + spread.drift_std * t


@njit()
def go_on(
    person: FloatArray,
    step: float,
    spread: Spread,
    clearance: Clearance,
    motion: FloatArray,
    std: FloatArray,
) -> None:
    """Predict one person straight on: ``motion`` (N, 4) and ``std`` (N,) are written."""
    is_standing = stands(person, spread)
    stop = -1.0  # [s] when the edge is near; negative: it is not
    started_clear = clearance_at(clearance, person[0], person[1]) >= _EDGE
    for n in range(len(std)):
        t = step * (n + 1)
        if is_standing:
            motion[n, 0] = person[0]
            motion[n, 1] = person[1]
            motion[n, 2] = person[2]
            motion[n, 3] = person[3]
            std[n] = spread.position_std + spread.standing_std * t
            continue
        std[n] = walk_std(person, t, spread)
        px = person[0] + t * person[2]
        py = person[1] + t * person[3]
        if stop < 0.0 and started_clear and clearance_at(clearance, px, py) < _EDGE:
            stop = t
        if stop < 0.0:
            motion[n, 0] = px
            motion[n, 1] = py
            motion[n, 2] = person[2]
            motion[n, 3] = person[3]
        else:
            motion[n, 0], motion[n, 1] = place_before(person, motion, n)
    if stop >= 0.0:
        for n in range(len(std)):
            std[n] += spread.turning_std * max(step * (n + 1) - max(stop - _HIDDEN, 0.0), 0.0)


@njit()
def place_before(person: FloatArray, motion: FloatArray, k: int) -> tuple[float, float]:
    """Where a person is before step ``k`` of its ``motion`` (N, 4)."""
    if k == 0:
        return person[0], person[1]
    return motion[k - 1, 0], motion[k - 1, 1]


@njit()
def corner_ahead(person: FloatArray, motion: FloatArray, clearance: Clearance) -> tuple[int, float]:
    """The step at which somebody comes nearest to an edge beside the way, and the side it is on.

    -1: none does.
    """
    before = FAR
    here = clearance_at(clearance, person[0], person[1])
    for k in range(min(len(motion) - _STEPS_AFTER, _CORNER_STEPS)):
        ahead = clearance_at(clearance, motion[k, 0], motion[k, 1])
        if here < _CORNER and here <= before and here <= ahead:
            x, y = place_before(person, motion, k)
            reach = _PROBE * clearance.mapped_grid[2]
            gx = clearance_at(clearance, x + reach, y) - clearance_at(clearance, x - reach, y)
            gy = clearance_at(clearance, x, y + reach) - clearance_at(clearance, x, y - reach)
            side = -1.0
            if person[3] * gx - person[2] * gy > 0.0:
                side = 1.0
            return k, side
        before = here
        here = ahead
    return -1, 0.0


@njit()
def turn(
    person: FloatArray,
    k: int,
    angle: float,
    step: float,
    motion: FloatArray,
) -> None:
    """Let ``motion`` (N, 4) turn by ``angle`` [rad] at step ``k``."""
    x, y = place_before(person, motion, k)
    cos = math.cos(angle)
    sin = math.sin(angle)
    vx = cos * person[2] - sin * person[3]
    vy = sin * person[2] + cos * person[3]
    for n in range(k, len(motion)):
        t = step * (n - k + 1)
        motion[n, 0] = x + t * vx
        motion[n, 1] = y + t * vy
        motion[n, 2] = vx
        motion[n, 3] = vy

"""The last word on a command: it keeps every limit, and a stop that was checked can follow.

Each accepted state is one from which the robot can brake to standstill within all limits of jerk,
acceleration, yaw and lateral acceleration, without touching what the costmap shows, and without
running into a person who keeps on walking (passive safety: at rest when it happens, if it happens;
e.g. Macek et al., "Safe vehicle navigation in dynamic urban environments", 2009). If the wanted
motion does not lead to such a state, it is moved towards the stop of the previous cycle, which is
one by induction; where even that one is no longer clear, it is the hardest braking there is.
"""

import math
from typing import NamedTuple

import numpy as np

from navstack.control.footprint_cost import walk_outline
from navstack.control.mpc import stage_layout as at
from navstack.control.mpc.distance_field import DistanceField
from navstack.control.mpc.people import predicted
from navstack.control.mpc.stop_profile import highest_jerk, lowest_jerk, stop_after, stop_time
from navstack.costmap.costmap import LETHAL_OBSTACLE
from navstack.jit import njit
from navstack.types import FloatArray, FloatMatrix, FloatVector

# how a stop treats the yaw rate: to 0 as fast as can be, or together with the speed
STRAIGHTEN = 0
KEEP_CURVE = 1
_LOOK = 0.1  # [s] between two looks for people along a stop
_SHARES = (0.0, 0.25, 0.5, 0.75)  # of the stop that is mixed in, in this order
# [m/s] of the fastest point of the footprint, below which a person who comes is not run into
_STANDING = 1e-3
_ROUNDING = 1e-9  # [m/s2], [rad/s], [control periods]
_AT_ONCE = 1e-6  # [s] of a stop that leaves no time to bring the yaw rate to 0


class RobotOutline(NamedTuple):
    """The robot's outline, and circles that cover it."""

    footprint: FloatMatrix  # (V, 2) [m]
    circles: FloatVector  # (C,) [m] x of their centres
    radius: float  # [m] of the circles


@njit(ahead=True)
def guarded(
    state: FloatVector,
    j: float,
    ja: float,
    period: float,
    limits: FloatVector,
    kind: int,
    field: DistanceField,
    body: RobotOutline,
    people: FloatMatrix,
) -> tuple[FloatArray, int, float]:
    """The motion (v, omega, a, alpha) after a control period, the stop that follows, its share.

    Args:
        state: (7,) now; its stop of kind ``kind`` keeps the limits.
        j: wanted linear jerk [m/s3].
        ja: wanted angular jerk [rad/s3].
        period: [s].
        limits: (8,) of :mod:`stage_layout`.
        kind: of the stop that was found last.
        field: static obstacles.
        body: the robot's.
        people: (n, FIELDS).
    """
    v = state[3]
    omega = state[4]
    a = state[5]
    alpha = state[6]
    speed = limits[at.MAX_SPEED]
    jerk = limits[at.MAX_JERK]
    j = min(j, highest_jerk(v, a, speed, limits[at.MAX_ACCELERATION], jerk, period))
    j = max(j, lowest_jerk(v, a, 0.0, limits[at.MAX_DECELERATION], jerk, period))
    rate = limits[at.MAX_YAW_RATE]
    turn = limits[at.MAX_YAW_ACCELERATION]
    twist = limits[at.MAX_YAW_JERK]
    ja = min(ja, highest_jerk(omega, alpha, rate, turn, twist, period))
    ja = max(ja, lowest_jerk(omega, alpha, -rate, turn, twist, period))
    wanted = np.array(
        (
            v + period * (a + 0.5 * period * j),
            omega + period * (alpha + 0.5 * period * ja),
            a + period * j,
            alpha + period * ja,
        )
    )
    stopping = stopped(v, omega, a, alpha, kind, limits, period)
    after = np.empty(7)
    for share in _SHARES:
        motion = (1.0 - share) * wanted + share * stopping
        after[2] = state[2] + 0.5 * period * (omega + motion[1])
        yaw = 0.5 * (state[2] + after[2])
        way = 0.5 * period * (v + motion[0])
        after[0] = state[0] + way * math.cos(yaw)
        after[1] = state[1] + way * math.sin(yaw)
        after[3:] = motion
        for other in (KEEP_CURVE, STRAIGHTEN):
            if stop_is_safe(after, other, period, limits, field, body, people):
                return motion, other, share
    return stopping, kind, 1.0


@njit()
def stopped(
    v: float,
    omega: float,
    a: float,
    alpha: float,
    kind: int,
    limits: FloatArray,
    time: float,
) -> FloatArray:
    """The motion (v, omega, a, alpha) ``time`` [s] after a stop began."""
    motion = np.empty(4)
    deceleration = limits[at.MAX_DECELERATION]
    jerk = limits[at.MAX_JERK]
    slower = stop_after(v, a, deceleration, jerk, time)
    motion[0] = slower.rate
    motion[2] = slower.change
    if kind == STRAIGHTEN:
        turn = limits[at.MAX_YAW_ACCELERATION]
        twist = limits[at.MAX_YAW_JERK]
        straighter = stop_after(omega, alpha, turn, twist, time)
        motion[1] = straighter.rate
        motion[3] = straighter.change
        return motion
    whole = stop_time(v, a, deceleration, jerk)
    if time >= whole:
        motion[1] = motion[3] = 0.0
        return motion
    second, third = _curve(omega, alpha, whole)
    motion[1] = omega + time * (alpha + time * (second + time * third))
    motion[3] = alpha + time * (2.0 * second + 3.0 * time * third)
    return motion


@njit()
def _curve(omega: float, alpha: float, whole: float) -> tuple[float, float]:
    """Coefficients 2 and 3 of the cubic that brings (omega, alpha) to (0, 0) in ``whole`` [s].

    Begun again on the way, it is the same curve.
    """
    return -(3.0 * omega + 2.0 * alpha * whole) / whole**2, (2.0 * omega + alpha * whole) / whole**3


@njit()
def _duration(state: FloatArray, kind: int, limits: FloatArray) -> float:
    """How long a stop takes in [s]; nan where the kind is not possible within the yaw limits."""
    whole = stop_time(state[3], state[5], limits[at.MAX_DECELERATION], limits[at.MAX_JERK])
    turn = limits[at.MAX_YAW_ACCELERATION]
    twist = limits[at.MAX_YAW_JERK]
    if kind == STRAIGHTEN:
        return max(whole, stop_time(state[4], state[6], turn, twist))
    if whole < _AT_ONCE:
        if abs(state[4]) > 0.0 or abs(state[6]) > 0.0:
            return math.nan
        return whole
    second, third = _curve(state[4], state[6], whole)
    if max(abs(2.0 * second), abs(2.0 * second + 6.0 * third * whole)) > twist:
        return math.nan
    middle = -1.0
    if third != 0.0:
        middle = -second / (3.0 * third)
    if 0.0 < middle < whole and abs(state[6] + second * middle) > turn:
        return math.nan
    return whole


@njit()
def stop_is_safe(
    start: FloatArray,
    kind: int,
    period: float,
    limits: FloatArray,
    field: DistanceField,
    body: RobotOutline,
    people: FloatArray,
) -> bool:
    """Whether a stop from the state ``start`` (7,) keeps all limits and meets nothing.

    See :func:`guarded`.

    Between two looks for static obstacles no point of the footprint moves farther than a cell.
    """
    duration = _duration(start, kind, limits)
    if math.isnan(duration):
        return False
    cycles = int(math.ceil(duration / period - _ROUNDING))
    every = max(1, int(round(_LOOK / period)))
    reach = _reach(body.footprint)
    x = start[0]
    y = start[1]
    yaw = start[2]
    motion = start[3:].copy()
    unseen = math.inf  # [m] that some point may have moved since the last look
    for i in range(cycles + 1):
        if abs(motion[0] * motion[1]) > limits[at.MAX_LATERAL] + _ROUNDING:
            return False
        if abs(motion[1]) > limits[at.MAX_YAW_RATE] + _ROUNDING:
            return False
        fastest = abs(motion[0]) + reach * abs(motion[1])
        if fastest >= _STANDING and (i % every == 0 or i == cycles):
            if _runs_into(x, y, yaw, (i + 1) * period, body, people):
                return False
        last = motion
        motion = stopped(start[3], start[4], start[5], start[6], kind, limits, (i + 1) * period)
        turned = 0.5 * period * (last[1] + motion[1])
        way = 0.5 * period * (last[0] + motion[0])
        moved = abs(way) + reach * abs(turned)
        parts = max(1, int(math.ceil(moved / field.grid[2])))
        way = way / parts
        turned = turned / parts
        moved = moved / parts
        for _ in range(parts):
            if unseen + moved > field.grid[2]:
                if _touches(x, y, yaw, field, body.footprint):
                    return False
                unseen = 0.0
            x = x + way * math.cos(yaw + 0.5 * turned)
            y = y + way * math.sin(yaw + 0.5 * turned)
            yaw += turned
            unseen += moved
    return not _touches(x, y, yaw, field, body.footprint)


@njit()
def _reach(footprint: FloatArray) -> float:
    """How far the farthest corner is from the base, in [m]."""
    farthest = 0.0
    for corner in footprint:
        farthest = max(farthest, math.hypot(corner[0], corner[1]))
    return farthest


@njit()
def _touches(
    x: float,
    y: float,
    yaw: float,
    field: DistanceField,
    footprint: FloatArray,
) -> bool:
    """Whether the footprint's outline lies on an obstacle."""
    worst = walk_outline(
        field.costs, field.grid, footprint, x, y, math.cos(yaw), math.sin(yaw), False
    )
    return bool(worst == LETHAL_OBSTACLE)


@njit()
def _runs_into(
    x: float,
    y: float,
    yaw: float,
    time: float,
    body: RobotOutline,
    people: FloatArray,
) -> bool:
    """Whether one of the footprint's circles lies on a person ``time`` [s] from now."""
    cosine = math.cos(yaw)
    sine = math.sin(yaw)
    for person in people:
        px, py = predicted(person, time)[:2]
        for offset in body.circles:
            distance = math.hypot(x + offset * cosine - px, y + offset * sine - py)
            if distance < body.radius + person[4]:
                return True
    return False

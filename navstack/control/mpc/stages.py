"""What is wanted and what stands in the way at each step of a predicted trajectory."""

import math
from typing import NamedTuple

import numpy as np

from navstack.control.mpc import stage_layout as at
from navstack.control.mpc.distance_field import DistanceField, distance_and_gradient
from navstack.control.mpc.motion import rollout
from navstack.control.mpc.path_line import PathLine, at_distance, between, project
from navstack.control.mpc.people import predicted
from navstack.control.mpc.stage_layout import Horizon
from navstack.control.mpc.stop_profile import progress_jerk
from navstack.jit import njit
from navstack.types import FloatArray, FloatMatrix, FloatVector

# segments of the line before and behind a step's one, in which the next one's is looked for
_BACK = 5
_AHEAD = 40
STEP_SHARES = (1.0, 0.5, 0.25)  # of a Gauss-Newton step
_CROSSING = 0.3  # [m/s] across the line, from which on somebody crosses it
# [m] around a tracked person's body: obstacle cells there are the person's, and move with the track
_OWN = 0.4


class Wishes(NamedTuple):
    """What is wanted besides following the line."""

    speed: float  # [m/s] at most; 0: stand
    heading: float  # [rad] to turn to; nan: the line's direction
    max_lag: float  # [m]


class Clearances(NamedTuple):
    """How far from obstacles the footprint's circles should stay.

    Fields but the first as in ``MpcParams``.
    """

    radius: float  # [m] of the circles
    obstacle_margin: float  # [m] beyond their rim
    person_margin: float  # [m] beyond both rims
    uncertainty_gain: float  # [-]
    max_uncertainty: float  # [m]
    passing_bias: float  # [m] sideways


@njit()
def sizes_of(horizon: Horizon) -> tuple[int, int]:
    """How many circles and people there is room for."""
    circles = len(horizon.shared) - at.CIRCLES
    return circles, (horizon.stages.shape[1] - at.BASE) // 3 - circles


@njit(ahead=True)
def fill_stages(
    horizon: Horizon,
    states: FloatMatrix,
    line: PathLine,
    segment: int,
    wishes: Wishes,
    limits: FloatVector,
) -> None:
    """Write foot points, headings, and the fastest progress that can stop at the line's end.

    Args:
        horizon: its stages are written.
        states: predicted (N + 1, 7).
        line: to follow.
        segment: of the line, at which the robot is.
        wishes: see there.
        limits: (8,).
    """
    stages = horizon.stages
    times = horizon.times
    jerk = limits[at.MAX_JERK]
    acceleration = limits[at.MAX_ACCELERATION]
    deceleration = limits[at.MAX_DECELERATION]
    first, share = project(line, states[0, 0], states[0, 1], segment, segment)
    s = between(line.s, first, share)
    v = states[0, 3]
    a = states[0, 5]
    end = line.s[-1]
    yaw = states[0, 2]  # to which the heading's turn is counted
    for k in range(len(stages)):
        stage = stages[k]
        state = states[k + 1]
        first, share = project(line, state[0], state[1], max(0, first - _BACK), first + _AHEAD)
        foot = between(line.s, first, share)
        heading = between(line.heading, first, share)
        stage[at.FOOT_X] = between(line.x, first, share)
        stage[at.FOOT_Y] = between(line.y, first, share)
        stage[at.TANGENT_X] = math.cos(heading)
        stage[at.TANGENT_Y] = math.sin(heading)
        stage[at.CONTOUR] = 1.0
        if not math.isnan(wishes.heading):
            heading = wishes.heading
            stage[at.CONTOUR] = 0.0
        heading -= 2.0 * math.pi * math.floor((heading - yaw + math.pi) / (2.0 * math.pi))
        stage[at.HEADING] = yaw = heading
        ahead, ahead_share = at_distance(line, s + v * times[k])
        allowed = min(wishes.speed, between(line.speed, ahead, ahead_share))
        j = progress_jerk(v, a, end - s, allowed, acceleration, deceleration, jerk, times[k])
        s += times[k] * (v + times[k] * (a / 2.0 + times[k] * j / 6.0))
        v += times[k] * (a + 0.5 * times[k] * j)
        a += times[k] * j
        stage[at.LEAD] = min(wishes.max_lag, max(-wishes.max_lag, s - foot))
        stage[at.SPEED] = v
        stage[at.JERK] = j


@njit(ahead=True)
def fill_obstacles(
    horizon: Horizon,
    states: FloatMatrix,
    field: DistanceField,
    people: FloatMatrix,
    keep: Clearances,
) -> None:
    """Write each circle's half-plane at the nearest static obstacle; see :func:`fill_stages`."""
    stages = horizon.stages
    circles = horizon.shared[at.CIRCLES :]
    # distances are to cells' centres
    clear = keep.radius + keep.obstacle_margin + 0.5 * field.grid[2]
    for k in range(len(stages)):
        state = states[k + 1]
        cosine = math.cos(state[2])
        sine = math.sin(state[2])
        for i in range(len(circles)):
            place = at.BASE + 3 * i
            x = state[0] + circles[i] * cosine
            y = state[1] + circles[i] * sine
            distance, gx, gy = distance_and_gradient(field, x, y, 2.0 * clear)
            stages[k, place] = 0.0
            stages[k, place + 1] = 0.0
            stages[k, place + 2] = -1.0
            if distance < 2.0 * clear and not _belongs_to_person(
                x - distance * gx, y - distance * gy, people
            ):
                stages[k, place] = gx
                stages[k, place + 1] = gy
                stages[k, place + 2] = clear - distance + gx * x + gy * y


@njit()
def _belongs_to_person(x: float, y: float, people: FloatArray) -> bool:
    for person in people:
        if math.hypot(person[0] - x, person[1] - y) < person[4] + _OWN:
            return True
    return False


@njit(ahead=True)
def fill_people(horizon: Horizon, people: FloatMatrix, keep: Clearances) -> None:
    """Write where people will be and how near is too near; see :func:`fill_stages`."""
    stages = horizon.stages
    times = horizon.times
    circles, room = sizes_of(horizon)
    time = 0.0
    for k in range(len(stages)):
        time += times[k]
        left_x = -stages[k, at.TANGENT_Y]
        left_y = stages[k, at.TANGENT_X]
        for j in range(room):
            place = at.BASE + 3 * circles + 3 * j
            if j >= len(people):
                stages[k, place] = 0.0
                stages[k, place + 1] = 0.0
                stages[k, place + 2] = -1.0
                continue
            x, y, deviation = predicted(people[j], time)
            grown = min(keep.max_uncertainty, keep.uncertainty_gain * deviation)
            sideways = people[j, 2] * left_x + people[j, 3] * left_y  # [m/s] to the left
            shift = keep.passing_bias  # to the left: pass on the right of who does not cross
            if sideways < -_CROSSING:
                shift = -shift  # pass behind
            stages[k, place] = x + shift * left_x
            stages[k, place + 1] = y + shift * left_y
            stages[k, place + 2] = keep.radius + people[j, 4] + keep.person_margin + grown


@njit()
def cost_terms(states: FloatArray, jerks: FloatArray, horizon: Horizon) -> FloatArray:
    """The unweighted cost terms (10,) of a trajectory, in the order of the weights.

    Sums of dt times squares.
    """
    terms = np.zeros(10)
    stages, times, shared = horizon
    circles, people = sizes_of(horizon)
    for k in range(len(stages)):
        stage = stages[k]
        state = states[k + 1]
        dt = times[k]
        dx = state[0] - stage[at.FOOT_X]
        dy = state[1] - stage[at.FOOT_Y]
        contour = stage[at.TANGENT_X] * dy - stage[at.TANGENT_Y] * dx
        lag = stage[at.TANGENT_X] * dx + stage[at.TANGENT_Y] * dy - stage[at.LEAD]
        excess = max(0.0, abs(state[3] * state[4]) - shared[at.LATERAL_LIMIT])
        terms[at.W_CONTOUR] += dt * stage[at.CONTOUR] * contour * contour
        terms[at.W_LAG] += dt * lag * lag
        terms[at.W_HEADING] += dt * (state[2] - stage[at.HEADING]) ** 2
        terms[at.W_SPEED] += dt * (state[3] - stage[at.SPEED]) ** 2
        terms[at.W_YAW_ACCELERATION] += dt * state[6] ** 2
        terms[at.W_LATERAL] += dt * excess * excess
        terms[at.W_JERK] += dt * (jerks[k, 0] - stage[at.JERK]) ** 2
        terms[at.W_YAW_JERK] += dt * jerks[k, 1] ** 2
        cosine = math.cos(state[2])
        sine = math.sin(state[2])
        for i in range(circles):
            cx = state[0] + shared[at.CIRCLES + i] * cosine
            cy = state[1] + shared[at.CIRCLES + i] * sine
            plane = at.BASE + 3 * i
            inside = stage[plane + 2] - stage[plane] * cx - stage[plane + 1] * cy
            if inside > 0.0:
                terms[at.W_OBSTACLE] += dt * inside * inside
        for j in range(people):
            place = at.BASE + 3 * circles + 3 * j
            if is_far(state, stage, place, shared):
                continue
            for i in range(circles):
                px = state[0] + shared[at.CIRCLES + i] * cosine - stage[place]
                py = state[1] + shared[at.CIRCLES + i] * sine - stage[place + 1]
                inside = stage[place + 2] - math.sqrt(px * px + py * py + at.SOFTENED)
                if inside > 0.0:
                    terms[at.W_PERSON] += dt * inside * inside
    return terms


@njit()
def is_far(state: FloatArray, stage: FloatArray, place: int, shared: FloatArray) -> bool:
    """Whether the person at ``place`` of a stage is out of all circles' reach, at any yaw."""
    span = max(abs(shared[at.CIRCLES]), abs(shared[len(shared) - 1]))  # the outermost circles
    reach = stage[place + 2]
    dx = state[0] - stage[place]
    dy = state[1] - stage[place + 1]
    return bool(reach <= 0.0 or dx * dx + dy * dy > (reach + span) ** 2)


@njit(ahead=True)
def best_between(
    start: FloatVector, jerks: FloatMatrix, wanted: FloatMatrix, horizon: Horizon
) -> FloatArray:
    """The cheapest trajectory from ``start`` (7,) at any of ``STEP_SHARES`` of the step."""
    best = wanted
    least = math.inf
    for share in STEP_SHARES:
        tried = jerks + share * (wanted - jerks)
        terms = cost_terms(rollout(start, tried, horizon.times), tried, horizon)
        cost = 0.0
        for i in range(len(terms)):
            cost += horizon.shared[i] * terms[i]
        if cost < least:
            best = tried
            least = cost
    return best

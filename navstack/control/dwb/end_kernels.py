"""Where trajectories end, all at once, without the poses in between.

Inner loops of :mod:`.choice_kernels`.
"""

import math

import numpy as np

from navstack.control.dwb.kernels import SMALL_TURN, small_sine_cosine
from navstack.jit import njit
from navstack.types import FloatArray, IntArray

# trajectories that are driven side by side; a constant, so that the loops over them use vector
# instructions
TILE = 64
# Where in the buffer of a tile the values of its trajectories stand.
X, Y, YAW, SINE, COSINE, DT, TURN, TURN_SINE, TURN_COSINE, VX = (TILE * i for i in range(10))
# after each of both velocities: its change per step, its least and its greatest value
RATE = VX + 4 * TILE
BUFFER_SIZE = 17 * TILE
LANES = 4  # a multiple of them is driven on, so that no loop has a rest


@njit()
def end_poses(
    robot: FloatArray,
    commands: FloatArray,
    steps: IntArray,
    limits: FloatArray,
    sim_time: float,
) -> FloatArray:
    """Last poses (5, K) of the trajectories of ``commands`` (K, 3).

    A pose is x, y, yaw, and the yaw's sine and cosine. To the last bit it is the one of
    :func:`~navstack.control.dwb.kernels.roll_out`, for robots that do not move sideways; sine and
    cosine are those of its recurrence. ``robot`` (6,) is pose and velocity.
    """
    count = len(commands)
    ends = np.empty((5, count))
    order = by_falling_steps(steps)
    b = np.empty(BUFFER_SIZE)
    for first in range(0, count, TILE):
        active = min(TILE, count - first)
        start_tile(b, robot, commands, steps, order, first, limits, sim_time)
        changes = (True, True)
        for t in range(1, steps[order[first]] + 1):
            changes = step_tile(b, active, changes)
            while active > 0 and steps[order[first + active - 1]] == t:
                active -= 1
                for j in range(5):
                    ends[j, order[first + active]] = b[TILE * j + active]
    return ends


@njit()
def by_falling_steps(steps: IntArray) -> IntArray:
    """Indices (K,) of the trajectories, the longest first, equals in their order."""
    longest = 0
    for s in steps:
        longest = max(longest, s)
    position = np.zeros(longest + 2, dtype=np.int64)
    for s in steps:
        position[longest - s + 1] += 1
    for i in range(1, longest + 2):
        position[i] += position[i - 1]
    order = np.empty(len(steps), dtype=np.int64)
    for k in range(len(steps)):
        at = longest - steps[k]
        order[position[at]] = k
        position[at] += 1
    return order


@njit()
def start_tile(
    b: FloatArray,
    robot: FloatArray,
    commands: FloatArray,
    steps: IntArray,
    order: IntArray,
    first: int,
    limits: FloatArray,
    sim_time: float,
) -> None:
    """Put the trajectories from ``order[first]`` on into a buffer.

    The last one is repeated until it is full.
    """
    sine = math.sin(robot[2])
    cosine = math.cos(robot[2])
    for i in range(TILE):
        k = order[min(first + i, len(order) - 1)]
        b[X + i] = robot[0]
        b[Y + i] = robot[1]
        b[YAW + i] = robot[2]
        b[SINE + i] = sine
        b[COSINE + i] = cosine
        b[DT + i] = sim_time / steps[k]
        _load_axis(b, VX + i, robot[3], commands[k, 0], limits[0], b[DT + i])
        _load_axis(b, RATE + i, robot[5], commands[k, 2], limits[2], b[DT + i])


@njit()
def step_tile(b: FloatArray, active: int, changes: tuple[bool, bool]) -> tuple[bool, bool]:
    """Drive the first ``active`` trajectories one step.

    Returns whether speeds, and turns, may differ in later steps.
    """
    lanes = (active + LANES - 1) // LANES * LANES
    speeds_change, turns_change = changes
    if speeds_change:
        speeds_change = _speed_up(b, VX, lanes)
    if turns_change:
        turns_change = _speed_up(b, RATE, lanes)
        _turn(b, lanes)
    _move(b, lanes)
    return speeds_change, turns_change


@njit()
def _load_axis(
    b: FloatArray,
    at: int,
    now: float,
    wanted: float,
    limits: FloatArray,
    dt: float,
) -> None:
    """Put an axis of a trajectory into a buffer.

    These are velocity, change per step, least and greatest velocity.
    """
    b[at] = now
    b[at + TILE] = limits[1] * dt
    b[at + 2 * TILE] = wanted
    b[at + 3 * TILE] = math.inf
    if now < wanted:
        b[at + TILE] = limits[0] * dt
        b[at + 2 * TILE] = -math.inf
        b[at + 3 * TILE] = wanted


@njit()
def _speed_up(b: FloatArray, axis: int, count: int) -> bool:
    """Find the next velocities of the first ``count`` trajectories.

    Returns whether later ones may differ. ``axis`` is VX or RATE, which steps and bounds follow in
    the buffer.
    """
    changes = 0
    for i in range(count):
        speed = b[axis + i] + b[axis + TILE + i]
        speed = b[axis + 2 * TILE + i] if speed < b[axis + 2 * TILE + i] else speed
        speed = b[axis + 3 * TILE + i] if speed > b[axis + 3 * TILE + i] else speed
        changes += speed != b[axis + i]
        b[axis + i] = speed
    return changes > 0


@njit()
def _turn(b: FloatArray, count: int) -> None:
    """Find the turn of the next step of the first ``count`` trajectories."""
    wide = 0
    for i in range(count):
        turn = b[RATE + i] * b[DT + i]
        b[TURN + i] = turn
        wide += abs(turn) > SMALL_TURN
        b[TURN_SINE + i], b[TURN_COSINE + i] = small_sine_cosine(turn)
    if wide > 0:
        for i in range(count):
            if abs(b[TURN + i]) > SMALL_TURN:
                b[TURN_SINE + i], b[TURN_COSINE + i] = math.sin(b[TURN + i]), math.cos(b[TURN + i])


@njit()
def _move(b: FloatArray, count: int) -> None:
    """Drive the first ``count`` trajectories one step along their headings, then turn them."""
    for i in range(count):
        sine = b[SINE + i]
        cosine = b[COSINE + i]
        dt = b[DT + i]
        b[X + i] += b[VX + i] * cosine * dt
        b[Y + i] += b[VX + i] * sine * dt
        b[YAW + i] += b[TURN + i]
        b[SINE + i] = sine * b[TURN_COSINE + i] + cosine * b[TURN_SINE + i]
        b[COSINE + i] = cosine * b[TURN_COSINE + i] - sine * b[TURN_SINE + i]

"""Walking along polylines, and the search for them. Cells are (row, column)."""

import heapq
import math
from typing import NamedTuple

import numpy as np

# one graph for all paths of the harness
from harness.task.shortest_paths import _BETWEEN, _LENGTHS, _MOVES
from navstack.jit import njit
from navstack.types import (
    BoolArray,
    BoolVector,
    ByteArray,
    ByteVector,
    Float32Array,
    Float32Matrix,
    FloatArray,
    FloatCube,
    FloatMatrix,
    FloatVector,
    Int32Vector,
    IntArray,
    IntVector,
)

CLOSED, BLOCKED = -1.0, -2.0  # lengths of cells that the search is done with, or may never enter
_WEIGHT = 1.01  # [-] of the heuristic


@njit(ahead=True)
def find_path(
    numbers: Int32Vector,
    width: int,
    landmarks: Float32Matrix,
    start: int,
    goal: int,
    length: FloatVector,
    ahead: FloatVector,
    arrival: ByteVector,
) -> IntArray:
    """The cells of a path at most 1 % longer than the shortest.

    Weighted A* with the landmark heuristic.

    By the triangle inequality |d(l, cell) - d(l, goal)| <= d(cell, goal) for every landmark l
    (Goldberg & Harrelson 2005). The weight bounds the excess even though no cell is expanded twice
    (Likhachev et al. 2003), and it decides between the many equally long paths of a wide street,
    which makes the search ten times faster.

    Start and goal must be connected.

    Args:
        numbers: (H * W,) int32 number of each free cell, row by row; -1: not free. The border of
            two cells is not.
        width: W.
        landmarks: (N, L) float32 lengths from each landmark to the free cells, in cells.
        start: flat index.
        goal: flat index.
        length: (H * W,) float64 work space full of inf, BLOCKED where it is not free; so again
            afterwards.
        ahead: (N,) float64 work space.
        arrival: (H * W,) uint8 work space.

    Returns:
        (M, 2) cells, ends included.
    """
    moves = _MOVES[:, 0] * width + _MOVES[:, 1]
    between = _BETWEEN[:, :, 0] * width + _BETWEEN[:, :, 1]
    aim = landmarks[numbers[goal]]
    length[start] = 0.0
    touched = [start]
    waiting = [(0.0, start)]  # by cost, then by cell
    cell = start
    while cell != goal:
        cell = heapq.heappop(waiting)[1]
        here = length[cell]
        if here == CLOSED:
            continue
        length[cell] = CLOSED
        for m in range(len(moves)):
            target = cell + moves[m]
            total = here + _LENGTHS[m]
            if total >= length[target]:
                continue
            if length[cell + between[m, 0]] == BLOCKED or length[cell + between[m, 1]] == BLOCKED:
                continue
            there = numbers[target]
            if length[target] == np.inf:
                touched.append(target)
                ahead[there] = _WEIGHT * _least_length(landmarks[there], aim)
            length[target] = total
            arrival[target] = m
            heapq.heappush(waiting, (total + ahead[there], target))
    for cell in touched:
        length[cell] = np.inf
    return _trace(moves, width, start, goal, arrival)


@njit()
def _trace(moves: IntArray, width: int, start: int, goal: int, arrival: ByteArray) -> IntArray:
    """The cells (M, 2) from ``start`` to ``goal``, found by undoing the move that led to each."""
    number, cell = 1, goal
    while cell != start:
        cell -= moves[arrival[cell]]
        number += 1
    cells = np.empty((number, 2), np.int64)
    cell = goal
    for k in range(number - 1, 0, -1):
        cells[k, 0], cells[k, 1] = cell // width, cell % width
        cell -= moves[arrival[cell]]
    cells[0, 0], cells[0, 1] = start // width, start % width
    return cells


@njit()
def _least_length(a: Float32Array, b: Float32Array) -> float:
    """Lower bound on the length between two cells, from their landmark lengths (L,), L even."""
    even, odd = 0.0, 0.0
    for i in range(0, len(a), 2):
        even = max(even, abs(np.float64(a[i]) - np.float64(b[i])))
        odd = max(odd, abs(np.float64(a[i + 1]) - np.float64(b[i + 1])))
    return max(even, odd)


@njit(ahead=True)
def count_near(states: FloatMatrix, x: float, y: float, radius: float) -> int:
    """How many of ``states`` (n, >= 2) are less than ``radius`` [m] from (x, y) [m]."""
    number = 0
    for i in range(len(states)):
        dx, dy = states[i, 0] - x, states[i, 1] - y
        number += dx * dx + dy * dy < radius * radius
    return number


class Walks(NamedTuple):
    """Where everybody goes."""

    points: FloatCube  # (n, M, 2) corners of everybody's path, [m]
    counts: IntVector  # (n,) corners per path
    next_point: IntVector  # (n,) index of the corner each one walks to; ``counts`` when standing
    pauses: FloatVector  # (n,) [s] to stand, counted down from the arrival on
    speeds: FloatVector  # (n,) [m/s] at which each likes to walk


@njit(ahead=True)
def walk(
    dt: float,
    times: int,
    walks: Walks,
    positions: FloatMatrix,
    states: FloatMatrix,
    restless: BoolVector,
) -> tuple[int, int]:
    """Move everybody by ``dt``, at most ``times`` times.

    No more after a step in which somebody becomes restless.

    Args:
        dt: [s].
        times: positive.
        walks: changed in place.
        positions: (n, 2) [m], changed in place.
        states: (n, 4) output: x, y [m], vx, vy [m/s].
        restless: (n,) output: who has stood long enough and needs a new path.

    Returns:
        How often they moved, and how many are restless.
    """
    points, counts, next_point, pauses, speeds = walks
    for moved in range(times):
        number = 0
        for i in range(len(speeds)):
            restless[i] = False
            states[i, 2:] = 0.0
            if next_point[i] >= counts[i]:
                pauses[i] -= dt
                if pauses[i] <= 1e-9:  # [s] rounding must not cost a step
                    restless[i] = True
                    number += 1
            left = speeds[i] * dt
            while next_point[i] < counts[i]:
                dx = points[i, next_point[i], 0] - positions[i, 0]
                dy = points[i, next_point[i], 1] - positions[i, 1]
                distance = math.sqrt(dx * dx + dy * dy)
                if left < distance:
                    positions[i, 0] += dx / distance * left
                    positions[i, 1] += dy / distance * left
                    states[i, 2] = dx / distance * speeds[i]
                    states[i, 3] = dy / distance * speeds[i]
                    break
                left -= distance
                positions[i] = points[i, next_point[i]]
                next_point[i] += 1
            states[i, :2] = positions[i]
        if number:
            return moved + 1, number
    return times, 0


@njit()
def replay(
    time: float,
    firsts: IntArray,
    times: FloatArray,
    positions: FloatArray,
    robot_x: float,
    robot_y: float,
    clearance: float,
    absent: BoolArray,
    hidden: BoolArray,
    states: FloatArray,
) -> None:
    """Everybody at one moment of a recording.

    Args:
        time: [s].
        firsts: (n + 1,) index of each person's first sample, and the number of samples.
        times: (N,) [s], ascending for each person.
        positions: (N, 2) [m].
        robot_x: [m].
        robot_y: [m].
        clearance: [m] from the robot within which nobody appears.
        absent: (n,) bool: who is not in the recording at the moment. Changed in place.
        hidden: (n,) bool: who appeared too near to the robot and is not shown. Changed in place.
        states: (n, 4) output: x, y [m], vx, vy [m/s]; (inf, inf, 0, 0) for those who are not there.
    """
    for i in range(len(absent)):
        first, last = firsts[i], firsts[i + 1] - 1
        states[i, :2], states[i, 2:] = math.inf, 0.0
        if not times[first] <= time <= times[last]:
            absent[i], hidden[i] = True, False
            continue
        k = min(
            first + np.searchsorted(times[first : last + 1], time, side="right") - 1,
            max(last - 1, first),
        )
        x, y, vx, vy = positions[k, 0], positions[k, 1], 0.0, 0.0
        if last > first:
            span, gone = times[k + 1] - times[k], time - times[k]
            vx, vy = (positions[k + 1, 0] - x) / span, (positions[k + 1, 1] - y) / span
            x, y = x + gone * vx, y + gone * vy
        if absent[i]:
            absent[i] = False
            hidden[i] = math.hypot(x - robot_x, y - robot_y) < clearance
        if not hidden[i]:
            states[i, 0], states[i, 1], states[i, 2], states[i, 3] = x, y, vx, vy

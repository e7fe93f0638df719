"""Walking along polylines, and the search for them. Cells are (row, column)."""

import heapq
import math

import numpy as np
from numba import njit

from harness.shortest_paths import _BETWEEN, _LENGTHS, _MOVES  # one graph for all paths of the harness


@njit(cache=True)
def field_towards(free, landmarks, goal_y, goal_x, start_y, start_x):
    """A distance field towards a goal that is exact along the shortest path from one start, and no wider than needed.

    A* from the goal with the landmark heuristic: |d(l, cell) - d(l, start)| never exceeds d(cell, start) by the triangle
    inequality (Goldberg & Harrelson 2005). Start and goal must be connected.

    Args:
        free: (H, W) bool with a border of two closed cells.
        landmarks: (H, W, L) float32 lengths from each landmark in cells.
        goal_y: row of the goal.
        goal_x: its column.
        start_y: row of the start.
        start_x: its column.

    Returns:
        (H, W) float32 in cells, inf where the search did not come: for :func:`harness.shortest_paths.descend`.
    """
    field = np.full(free.shape, np.inf, np.float32)
    done = np.zeros(free.shape, np.bool_)
    field[goal_y, goal_x] = 0.0
    queue = [(0.0, goal_y, goal_x)]
    while queue:
        _, y, x = heapq.heappop(queue)
        if done[y, x]:
            continue
        done[y, x] = True
        if y == start_y and x == start_x:
            break
        for m in range(len(_LENGTHS)):
            ty, tx = y + _MOVES[m, 0], x + _MOVES[m, 1]
            length = np.float32(field[y, x] + _LENGTHS[m])
            if not free[ty, tx] or done[ty, tx] or length >= field[ty, tx]:
                continue
            if (
                free[y + _BETWEEN[m, 0, 0], x + _BETWEEN[m, 0, 1]]
                and free[y + _BETWEEN[m, 1, 0], x + _BETWEEN[m, 1, 1]]
            ):
                field[ty, tx] = length
                estimate = length + _least_length(landmarks[ty, tx], landmarks[start_y, start_x])
                heapq.heappush(queue, (estimate, ty, tx))
    return field


@njit(cache=True)
def _least_length(a, b):
    """Lower bound on the length between two cells from their landmark lengths (L,), in cells."""
    bound = 0.0
    for i in range(len(a)):
        bound = max(bound, abs(np.float64(a[i]) - np.float64(b[i])))
    return bound


@njit(cache=True)
def walk(dt, points, counts, next_point, pauses, speeds, positions, states, restless):
    """Move everybody by ``dt``.

    Args:
        dt: [s].
        points: (n, M, 2) corners of everybody's path, [m].
        counts: (n,) corners per path.
        next_point: (n,) index of the corner each one walks to; ``counts`` when standing. Changed in place.
        pauses: (n,) [s] to stand, counted down in place from the arrival on.
        speeds: (n,) [m/s].
        positions: (n, 2) [m], changed in place.
        states: (n, 4) output: x, y [m], vx, vy [m/s].
        restless: (n,) output: who has stood long enough and needs a new path.

    Returns:
        How many are restless.
    """
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
    return number

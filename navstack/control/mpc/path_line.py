"""The plan as a smooth line with a speed for each of its points."""

import math
from typing import NamedTuple

import numpy as np

from navstack.control.mpc import stage_layout as at
from navstack.jit import njit
from navstack.types import FloatArray, FloatVector

SPACING = 0.1  # [m] of the line's points
# points on either side over which positions are averaged: plans follow the cells of a grid
_SMOOTHED = 3
_CURVED = 3  # points on either side over which curvature is measured
# of the limits that the wanted speed uses in curves and before them; the rest is the controller's
_SHARE = 0.8


class PathLine(NamedTuple):
    """Points (n,) along the plan, n >= 2."""

    x: FloatVector  # [m]
    y: FloatVector  # [m]
    s: FloatVector  # [m] along the line
    heading: FloatVector  # [rad] without jumps
    speed: FloatVector  # [m/s] that the curve here and those ahead allow


def make_line(poses: FloatArray, limits: FloatArray) -> PathLine:
    """The line along the poses (N >= 1, 3) of a plan, under limits (8,) of :mod:`stage_layout`."""
    x = poses[:, 0]
    y = poses[:, 1]
    travelled = np.concatenate(((0.0,), np.cumsum(np.hypot(np.diff(x), np.diff(y)))))
    length = float(travelled[-1])
    if length < 1e-3:  # nowhere to go: a line through the goal along its yaw
        goal_x, goal_y, yaw = (float(value) for value in poses[-1])
        ahead = np.array((-1e-3, 0.0))
        x_line = goal_x + ahead * math.cos(yaw)
        y_line = goal_y + ahead * math.sin(yaw)
        s = ahead + 1e-3
        return PathLine(x_line, y_line, s, np.full(2, yaw), np.full(2, limits[at.MAX_SPEED]))
    even = np.linspace(0.0, length, max(2, math.ceil(length / SPACING) + 1))
    x_line = smoothed(np.interp(even, travelled, x))
    y_line = smoothed(np.interp(even, travelled, y))
    dx = np.diff(x_line)
    dy = np.diff(y_line)
    s = np.concatenate(((0.0,), np.cumsum(np.hypot(dx, dy))))
    along = np.unwrap(np.arctan2(dy, dx))
    heading = np.concatenate((along[:1], 0.5 * (along[1:] + along[:-1]), along[-1:]))
    return PathLine(x_line, y_line, s, heading, curve_speeds(s, heading, limits))


@njit(ahead=True)
def smoothed(values: FloatVector) -> FloatArray:
    """The mean over ``_SMOOTHED`` neighbours on either side, fewer towards the ends.

    The ends stay.
    """
    count = len(values)
    result = np.empty_like(values)
    for i in range(count):
        half = min(_SMOOTHED, i, count - 1 - i)
        total = 0.0
        for j in range(i - half, i + half + 1):
            total += values[j]
        result[i] = total / (2 * half + 1)
    return result


@njit(ahead=True)
def curve_speeds(s: FloatVector, heading: FloatVector, limits: FloatVector) -> FloatArray:
    """The speed at each point that keeps the limits there and, after braking, ahead of it."""
    count = len(s)
    speeds = np.empty(count)
    brake = _SHARE * limits[at.MAX_DECELERATION]
    for i in range(count - 1, -1, -1):
        before = max(0, i - _CURVED)
        after = min(count - 1, i + _CURVED)
        curvature = abs(heading[after] - heading[before]) / max(1e-6, s[after] - s[before])
        speed = limits[at.MAX_SPEED]
        if curvature > 1e-6:
            speed = min(speed, math.sqrt(_SHARE * limits[at.MAX_LATERAL] / curvature))
            speed = min(speed, _SHARE * limits[at.MAX_YAW_RATE] / curvature)
        if i + 1 < count:
            speed = min(speed, math.sqrt(speeds[i + 1] ** 2 + 2.0 * brake * (s[i + 1] - s[i])))
        speeds[i] = speed
    return speeds


@njit(ahead=True)
def project(
    line: PathLine,
    x: float,
    y: float,
    first: int,
    last: int,
) -> tuple[int, float]:
    """The segment, of ``first`` to ``last``, and the share 0..1 of it nearest to (x, y)."""
    best = first
    best_share = 0.0
    least = math.inf
    for i in range(first, min(last, len(line.x) - 2) + 1):
        dx = line.x[i + 1] - line.x[i]
        dy = line.y[i + 1] - line.y[i]
        squared = max(1e-12, dx * dx + dy * dy)
        share = min(1.0, max(0.0, ((x - line.x[i]) * dx + (y - line.y[i]) * dy) / squared))
        distance = math.hypot(line.x[i] + share * dx - x, line.y[i] + share * dy - y)
        if distance < least:
            best = i
            best_share = share
            least = distance
    return best, best_share


@njit(ahead=True)
def between(values: FloatVector, segment: int, share: float) -> float:
    """A quantity of the line at a share of a segment."""
    return float(values[segment] + share * (values[segment + 1] - values[segment]))


@njit(ahead=True)
def at_distance(line: PathLine, s: float) -> tuple[int, float]:
    """The segment and the share of it at ``s`` [m] along the line; its ends beyond them."""
    count = len(line.s)
    segment = min(max(0, int(np.searchsorted(line.s, s, side="right")) - 1), count - 2)
    span = max(1e-12, line.s[segment + 1] - line.s[segment])
    return segment, min(1.0, max(0.0, float(s - line.s[segment]) / span))

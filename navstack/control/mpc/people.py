"""Tracked people as the optimiser sees them: where they will be and how sure that is."""

import math
from collections.abc import Sequence

import numpy as np

from navstack.jit import njit
from navstack.types import FloatArray, Pose2D, Track

# x, y [m], vx, vy [m/s], radius [m], and the variance per axis: now [m2], per s [m2/s], per s2
# [m2/s2]
FIELDS = 8


def nearest_people(tracks: Sequence[Track], pose: Pose2D, stamp: float, most: int) -> FloatArray:
    """The nearest tracks at time ``stamp`` [s] as rows (n <= most, FIELDS)."""
    rows = np.empty((len(tracks), FIELDS))
    for row, track in zip(rows, tracks, strict=True):
        late = stamp - track.stamp  # [s] since it was last estimated
        p = track.covariance
        now = 0.5 * (p[0, 0] + p[1, 1])
        cross = p[0, 2] + p[1, 3]
        speed = 0.5 * (p[2, 2] + p[3, 3])
        row[:4] = track.x + late * track.vx, track.y + late * track.vy, track.vx, track.vy
        row[4] = track.radius
        row[5:] = now + late * (cross + late * speed), cross + 2.0 * late * speed, speed
    distances = np.hypot(rows[:, 0] - pose.x, rows[:, 1] - pose.y)
    nearest: FloatArray = rows[np.argsort(distances, kind="stable")[:most]]
    return nearest


@njit()
def predicted(person: FloatArray, time: float) -> tuple[float, float, float]:
    """Position (x, y) and its standard deviation per axis [m], ``time`` [s] from now.

    The velocity stays constant.
    """
    variance = person[5] + time * (person[6] + time * person[7])
    return person[0] + time * person[2], person[1] + time * person[3], math.sqrt(max(0.0, variance))

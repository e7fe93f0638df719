"""Kinds of meetings, by how near somebody passes the planned path and where he walks."""

import numpy as np

from navstack.types import FloatArray, IntArray

MISSES = (0.25, 0.5, 1.0, 2.0, 4.0)  # [m] upper ends; who passes farther away is not met
DIRECTIONS = ("head-on", "crossing", "same way")
ALONG = 0.7  # [m/s] along the path, beyond which somebody walks against or with the robot
STRATA = tuple((miss, direction) for miss in MISSES for direction in DIRECTIONS)
# [USD] spread of what a meeting costs, before any is driven: that of a hit, times the root of its
# probability by the miss; it decides how many are driven, never what they come to
PRIOR = np.repeat((25.0, 20.0, 10.0, 6.0, 4.0), len(DIRECTIONS))
PRIOR_WEIGHT = 10.0  # meetings that the prior counts as
# [USD] passings a delivery times these spreads, in the default world (15 missions of sidewalk)
PRIOR_SUM = 17.0
NUMBER = 12  # of meetings a mission, on average


def strata_of(misses: FloatArray, along: FloatArray) -> IntArray:
    """The number of each meeting's stratum in :data:`STRATA`, shape (n,).

    Args:
        misses: [m] from the planned path, below the last of :data:`MISSES`, shape (n,).
        along: [m/s] of the person along the path, shape (n,).
    """
    nearness = np.digitize(misses, MISSES)
    direction = np.ones(len(along), dtype=np.int64)
    direction[along < -ALONG] = 0
    direction[along > ALONG] = 2
    return nearness * len(DIRECTIONS) + direction

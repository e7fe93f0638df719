"""Limits, obstacles and optimal motions that the tests of the jerk-limited MPC share."""

import numpy as np
from ruckig import InputParameter, Ruckig, Trajectory

from navstack.control.mpc.distance_field import DistanceField, distance_table
from navstack.control.mpc.stages import Clearances

from ..given import INSCRIBED, LAYER, RESOLUTION, inflated

PERIOD = 1.0 / 30.0  # [s]
DECELERATION = 2.5  # [m/s2]
JERK = 5.0  # [m/s3]
LIMITS = np.array((2.0, 1.5, DECELERATION, JERK, 1.2, 2.5, 10.0, 1.3))
KEEP = Clearances(0.33, 0.25, 0.3, 1.5, 0.4, 0.1)
TABLE = distance_table(INSCRIBED, LAYER.cost_scaling_factor)


def field_on(costs, origin=(0.0, 0.0)):
    """The distance field of a costmap's cells."""
    return DistanceField(costs, (*origin, RESOLUTION), TABLE, INSCRIBED)


def inflated_field(*cells):
    """The field of 10 x 10 m from (-5, 3) on, with lethal cells (column, row)."""
    origin = (-5.0, 3.0)
    middles = np.array(origin) + RESOLUTION * (np.array(cells) + 0.5)
    boxes = ((x, x, y, y) for x, y in middles.tolist())
    return field_on(inflated(200, 200, origin, *boxes).data, origin)


def least_time(length):
    """Duration [s] of the fastest motion over so many metres, from rest to rest, by Ruckig."""
    given = InputParameter(1)
    trajectory = Trajectory(1)
    given.target_position = [length]
    given.max_velocity = [LIMITS[0]]
    given.max_acceleration = [LIMITS[1]]
    given.min_acceleration = [-DECELERATION]
    given.max_jerk = [JERK]
    Ruckig(1).calculate(given, trajectory)
    return trajectory.duration


def horizon_times(steps):
    """Lengths [s] of a horizon's steps: a control period, then tenths of a second."""
    times = np.full(steps, 0.1)
    times[0] = PERIOD
    return times

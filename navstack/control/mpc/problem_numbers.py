"""Parameters and footprint as the arrays that the kernels take."""

import math

import numpy as np

from navstack.params.mpc import MpcParams
from navstack.types import FloatArray

_LIMITS = """
    max_speed max_acceleration max_deceleration max_jerk
    max_yaw_rate max_yaw_acceleration max_yaw_jerk max_lateral_acceleration
"""
_WEIGHTS = "contour lag heading speed yaw_acceleration lateral obstacle person jerk yaw_jerk"


def limits_of(params: MpcParams) -> FloatArray:
    """The limits (8,) in the order of :mod:`stage_layout`."""
    return np.array([getattr(params, name) for name in _LIMITS.split()])


def weights_of(params: MpcParams) -> FloatArray:
    """The weights (10,) in the order of :mod:`stage_layout`."""
    return np.array([getattr(params, f"{name}_weight") for name in _WEIGHTS.split()])


def bounds_of(params: MpcParams) -> FloatArray:
    """Lower and upper bounds (2, 9) of the jerks and the state."""
    rate = params.max_yaw_rate
    turn = params.max_yaw_acceleration
    low = (0.0, -rate, -params.max_deceleration, -turn)
    high = (params.max_speed, rate, params.max_acceleration, turn)
    jerk = (params.max_jerk, params.max_yaw_jerk)
    free = (math.inf,) * 3  # the pose
    return np.array(
        ((-jerk[0], -jerk[1], -free[0], -free[1], -free[2], *low), (*jerk, *free, *high))
    )

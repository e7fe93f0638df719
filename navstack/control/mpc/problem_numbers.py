"""Parameters and footprint as the arrays that the kernels take."""

import math

import numpy as np

from navstack.params.mpc import MpcParams
from navstack.types import FloatArray


def limits_of(params: MpcParams) -> FloatArray:
    """The limits (8,) in the order of :mod:`stage_layout`."""
    return np.array(
        (
            params.max_speed,
            params.max_acceleration,
            params.max_deceleration,
            params.max_jerk,
            params.max_yaw_rate,
            params.max_yaw_acceleration,
            params.max_yaw_jerk,
            params.max_lateral_acceleration,
        )
    )


def weights_of(params: MpcParams) -> FloatArray:
    """The weights (10,) in the order of :mod:`stage_layout`."""
    return np.array(
        (
            params.contour_weight,
            params.lag_weight,
            params.heading_weight,
            params.speed_weight,
            params.yaw_acceleration_weight,
            params.lateral_weight,
            params.obstacle_weight,
            params.person_weight,
            params.jerk_weight,
            params.yaw_jerk_weight,
        )
    )


def bounds_of(params: MpcParams) -> FloatArray:
    """Lower and upper bounds (2, 9) of the jerks and the state."""
    rate, turn = params.max_yaw_rate, params.max_yaw_acceleration
    low = (0.0, -rate, -params.max_deceleration, -turn)
    high = (params.max_speed, rate, params.max_acceleration, turn)
    jerk = (params.max_jerk, params.max_yaw_jerk)
    free = (math.inf,) * 3  # the pose
    return np.array(((-jerk[0], -jerk[1], -free[0], -free[1], -free[2], *low), (*jerk, *free, *high)))

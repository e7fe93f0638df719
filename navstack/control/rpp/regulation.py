"""The heuristics that slow regulated pure pursuit down.

Macenski et al. 2023; Nav2's ``regulation_functions.hpp``.
"""

import math

from navstack.control.rpp.lookahead import path_length
from navstack.costmap.costmap import FREE_SPACE, INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION
from navstack.params.rpp import RppParams
from navstack.types import FloatArray


def speed_in_curve(speed: float, curvature: float, min_radius: float) -> float:
    """``speed`` [m/s], reduced in proportion to a radius less than ``min_radius`` [m]."""
    if curvature == 0.0 or 1.0 / abs(curvature) >= min_radius:
        return speed
    return speed * (1.0 - (min_radius - 1.0 / abs(curvature)) / min_radius)


def speed_near_obstacle(
    speed: float, cost: int, inscribed_radius: float, params: RppParams
) -> float:
    """``speed`` [m/s], reduced near an obstacle, whose distance the ``cost`` tells."""
    if cost in (NO_INFORMATION, FREE_SPACE):
        return speed
    decay = math.log(cost / INSCRIBED_INFLATED_OBSTACLE)
    distance = -decay / params.inflation_cost_scaling_factor + inscribed_radius  # [m]
    if distance >= params.cost_scaling_dist:
        return speed
    return speed * (params.cost_scaling_gain * distance / params.cost_scaling_dist)


def speed_on_approach(speed: float, path: FloatArray, params: RppParams) -> float:
    """``speed`` [m/s], reduced near the end of a path (N, 3), base frame."""
    scaling = 1.0
    if path_length(path) < params.approach_velocity_scaling_dist:
        scaling = math.hypot(path[-1, 0], path[-1, 1]) / params.approach_velocity_scaling_dist
    return min(speed, max(speed * scaling, params.min_approach_linear_velocity))

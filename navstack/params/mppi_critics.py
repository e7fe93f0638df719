"""Parameters of MPPI's critics: names and defaults are those of Nav2 Jazzy (``nav2_mppi_controller/src/critics``).

Every critic adds ``(cost_weight * raw cost) ** cost_power`` to the cost of each trajectory.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from navstack.errors import ParameterError

# Least and most of each parameter, far beyond any sensible value: outside, float32 costs over- or underflow.
_RANGES = {
    "cost_weight": (0.0, 1e6),
    "cost_power": (0, 10),
    "threshold_to_consider": (0.0, 1e4),
    "offset_from_furthest": (0, 10_000),
    "max_path_occupancy_ratio": (0.0, 1e3),
    "critical_cost": (0.0, 1e9),
    "collision_cost": (0.0, 1e9),
    "near_collision_cost": (0, 1000),
    "near_goal_distance": (0.0, 1e4),
    "critical_weight": (0.0, 1e6),
    "repulsion_weight": (0.0, 1e6),
    "collision_margin_distance": (0.0, 1e4),
    "max_angle_to_furthest": (0.0, 1e3),
    "trajectory_point_step": (1, 10_000),
}
FORWARD, EITHER, AS_THE_PATH = 0, 1, 2  # values of PathAngleCritic's mode


@dataclass(frozen=True, slots=True)
class ConstraintParams:
    """``constraint_critic.cpp``: speeds beyond the limits."""

    enabled: bool = True
    cost_power: int = 1
    cost_weight: float = 4.0

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True, slots=True)
class CostParams:
    """``cost_critic.cpp``: the costmap's costs under the trajectory."""

    enabled: bool = True
    cost_power: int = 1
    cost_weight: float = 3.81  # per 254 of cost
    consider_footprint: bool = False  # collision: the outline touches a lethal cell; False: the centre is inscribed
    critical_cost: float = 300.0  # of a pose at near_collision_cost or more
    near_collision_cost: int = 253  # cost of the centre's cell
    collision_cost: float = 1_000_000.0  # of a trajectory that collides
    near_goal_distance: float = 0.5  # [m] to the goal, within which obstacles repel no more
    trajectory_point_step: int = 2  # every how many poses are looked at
    inflation_layer_name: str = ""  # empty: the last inflation layer of the local costmap

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True, slots=True)
class ObstaclesParams:
    """``obstacles_critic.cpp``: the distance to obstacles, as the inflated costmap tells it."""

    enabled: bool = True
    cost_power: int = 1
    critical_weight: float = 20.0  # [1/m] of poses within the margin
    repulsion_weight: float = 1.5  # [1/m] of poses within the inflation radius
    consider_footprint: bool = False  # collision: the outline touches a lethal cell; False: the centre is inscribed
    collision_cost: float = 100_000.0  # of a trajectory that collides
    collision_margin_distance: float = 0.1  # [m]
    near_goal_distance: float = 0.5  # [m] to the goal, within which obstacles repel no more
    inflation_layer_name: str = ""  # empty: the last inflation layer of the local costmap

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True, slots=True)
class GoalParams:
    """``goal_critic.cpp``: the mean distance to the goal, near it."""

    enabled: bool = True
    cost_power: int = 1
    cost_weight: float = 5.0  # [1/m]
    threshold_to_consider: float = 1.4  # [m] to the goal, within which it counts

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True, slots=True)
class GoalAngleParams:
    """``goal_angle_critic.cpp``: the mean angle to the path's last yaw, near the goal."""

    enabled: bool = True
    cost_power: int = 1
    cost_weight: float = 3.0  # [1/rad]
    threshold_to_consider: float = 0.5  # [m] to the goal, within which it counts

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True, slots=True)
class PathAlignParams:
    """``path_align_critic.cpp``: the mean distance to the path's point as far along as the trajectory."""

    enabled: bool = True
    cost_power: int = 1
    cost_weight: float = 10.0  # [1/m]
    threshold_to_consider: float = 0.5  # [m] to the goal, within which it counts no more
    offset_from_furthest: int = 20  # path points that some trajectory has to reach
    max_path_occupancy_ratio: float = 0.07  # of these points, in obstacles, up to which it counts
    use_path_orientations: bool = False  # a radian off the path's yaw is as a metre off
    trajectory_point_step: int = 4  # every how many poses are looked at

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True, slots=True)
class PathAngleParams:
    """``path_angle_critic.cpp``: the last pose's bearing to a point ahead on the path, where the robot looks away."""

    enabled: bool = True
    cost_power: int = 1
    cost_weight: float = 2.2  # [1/rad]
    threshold_to_consider: float = 0.5  # [m] to the goal, within which it counts no more
    offset_from_furthest: int = 4  # path points beyond the furthest one reached
    max_angle_to_furthest: float = 0.785398  # [rad] of the robot, from which on it counts
    mode: int = FORWARD  # 0: forwards; 1: forwards or backwards; 2: as the path's yaws say

    def __post_init__(self) -> None:
        _check(self)
        if self.mode not in (FORWARD, EITHER, AS_THE_PATH):
            raise ParameterError(f"mode {self.mode} is not 0, 1 or 2")


@dataclass(frozen=True, slots=True)
class PathFollowParams:
    """``path_follow_critic.cpp``: the last pose's distance to a free point ahead on the path."""

    enabled: bool = True
    cost_power: int = 1
    cost_weight: float = 5.0  # [1/m]
    threshold_to_consider: float = 1.4  # [m] to the goal, within which it counts no more
    offset_from_furthest: int = 6  # path points beyond the furthest one reached

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True, slots=True)
class PreferForwardParams:
    """``prefer_forward_critic.cpp``: the way driven backwards."""

    enabled: bool = True
    cost_power: int = 1
    cost_weight: float = 5.0  # [1/m]
    threshold_to_consider: float = 0.5  # [m] to the goal, within which it counts no more

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True, slots=True)
class TwirlingParams:
    """``twirling_critic.cpp``: the mean yaw rate, except within the goal checker's tolerance."""

    enabled: bool = True
    cost_power: int = 1
    cost_weight: float = 10.0  # [s/rad]

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True, slots=True)
class VelocityDeadbandParams:
    """``velocity_deadband_critic.cpp``: speeds that the drive does not turn into motion."""

    enabled: bool = True
    cost_power: int = 1
    cost_weight: float = 35.0
    deadband_velocities: tuple[float, float, float] = (0.0, 0.0, 0.0)  # [m/s], [m/s], [rad/s] along x, y and about z

    def __post_init__(self) -> None:
        _check(self)
        if not all(map(math.isfinite, self.deadband_velocities)):
            raise ParameterError(f"deadband_velocities {list(self.deadband_velocities)} must be finite numbers")


def check_ranges(params: Any, ranges: Mapping[str, tuple[float, float]]) -> None:
    """Refuse what no formula can use.

    Args:
        params: a dataclass of parameters; those that are None are left out.
        ranges: least and most allowed value by name; names that ``params`` does not have are left out.

    Raises:
        ParameterError: a value lies outside its range, or is no finite number.
    """
    for name, (least, most) in ranges.items():
        value = getattr(params, name, None)
        if value is not None and not least <= value <= most:
            raise ParameterError(f"{name} {value} must be {least:g} to {most:g}")


def _check(params: Any) -> None:
    check_ranges(params, _RANGES)

"""Parameters of MPPI's critics: names and defaults are those of Nav2 Jazzy.

Every critic adds ``(cost_weight * raw cost) ** cost_power`` to the cost of each trajectory.
"""

import math
from dataclasses import dataclass
from typing import Annotated

from navstack.ranges import Allowed, Parameters, within

# Least and most of each parameter, far beyond any sensible value: outside, float32 costs over- or
# underflow.
Weight = Annotated[float, within(0.0, 1e6)]
Distance = Annotated[float, within(0.0, 1e4)]
Cost = Annotated[float, within(0.0, 1e9)]
Ratio = Annotated[float, within(0.0, 1e3)]
Points = Annotated[int, within(0, 10_000)]
Step = Annotated[int, within(1, 10_000)]
FORWARD, EITHER, AS_THE_PATH = 0, 1, 2  # values of PathAngleCritic's mode
Mode = Annotated[int, Allowed("0, 1 or 2", (FORWARD, EITHER, AS_THE_PATH).__contains__)]


@dataclass(frozen=True, slots=True)
class CriticParams(Parameters):
    """What all critics have."""

    enabled: bool = True
    cost_power: Annotated[int, within(0, 10)] = 1


@dataclass(frozen=True, slots=True)
class ConstraintParams(CriticParams):
    """``constraint_critic.cpp``: speeds beyond the limits."""

    cost_weight: Weight = 4.0


@dataclass(frozen=True, slots=True)
class CostParams(CriticParams):
    """``cost_critic.cpp``: the costmap's costs under the trajectory."""

    cost_weight: Weight = 3.81  # per 254 of cost
    # collision: the outline touches a lethal cell; False: the centre is inscribed
    consider_footprint: bool = False
    critical_cost: Cost = 300.0  # of a pose at near_collision_cost or more
    near_collision_cost: Annotated[int, within(0, 1000)] = 253  # cost of the centre's cell
    collision_cost: Cost = 1_000_000.0  # of a trajectory that collides
    near_goal_distance: Distance = 0.5  # [m] to the goal, within which obstacles repel no more
    trajectory_point_step: Step = 2  # every how many poses are looked at
    inflation_layer_name: str = ""  # empty: the last inflation layer of the local costmap


@dataclass(frozen=True, slots=True)
class ObstaclesParams(CriticParams):
    """``obstacles_critic.cpp``: the distance to obstacles, as the inflated costmap tells it."""

    critical_weight: Weight = 20.0  # [1/m] of poses within the margin
    repulsion_weight: Weight = 1.5  # [1/m] of poses within the inflation radius
    # collision: the outline touches a lethal cell; False: the centre is inscribed
    consider_footprint: bool = False
    collision_cost: Cost = 100_000.0  # of a trajectory that collides
    collision_margin_distance: Distance = 0.1  # [m]
    near_goal_distance: Distance = 0.5  # [m] to the goal, within which obstacles repel no more
    inflation_layer_name: str = ""  # empty: the last inflation layer of the local costmap


@dataclass(frozen=True, slots=True)
class GoalParams(CriticParams):
    """``goal_critic.cpp``: the mean distance to the goal, near it."""

    cost_weight: Weight = 5.0  # [1/m]
    threshold_to_consider: Distance = 1.4  # [m] to the goal, within which it counts


@dataclass(frozen=True, slots=True)
class GoalAngleParams(CriticParams):
    """``goal_angle_critic.cpp``: the mean angle to the path's last yaw, near the goal."""

    cost_weight: Weight = 3.0  # [1/rad]
    threshold_to_consider: Distance = 0.5  # [m] to the goal, within which it counts
    symmetric_yaw_tolerance: bool = False  # the opposite yaw is as good


@dataclass(frozen=True, slots=True)
class PathAlignParams(CriticParams):
    """``path_align_critic.cpp``: the mean distance to the path's point as far along."""

    cost_weight: Weight = 10.0  # [1/m]
    threshold_to_consider: Distance = 0.5  # [m] to the goal, within which it counts no more
    offset_from_furthest: Points = 20  # path points that some trajectory has to reach
    max_path_occupancy_ratio: Ratio = 0.07  # of these points, in obstacles, up to which it counts
    use_path_orientations: bool = False  # a radian off the path's yaw is as a metre off
    trajectory_point_step: Step = 4  # every how many poses are looked at


@dataclass(frozen=True, slots=True)
class PathAngleParams(CriticParams):
    """``path_angle_critic.cpp``: the last pose's bearing to a point ahead on the path."""

    cost_weight: Weight = 2.2  # [1/rad]
    threshold_to_consider: Distance = 0.5  # [m] to the goal, within which it counts no more
    offset_from_furthest: Points = 4  # path points beyond the furthest one reached
    max_angle_to_furthest: Ratio = 0.785398  # [rad] of the robot, from which on it counts
    mode: Mode = FORWARD  # 0: forwards; 1: forwards or backwards; 2: as the path's yaws say


@dataclass(frozen=True, slots=True)
class PathFollowParams(CriticParams):
    """``path_follow_critic.cpp``: the last pose's distance to a free point ahead on the path."""

    cost_weight: Weight = 5.0  # [1/m]
    threshold_to_consider: Distance = 1.4  # [m] to the goal, within which it counts no more
    offset_from_furthest: Points = 6  # path points beyond the furthest one reached


@dataclass(frozen=True, slots=True)
class MppiPreferForwardParams(CriticParams):
    """``prefer_forward_critic.cpp``: the way driven backwards."""

    cost_weight: Weight = 5.0  # [1/m]
    threshold_to_consider: Distance = 0.5  # [m] to the goal, within which it counts no more


@dataclass(frozen=True, slots=True)
class MppiTwirlingParams(CriticParams):
    """``twirling_critic.cpp``: the mean yaw rate, except within the goal checker's tolerance."""

    cost_weight: Weight = 10.0  # [s/rad]


@dataclass(frozen=True, slots=True)
class VelocityDeadbandParams(CriticParams):
    """``velocity_deadband_critic.cpp``: speeds that the drive does not turn into motion."""

    cost_weight: Weight = 35.0
    deadband_velocities: Annotated[
        tuple[float, float, float],
        Allowed("finite numbers", lambda three: all(map(math.isfinite, three))),
    ] = (0.0, 0.0, 0.0)  # [m/s], [m/s], [rad/s] along x, y and about z

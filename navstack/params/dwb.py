"""Parameters of the DWB local planner and its critics: names and defaults are those of Nav2 Jazzy.

Each critic has its own dataclass; :class:`DwbParams` holds them under the critic's name, as
``FollowPath.<Critic>.*``. A critic is declared there and written in ``control/dwb/critics``.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from navstack.errors import ParameterError
from navstack.params.expected_contact import DwbContactParams
from navstack.ranges import OpenQuantity, Parameters, Positive, Quantity, Whole

MOST_SAMPLES = 100_000  # trajectories per cycle; Nav2's defaults make about 400
MOST_POSES = 2_000_000  # of all trajectories of a cycle; Nav2's defaults make about 50 000
# [m/s, rad/s] tolerance of all comparisons in one_d_velocity_iterator.hpp
EPSILON = 1e-5

# Where a file names no critics: critic -> ROS 1's parameter that gives its scale, and the scale
# where that is absent (loadBackwardsCompatibleParameters in Foxy's dwb_local_planner.cpp; later
# releases do not start without critics).
FALLBACK_SCALES = {
    "PathAlign": ("path_distance_bias", 32.0),
    "PathDist": ("path_distance_bias", 32.0),
    "GoalAlign": ("goal_distance_bias", 24.0),
    "GoalDist": ("goal_distance_bias", 24.0),
    "ObstacleFootprint": ("occdist_scale", 0.01),
}


@dataclass(frozen=True, slots=True)
class RotateToGoalParams(Parameters):
    """``rotate_to_goal.cpp``: stop, then turn, once the goal is within its tolerance."""

    scale: Quantity = 1.0  # weight of the raw score
    slowing_factor: Quantity = 5.0  # [s2/m2] cost of the squared speed while slowing down
    lookahead_time: Quantity = -1.0  # [s] after which the heading is scored; negative: at the end


@dataclass(frozen=True, slots=True)
class OscillationParams(Parameters):
    """``oscillation.cpp``: forbid a change of direction until the robot has got somewhere."""

    scale: Quantity = 1.0
    oscillation_reset_dist: Quantity = 0.05  # [m]; negative: never by distance
    oscillation_reset_angle: Quantity = 0.2  # [rad]; negative: never by angle
    oscillation_reset_time: Quantity = -1.0  # [s]; negative: never by time
    # [m/s]; faster than this only x is watched; negative: always watch all
    x_only_threshold: Quantity = 0.05


@dataclass(frozen=True, slots=True)
class ObstacleParams(Parameters):
    """``base_obstacle.cpp`` and ``obstacle_footprint.cpp``."""

    scale: Quantity = 1.0
    sum_scores: bool = False  # the sum over all poses instead of the last pose's cost


@dataclass(frozen=True, slots=True)
class DistParams(Parameters):
    """``path_dist.cpp`` and ``goal_dist.cpp``."""

    scale: Quantity = 1.0
    aggregation_type: str = "last"  # last, sum or product of the poses' distances


@dataclass(frozen=True, slots=True)
class AlignParams(Parameters):
    """``path_align.cpp`` and ``goal_align.cpp``."""

    scale: Quantity = 1.0
    aggregation_type: str = "last"  # last, sum or product of the poses' distances
    forward_point_distance: Quantity = (
        0.325  # [m] from the base to the scored point, the robot's nose
    )


@dataclass(frozen=True, slots=True)
class PreferForwardParams(Parameters):
    """``prefer_forward.cpp``."""

    scale: Quantity = 1.0
    penalty: Quantity = 1.0  # raw score of driving backwards or strafing
    strafe_x: Quantity = 0.1  # [m/s] below which a motion counts as strafing
    strafe_theta: Quantity = 0.2  # [rad/s] below which a motion counts as strafing
    theta_scale: Quantity = 10.0  # [s/rad] raw score per yaw rate otherwise


@dataclass(frozen=True, slots=True)
class TwirlingParams(Parameters):
    """``twirling.cpp``."""

    scale: Quantity = 1.0


MODULE = "module"  # metadata of a critic's field


def _critic(params: type[Any], module: str) -> Any:
    """The field of a critic: its parameters, and the module of its class ``<field>Critic``."""
    return field(default_factory=params, metadata={MODULE: module})


@dataclass(frozen=True, slots=True)
class NamedCritic:
    """A critic under a name of its own: ``critics: [Narrow]`` with ``Narrow.class: PathAlign``."""

    type: str  # one of the critics that DwbParams has
    params: Any  # the dataclass of that type


@dataclass(frozen=True, slots=True)
class DwbParams(Parameters):
    """``dwb_core::DWBLocalPlanner``, its trajectory generator, and its critics under their names.

    Where a file names no critics, these run with the scales of :data:`FALLBACK_SCALES`.
    """

    critics: tuple[str, ...] = (
        "RotateToGoal",
        "Oscillation",
        "ObstacleFootprint",
        "GoalAlign",
        "PathAlign",
        "PathDist",
        "GoalDist",
    )
    path_distance_bias: Quantity | None = None  # [-] see FALLBACK_SCALES
    goal_distance_bias: Quantity | None = None  # [-]
    occdist_scale: Quantity | None = None  # [-]
    default_critic_namespaces: tuple[str, ...] = ("dwb_critics",)
    trajectory_generator_name: str = "dwb_plugins::StandardTrajectoryGenerator"
    prune_plan: bool = True  # forget the part of the plan that has been passed
    prune_distance: Quantity = 2.0  # [m] kept of the plan behind the robot
    # [m] kept ahead, along the straight line; negative: everything
    forward_prune_distance: Quantity = 2.0
    shorten_transformed_plan: bool = True  # show the critics forward_prune_distance only
    short_circuit_trajectory_evaluation: bool = True  # accepted; it never changes the winner
    debug_trajectory_details: bool = False  # accepted; rejections per critic are always counted
    xy_goal_tolerance: Quantity = 0.25  # [m] within which RotateToGoal acts
    trans_stopped_velocity: Quantity = 0.25  # [m/s] at or below which the robot has stopped
    # [m] Nav2 main's RotateToGoal also wants the plan this short (1.0 there)
    path_length_tolerance: OpenQuantity = math.inf

    min_vel_x: Quantity = 0.0  # [m/s]
    max_vel_x: Quantity = 0.0  # [m/s]
    min_vel_y: Quantity = 0.0  # [m/s]
    max_vel_y: Quantity = 0.0  # [m/s]
    max_vel_theta: Quantity = 0.0  # [rad/s]
    # [m/s] a slower sample is dropped if it also turns slower than min_speed_theta
    min_speed_xy: Quantity = 0.0
    max_speed_xy: Quantity = 0.0  # [m/s]; negative: no limit
    min_speed_theta: Quantity = 0.0  # [rad/s]
    acc_lim_x: Quantity = 0.0  # [m/s2]
    acc_lim_y: Quantity = 0.0  # [m/s2]
    acc_lim_theta: Quantity = 0.0  # [rad/s2]
    decel_lim_x: Quantity = 0.0  # [m/s2] negative
    decel_lim_y: Quantity = 0.0  # [m/s2] negative
    decel_lim_theta: Quantity = 0.0  # [rad/s2] negative

    vx_samples: Whole = 20
    vy_samples: Whole = 5
    vtheta_samples: Whole = 20
    sim_time: Positive = 1.7  # [s] length of a trajectory
    sim_period: Quantity | None = None  # [s] of LimitedAccelGenerator; absent: one control period
    discretize_by_time: bool = False
    time_granularity: Positive = 0.5  # [s] between poses, if discretize_by_time
    linear_granularity: Positive = 0.5  # [m] between poses at most
    angular_granularity: Positive = 0.025  # [rad] between poses at most
    include_last_point: bool = True  # the last pose twice
    # command the first velocity of the ramp instead of the sample
    limit_vel_cmd_in_traj: bool = False

    RotateToGoal: RotateToGoalParams = _critic(RotateToGoalParams, "rotate_to_goal")
    Oscillation: OscillationParams = _critic(OscillationParams, "oscillation")
    BaseObstacle: ObstacleParams = _critic(ObstacleParams, "obstacles")
    ObstacleFootprint: ObstacleParams = _critic(ObstacleParams, "obstacles")
    GoalAlign: AlignParams = _critic(AlignParams, "align")
    PathAlign: AlignParams = _critic(AlignParams, "align")
    PathDist: DistParams = _critic(DistParams, "dist")
    GoalDist: DistParams = _critic(DistParams, "dist")
    PreferForward: PreferForwardParams = _critic(PreferForwardParams, "prefer_forward")
    Twirling: TwirlingParams = _critic(TwirlingParams, "twirling")
    # this program's own
    ExpectedContact: DwbContactParams = _critic(DwbContactParams, "expected_contact")
    # those in ``critics`` with a ``class``
    named_critics: Mapping[str, NamedCritic] = field(default_factory=dict)

    def _check_together(self) -> None:
        samples = max(self.vx_samples, 1) * max(self.vy_samples, 1) * max(self.vtheta_samples, 1)
        if samples > MOST_SAMPLES:
            raise ParameterError(
                f"vx_samples, vy_samples and vtheta_samples make {samples:,} trajectories; "
                f"at most {MOST_SAMPLES:,} are allowed"
            )
        if samples * self.largest_steps > MOST_POSES:
            raise ParameterError(
                f"sim_time {self.sim_time:g} s and the granularities make {samples:,} trajectories "
                f"of {self.largest_steps:,} poses; at most {MOST_POSES:,} poses in all are allowed"
            )

    @property
    def largest_steps(self) -> int:
        """An upper bound of the steps of any sample's trajectory."""
        if self.discretize_by_time:
            return _whole(self.sim_time / self.time_granularity)
        vx = max(abs(self.min_vel_x), abs(self.max_vel_x))
        vy = max(abs(self.min_vel_y), abs(self.max_vel_y))
        linear = (math.hypot(vx, vy) + 2.0 * EPSILON) * self.sim_time / self.linear_granularity
        angular = (self.max_vel_theta + 2.0 * EPSILON) * self.sim_time / self.angular_granularity
        return _whole(max(linear, angular))


def _whole(steps: float) -> int:
    """Steps rounded up, at least one; beyond ``MOST_POSES`` it does not matter how many."""
    return max(1, math.ceil(min(steps, 2.0 * MOST_POSES)))

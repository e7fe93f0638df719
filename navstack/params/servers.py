"""Parameters of Nav2's task servers and behaviors: names and defaults are those of Nav2 Jazzy."""

from dataclasses import dataclass
from typing import Annotated

from navstack.ranges import NotNegative, Parameters, Positive, Quantity, Signed, within


@dataclass(frozen=True, slots=True)
class ControllerServerParams(Parameters):
    """``controller_server``, without its plug-ins."""

    controller_frequency: Positive = 20.0  # [Hz]
    min_x_velocity_threshold: Quantity = 0.0001  # [m/s] slower measured velocities count as zero
    min_y_velocity_threshold: Quantity = 0.0001  # [m/s]
    min_theta_velocity_threshold: Quantity = 0.0001  # [rad/s]
    # [s] the controller may find no command; 0: not at all, -1: endlessly
    failure_tolerance: Quantity = 0.0
    controller_plugins: tuple[str, ...] = ("FollowPath",)
    goal_checker_plugins: tuple[str, ...] = ("goal_checker",)
    progress_checker_plugins: tuple[str, ...] = ("progress_checker",)


@dataclass(frozen=True, slots=True)
class PlannerServerParams:
    """``planner_server``, without its plug-ins."""

    planner_plugins: tuple[str, ...] = ("GridBased",)


@dataclass(frozen=True, slots=True)
class BtNavigatorParams:
    """``bt_navigator``: the files of its trees. Nav2's default tree is built in.

    No other is read.
    """

    default_nav_to_pose_bt_xml: str = ""  # empty: navigate_to_pose_w_replanning_and_recovery.xml


@dataclass(frozen=True, slots=True)
class BehaviorServerParams(Parameters):
    """``behavior_server``.

    As in Nav2, what spinning and looking ahead need stands beside the plugins, not in them.
    """

    cycle_frequency: Positive = 10.0  # [Hz]
    behavior_plugins: tuple[str, ...] = ("spin", "backup", "drive_on_heading", "wait")
    # [s] for which the motion must be free of collisions; one look a cycle
    simulate_ahead_time: Annotated[float, within(0.0, 100.0)] = 2.0
    max_rotational_vel: NotNegative = 1.0  # [rad/s]
    min_rotational_vel: Quantity = 0.4  # [rad/s]; as in Nav2 negative ones slow nothing down
    rotational_acc_lim: NotNegative = 3.2  # [rad/s2]


@dataclass(frozen=True, slots=True)
class DriveParams(Parameters):
    """``nav2_behaviors::DriveOnHeading`` and ``nav2_behaviors::BackUp``."""

    # [m/s2]; 0 here or below: the commanded speed at once
    acceleration_limit: Annotated[float, Signed(1.0)] = 0.0
    deceleration_limit: Annotated[float, Signed(-1.0)] = 0.0  # [m/s2] negative
    minimum_speed: Quantity = 0.0  # [m/s]

"""Parameters of Nav2's task servers: names and defaults are those of Nav2 Jazzy."""

from dataclasses import dataclass

from navstack.params.checks import Positive, check


@dataclass(frozen=True, slots=True)
class ControllerServerParams:
    """``controller_server``, without its plug-ins."""

    controller_frequency: Positive = 20.0  # [Hz]
    min_x_velocity_threshold: float = 0.0001  # [m/s] slower measured velocities count as zero
    min_y_velocity_threshold: float = 0.0001  # [m/s]
    min_theta_velocity_threshold: float = 0.0001  # [rad/s]
    # [s] the controller may find no command; 0: not at all, -1: endlessly
    failure_tolerance: float = 0.0
    controller_plugins: tuple[str, ...] = ("FollowPath",)
    goal_checker_plugins: tuple[str, ...] = ("goal_checker",)
    progress_checker_plugins: tuple[str, ...] = ("progress_checker",)

    def __post_init__(self) -> None:
        check(self)


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

"""Parameters of the controller server's goal and progress checkers.

Names and defaults are those of Nav2 Jazzy.
"""

from dataclasses import dataclass

from navstack.ranges import Parameters, Positive, Quantity


@dataclass(frozen=True, slots=True)
class SimpleGoalCheckerParams(Parameters):
    """``simple_goal_checker.cpp``."""

    xy_goal_tolerance: Quantity = 0.25  # [m]
    yaw_goal_tolerance: Quantity = 0.25  # [rad]
    stateful: bool = True  # once the position was reached it counts as reached, until the next plan
    symmetric_yaw_tolerance: bool = False  # the opposite heading is as good


@dataclass(frozen=True, slots=True)
class PositionGoalCheckerParams(Parameters):
    """``position_goal_checker.cpp``."""

    xy_goal_tolerance: Quantity = 0.25  # [m]
    stateful: bool = True  # as above


@dataclass(frozen=True, slots=True)
class StoppedGoalCheckerParams(SimpleGoalCheckerParams):
    """``stopped_goal_checker.cpp``."""

    rot_stopped_velocity: Quantity = 0.25  # [rad/s] the robot stands if it turns no faster
    trans_stopped_velocity: Quantity = 0.25  # [m/s] and drives no faster


@dataclass(frozen=True, slots=True)
class AxisGoalCheckerParams(Parameters):
    """``axis_goal_checker.cpp`` of Nav2 main; directions are those of the path's end.

    Lyrical's takes the direction of the path's last piece, however short.
    """

    along_path_tolerance: Positive = 0.25  # [m]
    cross_track_tolerance: Positive = 0.25  # [m]
    path_length_tolerance: Positive = 1.0  # [m] of the plan that may be left
    # [m] to the goal, from which on a pose of the plan gives the direction
    direction_estimation_distance: Positive = 0.15
    is_overshoot_valid: bool = False  # anywhere beyond the goal is reached, too

    @property
    def xy_goal_tolerance(self) -> float:
        """The distance in [m] that other parts take for the tolerance (``getTolerances``)."""
        return min(self.along_path_tolerance, self.cross_track_tolerance)


@dataclass(frozen=True, slots=True)
class SimpleProgressCheckerParams(Parameters):
    """``simple_progress_checker.cpp``."""

    required_movement_radius: Quantity = 0.5  # [m] the robot must get so far
    movement_time_allowance: Quantity = 10.0  # [s] within this time


@dataclass(frozen=True, slots=True)
class PoseProgressCheckerParams(SimpleProgressCheckerParams):
    """``pose_progress_checker.cpp``."""

    required_movement_angle: Quantity = 0.5  # [rad] or turn so far

"""Parameters of regulated pure pursuit: names and defaults are those of Nav2 Jazzy."""

from dataclasses import dataclass
from typing import Annotated

from navstack.ranges import NotNegative, Parameters, Positive, Quantity, at_most, one_of, within

# Of a look ahead, which takes one step a cell: more keeps a cycle from ending.
MOST_SECONDS, MOST_METRES = 100.0, 100.0
Feedback = Annotated[str, one_of(("OPEN_LOOP", "CLOSED_LOOP"))]


@dataclass(frozen=True, slots=True)
class RppParams(Parameters, whose="regulated pure pursuit"):
    """``nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController``."""

    desired_linear_vel: Positive = 0.5  # [m/s] on a straight path in the open
    lookahead_dist: Positive = 0.6  # [m] to the carrot
    # lookaheads are measured along the path, as since Nav2 Lyrical; False: from the robot
    lookahead_along_path: bool = False
    min_lookahead_dist: Positive = 0.3  # [m] of the lookahead that grows with the speed
    max_lookahead_dist: Quantity = 0.9  # [m]
    lookahead_time: NotNegative = 1.5  # [s] by which the speed is multiplied
    # lookahead = speed * lookahead_time instead of lookahead_dist
    use_velocity_scaled_lookahead_dist: bool = False
    use_fixed_curvature_lookahead: bool = False  # steer by the point curvature_lookahead_dist ahead
    curvature_lookahead_dist: Positive = 0.6  # [m]
    # that point may lie beyond the goal, on the path's last direction
    interpolate_curvature_after_goal: bool = False
    # [m] along the path in which the robot is looked for; absent: half the local costmap's width;
    # negative: the whole path
    max_robot_pose_search_dist: Quantity | None = None

    use_regulated_linear_velocity_scaling: bool = True  # slow down where the curve is tight
    regulated_linear_scaling_min_radius: Positive = 0.9  # [m] of a curve that is not tight
    regulated_linear_scaling_min_speed: NotNegative = 0.25  # [m/s] that curves and costs leave
    use_cost_regulated_linear_velocity_scaling: bool = True  # slow down near obstacles
    cost_scaling_dist: Positive = 0.6  # [m] to the obstacle, from where on it slows down
    cost_scaling_gain: NotNegative = 1.0  # [-] below 1 slows down more
    # [1/m] that of the inflation layer: turns costs into distances; 0 or less: costs do not count
    inflation_cost_scaling_factor: Quantity = 3.0
    # [m] to the end of the path, from where on it slows down
    approach_velocity_scaling_dist: NotNegative = 0.6
    min_approach_linear_velocity: NotNegative = 0.05  # [m/s] that the approach leaves

    # turn on the spot to a path far off the heading, and to the goal's yaw
    use_rotate_to_heading: bool = True
    rotate_to_heading_min_angle: NotNegative = 0.785  # [rad] from which on it turns on the spot
    rotate_to_heading_angular_vel: Positive = 1.8  # [rad/s]
    max_angular_accel: Positive = 3.2  # [rad/s2] of turns on the spot
    # drive backwards to a carrot behind the robot, up to the path's next cusp
    allow_reversing: bool = False
    # once within the goal's tolerance, turn to its yaw even if the robot drifts out again
    stateful: bool = True

    # Nav2 main: command only what the limits below allow within a cycle
    use_dynamic_window: bool = False
    # its window is about the last command; CLOSED_LOOP: about the measured velocity
    velocity_feedback: Feedback = "OPEN_LOOP"
    min_linear_vel: Quantity = -0.5  # [m/s]
    max_angular_vel: Quantity = 2.5  # [rad/s]
    min_angular_vel: Quantity = -2.5  # [rad/s]
    max_linear_accel: Quantity = 2.5  # [m/s2]
    max_linear_decel: Quantity = -2.5  # [m/s2]
    max_angular_decel: Quantity = -3.2  # [rad/s2]

    use_collision_detection: bool = True  # look along the commanded arc
    # [s] looked ahead, at most up to the carrot
    max_allowed_time_to_collision_up_to_carrot: Annotated[float, within(0.0, MOST_SECONDS)] = 1.0
    # [m] looked ahead at least, however slow; 0 or less: no such distance
    min_distance_to_obstacle: Annotated[float, at_most(MOST_METRES)] = -1.0

    def _check_together(self) -> None:
        reaches, least = self.max_lookahead_dist >= self.min_lookahead_dist, self.min_lookahead_dist
        self._require("max_lookahead_dist", reaches, f"at least min_lookahead_dist ({least})")

    @property
    def regulates_by_cost(self) -> bool:
        """Whether obstacles slow the robot down."""
        return (
            self.use_cost_regulated_linear_velocity_scaling
            and self.inflation_cost_scaling_factor > 0.0
        )

"""Parameters of the graceful controller: names and defaults are those of Nav2 Jazzy."""

from dataclasses import dataclass, field
from typing import Annotated

from navstack.params.local_costs import LocalCosts
from navstack.ranges import NotNegative, Parameters, Positive, Quantity, at_least


@dataclass(frozen=True, slots=True)
class GracefulParams(Parameters, whose="graceful controller"):
    """``nav2_graceful_controller::GracefulController`` (``parameter_handler.cpp``)."""

    # [m] along the path to the nearest target, before the end comes into reach
    min_lookahead: NotNegative = 0.25
    max_lookahead: Positive = 1.0  # [m] to the farthest
    # [m] along the path in which the robot is looked for; absent: half the local costmap's width;
    # negative: the whole path
    max_robot_pose_search_dist: Quantity | None = None

    # [-] how fast the bearing converges against the distance; 0: only drives to the position
    k_phi: NotNegative = 2.0
    k_delta: NotNegative = 1.0  # [-] how much faster the steering converges than the bearing
    beta: NotNegative = 0.4  # [m^lambda] how much a curve slows down
    lambda_: NotNegative = 2.0  # [-] how sharply it does; ``lambda`` in a file
    v_linear_min: NotNegative = 0.1  # [m/s] on the way, however tight the curve
    v_linear_max: Positive = 0.5  # [m/s]
    v_angular_max: NotNegative = 1.0  # [rad/s]
    v_angular_min_in_place: NotNegative = 0.25  # [rad/s] of turns on the spot
    # [m] about the target, within which it slows down; 0: it does not
    slowdown_radius: NotNegative = 1.5

    initial_rotation: bool = True  # turn on the spot to a new path
    initial_rotation_tolerance: NotNegative = 0.75  # [rad] off the heading, from which on it does
    prefer_final_rotation: bool = True  # drive straight to a goal in reach, and turn there
    # [-] turns on the spot: rate = factor * angle * v_angular_max
    rotation_scaling_factor: NotNegative = 0.5
    # drive backwards to a target behind the robot; initial_rotation excludes it
    allow_backward: bool = False

    use_collision_detection: bool = True  # look for obstacles on the way to the target
    # [rad] between looks while turning at the goal; finer ones are never done
    in_place_collision_resolution: Annotated[float, at_least(1e-3)] = 0.1
    # read from the local costmap's section
    local_costs: LocalCosts = field(default_factory=LocalCosts)

    @property
    def may_reverse(self) -> bool:
        """Whether it drives backwards: with both Nav2 keeps the turn on the spot only."""
        return self.allow_backward and not self.initial_rotation

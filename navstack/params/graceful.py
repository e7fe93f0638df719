"""Parameters of the graceful controller: names and defaults are those of Nav2 Jazzy."""

from dataclasses import dataclass

from navstack.params.checks import check_signs

_WHOSE = "graceful controller"
_POSITIVE = "max_lookahead v_linear_max in_place_collision_resolution"
_NOT_NEGATIVE = """
    min_lookahead k_phi k_delta beta lambda_ v_linear_min v_angular_max v_angular_min_in_place slowdown_radius
    initial_rotation_tolerance rotation_scaling_factor
"""


@dataclass(frozen=True, slots=True)
class GracefulParams:
    """``nav2_graceful_controller::GracefulController`` (``parameter_handler.cpp``)."""

    min_lookahead: float = 0.25  # [m] along the path to the nearest target, before the end comes into reach
    max_lookahead: float = 1.0  # [m] to the farthest
    max_robot_pose_search_dist: float | None = None  # [m] along the path in which the robot is looked for
    # (absent: half the local costmap's width; negative: the whole path)

    k_phi: float = 2.0  # [-] how fast the bearing converges against the distance; 0: only drives to the position
    k_delta: float = 1.0  # [-] how much faster the steering converges than the bearing
    beta: float = 0.4  # [m^lambda] how much a curve slows down
    lambda_: float = 2.0  # [-] how sharply it does; ``lambda`` in a file
    v_linear_min: float = 0.1  # [m/s] on the way, however tight the curve
    v_linear_max: float = 0.5  # [m/s]
    v_angular_max: float = 1.0  # [rad/s]
    v_angular_min_in_place: float = 0.25  # [rad/s] of turns on the spot
    slowdown_radius: float = 1.5  # [m] about the target, within which it slows down; 0: it does not

    initial_rotation: bool = True  # turn on the spot to a new path
    initial_rotation_tolerance: float = 0.75  # [rad] off the heading, from which on it does
    prefer_final_rotation: bool = True  # drive straight to a goal in reach, and turn there
    rotation_scaling_factor: float = 0.5  # [-] turns on the spot: rate = factor * angle * v_angular_max
    allow_backward: bool = False  # drive backwards to a target behind the robot; initial_rotation excludes it

    use_collision_detection: bool = True  # look for obstacles on the way to the target
    in_place_collision_resolution: float = 0.1  # [rad] between looks while turning at the goal

    def __post_init__(self) -> None:
        check_signs(self, _POSITIVE, _NOT_NEGATIVE, _WHOSE)

    @property
    def may_reverse(self) -> bool:
        """Whether it drives backwards: where both are asked for, Nav2 keeps the turn on the spot."""
        return self.allow_backward and not self.initial_rotation

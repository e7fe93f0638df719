"""Parameters of the rotation shim.

Names and defaults are those of Nav2 Jazzy, read at ``FollowPath.*``.
"""

from dataclasses import dataclass
from typing import Annotated

from navstack.ranges import NotNegative, Parameters, Quantity, at_most


@dataclass(frozen=True, slots=True)
class RotationShimParams(Parameters):
    """``nav2_rotation_shim_controller::RotationShimController``."""

    primary_controller: str = ""  # plug-in that follows the path once the heading is right
    angular_dist_threshold: Quantity = 0.785  # [rad] heading error at which the shim starts to turn
    angular_disengage_threshold: Quantity = (
        0.3925  # [rad] heading error at which it hands over again
    )
    # [m] along the straight line to the path point that gives the heading
    forward_sampling_distance: Quantity = 0.5
    rotate_to_heading_angular_vel: Quantity = 1.8  # [rad/s]
    max_angular_accel: NotNegative = 3.2  # [rad/s2]
    # [s] of the turn that must be free of collisions; one look a control period
    simulate_ahead_time: Annotated[float, at_most(100.0)] = 1.0
    # [-] cost under the footprint from which on a turn would collide; 254: lethal or unknown
    max_cost_threshold: Quantity = 254.0
    # turn to the goal's yaw within the goal checker's xy tolerance
    rotate_to_goal_heading: bool = False
    rotate_to_heading_once: bool = False  # decide once per goal instead of once per plan
    closed_loop: bool = True  # accelerate from the measured yaw rate instead of the last command
    use_path_orientations: bool = False  # turn to the path point's yaw instead of its bearing

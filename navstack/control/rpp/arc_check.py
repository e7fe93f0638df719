"""Looks for obstacles along the arc that a command drives (``collision_checker.cpp``)."""

import math

from navstack.control.footprint_cost import is_occupied
from navstack.costmap.costmap import Costmap
from navstack.jit import njit
from navstack.params.rpp import RppParams
from navstack.types import ByteArray, FloatArray, Pose2D, Twist2D

SLOWEST_DRIVE = 0.01  # [m/s] slower commands count as turns on the spot ...
SLOWEST_TURN = 0.01  # [rad/s] ... if they turn faster than this


class ArcCheck:
    """Moves the footprint along the commanded arc, one cell at a time."""

    def __init__(self, params: RppParams, footprint: FloatArray, circumscribed_radius: float) -> None:
        """``footprint`` is the padded polygon (V, 2) in [m], base frame; ``circumscribed_radius`` its own, in [m]."""
        self._params = params
        self._footprint = footprint
        self._radius = circumscribed_radius

    def collides(self, command: Twist2D, pose: Pose2D, carrot_distance: float, costmap: Costmap) -> bool:
        """Whether the robot stands in an obstacle or would meet one on its way, at most up to the carrot [m]."""
        duration, distance = self._horizon(command.linear_x, carrot_distance)
        return bool(
            arc_collides(
                costmap.data,
                costmap.origin_x,
                costmap.origin_y,
                costmap.resolution,
                self._footprint,
                pose.x,
                pose.y,
                pose.yaw,
                command.linear_x,
                command.angular_z,
                self._time_step(command, costmap.resolution),
                duration,
                distance,
            )
        )

    def _time_step(self, command: Twist2D, resolution: float) -> float:
        """Time in [s] in which no point of the robot moves farther than one cell; inf at standstill."""
        if abs(command.linear_x) < SLOWEST_DRIVE and abs(command.angular_z) > SLOWEST_TURN:
            return 2.0 * math.sin(resolution / 2.0 / self._radius) / abs(command.angular_z)
        return resolution / abs(command.linear_x) if command.linear_x != 0.0 else math.inf

    def _horizon(self, speed: float, carrot_distance: float) -> tuple[float, float]:
        """How long in [s] and how far in [m] it looks ahead."""
        params = self._params
        duration, distance = params.max_allowed_time_to_collision_up_to_carrot, carrot_distance
        if params.min_distance_to_obstacle > 0.0:
            slowest = max(abs(speed), params.min_approach_linear_velocity)
            duration = max(duration, params.min_distance_to_obstacle / slowest) if slowest > 0.0 else math.inf
            if params.use_velocity_scaled_lookahead_dist:
                distance = min(max(distance, params.min_distance_to_obstacle), params.max_lookahead_dist)
        return duration, distance


@njit(
    cache=True,
    ahead="uint8[:, ::1], float64, float64, float64, float64[:, ::1], float64, float64, float64, float64, "
    "float64, float64, float64, float64",
)
def arc_collides(
    costs: ByteArray,
    origin_x: float,
    origin_y: float,
    resolution: float,
    footprint: FloatArray,
    x: float,
    y: float,
    yaw: float,
    speed: float,
    yaw_rate: float,
    time_step: float,
    duration: float,
    distance: float,
) -> bool:
    """Whether a footprint (V, 2) meets an obstacle while driving from (x, y, yaw).

    It looks at the start and after each ``time_step`` [s], for ``duration`` [s] or until it is ``distance`` [m] away.
    """
    if is_occupied(costs, origin_x, origin_y, resolution, footprint, x, y, yaw):
        return True
    start_x, start_y = x, y
    step = 1
    while step * time_step < duration:
        step += 1
        x += time_step * speed * math.cos(yaw)
        y += time_step * speed * math.sin(yaw)
        yaw += time_step * yaw_rate
        if math.hypot(x - start_x, y - start_y) > distance:
            break
        if is_occupied(costs, origin_x, origin_y, resolution, footprint, x, y, yaw):
            return True
    return False

"""Looks for obstacles along the arc that a command drives (``collision_checker.cpp``)."""

import math

from navstack.control.footprint_cost import is_occupied
from navstack.costmap.costmap import Costmap, Grid
from navstack.jit import njit
from navstack.params.rpp import RppParams
from navstack.types import ByteMatrix, FloatArray, FloatMatrix, Pose2D, Twist2D

SLOWEST_DRIVE = 0.01  # [m/s] slower commands count as turns on the spot ...
SLOWEST_TURN = 0.01  # [rad/s] ... if they turn faster than this


class ArcCheck:
    """Moves the footprint along the commanded arc, one cell at a time."""

    def __init__(
        self, params: RppParams, footprint: FloatArray, circumscribed_radius: float
    ) -> None:
        """``footprint`` is the padded polygon (V, 2) in [m], base frame.

        ``circumscribed_radius`` its own, in [m].
        """
        self._params = params
        self._footprint = footprint
        self._radius = circumscribed_radius

    def collides(
        self,
        command: Twist2D,
        pose: Pose2D,
        carrot_distance: float,
        costmap: Costmap,
    ) -> bool:
        """Whether the robot stands in an obstacle or would meet one, up to the carrot [m]."""
        start = (pose.x, pose.y, pose.yaw)
        speeds = (command.linear_x, command.angular_z)
        duration, distance = self._horizon(command.linear_x, carrot_distance)
        step = self._time_step(command, costmap.resolution)
        times = (step, min(duration, _lap(command) + step), distance)
        return bool(
            arc_collides(costmap.data, costmap.grid, self._footprint, start, speeds, *times)
        )

    def _time_step(self, command: Twist2D, resolution: float) -> float:
        """Time in [s] in which no point of the robot moves farther than one cell.

        Inf at standstill.
        """
        if abs(command.linear_x) < SLOWEST_DRIVE and abs(command.angular_z) > SLOWEST_TURN:
            half = min(resolution / 2.0 / self._radius, 0.5 * math.pi)
            return 2.0 * math.sin(half) / abs(command.angular_z)
        if command.linear_x == 0.0:
            return math.inf
        return resolution / abs(command.linear_x)

    def _horizon(self, speed: float, carrot_distance: float) -> tuple[float, float]:
        """How long in [s] and how far in [m] it looks ahead."""
        params = self._params
        duration = params.max_allowed_time_to_collision_up_to_carrot
        distance = carrot_distance
        if params.min_distance_to_obstacle > 0.0:
            slowest = max(abs(speed), params.min_approach_linear_velocity)
            if slowest > 0.0:
                duration = max(duration, params.min_distance_to_obstacle / slowest)
            else:
                duration = math.inf
            if params.use_velocity_scaled_lookahead_dist:
                distance = min(
                    max(distance, params.min_distance_to_obstacle), params.max_lookahead_dist
                )
        return duration, distance


def _lap(command: Twist2D) -> float:
    """Time in [s] of a full turn, after which the robot meets what it met before."""
    if command.angular_z == 0.0:
        return math.inf
    return 2.0 * math.pi / abs(command.angular_z)


@njit(ahead=True)
def arc_collides(
    costs: ByteMatrix,
    grid: Grid,
    footprint: FloatMatrix,
    start: tuple[float, float, float],
    speeds: tuple[float, float],
    time_step: float,
    duration: float,
    distance: float,
) -> bool:
    """Whether a footprint (V, 2) meets an obstacle from ``start`` (x, y, yaw) on.

    It drives at ``speeds`` [m/s, rad/s]. It looks at the start and after each ``time_step`` [s],
    for ``duration`` [s] or until it is ``distance`` [m] away.
    """
    (x, y, yaw) = start
    (speed, yaw_rate) = speeds
    if is_occupied(costs, grid, footprint, x, y, yaw):
        return True
    step = 1
    while step * time_step < duration:
        step += 1
        x += time_step * speed * math.cos(yaw)
        y += time_step * speed * math.sin(yaw)
        yaw += time_step * yaw_rate
        if math.hypot(x - start[0], y - start[1]) > distance:
            break
        if is_occupied(costs, grid, footprint, x, y, yaw):
            return True
    return False

"""The pose-following control law of Park and Kuipers (ICRA 2011), and where it leads.

After ``smooth_control_law.cpp``.
"""

import math
from typing import NamedTuple

from navstack.control.footprint_cost import is_centre_occupied, is_occupied
from navstack.costmap.costmap import Grid
from navstack.jit import njit
from navstack.types import ByteMatrix, FloatMatrix


class Law(NamedTuple):
    """Gains and limits; see ``GracefulParams``."""

    k_phi: float
    k_delta: float
    beta: float
    lambda_: float
    v_linear_min: float  # [m/s]
    v_linear_max: float  # [m/s]
    v_angular_max: float  # [rad/s]
    slowdown_radius: float  # [m]
    rotation_scaling_factor: float  # [-] of turns on the spot
    v_angular_min_in_place: float  # [rad/s] on the spot
    initial_rotation_tolerance: float  # [rad] within which a turn on the spot ends


class LocalGround(NamedTuple):
    """The local costmap, the robot on it and its footprint."""

    costs: ByteMatrix  # (rows, columns)
    grid: Grid
    footprint: FloatMatrix  # (V, 2) [m], base frame
    is_round: bool  # the cost of the robot's centre counts, not its footprint
    pose: tuple[float, float, float]  # [m], [m], [rad] of the robot, map frame


@njit()
def _normalized(angle: float) -> float:
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@njit()
def velocity_to(
    target: tuple[float, float, float], pose: tuple[float, float, float], backward: bool, law: Law
) -> tuple[float, float]:
    """Speed [m/s] and turn rate [rad/s] at a pose (x, y, yaw) towards a target pose.

    Equations 13 and 15 of the paper, on the distance and the angles of both headings to the line
    of sight.
    """
    dx = target[0] - pose[0]
    dy = target[1] - pose[1]
    distance = math.hypot(dx, dy)
    sight = math.atan2(dy, dx)
    if backward:
        sight -= math.pi
    phi = _normalized(target[2] - sight)
    delta = _normalized(pose[2] - sight)
    wanted = math.atan(-law.k_phi * phi)  # [rad] of the steering
    feedback = (1.0 + law.k_phi / (1.0 + (law.k_phi * phi) ** 2)) * math.sin(delta)
    curvature = 0.0
    if distance > 0.0:
        curvature = -(law.k_delta * (delta - wanted) + feedback) / distance
    if backward:
        curvature = -curvature
    speed = law.v_linear_max / (1.0 + law.beta * abs(curvature) ** law.lambda_)
    if law.slowdown_radius > 0.0:
        speed = min(speed, law.v_linear_max * distance / law.slowdown_radius)
    speed = min(max(speed, law.v_linear_min), law.v_linear_max)
    if backward:
        speed = -speed
    turn = min(max(curvature * speed, -law.v_angular_max), law.v_angular_max)
    if curvature != 0.0:
        speed = turn / curvature
    return speed, turn


@njit()
def turn_on_the_spot(angle: float, law: Law) -> float:
    """The rate in [rad/s] of a turn by ``angle`` [rad]."""
    rate = law.rotation_scaling_factor * angle * law.v_angular_max
    return math.copysign(max(abs(rate), law.v_angular_min_in_place), rate)


@njit()
def is_blocked(x: float, y: float, yaw: float, ground: LocalGround) -> bool:
    """Whether the robot meets an obstacle at a pose in the base frame (``inCollision``)."""
    cosine = math.cos(ground.pose[2])
    sine = math.sin(ground.pose[2])
    map_x = ground.pose[0] + cosine * x - sine * y
    map_y = ground.pose[1] + sine * x + cosine * y
    if ground.is_round:
        return is_centre_occupied(ground.costs, ground.grid, map_x, map_y)
    return is_occupied(
        ground.costs, ground.grid, ground.footprint, map_x, map_y, ground.pose[2] + yaw
    )


@njit(ahead=True)
def drive_to(
    target: tuple[float, float, float],
    backward: bool,
    turns_first: bool,
    looks: bool,
    law: Law,
    ground: LocalGround,
) -> tuple[bool, float, float]:
    """Simulate the drive to a target pose (x, y, yaw), base frame, one cell at a time.

    Args:
        target: where to, in [m] and [rad].
        backward: whether in reverse.
        turns_first: whether the robot first turns on the spot until it looks at the target.
        looks: whether obstacles stop it.
        law: gains and limits.
        ground: where obstacles are.

    Returns:
        Whether it gets there, or as far as three times the straight way; and the first speed and
        turn rate.
    """
    step = ground.grid[2] / law.v_linear_max  # [s]
    bearing = math.atan2(target[1], target[0])
    distance = math.hypot(target[0], target[1])
    steps = max(int(3.0 * distance / ground.grid[2]), 1)
    x = y = yaw = speed = turn = 0.0
    for i in range(steps):
        if turns_first:
            if i == 0:
                turn = turn_on_the_spot(bearing - yaw, law)
            turns_first = abs(bearing - yaw) >= law.initial_rotation_tolerance
            yaw += turn * step  # upstream, too, goes on with the first rate
        else:
            v, w = velocity_to(target, (x, y, yaw), backward, law)
            if i == 0:
                speed = v
                turn = w
            x += v * step * math.cos(yaw)
            y += v * step * math.sin(yaw)
            yaw += w * step
        if looks and is_blocked(x, y, yaw, ground):
            return False, speed, turn
        if math.hypot(target[0] - x, target[1] - y) <= ground.grid[2]:
            break
    return True, speed, turn


@njit(ahead=True)
def can_turn(angle: float, looks: int, ground: LocalGround) -> bool:
    """Whether the robot can turn on the spot by ``angle`` [rad], by that many looks on the way."""
    for i in range(1, looks + 1):
        if is_blocked(0.0, 0.0, angle * i / looks, ground):
            return False
    return True

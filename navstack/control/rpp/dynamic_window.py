"""Dynamic Window Pure Pursuit: the reachable velocity that keeps to the arc.

After F. Ohnishi, M. Takahashi, "Dynamic Window Pure Pursuit", and
``dynamic_window_pure_pursuit_functions.hpp`` of Nav2 main. In the plane of speed v and yaw rate w
what can be reached is a rectangle; the arc of curvature k is the line w = k v through the origin.
"""

import math
from typing import NamedTuple

from navstack.params.rpp import RppParams
from navstack.types import Twist2D

STILL = 1e-3  # [m/s, rad/s] below which a velocity has no direction
STRAIGHT = 1e-3  # [1/m] below which an arc is a line
TIE = 1e-3  # of distances to the line that count as equal


class VelocityWindow(NamedTuple):
    """What can be reached within a cycle."""

    min_v: float  # [m/s]
    max_v: float
    min_w: float  # [rad/s]
    max_w: float


def reachable(velocity: Twist2D, params: RppParams, period: float) -> VelocityWindow:
    """The window about a velocity; decelerations are negative, and count towards standstill.

    Args:
        velocity: that counts as the present one.
        params: limits of velocities and accelerations.
        period: of the control cycle [s].
    """
    v = _range(
        velocity.linear_x, params.max_linear_accel * period, params.max_linear_decel * period
    )
    w = _range(
        velocity.angular_z, params.max_angular_accel * period, params.max_angular_decel * period
    )
    return VelocityWindow(
        max(v[0], params.min_linear_vel),
        min(v[1], params.desired_linear_vel),
        max(w[0], params.min_angular_vel),
        min(w[1], params.max_angular_vel),
    )


def _range(now: float, faster: float, slower: float) -> tuple[float, float]:
    """The least and the greatest velocity of one axis; ``slower`` is negative."""
    if now > STILL:
        return now + slower, now + faster
    if now < -STILL:
        return now - faster, now - slower
    return now - faster, now + faster


def regulated(window: VelocityWindow, speed: float) -> VelocityWindow:
    """The window cut to speeds from standstill to ``speed`` [m/s], or its edge nearest to them."""
    least = min(0.0, speed)
    most = max(0.0, speed)
    low = max(window.min_v, least)
    high = min(window.max_v, most)
    if low > most:
        high = low
    elif low > high:
        low = high
    return window._replace(min_v=low, max_v=high)


def best_velocity(window: VelocityWindow, curvature: float, direction: float) -> Twist2D:
    """The fastest velocity of the window on the arc, or its corner that is nearest to it.

    Args:
        window: to choose from.
        curvature: of the arc [1/m].
        direction: 1 forwards, -1 backwards.
    """
    if abs(curvature) < STRAIGHT:
        v = window.max_v
        if direction < 0.0:
            v = window.min_v
        return Twist2D(v, 0.0, min(max(0.0, window.min_w), window.max_w))
    on_arc = [(v, curvature * v) for v in (window.min_v, window.max_v)]
    on_arc += [(w / curvature, w) for w in (window.min_w, window.max_w)]
    best = [
        (v, w)
        for v, w in on_arc
        if window.min_v <= v <= window.max_v and window.min_w <= w <= window.max_w
    ]
    if not best:
        corners = [
            (v, w) for v in (window.min_v, window.max_v) for w in (window.min_w, window.max_w)
        ]
        distances = [abs(curvature * v - w) / math.hypot(curvature, 1.0) for v, w in corners]
        nearest = min(distances) + TIE
        best = [corners[i] for i in range(4) if distances[i] <= nearest]
    v, w = max(best, key=lambda point: point[0] * direction)
    return Twist2D(v, 0.0, w)

"""Following the waypoints that a policy answers with.

Pure pursuit (Coulter 1992, CMU-RI-TR-92-01).
"""

import math

import numpy as np

from navstack.geometry import relative_to, transform_points
from navstack.types import FloatArray, Pose2D, Twist2D

LOOK_AHEAD = 0.8  # [m] to the point that is driven to, or the last waypoint where all are nearer
BEHIND = 1.2  # [rad] off the robot's heading from which it turns on the spot
TURN_GAIN, TURN_RATE = 2.0, 1.5  # [1/s], [rad/s] at most, of that turn
NEAR = 0.05  # [m] from the last waypoint at which it stands
STOPPING = 1.0  # [m/s2] with which it comes to rest at the last waypoint


class WaypointFollower:
    """Drives along waypoints that stay where they are in the odom frame."""

    def __init__(self, speed: float) -> None:
        """Follow nothing yet.

        Args:
            speed: [m/s] where nothing calls for less.
        """
        self._speed = speed
        self.clear()

    def clear(self) -> None:
        """Forget the waypoints."""
        self._points: FloatArray = np.empty((0, 2))

    def take(self, waypoints: FloatArray, at: Pose2D) -> None:
        """Follow new waypoints (k, 2) [m] in the base frame of a robot ``at`` a pose."""
        self._points = transform_points(at, waypoints)

    def follow(self, at: Pose2D) -> Twist2D:
        """The command of a robot ``at`` a pose of the odom frame."""
        if not len(self._points):
            return Twist2D()
        distances = np.hypot(self._points[:, 0] - at.x, self._points[:, 1] - at.y)
        nearest = int(distances.argmin())
        far = np.flatnonzero(distances[nearest:] >= LOOK_AHEAD)
        target = len(self._points) - 1
        if len(far):
            target = nearest + int(far[0])
        left = float(distances[-1])  # [m]
        if target == len(self._points) - 1 and left < NEAR:
            return Twist2D()
        x, y = self._points[target]
        aim = relative_to(at, Pose2D(float(x), float(y)))
        angle = math.atan2(aim.y, aim.x)
        if abs(angle) > BEHIND:
            return Twist2D(0.0, 0.0, min(max(TURN_GAIN * angle, -TURN_RATE), TURN_RATE))
        speed = min(self._speed, math.sqrt(2.0 * STOPPING * left))
        return Twist2D(speed, 0.0, speed * 2.0 * aim.y / max(aim.x**2 + aim.y**2, NEAR**2))

"""Odometry of logs that have it in ``tf`` only, where nav2_amcl reads it, too."""

import math
from typing import Any

from harness.recorded.mountings import frame_name, from_quaternion
from navstack.geometry import relative_to
from navstack.types import Odometry, Pose2D, Twist2D

ODOMETRY_FRAMES = ("odom", "odom_combined")
_LONGEST = 1.0  # [s] over which a velocity is taken
_FARTHEST = 1e7  # [m]

Edge = tuple[str, str]  # names of parent and child as the transforms spell them


def odometry_edge(message: Any) -> Edge | None:
    """Frames between which a ``tf2_msgs/TFMessage`` tells odometry; None: it does not."""
    for stamped in message.transforms:
        parent = stamped.header.frame_id
        if frame_name(parent).rsplit("/", 1)[-1] in ODOMETRY_FRAMES:
            return parent, stamped.child_frame_id
    return None


class MovingFrame:
    """Odometry from the transform between two frames; velocities from one to the next."""

    def __init__(self, edge: Edge) -> None:
        self._edge = edge
        self._last: Odometry | None = None

    def stamped(self, message: Any) -> Any | None:
        """The transform in a message; None: it has others only."""
        for stamped in message.transforms:
            if (stamped.header.frame_id, stamped.child_frame_id) == self._edge:
                return stamped
        return None

    def convert(self, message: Any, stamp: float) -> Odometry | None:
        """The odometry in a message; None: it holds no numbers."""
        stamped = self.stamped(message)
        if stamped is None:
            return None
        move = stamped.transform.translation
        turn = stamped.transform.rotation
        rotation = from_quaternion(turn.x, turn.y, turn.z, turn.w)
        if rotation is None or not (abs(move.x) <= _FARTHEST and abs(move.y) <= _FARTHEST):
            return None
        pose = Pose2D(move.x, move.y, math.atan2(rotation[1, 0], rotation[0, 0]))
        twist, last = Twist2D(), self._last
        if last is not None and 0.0 < stamp - last.stamp <= _LONGEST:
            way, dt = relative_to(last.pose, pose), stamp - last.stamp
            twist = Twist2D(way.x / dt, way.y / dt, way.yaw / dt)
        if last is None or stamp > last.stamp:
            self._last = Odometry(stamp, pose, twist)
        return Odometry(stamp, pose, twist)

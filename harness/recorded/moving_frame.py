"""Odometry of logs that have poses only: in ``tf``, or in messages whose velocities are unset."""

from typing import Any

import numpy as np

from harness.recorded.mountings import BASE_FRAMES, Transform, frame_name, from_quaternion
from navstack.geometry import relative_to
from navstack.types import Odometry, Pose2D, Twist2D

ODOMETRY_FRAMES = ("odom", "odom_combined")
_FARTHEST = 1e7  # [m]

Edge = tuple[str, str]  # names of parent and child as the transforms spell them


def odometry_edges(message: Any) -> list[Edge]:
    """Frames between which a ``tf2_msgs/TFMessage`` may have odometry."""
    return [
        (stamped.header.frame_id, stamped.child_frame_id)
        for stamped in message.transforms
        if _own_name(stamped.header.frame_id) in ODOMETRY_FRAMES
    ]


def is_of_base(edge: Edge, base: str | None) -> bool:
    """Whether what moves is the base: the frame that is given, or one with a usual name."""
    if base:
        return frame_name(edge[1]) == frame_name(base)
    return _own_name(edge[1]) in BASE_FRAMES


def _own_name(frame: str) -> str:
    """A frame's name without its prefix."""
    return frame_name(frame).rsplit("/", 1)[-1]


class MovingFrame:
    """The transform between two frames, one of which moves."""

    def __init__(self, edge: Edge) -> None:
        self._edge = edge

    @property
    def child(self) -> str:
        """The frame that moves."""
        return self._edge[1]

    def stamped(self, message: Any) -> Any | None:
        """The transform in a message; None: it has others only."""
        for stamped in message.transforms:
            if (stamped.header.frame_id, stamped.child_frame_id) == self._edge:
                return stamped
        return None

    def place(self, message: Any) -> Transform | None:
        """Where the child stands in the parent by a message; None: it holds no numbers."""
        stamped = self.stamped(message)
        if stamped is None:
            return None
        move, turn = stamped.transform.translation, stamped.transform.rotation
        rotation = from_quaternion(turn.x, turn.y, turn.z, turn.w)
        if rotation is None or not (abs(move.x) <= _FARTHEST and abs(move.y) <= _FARTHEST):
            return None
        return Transform(rotation, np.array((move.x, move.y, 0.0)))


class Motion:
    """Velocities from one pose to the next.

    As in robot_localization's differential mode, the first pose only begins, and the velocity after
    a gap is the mean one over it. What is not newer than the last gives no velocity and is passed
    over.
    """

    def __init__(self) -> None:
        self._last: tuple[float, Pose2D] | None = None  # [s], of the base

    def to(self, stamp: float, pose: Pose2D) -> Odometry | None:
        """The odometry of a base that stands there now.

        None: there is no newer pose than the last, or no last one.
        """
        last = self._last
        if last is not None and stamp <= last[0]:
            return None
        self._last = stamp, pose
        if last is None:
            return None
        way, dt = relative_to(last[1], pose), stamp - last[0]
        return Odometry(stamp, pose, Twist2D(way.x / dt, way.y / dt, way.yaw / dt))

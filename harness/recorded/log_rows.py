"""Messages of a log as rows of numbers."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from harness.recorded.bag import Message
from harness.recorded.clock import STILL_AFTER, Clock
from harness.recorded.messages import pose_of, stamp_of
from harness.recorded.receiver import Receiver
from harness.recorded.ros_messages import ODOMETRY, POSE_COVARIANCE, TWIST, decode
from navstack.types import FloatArray, GpsFix, Imu, LaserScan, Odometry, Pose2D

SWITCH, JOYSTICK = "std_msgs/msg/Bool", "sensor_msgs/msg/Joy"
_PUSHED = 0.1  # [-] of a joystick's way from which it is moved
_LARGEST = 1e3  # [m/s], [rad/s] beyond which a number is no command
_NOTHING = Pose2D()


@dataclass(slots=True)
class LogRows:
    """Rows of the streams as they are read."""

    by_kind: dict[str, list[tuple[float, ...]]] = field(default_factory=dict)
    scans: list[LaserScan] = field(default_factory=list)
    delays: dict[str, list[float]] = field(default_factory=dict)
    rests: dict[str, FloatArray] = field(default_factory=dict)  # axes of joysticks, by topic

    def add(self, kind: str, *row: float) -> None:
        """Enter a row."""
        self.by_kind.setdefault(kind, []).append(row)

    def forget(self, kind: str) -> None:
        """Leave a kind out, as if it had not been recorded."""
        self.by_kind.pop(kind, None)
        self.delays.pop(kind, None)


def take(
    rows: LogRows,
    kind: str,
    message: Message,
    receiver: Receiver,
    clock: Clock,
    offset: float,
) -> None:
    """Enter one message."""
    decoded, arrival = decode(message), message.arrival + offset
    if kind == TWIST:
        _take_command(rows, decoded, arrival)
    elif kind in (SWITCH, JOYSTICK):
        if _is_takeover(rows, message.topic.name, kind, decoded):
            rows.add(SWITCH, arrival)
    else:
        _take_measured(rows, kind, message, decoded, receiver, clock, arrival)


def _take_measured(
    rows: LogRows,
    kind: str,
    message: Message,
    decoded: Any,
    receiver: Receiver,
    clock: Clock,
    arrival: float,
) -> None:
    """Enter a message that says when it was measured."""
    measured_at = receiver.stamp_of(kind, decoded)
    if measured_at is None:
        return
    still_after = STILL_AFTER.get(kind, 0.0)
    stamp = clock.take(message.topic.name, message.arrival, measured_at, still_after)
    if kind == POSE_COVARIANCE:
        if (place := pose_of(decoded)) is not None:
            rows.add(kind, stamp, *place)
        return
    measured = receiver.convert(kind, decoded, stamp, _NOTHING)
    if measured is None:
        return
    if isinstance(measured, Odometry):
        kind = ODOMETRY  # transforms may tell it, too
    rows.delays.setdefault(kind, []).append(arrival - stamp)
    match measured:
        case Odometry():
            at, twist = measured.pose, measured.twist
            rows.add(kind, stamp, at.x, at.y, at.yaw, twist.linear_x, twist.angular_z)
        case Imu():
            force = measured.linear_acceleration_x, measured.linear_acceleration_y
            rows.add(kind, stamp, measured.yaw, measured.angular_velocity_z, *force)
        case GpsFix():
            rows.add(kind, stamp, measured.x, measured.y, measured.position_std)
        case LaserScan():
            rows.scans.append(measured)


def _take_command(rows: LogRows, decoded: Any, arrival: float) -> None:
    """Enter a command, as sent when it was recorded."""
    twist = getattr(decoded, "twist", decoded)
    speed, turn = float(twist.linear.x), float(twist.angular.z)
    if abs(speed) <= _LARGEST and abs(turn) <= _LARGEST:
        rows.add(TWIST, arrival, speed, turn)
        is_stamped = hasattr(decoded, "header")
        if is_stamped and (stamp := stamp_of(decoded)):
            rows.delays.setdefault(TWIST, []).append(arrival - stamp)


def _is_takeover(rows: LogRows, topic: str, kind: str, decoded: Any) -> bool:
    """Whether a message says that a person drives or stops the robot."""
    if kind == SWITCH:
        return bool(decoded.data)
    axes, buttons = np.asarray(decoded.axes, dtype=np.float64), np.asarray(decoded.buttons)
    rest = rows.rests.setdefault(topic, _rest(axes))
    if rest.shape != axes.shape:
        rest = _rest(axes)
    return bool((np.abs(axes - rest) > _PUSHED).any() or buttons.any())


def _rest(axes: FloatArray) -> FloatArray:
    """Axes (N,) of a joystick that nobody touches, by its first message.

    Triggers rest at one end of their way, sticks in the middle.
    """
    found: FloatArray = np.where(np.abs(axes) == 1.0, axes, 0.0)
    return found

"""A recorded drive as arrays: commands, odometry, inertial unit, fixes and scans."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from harness.recorded.bag import Bag, Message
from harness.recorded.bag_file import BagError, DamageError
from harness.recorded.clock import STILL_AFTER, Clock
from harness.recorded.mountings import BASE_FRAMES, Mountings, frame_name
from harness.recorded.receiver import Receiver
from harness.recorded.ros_messages import (
    COMMAND_TYPES,
    FIX,
    IMU,
    ODOMETRY,
    SCAN,
    TWIST,
    TYPES,
    decode,
    first_messages,
)
from harness.recorded.sources import read_transforms
from harness.recorded.topics import Topics
from navstack.types import FloatArray, GpsFix, Imu, LaserScan, Odometry, Pose2D

LOG_TYPES = TYPES | frozenset(COMMAND_TYPES)
OTHER_CLOCK = 5.0  # [s] between stamps and arrivals from which both are of different clocks
_FIRST = 50  # messages of a topic from which its clock is told
_FASTEST = 30.0  # [m/s] beyond which a step of the odometry is a jump
_JUMPS = 0.1  # [-] share of such steps in which two publishers take turns
_LARGEST = 1e3  # [m/s], [rad/s] beyond which a number is no command
_NOTHING = Pose2D()

Say = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class LogRequest:
    """Which log to read, and how."""

    bags: tuple[Path, ...]
    static_tf: tuple[str, ...] = ()
    remap: tuple[str, ...] = ()
    base_frame: str | None = None


@dataclass(slots=True, eq=False)
class DriveLog:
    """What a log holds; rows in the order of their stamps, each stamp once.

    The first column is the stamp in [s], less ``start``. A sensor that is missing has no rows.
    """

    start: float  # [s] that is taken from every stamp
    commands: FloatArray  # (N, 3) [s], forward [m/s], yaw rate [rad/s]; when it was sent
    odometry: FloatArray  # (N, 6) [s], x, y [m], yaw [rad], forward [m/s], yaw rate [rad/s]
    imu: FloatArray  # (N, 5) [s], yaw [rad] or nan, yaw rate [rad/s], ax, ay [m/s2], base frame
    fixes: FloatArray  # (N, 4) [s], x, y [m] in a local frame, stated deviation [m] or 0
    scans: list[LaserScan]  # their stamps less ``start``
    delays: dict[str, FloatArray]  # [s] arrival less stamp of each message, by kind
    has_mounting: bool  # of the lidar, in the log or from the user
    topics: dict[str, str]  # what was read: topic by kind
    files: str  # as the user named them

    @property
    def duration(self) -> float:
        """[s] from the first to the last message of odometry."""
        if not len(self.odometry):
            return 0.0
        return float(self.odometry[-1, 0] - self.odometry[0, 0])


@dataclass(slots=True)
class _Rows:
    """Rows of the streams as they are read."""

    by_kind: dict[str, list[tuple[float, ...]]] = field(default_factory=dict)
    scans: list[LaserScan] = field(default_factory=list)
    delays: dict[str, list[float]] = field(default_factory=dict)

    def add(self, kind: str, *row: float) -> None:
        """Enter a row."""
        self.by_kind.setdefault(kind, []).append(row)


def read_log(request: LogRequest, say: Say) -> DriveLog:
    """Read a log.

    Args:
        request: files and frames.
        say: takes warnings.

    Raises:
        InputError: the log cannot be used, or has no odometry.
    """
    mountings = Mountings()
    for text in request.static_tf:
        mountings.give(text)
    with Bag(request.bags, LOG_TYPES) as bag:
        topics = Topics(bag.topics, bag.counts(), request.remap)
        chosen = _choose(bag, topics)
        read_transforms(bag, topics, mountings)
        frame = _one_frame(bag, chosen[ODOMETRY])
        receiver = Receiver(mountings, request.base_frame, frame, None, 0.0, say)
        rows = _read(bag, chosen, receiver, say)
        bases = [frame_name(each) for each in (request.base_frame, frame, *BASE_FRAMES) if each]
        has_mounting = SCAN in chosen and _is_mounted(bag, chosen[SCAN], mountings, bases)
        damage = bag.damage
    if damage:
        say(f"{damage}; what stands before it is used")
    return _assemble(rows, chosen, has_mounting, request)


def _choose(bag: Bag, topics: Topics) -> dict[str, str]:
    """The topics to read by kind."""
    counts = bag.counts()
    chosen = {}
    for kind in (TWIST, ODOMETRY, IMU, FIX, SCAN):
        name = topics.find(kind, None)
        if name is not None and counts[name] > 0:
            chosen[kind] = name
    if ODOMETRY not in chosen:
        where = "the bag"
        if bag.damage:
            where = f"{bag.damage}; what stands before that"
        listed = [f"{name} ({kind})" for name, kind in sorted(bag.topics.items())[:20]]
        raise BagError(
            f"{where} has no message of nav_msgs/msg/Odometry, which everything is measured "
            f"with; record /odom as well. It has: {', '.join(listed) or 'no topic'}"
        )
    return chosen


def _one_frame(bag: Bag, topic: str) -> str | None:
    """The frame that the odometry is of.

    Raises:
        BagError: two nodes publish on the topic.
    """
    frames = {message.child_frame_id for _, message in first_messages(bag, topic, _FIRST)}
    if len(frames) > 1:
        names = " and ".join(repr(name) for name in sorted(frames)[:2])
        raise BagError(
            f"topic {topic} has two publishers, with the child frames {names}; record one of "
            "them on a topic of its own"
        )
    return next(iter(frames), None)


def _is_mounted(bag: Bag, topic: str, mountings: Mountings, bases: Sequence[str]) -> bool:
    """Whether the log or the user says where the lidar is."""
    for _, message in first_messages(bag, topic, 1):
        frame = frame_name(message.header.frame_id)
        return mountings.find_from_any(bases, frame) is not None
    return False


def _read(bag: Bag, chosen: dict[str, str], receiver: Receiver, say: Say) -> _Rows:
    """All messages of the chosen topics, up to the first that cannot be read."""
    rows = _Rows()
    offset = _offset(bag, chosen, receiver)
    clock = Clock(offset)
    kinds = {name: kind for kind, name in chosen.items()}
    try:
        for place in bag.places(set(chosen.values())):
            message = bag.read(place)
            _take(rows, kinds[message.topic.name], message, receiver, clock, offset)
    except DamageError as error:
        say(f"{error}; what stands before it is used")
    for topic, seconds in clock.jumps.items():
        say(f"stamps of {topic} jump by {seconds:.3f} s; taken to run on from there")
    for topic, count in clock.replaced.items():
        say(f"{count} messages of {topic} have unset or foreign stamps; their arrival is taken")
    for kind, count in receiver.left_out.items():
        say(f"{count} messages of {kind.rsplit('/', 1)[-1]} hold nothing usable; left out")
    return rows


def _offset(bag: Bag, chosen: dict[str, str], receiver: Receiver) -> float:
    """[s] from arrivals to stamps; 0 where both are of one clock, delays apart.

    Raises:
        BagError: the sensors' clocks differ.
    """
    offsets = {}
    for kind, name in chosen.items():
        if kind == TWIST:
            continue
        known = []
        for message, decoded in first_messages(bag, name, _FIRST):
            stamp = receiver.stamp_of(kind, decoded)
            if stamp:
                known.append(stamp - message.arrival)
        if known:
            offsets[name] = median(known)
    spread = max(offsets.values(), default=0.0) - min(offsets.values(), default=0.0)
    if spread > OTHER_CLOCK:
        least, most = min(offsets, key=offsets.__getitem__), max(offsets, key=offsets.__getitem__)
        raise BagError(
            f"the stamps of {least} and {most} are of clocks {spread:.1f} s apart; set the "
            "sensors' clocks (chrony, PTP) and record again"
        )
    found = median(offsets.values()) if offsets else 0.0
    if abs(found) < OTHER_CLOCK:
        return 0.0
    return found


def _take(
    rows: _Rows, kind: str, message: Message, receiver: Receiver, clock: Clock, offset: float
) -> None:
    """Enter one message."""
    decoded, arrival = decode(message), message.arrival + offset
    if kind == TWIST:
        _take_command(rows, decoded, arrival)
        return
    measured_at = receiver.stamp_of(kind, decoded)
    if measured_at is None:
        return
    still_after = STILL_AFTER.get(kind, 0.0)
    stamp = clock.take(message.topic.name, message.arrival, measured_at, still_after)
    measured = receiver.convert(kind, decoded, stamp, _NOTHING)
    if measured is None:
        return
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


def _take_command(rows: _Rows, decoded: Any, arrival: float) -> None:
    """Enter a command, as sent when it was recorded."""
    twist = getattr(decoded, "twist", decoded)
    speed, turn = float(twist.linear.x), float(twist.angular.z)
    if abs(speed) <= _LARGEST and abs(turn) <= _LARGEST:
        rows.add(TWIST, arrival, speed, turn)


def _assemble(
    rows: _Rows, chosen: dict[str, str], has_mounting: bool, request: LogRequest
) -> DriveLog:
    columns = {TWIST: 3, ODOMETRY: 6, IMU: 5, FIX: 4}
    arrays = {kind: _sorted(rows.by_kind.get(kind, []), n) for kind, n in columns.items()}
    if not len(arrays[ODOMETRY]):
        raise BagError(f"no message of {chosen[ODOMETRY]} holds anything usable")
    _require_one_publisher(arrays[ODOMETRY], chosen[ODOMETRY])
    _fill_twist(arrays[ODOMETRY])
    start = float(arrays[ODOMETRY][0, 0])
    for array in arrays.values():
        array[:, 0] -= start
    scans = sorted(rows.scans, key=lambda scan: scan.stamp)
    return DriveLog(
        start,
        arrays[TWIST],
        arrays[ODOMETRY],
        arrays[IMU],
        arrays[FIX],
        [replace(scan, stamp=scan.stamp - start) for scan in scans],
        {kind: np.array(values) for kind, values in rows.delays.items()},
        has_mounting,
        chosen,
        ", ".join(map(str, request.bags)),
    )


def _sorted(rows: Sequence[tuple[float, ...]], columns: int) -> FloatArray:
    """Rows by stamp; of repeated stamps the first."""
    array = np.array(rows, dtype=np.float64).reshape(-1, columns)
    array = array[np.argsort(array[:, 0], kind="stable")]
    return array[np.diff(array[:, 0], prepend=-math.inf) > 0.0]


def _require_one_publisher(odometry: FloatArray, topic: str) -> None:
    """Refuse odometry that jumps to and fro.

    Raises:
        BagError: it does.
    """
    steps = np.hypot(np.diff(odometry[:, 1]), np.diff(odometry[:, 2]))
    is_jump = steps > 0.05 + _FASTEST * np.diff(odometry[:, 0])
    if len(steps) > 10 and is_jump.mean() > _JUMPS:
        raise BagError(
            f"the poses of {topic} jump in {is_jump.mean():.0%} of its messages, as where two "
            "nodes publish on one topic; record one of them on a topic of its own"
        )


def _fill_twist(odometry: FloatArray) -> None:
    """Where a driver leaves the twist out: from the poses, in place."""
    if len(odometry) < 3 or np.any(odometry[:, 4:]):
        return
    stamps, yaw = odometry[:, 0], np.unwrap(odometry[:, 3])
    vx, vy = np.gradient(odometry[:, 1], stamps), np.gradient(odometry[:, 2], stamps)
    odometry[:, 4] = np.cos(yaw) * vx + np.sin(yaw) * vy
    odometry[:, 5] = np.gradient(yaw, stamps)

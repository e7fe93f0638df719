"""A recorded drive as arrays: commands, odometry, inertial unit, fixes and scans."""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

import numpy as np

from harness.recorded.bag import Bag
from harness.recorded.bag_file import BagError, DamageError
from harness.recorded.clock import Clock
from harness.recorded.log_rows import JOYSTICK, SWITCH, LogRows, take
from harness.recorded.mountings import Mountings
from harness.recorded.receiver import Receiver
from harness.recorded.ros_messages import (
    COMMAND_TYPES,
    FIX,
    IMU,
    ODOMETRY,
    POSE_COVARIANCE,
    SCAN,
    TWIST,
    TYPES,
    first_messages,
)
from harness.recorded.sources import read_transforms
from harness.recorded.topics import Topics
from navstack.types import FloatArray, LaserScan

LOG_TYPES = TYPES | frozenset((*COMMAND_TYPES, SWITCH, JOYSTICK))
_TAKEOVER = re.compile(r"e_?stop|emergency|manual|teleop|intervention|takeover", re.IGNORECASE)
_APART = 5.0  # [s] between two takeovers
OTHER_CLOCK = 5.0  # [s] between stamps and arrivals from which both are of different clocks
_FEWEST = 10  # messages of odometry
_FIRST = 50  # messages of a topic from which its clock is told
_FASTEST = 30.0  # [m/s] beyond which a step of the odometry is a jump
_JUMPS = 0.1  # [-] share of such steps in which two publishers take turns

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
    poses: FloatArray  # (N, 4) [s], x, y [m], yaw [rad] where a localizer believed to be, map frame
    takeovers: FloatArray  # (N,) [s] when a person took over, by buttons and switches
    scans: list[LaserScan]  # their stamps less ``start``
    delays: dict[str, FloatArray]  # [s] arrival less stamp of each message, by kind
    has_mounting: bool  # of the lidar, in the log or from the user
    topics: dict[str, str]  # what was read: topic by kind
    files: str  # as the user named them

    @property
    def stamps(self) -> FloatArray:
        """[s] of the odometry, (N,)."""
        return self.odometry[:, 0]

    @property
    def yaws(self) -> FloatArray:
        """[rad] of the odometry without jumps of a turn, (N,)."""
        return np.unwrap(self.odometry[:, 3])

    @property
    def speeds(self) -> FloatArray:
        """[m/s] forward by the odometry, (N,)."""
        return self.odometry[:, 4]

    @property
    def yaw_rates(self) -> FloatArray:
        """[rad/s] by the odometry, (N,)."""
        return self.odometry[:, 5]

    @property
    def imu_stamps(self) -> FloatArray:
        """[s] of the inertial unit, (N,)."""
        return self.imu[:, 0]

    @property
    def gyro_rates(self) -> FloatArray:
        """[rad/s] yaw rates of the gyro, (N,)."""
        return self.imu[:, 2]

    @property
    def duration(self) -> float:
        """[s] from the first to the last message of odometry."""
        if not len(self.odometry):
            return 0.0
        return float(self.stamps[-1] - self.stamps[0])


def period_of(stamps: FloatArray) -> float:
    """[s] between stamps (N,), the median; 0 where there are fewer than two."""
    if len(stamps) < 2:
        return 0.0
    return float(np.median(np.diff(stamps)))


def read_log(
    request: LogRequest, say: Say, update: Callable[[float], None] = lambda share: None
) -> DriveLog:
    """Read a log.

    Args:
        request: files and frames.
        say: takes notes.
        update: hears of the share of its messages that is read.

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
        rows = _read(bag, chosen, receiver, say, update)
        has_mounting = SCAN in chosen and _is_mounted(bag, chosen[SCAN], receiver)
        damage = bag.damage
    if damage:
        say(f"{damage}; what stands before it is used")
    return _assemble(rows, chosen, has_mounting, request)


def _choose(bag: Bag, topics: Topics) -> dict[str, str]:
    """The topics to read by kind."""
    counts = bag.counts()
    chosen = {}
    for kind in (TWIST, ODOMETRY, IMU, FIX, SCAN, POSE_COVARIANCE):
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


def _is_mounted(bag: Bag, topic: str, receiver: Receiver) -> bool:
    """Whether the log or the user says where the lidar is."""
    for _, message in first_messages(bag, topic, 1):
        return receiver.is_mounted(SCAN, message.header.frame_id)
    return False


def _read(
    bag: Bag,
    chosen: dict[str, str],
    receiver: Receiver,
    say: Say,
    update: Callable[[float], None],
) -> LogRows:
    """All messages of the chosen topics, up to the first that cannot be read."""
    rows = LogRows()
    offset = _offset(bag, chosen, receiver)
    clock = Clock(offset)
    kinds = {name: kind for kind, name in chosen.items()}
    kinds |= _switches(bag)
    counts = bag.counts()
    total = sum(counts[name] for name in kinds)
    try:
        for number, place in enumerate(bag.places(set(kinds))):
            update(number / max(total, number + 1))
            message = bag.read(place)
            take(rows, kinds[message.topic.name], message, receiver, clock, offset)
    except DamageError as error:
        say(f"{error}; what stands before it is used")
    for line in receiver.notes(clock):
        say(line)
    return rows


def _switches(bag: Bag) -> dict[str, str]:
    """Topics by which people take over, with their types."""
    return {
        name: kind
        for name, kind in bag.topics.items()
        if kind == JOYSTICK or (kind == SWITCH and _TAKEOVER.search(name))
    }


def _offset(bag: Bag, chosen: dict[str, str], receiver: Receiver) -> float:
    """[s] from arrivals to stamps; 0 where both are of one clock, delays apart.

    Raises:
        BagError: the sensors' clocks differ.
    """
    offsets = {}
    for kind, name in chosen.items():
        if kind in (TWIST, POSE_COVARIANCE):
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


def _assemble(
    rows: LogRows,
    chosen: dict[str, str],
    has_mounting: bool,
    request: LogRequest,
) -> DriveLog:
    columns = {TWIST: 3, ODOMETRY: 6, IMU: 5, FIX: 4, POSE_COVARIANCE: 4, SWITCH: 1}
    arrays = {kind: _sorted(rows.by_kind.get(kind, []), n) for kind, n in columns.items()}
    if len(arrays[ODOMETRY]) < _FEWEST:
        raise BagError(
            f"{chosen[ODOMETRY]} has {len(arrays[ODOMETRY])} usable messages of odometry; a drive "
            f"has {_FEWEST} or more"
        )
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
        arrays[POSE_COVARIANCE],
        _apart(arrays[SWITCH][:, 0]),
        [replace(scan, stamp=scan.stamp - start) for scan in scans],
        {kind: np.array(values) for kind, values in rows.delays.items()},
        has_mounting,
        chosen,
        ", ".join(map(str, request.bags)),
    )


def _apart(stamps: FloatArray) -> FloatArray:
    """The first stamp of each takeover, whose messages repeat."""
    first: FloatArray = stamps[np.diff(stamps, prepend=-math.inf) > _APART]
    return first


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

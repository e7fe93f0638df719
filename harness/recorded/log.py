"""A recorded drive from its files: which topics are read, and their rows."""

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
from harness.recorded.drive_log import DriveLog, Pauses, are_jumps, jumps_of
from harness.recorded.log_rows import JOYSTICK, SWITCH, LogRows, take
from harness.recorded.mountings import Mountings
from harness.recorded.moving_frame import Edge
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
from harness.recorded.sources import moving_frame, note_of_edge, read_transforms
from harness.recorded.topics import Topics
from navstack.types import FloatArray, LaserScan

LOG_TYPES = TYPES | frozenset((*COMMAND_TYPES, SWITCH, JOYSTICK))
_TAKEOVER = re.compile(r"e_?stop|emergency|manual|teleop|intervention|takeover", re.IGNORECASE)
_COMMANDS = re.compile(r"cmd|command|teleop|joy|twist_mux|key_vel", re.IGNORECASE)
_APART = 5.0  # [s] between two takeovers
OTHER_CLOCK = 5.0  # [s] between stamps and arrivals from which both are of different clocks
_FEWEST = 10  # messages of odometry
_FIRST = 50  # messages of a topic from which its clock is told
_JUMPS = 0.1  # [-] share of such steps in which two publishers take turns

Say = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class LogRequest:
    """Which log to read, and how."""

    bags: tuple[Path, ...]
    static_tf: tuple[str, ...] = ()
    remap: tuple[str, ...] = ()
    base_frame: str | None = None


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
        chosen, edge = _choose(bag, topics, request.base_frame, say)
        read_transforms(bag, topics, mountings)
        if edge is None:
            frame = _one_frame(bag, chosen[ODOMETRY])
        else:
            frame = edge[1]
            say(note_of_edge(chosen[ODOMETRY], edge))
        receiver = Receiver(mountings, request.base_frame, frame, None, 0.0, say, edge)
        rows = _read(bag, chosen, receiver, say, update)
        has_mounting = SCAN in chosen and _is_mounted(bag, chosen[SCAN], receiver)
        damage = bag.damage
    if damage:
        say(f"{damage}; what stands before it is used")
    log = _assemble(rows, chosen, has_mounting, request, say)
    log.antenna = receiver.antenna
    return log


def _choose(
    bag: Bag, topics: Topics, base: str | None, say: Say
) -> tuple[dict[str, str], Edge | None]:
    """The topics to read by kind, and between which frames transforms tell the odometry.

    Raises:
        BagError: nothing does.
    """
    counts = bag.counts()
    chosen = {}
    for kind in (TWIST, ODOMETRY, IMU, FIX, SCAN, POSE_COVARIANCE):
        name = topics.find(kind, None)
        if name is None or counts[name] == 0:
            continue
        if kind == TWIST and not (_COMMANDS.search(name) or topics.is_chosen(name)):
            say(
                f"{name} is not taken for commands, as its name says nothing of the kind; "
                f"if they are, give --remap /cmd_vel:={name}"
            )
            continue
        chosen[kind] = name
    if ODOMETRY not in chosen and (moving := moving_frame(bag, topics, base)) is not None:
        chosen[ODOMETRY] = moving[0]
        return chosen, moving[1]
    if ODOMETRY not in chosen:
        where = "the bag"
        if bag.damage:
            where = f"{bag.damage}; what stands before that"
        listed = [f"{name} ({kind})" for name, kind in sorted(bag.topics.items())[:20]]
        raise BagError(
            f"{where} has no message of nav_msgs/msg/Odometry, which everything is measured "
            f"with; record /odom as well. It has: {', '.join(listed) or 'no topic'}"
        )
    return chosen, None


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
    kinds = {name: _read_as(bag, kind, name) for kind, name in chosen.items()}
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
    if receiver.doubt:  # gravity would count as a push
        say("the inertial unit is left out, until its mounting is given")
        rows.forget(IMU)
    return rows


def _read_as(bag: Bag, kind: str, name: str) -> str:
    """The type as which a topic that is chosen for a kind is read: transforms as what they are."""
    if kind == ODOMETRY:
        return bag.topics[name]
    return kind


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
            stamp = receiver.stamp_of(_read_as(bag, kind, name), decoded)
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
    say: Say,
) -> DriveLog:
    columns = {TWIST: 3, ODOMETRY: 6, IMU: 5, FIX: 4, POSE_COVARIANCE: 4, SWITCH: 1}
    arrays = {kind: _sorted(rows.by_kind.get(kind, []), n) for kind, n in columns.items()}
    if len(arrays[ODOMETRY]) < _FEWEST:
        raise BagError(
            f"{chosen[ODOMETRY]} has {len(arrays[ODOMETRY])} usable messages of odometry; a drive "
            f"has {_FEWEST} or more"
        )
    _require_one_publisher(arrays[ODOMETRY], chosen[ODOMETRY])
    if _fill_twist(arrays[ODOMETRY]):
        say(f"{chosen[ODOMETRY]} has no velocities; taken from its poses")
    if jumps := int(jumps_of(arrays[ODOMETRY]).sum()):
        say(f"the odometry jumps {jumps} times, as where it begins anew; nothing is driven there")
    start = float(arrays[ODOMETRY][0, 0])
    for array in arrays.values():
        array[:, 0] -= start
    scans = sorted(rows.scans, key=lambda scan: scan.stamp)
    scans = [replace(scan, stamp=scan.stamp - start) for scan in scans]
    pauses = Pauses.between(arrays[ODOMETRY][:, 0])
    if len(pauses.begins):
        say(pauses.note())
        switches = arrays[SWITCH]  # whose robot may be without power
        switches[:, 0] = pauses.at_begins(switches[:, 0])
        arrays = {kind: _without(pauses, array) for kind, array in arrays.items()}
        scans = _scans_without(pauses, scans)
    return DriveLog(
        start,
        arrays[TWIST],
        arrays[ODOMETRY],
        arrays[IMU],
        arrays[FIX],
        arrays[POSE_COVARIANCE],
        _apart(arrays[SWITCH][:, 0]),
        scans,
        {kind: np.array(values) for kind, values in rows.delays.items()},
        has_mounting,
        chosen,
        ", ".join(map(str, request.bags)),
        pauses.taken_out(pauses.ends),
    )


def _without(pauses: Pauses, rows: FloatArray) -> FloatArray:
    """Rows with the stamp first, by the time that pauses leave."""
    kept = rows[pauses.leave(rows[:, 0])]
    kept[:, 0] = pauses.taken_out(kept[:, 0])
    return kept


def _scans_without(pauses: Pauses, scans: list[LaserScan]) -> list[LaserScan]:
    stamps = np.array([scan.stamp for scan in scans])
    times = pauses.taken_out(stamps).tolist()
    kept = pauses.leave(stamps).tolist()
    return [
        replace(scan, stamp=time)
        for scan, time, is_kept in zip(scans, times, kept, strict=True)
        if is_kept
    ]


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
    is_jump = are_jumps(odometry)
    if len(is_jump) > 10 and is_jump.mean() > _JUMPS:
        raise BagError(
            f"the poses of {topic} jump in {is_jump.mean():.0%} of its messages, as where two "
            "nodes publish on one topic; record one of them on a topic of its own"
        )


def _fill_twist(odometry: FloatArray) -> bool:
    """Where a driver leaves the twist out: from the poses, in place; whether that was so.

    Beside a jump of the poses the twist is that before and after.
    """
    if len(odometry) < 3 or np.any(odometry[:, 4:]):
        return False
    stamps, yaw = odometry[:, 0], np.unwrap(odometry[:, 3])
    vx, vy = np.gradient(odometry[:, 1], stamps), np.gradient(odometry[:, 2], stamps)
    is_jump = are_jumps(odometry)
    is_sound = ~(np.append(is_jump, False) | np.insert(is_jump, 0, False))
    if not is_sound.any():
        return False
    for column, twist in ((4, np.cos(yaw) * vx + np.sin(yaw) * vy), (5, np.gradient(yaw, stamps))):
        odometry[:, column] = np.interp(stamps, stamps[is_sound], twist[is_sound])
    return bool(np.any(odometry[:, 4:]))

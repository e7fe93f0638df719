"""Bags written with rosbags, and a drive through the sidewalk world of which the truth is known."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from harness.recorded.bag import Message
from harness.recorded.bag_file import Topic
from harness.recorded.ros_messages import FIX, IMU, ODOMETRY, POSE, SCAN, TRANSFORMS, decode
from harness.recorded.start import static_map
from harness.world.sensors.lidar import Lidar, LidarParams, SelfFilter
from navstack.geometry import compose
from navstack.types import Pose2D

START = 1_700_000_000.0  # [s] of the first message
FROM = Pose2D(31.15, -44.1, 3.0)  # where the drive begins: 2.9 m from anything all the way
DATUM = (37.4, -122.1)  # [deg]
FORMATS = (
    "ros1",
    "ros1-bz2",
    "ros1-lz4",
    "sqlite3",
    "mcap",
    "mcap-zstd",
    "sqlite3-message",
    "sqlite3-file",
)


@dataclass
class Entry:
    """A message to be written."""

    topic: str
    type: str
    stamp: float  # [s] in the header
    fields: dict[str, Any]
    frame: str = ""
    arrival: float | None = None  # [s] when it was recorded; None: at its stamp


@dataclass
class Drive:
    """A log with its truth."""

    entries: list[Entry] = field(default_factory=list)
    truth: list[tuple[float, Pose2D]] = field(default_factory=list)


def make(store: Any, kind: str, **given: Any) -> Any:
    """A message with all that is not given at zero; dictionaries become messages."""
    values = {}
    for name, (node, about) in store.fielddefs[kind][1]:
        value = given.get(name)
        if int(node) == 2:  # another message
            values[name] = make(store, about, **(value or {}))
        elif int(node) in (3, 4):  # an array of fixed or any length
            inner = about[0]
            if int(inner[0]) == 1:
                size = about[1] if int(node) == 3 else 0
                values[name] = np.array(
                    np.zeros(size) if value is None else value, dtype=inner[1][0]
                )
            else:
                values[name] = [make(store, inner[1], **item) for item in value or []]
        else:
            values[name] = value if value is not None else ("" if about[0] == "string" else 0)
    return store.types[kind](**values)


def write(path: Path, entries: Sequence[Entry], form: str) -> Path:
    """A bag of one of FORMATS; returns what is given to --bag."""
    kind, _, extra = form.partition("-")
    if kind == "ros1":
        path = path.with_suffix(".bag")
        writer: Any = Writer1(path)
        if extra:
            writer.set_compression(Writer1.CompressionFormat[extra.upper()])
    else:
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        writer = Writer2(path, version=9, storage_plugin=plugin)
        if extra:
            mode = {
                "zstd": CompressionMode.STORAGE,
                "message": CompressionMode.MESSAGE,
                "file": CompressionMode.FILE,
            }
            writer.set_compression(mode[extra], CompressionFormat.ZSTD)
    store = _store(kind == "ros1")
    with writer:
        connections: dict[str, Any] = {}
        for entry in entries:
            if entry.topic not in connections:
                connections[entry.topic] = writer.add_connection(
                    entry.topic, entry.type, typestore=store
                )
            arrival = entry.stamp if entry.arrival is None else entry.arrival
            writer.write(
                connections[entry.topic], round(arrival * 1e9), content(entry, kind == "ros1")
            )
    return path


def content(entry: Entry, is_ros1: bool) -> bytes:
    """The bytes of a message."""
    store, given = _store(is_ros1), dict(entry.fields)
    if entry.type != TRANSFORMS:
        given["header"] = header(entry.stamp, entry.frame)
    message = make(store, entry.type, **given)
    raw = (
        store.serialize_ros1(message, entry.type)
        if is_ros1
        else store.serialize_cdr(message, entry.type)
    )
    return bytes(raw)


def ros(entry: Entry, encoding: str = "cdr") -> Any:
    """The message as it comes out of a bag."""
    topic = Topic(entry.topic, entry.type, encoding)
    return decode(Message(topic, entry.stamp, content(entry, encoding == "ros1")))


def header(stamp: float, frame: str) -> dict[str, Any]:
    """The fields of a std_msgs/Header."""
    seconds = math.floor(stamp)
    return {
        "stamp": {"sec": seconds, "nanosec": round((stamp - seconds) * 1e9) % 10**9},
        "frame_id": frame,
    }


@cache
def _store(is_ros1: bool) -> Any:
    store = get_typestore(Stores.ROS1_NOETIC if is_ros1 else Stores.ROS2_HUMBLE)
    # tf2_msgs is not among the types that rosbags has of ROS 1
    if TRANSFORMS not in store.fielddefs:
        store.register(
            get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TRANSFORMS)
        )
    return store


def quaternion(yaw: float) -> dict[str, float]:
    """The fields of a geometry_msgs/Quaternion."""
    return {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2.0), "w": math.cos(yaw / 2.0)}


def quaternion_of(rotation: np.ndarray) -> tuple[float, float, float, float]:
    """x, y, z, w of a rotation whose trace is not -1."""
    w = math.sqrt(1.0 + np.trace(rotation)) / 2.0
    x, y, z = (
        rotation[2, 1] - rotation[1, 2],
        rotation[0, 2] - rotation[2, 0],
        rotation[1, 0] - rotation[0, 1],
    )
    return x / (4 * w), y / (4 * w), z / (4 * w), w


def pose(at: Pose2D) -> dict[str, Any]:
    """The fields of a geometry_msgs/Pose."""
    return {"position": {"x": at.x, "y": at.y, "z": 0.0}, "orientation": quaternion(at.yaw)}


def odometry(
    stamp: float,
    at: Pose2D,
    speed: float,
    turn: float,
    child: str = "base_link",
) -> Entry:
    """A nav_msgs/Odometry."""
    twist = {
        "twist": {"linear": {"x": speed}, "angular": {"z": turn}},
        "covariance": np.diag([0.01] * 6).ravel(),
    }
    fields = {"child_frame_id": child, "pose": {"pose": pose(at)}, "twist": twist}
    return Entry("/odom", ODOMETRY, stamp, fields, "odom")


def imu(stamp: float, yaw: float, turn: float, topic: str = "/imu/data") -> Entry:
    """A sensor_msgs/Imu of a level unit."""
    fields = {
        "orientation": quaternion(yaw),
        "orientation_covariance": np.diag([1e-4] * 3).ravel(),
        "angular_velocity": {"z": turn},
        "angular_velocity_covariance": np.diag([4e-6] * 3).ravel(),
        "linear_acceleration": {"z": 9.81},
    }
    return Entry(topic, IMU, stamp, fields, "imu_link")


def fix(stamp: float, x: float, y: float, std: float = 0.5) -> Entry:
    """A sensor_msgs/NavSatFix at metres east and north of DATUM (a sphere's metres.

    Good to 0.5 %).
    """
    latitude = DATUM[0] + math.degrees(y / 6_371_000.0)
    longitude = DATUM[1] + math.degrees(x / (6_371_000.0 * math.cos(math.radians(DATUM[0]))))
    fields = {
        "status": {"status": 0, "service": 1},
        "latitude": latitude,
        "longitude": longitude,
        "position_covariance": np.diag([std**2, std**2, 4 * std**2]).ravel(),
        "position_covariance_type": 2,
    }
    return Entry("/fix", FIX, stamp, fields, "gps")


def scan(stamp: float, ranges: Iterable[float], start: float, step: float, **more: Any) -> Entry:
    """A sensor_msgs/LaserScan."""
    ranges = list(ranges)
    fields = {
        "angle_min": start,
        "angle_max": start + step * (len(ranges) - 1),
        "angle_increment": step,
        "range_min": 0.1,
        "range_max": 30.0,
        "ranges": ranges,
    }
    return Entry("/scan", SCAN, stamp, {**fields, **more}, "laser")


def transforms(
    stamp: float,
    *mountings: tuple[str, str, tuple[float, ...]],
    topic: str = "/tf_static",
) -> Entry:
    """A tf2_msgs/TFMessage: parent, child, (x, y, z, qx, qy, qz, qw) of each."""
    fields = [
        {
            "header": header(stamp, parent),
            "child_frame_id": child,
            "transform": {
                "translation": dict(zip("xyz", at[:3], strict=True)),
                "rotation": dict(zip("xyzw", at[3:], strict=True)),
            },
        }
        for parent, child, at in mountings
    ]
    return Entry(topic, TRANSFORMS, stamp, {"transforms": fields})


@cache
def sidewalk_drive(duration: float = 20.0) -> Drive:
    """A drive at 1.5 m/s along a gentle bend of maps/sidewalk.

    Laser at 10 Hz, odometry at 25 Hz, truth at 5 Hz.

    The laser stands 0.3 m ahead of the base and is turned by 0.2 rad. The odometry begins at 0 and
    drifts by 2 %.
    """
    grid = static_map("sidewalk", "amcl")
    mount = Pose2D(0.3, 0.0, 0.2)
    nothing = SelfFilter(0.0, 0.0, 0.0, 0.0)
    lidar = Lidar(LidarParams(10.0, 360, 2 * math.pi, 0.1, 30.0, 0.0, mount, nothing), grid, 0.3)
    rng = np.random.default_rng(1)
    drive, at, in_odom = Drive(), FROM, Pose2D()
    drive.entries.append(
        transforms(
            START, ("base_link", "laser", (0.3, 0.0, 0.4, 0.0, 0.0, math.sin(0.1), math.cos(0.1)))
        )
    )
    dt = 0.02
    for number in range(round(duration / dt)):
        stamp = START + number * dt
        speed, turn = 1.5, 0.05 * math.sin(0.5 * number * dt)
        if number % 2 == 0:
            drive.entries.append(odometry(stamp, in_odom, 1.02 * speed, turn))
        drive.entries.append(imu(stamp, at.yaw, turn))
        if number % 5 == 0:
            ranges = lidar.exact_ranges(at, np.empty((0, 2))) + 0.01 * rng.standard_normal(360)
            drive.entries.append(scan(stamp, ranges, -math.pi, 2 * math.pi / 360))
        if number % 10 == 0:
            drive.truth.append((stamp, at))
            drive.entries.append(Entry("/truth", POSE, stamp, {"pose": pose(at)}, "map"))
            drive.entries.append(
                fix(stamp, at.x + 0.3 * rng.standard_normal(), at.y + 0.3 * rng.standard_normal())
            )
        at = compose(at, Pose2D(speed * dt, 0.0, turn * dt))
        in_odom = compose(in_odom, Pose2D(1.02 * speed * dt, 0.0, turn * dt))
    return drive

"""A recorded delivery as ROS 2 messages in an MCAP file, for Foxglove, RViz and ``ros2 bag play``.

Frames: ``map``, ``odom`` and ``base_link`` as the robot believed them, ``base_link_true`` where it
really was, ``laser`` on the robot. Times are those of the simulation: 0 is the beginning of the
delivery.
"""

import heapq
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from harness.economics.accountings import is_grave
from harness.metrics.columns import Row
from harness.metrics.replay_log import FARTHEST_MM, NO_RETURN, plans_of, tracks_of
from harness.recorded.mcap_writer import McapWriter
from harness.report.replay import RecordedReplay, grid_around
from harness.storage.files import writing
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.geometry import compose, relative_to
from navstack.types import FloatArray, Pose2D

Fields = dict[str, Any]

CYLINDER, SPHERE = 3, 2  # types of visualization_msgs/Marker
PERSON_HEIGHT = 1.7  # [m]
PURPLE, AMBER, RED, GREY = (
    (0.48, 0.25, 0.63),
    (0.71, 0.41, 0.06),
    (0.82, 0.14, 0.18),
    (0.5, 0.5, 0.5),
)


def write_bag(path: Path, replay: RecordedReplay, grid: OccupancyGrid | None) -> int:
    """Write a recorded delivery; returns the number of messages.

    Args:
        path: of the file.
        replay: what to write.
        grid: the map; None: it is not written.

    Raises:
        InputError: the file cannot be written.
    """
    count, arrays = 0, replay.arrays
    streams = [  # in the order of time each, so that the messages need not be in memory all at once
        _fixed(arrays, grid),
        _states(arrays, replay.footprint),
        _scans(arrays),
        _plans(arrays),
        _people(arrays, replay.person_radius),
        _hits(replay.contacts),
    ]
    with writing(path), McapWriter(path) as bag:
        for topic, kind, stamp, fields in heapq.merge(*streams, key=lambda message: message[2]):
            bag.write(topic, kind, stamp, fields, is_latched=topic in ("/map", "/tf_static"))
            count += 1
    return count


Message = tuple[str, str, float, Fields]


def _fixed(arrays: Mapping[str, Any], grid: OccupancyGrid | None) -> Iterator[Message]:
    """What stays: the map, and the sensor's mounting."""
    first = float(arrays["trace"][0, 0])
    part = None
    if grid is not None:
        part = grid_around(grid, arrays["trace"])
    if part is not None:
        yield _map(part, first)
    mount = _transform("base_link", "laser", first, Pose2D(*arrays["scan_geometry"][4:7].tolist()))
    yield "/tf_static", "tf2_msgs/msg/TFMessage", first, {"transforms": [mount]}


def _hits(contacts: Sequence[Row]) -> Iterator[Message]:
    """What was touched."""
    for number, event in enumerate(contacts):
        yield (
            "/contacts",
            "visualization_msgs/msg/MarkerArray",
            event["stamp_s"],
            {"markers": [_hit(number, event)]},
        )


def _states(arrays: Mapping[str, Any], footprint: FloatArray) -> Iterator[Message]:
    """Transforms, odometry, poses, footprint and command, row by row."""
    for row, odometry, spread in zip(
        arrays["trace"], arrays["odometry"], arrays["belief_covariance"], strict=True
    ):
        stamp, true, believed = (
            float(row[0]),
            Pose2D(*row[1:4].tolist()),
            Pose2D(*row[6:9].tolist()),
        )
        in_odom = Pose2D(*odometry[:3].tolist())
        transforms = [
            _transform("odom", "base_link", stamp, in_odom),
            _transform("map", "base_link_true", stamp, true),
        ]
        if not math.isnan(believed.x):
            transforms.append(
                _transform("map", "odom", stamp, compose(believed, relative_to(in_odom, Pose2D())))
            )
            covariance = np.zeros((6, 6))
            covariance[0, 0], covariance[0, 1], covariance[1, 0], covariance[1, 1] = spread[
                [0, 1, 1, 2]
            ]
            pose = {"pose": _pose(believed), "covariance": covariance.ravel()}
            yield _stamped(
                "/belief", "geometry_msgs/msg/PoseWithCovarianceStamped", "map", stamp, pose=pose
            )
        yield "/tf", "tf2_msgs/msg/TFMessage", stamp, {"transforms": transforms}
        twist = {"linear": {"x": float(odometry[3])}, "angular": {"z": float(odometry[4])}}
        fields = {
            "pose": {"pose": _pose(in_odom)},
            "twist": {"twist": twist},
            "child_frame_id": "base_link",
        }
        yield _stamped("/odom", "nav_msgs/msg/Odometry", "odom", stamp, **fields)
        yield _stamped(
            "/ground_truth", "geometry_msgs/msg/PoseStamped", "map", stamp, pose=_pose(true)
        )
        polygon = {"points": [{"x": x, "y": y} for x, y in footprint.tolist()]}
        yield _stamped(
            "/footprint",
            "geometry_msgs/msg/PolygonStamped",
            "base_link_true",
            stamp,
            polygon=polygon,
        )
        command = {"linear": {"x": float(row[9])}, "angular": {"z": float(row[10])}}
        yield _stamped(
            "/cmd_vel", "geometry_msgs/msg/TwistStamped", "base_link", stamp, twist=command
        )


def _scans(arrays: Mapping[str, Any]) -> Iterator[Message]:
    least, increment, closest, farthest = arrays["scan_geometry"][:4].tolist()
    for stamp, scan in zip(arrays["scan_stamp"].tolist(), arrays["scan_mm"], strict=True):
        yield _stamped(
            *("/scan", "sensor_msgs/msg/LaserScan", "laser", stamp),
            angle_min=least,
            angle_max=least + increment * (len(scan) - 1),
            angle_increment=increment,
            range_min=closest,
            range_max=min(farthest, FARTHEST_MM / 1000.0),
            ranges=np.where(scan == NO_RETURN, np.inf, scan / 1000.0),
        )


def _plans(arrays: Mapping[str, Any]) -> Iterator[Message]:
    for stamp, plan in plans_of(arrays):
        header = _header("map", stamp)
        headings = _headings(plan)
        poses = [
            {"header": header, "pose": _pose(Pose2D(x, y, float(yaw)))}
            for (x, y), yaw in zip(plan.tolist(), headings, strict=True)
        ]
        yield _stamped("/plan", "nav_msgs/msg/Path", "map", stamp, poses=poses)


def _headings(plan: FloatArray) -> FloatArray:
    """Headings (N,) [rad] from each point (N, 2) to the next.

    The last one keeps the heading in which it is reached.
    """
    if len(plan) < 2:
        return np.zeros(len(plan))
    steps = np.diff(plan, axis=0)
    return np.asarray(np.arctan2(*np.vstack((steps, steps[-1:])).T[::-1]))


def _people(arrays: Mapping[str, Any], radius: float) -> Iterator[Message]:
    """People as they were and tracks as the robot saw them, as markers."""
    kind = "visualization_msgs/msg/MarkerArray"
    stamps = arrays["trace"][:, 0].tolist()
    for stamp, crowd, tracks in zip(stamps, arrays["crowd"], tracks_of(arrays), strict=True):
        people = [
            _marker("people", number, stamp, place, radius, PURPLE)
            for number, place in enumerate(crowd.tolist())
            if np.isfinite(place).all()  # the absent are nowhere
        ]
        yield "/people", kind, stamp, {"markers": people}
        seen = [
            _marker("tracks", int(number), stamp, [x, y], seen_radius, AMBER)
            for number, x, y, _, _, seen_radius in tracks.tolist()
        ]
        yield "/tracks", kind, stamp, {"markers": seen}


def _marker(
    group: str,
    number: int,
    stamp: float,
    place: Sequence[float],
    radius: float,
    colour: tuple[float, float, float],
) -> Fields:
    return {
        "header": _header("map", stamp),
        "ns": group,
        "id": number,
        "type": CYLINDER,
        "pose": {
            "position": {"x": place[0], "y": place[1], "z": PERSON_HEIGHT / 2},
            "orientation": {"w": 1.0},
        },
        "scale": {"x": 2.0 * radius, "y": 2.0 * radius, "z": PERSON_HEIGHT},
        "color": {"r": colour[0], "g": colour[1], "b": colour[2], "a": 0.8},
        "lifetime": {"nanosec": 300_000_000},
    }


def _hit(number: int, event: Row) -> Fields:
    """A contact; red where it matters. It stays."""
    colour = GREY
    if is_grave(event):
        colour = RED
    marker = _marker(
        "contacts",
        number,
        event["stamp_s"],
        [event["x_m"], event["y_m"]],
        0.2,
        colour,
    )
    return {**marker, "type": SPHERE, "scale": {"x": 0.4, "y": 0.4, "z": 0.4}, "lifetime": {}}


def _map(grid: OccupancyGrid, stamp: float) -> Message:
    size = {
        "resolution": grid.resolution,
        "width": grid.width,
        "height": grid.height,
        "origin": _pose(grid.origin),
    }
    return _stamped(
        "/map",
        "nav_msgs/msg/OccupancyGrid",
        "map",
        stamp,
        info=size,
        data=grid.data.ravel(),
    )


def _stamped(topic: str, kind: str, frame: str, stamp: float, **fields: Any) -> Message:
    """A message whose type begins with a header."""
    return topic, kind, stamp, {"header": _header(frame, stamp), **fields}


def _header(frame: str, stamp: float) -> Fields:
    nanoseconds = round(stamp * 1e9)
    return {
        "stamp": {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9},
        "frame_id": frame,
    }


def _transform(parent: str, child: str, stamp: float, pose: Pose2D) -> Fields:
    place = {"translation": {"x": pose.x, "y": pose.y}, "rotation": _rotation(pose.yaw)}
    return {"header": _header(parent, stamp), "child_frame_id": child, "transform": place}


def _pose(pose: Pose2D) -> Fields:
    return {
        "position": {"x": float(pose.x), "y": float(pose.y)},
        "orientation": _rotation(pose.yaw),
    }


def _rotation(yaw: float) -> Fields:
    return {"z": math.sin(yaw / 2.0), "w": math.cos(yaw / 2.0)}

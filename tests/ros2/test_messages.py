"""The robot's messages there and back, and transforms byte for byte as real robots sent them."""

import math
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.recorded import messages as received
from harness.recorded.mountings import IDENTITY
from harness.task.ros2_params import Ros2Params
from harness.world.sensors.message_precision import as_messages
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.localization.geodesy import LocalFrame
from navstack.types import GpsFix, Imu, LaserScan, Observation, Odometry, Pose2D, Twist2D

messages = pytest.importorskip("harness.ros2.messages", exc_type=ImportError)

PARAMS = Ros2Params()
SITE = LocalFrame(PARAMS.latitude, PARAMS.longitude)
OFFSET = 12.5
LENGTHS = st.floats(-500.0, 500.0)
ANGLES = st.floats(-3.1, 3.1)
POSES = st.builds(Pose2D, LENGTHS, LENGTHS, ANGLES)


def near(first: Pose2D, second: Pose2D) -> bool:
    return bool(np.allclose(first.as_array(), second.as_array(), atol=1e-9))


@given(POSES, st.floats(-2.0, 2.0), st.floats(0.0, 100.0))
@settings(max_examples=50, deadline=None)
def test_odometry_comes_back(pose: Pose2D, speed: float, stamp: float) -> None:
    sent = Odometry(stamp, pose, Twist2D(speed, 0.0, 0.3), 0.1, 0.2)
    message = messages.odometry_message(sent, OFFSET, PARAMS)
    found = received.odometry(message, stamp, IDENTITY)
    assert found is not None
    assert near(found.pose, pose) and found.twist == sent.twist
    assert received.stamp_of(message) == pytest.approx(stamp + OFFSET, abs=2e-9)
    assert (found.velocity_std, found.yaw_rate_std) == pytest.approx((0.1, 0.2))


@given(ANGLES)
@settings(max_examples=50, deadline=None)
def test_an_inertial_measurement_comes_back(yaw: float) -> None:
    sent = Imu(1.0, yaw, 0.2, 0.3, -0.4, 0.01, 0.02)
    found = received.imu(messages.imu_message(sent, OFFSET, "imu_link"), 1.0, IDENTITY)
    assert found is not None
    assert found.yaw == pytest.approx(yaw, abs=1e-9)
    measured = (found.angular_velocity_z, found.linear_acceleration_x, found.linear_acceleration_y)
    assert measured == pytest.approx((0.2, 0.3, -0.4), abs=1e-9)
    assert (found.yaw_std, found.yaw_rate_std) == pytest.approx((0.01, 0.02))
    blind = messages.imu_message(Imu(1.0, math.nan, 0.2, 0.3, -0.4), OFFSET, "imu_link")
    seen = received.imu(blind, 1.0, IDENTITY)
    assert seen is not None and math.isnan(seen.yaw)


@given(LENGTHS, LENGTHS)
@settings(max_examples=50, deadline=None)
def test_a_fix_comes_back(x: float, y: float) -> None:
    """To 1 mm, for PROJ takes what is nearer to the datum for the datum; and as a valid one."""
    message = messages.fix_message(GpsFix(1.0, x, y, 0.5), OFFSET, "gps", SITE)
    place = received.coordinates(message)
    assert place is not None
    found = received.gps_fix(message, 1.0, SITE.to_local(*place), np.zeros(3), 0.0)
    assert (found.x, found.y, found.position_std) == pytest.approx((x, y, 0.5), abs=1e-3)


def test_a_scan_comes_back_in_the_precision_of_its_message() -> None:
    ranges = np.array((0.5, 1.0 / 3.0, math.inf))
    sent = LaserScan(2.0, ranges, -1.0, 0.1, 0.05, 25.0)
    message = messages.scan_message(sent, OFFSET, "base_scan")
    found = received.laser_scan(message, 2.0, IDENTITY)
    assert found is not None
    assert found.ranges.tolist() == [0.5, float(np.float32(1.0 / 3.0)), math.inf]


@given(POSES, ANGLES, LENGTHS, LENGTHS, st.integers(0, 20_000))
@settings(max_examples=100, deadline=None)
def test_what_messages_carry_comes_back_to_the_last_bit(
    pose: Pose2D, yaw: float, x: float, y: float, tick: int
) -> None:
    now = tick / 60.0
    ranges = np.array((abs(x), 1.0 / 3.0, math.inf))
    sent = as_messages(
        Observation(
            now,
            Odometry(now, pose, Twist2D(y / 100.0, 0.0, yaw), 0.02, 0.01),
            Imu(now, yaw, 0.927398877404336, x / 100.0, y / 100.0, 0.01, 0.003),
            GpsFix(now, x, y, 0.02),
            LaserScan(now, ranges, -3.1415926535, 0.017453292, 0.05, 30.0),
        )
    )
    odometry = messages.odometry_message(sent.odometry, OFFSET, PARAMS)
    imu, fix = (
        messages.imu_message(sent.imu, OFFSET, "imu"),
        messages.fix_message(sent.gps, OFFSET, "gps", SITE),
    )
    scan, clock = messages.scan_message(sent.scan, OFFSET, "scan"), messages.time_of(now + OFFSET)
    place = SITE.to_local(fix.latitude, fix.longitude)
    found = as_messages(
        Observation(
            messages.seconds(clock) - OFFSET,
            received.odometry(odometry, received.stamp_of(odometry) - OFFSET, IDENTITY),
            received.imu(imu, received.stamp_of(imu) - OFFSET, IDENTITY),
            received.gps_fix(fix, received.stamp_of(fix) - OFFSET, place, np.zeros(3), 0.0),
            received.laser_scan(scan, received.stamp_of(scan) - OFFSET, IDENTITY),
        )
    )
    assert (found.stamp, found.odometry, found.imu) == (sent.stamp, sent.odometry, sent.imu)
    assert found.gps == sent.gps or math.hypot(x, y) < 1e-2  # what is nearer PROJ takes for it
    assert found.scan is not None and sent.scan is not None
    assert found.scan.ranges.tolist() == sent.scan.ranges.tolist()
    for name in ("stamp", "angle_min", "angle_increment", "range_min", "range_max"):
        assert getattr(found.scan, name) == getattr(sent.scan, name)


def test_a_goals_heading_comes_back_to_the_last_bit() -> None:
    """But for one in 300, which no quaternion near it is read back as."""
    headings = np.random.default_rng(0).uniform(-math.pi, math.pi, 300).tolist()
    read = [received.pose_of(messages.goal_message(Pose2D(0, 0, yaw), 0, "")) for yaw in headings]
    same = [each is not None and each[2] == yaw for each, yaw in zip(read, headings, strict=True)]
    assert sum(same) >= 297


@given(st.floats(0.0, 2e9))
@settings(max_examples=200, deadline=None)
def test_the_clock_and_a_header_agree_to_the_last_bit(stamp: float) -> None:
    """Else a scan of this moment is ahead of it."""
    message = messages.goal_message(Pose2D(), stamp, "map")
    assert messages.seconds(messages.time_of(stamp)) == received.stamp_of(message)


def test_a_map_comes_back() -> None:
    cells = np.array([[0, 100, -1], [0, 0, 100]], dtype=np.int8)
    sent = OccupancyGrid(cells, 0.05, Pose2D(-3.0, 4.0))
    found = messages.grid_of(messages.map_message(sent, "map"))
    assert np.array_equal(found.data, cells)
    assert (found.resolution, found.origin) == (0.05, Pose2D(-3.0, 4.0))


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf, 1e308])
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_command_that_no_robot_can_follow_is_none(number: float, axis: str) -> None:
    twist: Any = SimpleNamespace(
        linear=SimpleNamespace(x=0.1, y=0.0), angular=SimpleNamespace(z=0.1)
    )
    setattr(twist.angular if axis == "z" else twist.linear, axis, number)
    assert messages.command_of(twist) is None
    assert messages.command_of(SimpleNamespace(twist=twist)) is None


def test_transforms_have_the_bytes_that_a_library_writes() -> None:
    from rosbags.typesys import Stores, get_typestore

    from harness.ros2.transforms import Frame, transform_message

    store = get_typestore(Stores.ROS2_JAZZY)
    frames = [
        Frame("odom", "base_link", Pose2D(1.25, -2.5, 0.7)),
        Frame("map", "odom", Pose2D(0.1, 0.2, -3.0)),
    ]
    written = transform_message(frames, 12.75).serialize()
    found: Any = store.deserialize_cdr(bytes(written), "tf2_msgs/msg/TFMessage")
    assert [each.child_frame_id for each in found.transforms] == ["base_link", "odom"]
    assert found.transforms[0].header.stamp.sec == 12
    assert found.transforms[0].header.stamp.nanosec == 750_000_000
    assert found.transforms[0].transform.translation.y == -2.5
    again = bytes(store.serialize_cdr(found, "tf2_msgs/msg/TFMessage"))
    # the last two bits of the header say how much is padding, which one of the two leaves out
    assert bytes(written)[4:] == again[4 : len(bytes(written))]


def test_transforms_of_a_recorded_drive_come_back_byte_for_byte() -> None:
    """The bag has poses of a real robot; the library writes them as transforms."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    from harness.ros2.transforms import TFMessage

    bag = Path(os.environ.get("NAVSTACK_DATA", "")) / "robot_localization" / "test1.bag"
    if not bag.is_file():
        pytest.skip("NAVSTACK_DATA names no folder with robot_localization/test1.bag")
    kind, store = "tf2_msgs/msg/TFMessage", get_typestore(Stores.ROS2_JAZZY)
    types: Any = store.types
    with AnyReader([bag]) as reader:
        poses = [each for each in reader.connections if each.msgtype.endswith("Odometry")]
        for _, (connection, _, raw) in zip(range(200), reader.messages(poses), strict=False):
            found: Any = reader.deserialize(raw, connection.msgtype)
            stamp, pose = found.header.stamp, found.pose.pose
            transform = types["geometry_msgs/msg/TransformStamped"](
                types["std_msgs/msg/Header"](
                    types["builtin_interfaces/msg/Time"](stamp.sec, stamp.nanosec), "odom"
                ),
                found.child_frame_id,
                types["geometry_msgs/msg/Transform"](pose.position, pose.orientation),
            )
            data = bytes(store.serialize_cdr(types[kind]([transform]), kind))
            again = bytes(TFMessage.deserialize(data).serialize())
            assert again[4:] == data[4 : len(again)]

"""ROS messages as the robot's own."""

import math
import re

import numpy as np
import pytest

from harness.recorded import messages
from harness.recorded.bag import Message
from harness.recorded.bag_file import DamageError, Topic
from harness.recorded.clock import Clock
from harness.recorded.mountings import IDENTITY, Mountings, Transform, from_angles
from harness.recorded.receiver import Receiver, _upright
from harness.recorded.ros_messages import FIX, IMU, ODOMETRY, SCAN, TRANSFORMS, decode
from navstack.types import Pose2D

from . import writing
from .writing import ros


def ends(scan) -> np.ndarray:
    """Where the beams end (n, 2) in the base frame."""
    angles = (
        scan.sensor_pose.yaw + scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
    )
    return (scan.sensor_pose.x, scan.sensor_pose.y) + scan.ranges[:, None] * np.column_stack(
        (np.cos(angles), np.sin(angles))
    )


@pytest.mark.parametrize("step", [0.1, -0.1])
@pytest.mark.parametrize(
    "angles", [(0.0, 0.0, 0.7), (math.pi, 0.0, 0.7), (0.0, math.pi, -2.0), (math.pi, 0.0, 0.0)]
)
def test_beams_end_where_the_mounted_sensor_sees_them(step, angles):
    ranges = np.linspace(1.0, 5.0, 20)
    mounting = Transform(from_angles(*angles), np.array((0.3, -0.1, 0.5)))
    scan = messages.laser_scan(ros(writing.scan(5.0, ranges, -0.4, step)), 5.0, mounting)
    bearings = -0.4 + step * np.arange(20)
    in_sensor = np.column_stack(
        (ranges * np.cos(bearings), ranges * np.sin(bearings), np.zeros(20))
    )
    expected = (in_sensor @ mounting.rotation.T + mounting.translation)[:, :2]
    ours = ends(scan)
    assert scan.angle_increment > 0.0 and scan.stamp == 5.0
    order = np.argsort(scan.ranges)
    assert ours[order] == pytest.approx(expected, abs=1e-5)


def test_ranges_that_are_no_distances_keep_their_meaning():
    ranges = [1.0, math.nan, math.inf, 0.0, -math.inf, -1.0, 40.0]
    scan = messages.laser_scan(ros(writing.scan(0.0, ranges, 0.0, 0.1)), 0.0, IDENTITY)
    assert np.isnan(scan.ranges[1]) and scan.ranges[2] == math.inf
    assert (scan.ranges[[3, 4, 5]] <= scan.range_min).all() and scan.ranges[6] > scan.range_max


def test_a_scan_without_increment_or_range_max_is_read_all_the_same():
    scan = ros(writing.scan(0.0, [1.0] * 11, -1.0, 0.2, angle_increment=0.0, range_max=0.0))
    read = messages.laser_scan(scan, 0.0, IDENTITY)
    assert read.angle_increment == pytest.approx(0.2) and read.range_max > 1.0


@pytest.mark.parametrize(
    "changes",
    [
        {"angle_min": math.nan},
        {"ranges": []},
        {"ranges": [math.nan] * 5},
        {"angle_increment": 0.0, "angle_max": math.inf},
        {"ranges": [1.0] * 100_001},
    ],
)
def test_a_scan_that_tells_nothing_is_left_out(changes):
    fields = {"ranges": [1.0] * 5, **changes}
    scan = writing.scan(0.0, fields.pop("ranges"), 0.0, 0.1, **fields)
    assert messages.laser_scan(ros(scan), 0.0, IDENTITY) is None


def test_the_heading_is_that_of_the_base_however_the_unit_is_mounted():
    mounting = Transform(from_angles(math.pi / 2, 0.0, -math.pi / 2), np.zeros(3))
    base = from_angles(0.0, 0.0, 1.2)
    x, y, z, w = writing.quaternion_of(base @ mounting.rotation)
    entry = writing.imu(0.0, 0.0, 0.0)
    rates, forces = mounting.rotation.T @ (0.0, 0.0, 0.3), mounting.rotation.T @ (0.5, -0.2, 9.81)
    entry.fields |= {
        "orientation": {"x": x, "y": y, "z": z, "w": w},
        "angular_velocity": dict(zip("xyz", rates, strict=True)),
        "linear_acceleration": dict(zip("xyz", forces, strict=True)),
        "orientation_covariance": np.diag((1.0, 4.0, 9.0)).ravel(),
    }
    imu = messages.imu(ros(entry), 7.0, mounting)
    assert imu.yaw == pytest.approx(1.2) and imu.angular_velocity_z == pytest.approx(0.3)
    assert (imu.linear_acceleration_x, imu.linear_acceleration_y) == pytest.approx((0.5, -0.2))
    assert imu.yaw_std == pytest.approx(2.0)  # the unit's y axis points up
    assert imu.yaw_rate_std == pytest.approx(0.002)
    assert messages.imu(ros(entry), 7.0, mounting, 0.2).yaw == pytest.approx(1.0)


def test_a_unit_without_orientation_has_no_heading():
    entry = writing.imu(0.0, 1.0, 0.1)
    entry.fields["orientation_covariance"] = [-1.0] + [0.0] * 8
    assert math.isnan(messages.imu(ros(entry), 0.0, IDENTITY).yaw)
    entry = writing.imu(0.0, 1.0, 0.1)
    entry.fields["orientation"] = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0}
    imu = messages.imu(ros(entry), 0.0, IDENTITY)
    assert math.isnan(imu.yaw) and imu.angular_velocity_z == pytest.approx(0.1)


def test_what_a_unit_says_that_it_does_not_measure_is_not_there():
    entry = writing.imu(0.0, 1.0, 0.1)
    entry.fields["angular_velocity_covariance"] = [-1.0] + [0.0] * 8
    assert messages.imu(ros(entry), 0.0, IDENTITY) is None
    entry = writing.imu(0.0, 1.0, 0.1)
    entry.fields["linear_acceleration"] = {"x": 5.0, "z": 9.81}
    entry.fields["linear_acceleration_covariance"] = [-1.0] + [0.0] * 8
    assert messages.specific_force(ros(entry)) is None
    imu = messages.imu(ros(entry), 0.0, IDENTITY)
    assert (imu.linear_acceleration_x, imu.angular_velocity_z) == (0.0, pytest.approx(0.1))


def test_covariances_that_are_not_stated_are_no_deviation():
    entry = writing.imu(0.0, 1.0, 0.1)
    entry.fields |= {
        "orientation_covariance": [0.0] * 9,
        "angular_velocity_covariance": [math.nan] * 9,
    }
    imu = messages.imu(ros(entry), 0.0, IDENTITY)
    assert (imu.yaw_std, imu.yaw_rate_std) == (0.0, 0.0)


@pytest.mark.filterwarnings("error")
def test_infinite_numbers_leave_no_warnings():
    entry = writing.imu(0.0, 1.0, 0.1)
    entry.fields |= {
        "linear_acceleration": {"x": math.inf, "z": 9.8},
        "orientation_covariance": [math.inf] * 9,
        "angular_velocity_covariance": [math.inf] * 9,
    }
    receiver = Receiver(Mountings(), None, "imu_link", None, 0.0, lambda _: None)
    imu = receiver.convert(IMU, ros(entry), 0.0, Pose2D())
    assert (imu.yaw_std, imu.yaw_rate_std, imu.linear_acceleration_x) == (0.0, 0.0, 0.0)
    assert imu.angular_velocity_z == pytest.approx(0.1)
    entry.fields["angular_velocity"] = {"x": math.inf, "z": 0.1}
    assert receiver.convert(IMU, ros(entry), 0.0, Pose2D()) is None
    fix = writing.fix(0.0, 1.0, 2.0)
    fix.fields["position_covariance"] = np.array([math.inf, 0, 0, 0, -math.inf, 0, 0, 0, 0])
    assert receiver.convert(FIX, ros(fix), 0.0, Pose2D()).position_std == 0.0


def test_odometry_of_another_frame_is_taken_to_the_base():
    child = Transform(from_angles(0.0, 0.0, math.pi / 2), np.array((0.5, 0.2, 0.0)))
    # The base stands at (1, 2), turned by 0.3 rad, and drives 1 m/s while turning 0.4 rad/s.
    c, s = math.cos(0.3), math.sin(0.3)
    at = Pose2D(1.0 + c * 0.5 - s * 0.2, 2.0 + s * 0.5 + c * 0.2, 0.3 + math.pi / 2)
    in_base = np.array((1.0 - 0.4 * 0.2, 0.4 * 0.5, 0.0))
    entry = writing.odometry(0.0, at, 0.0, 0.4)
    entry.fields["twist"]["twist"]["linear"] = dict(
        zip("xyz", child.rotation.T @ in_base, strict=True)
    )
    odometry = messages.odometry(ros(entry), 3.0, child)
    assert odometry.pose.as_array() == pytest.approx((1.0, 2.0, 0.3))
    assert (odometry.twist.linear_x, odometry.twist.linear_y) == pytest.approx((1.0, 0.0))
    assert odometry.twist.angular_z == pytest.approx(0.4)
    assert (odometry.velocity_std, odometry.yaw_rate_std) == pytest.approx((0.1, 0.1))


def in_tf(receiver: Receiver, stamp: float, at: Pose2D):
    """The odometry in a transform from odom to base_footprint."""
    numbers = (at.x, at.y, 0.0, 0.0, 0.0, math.sin(at.yaw / 2.0), math.cos(at.yaw / 2.0))
    entry = writing.transforms(stamp, ("odom", "base_footprint", numbers), topic="/tf")
    return receiver.convert(TRANSFORMS, ros(entry), stamp, Pose2D())


def test_a_pose_of_tf_tells_a_velocity_only_where_it_is_newer_than_the_last():
    edge = ("odom", "base_footprint")
    receiver = Receiver(Mountings(), None, "base_footprint", None, 0.0, lambda _: None, edge)
    times = (0.0, 0.02, 0.02, 0.01, 0.04, 0.04, 5.04)
    told = [in_tf(receiver, stamp, Pose2D(1.5 * stamp, 0.0, 0.0)) for stamp in times]
    assert [each and each.stamp for each in told] == [None, 0.02, None, None, 0.04, None, 5.04]
    assert [each.twist.linear_x for each in told if each] == pytest.approx([1.5, 1.5, 1.5])
    assert not receiver.left_out
    assert in_tf(receiver, 6.0, Pose2D(math.nan, 0.0, 0.0)) is None and receiver.left_out == {
        TRANSFORMS: 1
    }


def test_odometry_of_tf_is_taken_to_the_base_frame():
    said: list[str] = []
    mountings = Mountings()
    mountings.give(f"base_footprint base_link 0.5 0.2 {math.pi / 2}")
    receiver = Receiver(
        mountings,
        "base_link",
        "base_footprint",
        None,
        0.0,
        said.append,
        ("odom", "base_footprint"),
    )
    # The footprint turns on the spot by 0.4 rad/s.
    assert in_tf(receiver, 0.0, Pose2D(1.0, 2.0, -0.001)) is None
    odometry = in_tf(receiver, 0.005, Pose2D(1.0, 2.0, 0.001))
    assert odometry.pose.as_array() == pytest.approx((1.5, 2.2, math.pi / 2), abs=2e-3)
    twist = odometry.twist
    assert (twist.linear_x, twist.linear_y, twist.angular_z) == pytest.approx(
        (0.2, 0.08, 0.4), abs=1e-3
    )
    assert not said


@pytest.mark.parametrize(
    "mounting", [IDENTITY, Transform(from_angles(0.3, -0.2, 1.0), np.zeros(3))]
)
def test_a_unit_on_a_slope_is_without_gravity_and_turns_about_the_vertical(mounting):
    base = from_angles(0.08, -0.15, 0.6)  # rolled, and uphill
    up, along = base[2], np.array((0.4, -0.3, 0.1))
    turning = np.linalg.solve(base, (0.0, 0.0, 0.5))  # about the vertical, in the base's axes
    for gravity in (9.81, 0.0):  # some drivers take it away themselves
        entry = writing.imu(0.0, 0.0, 0.0)
        entry.fields["orientation"] = dict(
            zip("xyzw", writing.quaternion_of(base @ mounting.rotation), strict=True)
        )
        force, rate = mounting.rotation.T @ (along + gravity * up), mounting.rotation.T @ turning
        entry.fields["linear_acceleration"] = dict(zip("xyz", force, strict=True))
        entry.fields["angular_velocity"] = dict(zip("xyz", rate, strict=True))
        imu = messages.imu(ros(entry), 0.0, mounting)
        assert (imu.linear_acceleration_x, imu.linear_acceleration_y) == pytest.approx(
            along[:2], abs=1e-3
        )
        assert imu.angular_velocity_z == pytest.approx(0.5) and imu.yaw == pytest.approx(0.6)
        assert imu.pitch == pytest.approx(-0.15)
    entry.fields["orientation_covariance"] = np.array([-1.0, *[0.0] * 8])
    entry.fields["angular_velocity"] = {"z": 0.5}
    imu = messages.imu(ros(entry), 0.0, IDENTITY)
    assert (imu.angular_velocity_z, imu.pitch) == (0.5, 0.0)


def test_an_orientation_in_other_axes_tells_no_slope():
    """North, east, down: a level base that seems to lie on its back."""
    entry = writing.imu(0.0, 0.0, 0.4)
    turned = writing.quaternion_of(from_angles(math.pi - 0.1, 0.05, 1.0))
    entry.fields["orientation"] = dict(zip("xyzw", turned, strict=True))
    imu = messages.imu(ros(entry), 0.0, IDENTITY)
    assert (imu.angular_velocity_z, imu.linear_acceleration_x, imu.pitch) == (0.4, 0.0, 0.0)


def test_an_unknown_mounting_is_said_once_and_gravity_tells_a_wrong_one():
    said: list[str] = []
    mountings = Mountings()
    receiver = Receiver(mountings, None, "base_link", None, 0.0, said.append)
    entry = writing.imu(0.0, 0.0, 0.0)
    entry.fields["linear_acceleration"] = {"y": 9.8}
    for _ in range(150):
        receiver.convert(IMU, ros(entry), 0.0, Pose2D())
    assert len(said) == 2 and "'imu_link'" in said[0] and "base_link imu_link x y z roll" in said[0]
    assert "gravity is 90 degrees off" in said[1]


def test_a_base_frame_with_the_prefix_of_the_sensors_is_found():
    said: list[str] = []
    mountings = Mountings()
    mountings.give("robot1/base_link robot1/laser 0.3 0 0")
    entry = writing.scan(0.0, [1.0] * 5, 0.0, 0.1)
    entry.frame = "robot1/laser"
    receiver = Receiver(mountings, None, "", None, 0.0, said.append)
    assert receiver.convert(SCAN, ros(entry), 0.0, Pose2D()).sensor_pose.x == 0.3 and not said
    assert receiver.is_mounted(SCAN, "robot1/laser") and not receiver.is_mounted(SCAN, "r2/laser")
    given = Receiver(mountings, "robot2/base_link", "", None, 0.0, said.append)
    assert given.convert(SCAN, ros(entry), 0.0, Pose2D()).sensor_pose.x == 0.0
    assert "frame 'robot1/laser' of LaserScan is on robot2/base_link" in said[0]


def test_a_sensor_that_names_no_frame_is_mounted_by_the_name_of_its_type():
    said: list[str] = []
    entry = writing.scan(0.0, [1.0] * 5, 0.0, 0.1)
    entry.frame = ""
    receiver = Receiver(Mountings(), None, "base_link", None, 0.0, said.append)
    receiver.convert(SCAN, ros(entry), 0.0, Pose2D())
    advice = re.search("--static-tf '(.*) x y z roll pitch yaw'", said[0])
    mountings = Mountings()
    mountings.give(f"{advice[1]} 0.3 0 0 0 0 0.2")
    receiver = Receiver(mountings, None, "base_link", None, 0.0, said.append)
    scan = receiver.convert(SCAN, ros(entry), 0.0, Pose2D())
    assert scan.sensor_pose == Pose2D(0.3, 0.0, pytest.approx(0.2)) and len(said) == 1


@pytest.mark.parametrize(("force", "is_odd"), [(9.8, False), (1.0, True), (980.0, True)])
def test_accelerations_in_other_units_are_told(force, is_odd):
    said: list[str] = []
    receiver = Receiver(Mountings(), None, "imu_link", None, 0.0, said.append)
    entry = writing.imu(0.0, 0.0, 0.0)
    entry.fields["linear_acceleration"] = {"z": force}
    for _ in range(150):
        receiver.convert(IMU, ros(entry), 0.0, Pose2D())
    assert [line.endswith("they have to be in m/s2") for line in said] == [True] * is_odd


def test_a_base_frame_with_another_usual_name_is_found():
    said: list[str] = []
    mountings = Mountings()
    mountings.give("base_link laser 0.3 0 0")
    receiver = Receiver(mountings, None, "base_footprint", None, 0.0, said.append)
    scan = receiver.convert(SCAN, ros(writing.scan(0.0, [1.0] * 5, 0.0, 0.1)), 0.0, Pose2D())
    assert scan.sensor_pose == Pose2D(0.3, 0.0, 0.0)
    odometry = receiver.convert(
        ODOMETRY, ros(writing.odometry(0.0, Pose2D(), 1.0, 0.0, "")), 0.0, Pose2D()
    )
    assert odometry.pose == Pose2D() and not said


def test_bytes_of_another_type_are_one_line():
    content = writing.content(writing.imu(0.0, 0.0, 0.0), False)
    for cut in (0, 3, 10, len(content) // 2):
        with pytest.raises(
            DamageError, match="a message of /scan is no sensor_msgs/msg/LaserScan"
        ) as caught:
            decode(Message(Topic("/scan", SCAN, "cdr"), 0.0, content[:cut]))
        assert "\n" not in str(caught.value)


def test_the_clock_follows_the_stamps_and_not_the_recording():
    clock = Clock(offset=-1000.0)
    assert clock.take("/a", 1000.0, 0.5) == 0.5
    assert clock.take("/b", 1000.1, 0.6) == 0.6 and clock.now == 0.6
    # late: keeps its stamp, time does not go back
    assert clock.take("/a", 1000.2, 0.3) == 0.3 and clock.now == 0.6
    assert clock.take("/c", 1000.3, 1e9) == pytest.approx(0.8)  # of another clock
    assert clock.take("/c", 1000.4, math.nan) == pytest.approx(0.9)
    assert clock.take("/a", 1030.4, 30.8) == 30.8  # a gap in the recording
    assert clock.take("/b", 9e8, 30.9) == 30.9  # recorded at a corrupt time
    assert clock.replaced == {"/c": 2}


def test_an_unset_stamp_is_replaced_even_where_it_could_be_one():
    clock = Clock(0.0, {"/b": 3.0})
    # simulated time begins
    assert [clock.take("/a", each, 0.0) for each in (0.05, 5.0)] == [0.0, pytest.approx(4.95)]
    assert clock.take("/b", 6.0, 3.0) == pytest.approx(5.95)  # stands still
    assert clock.take("/b", 6.1, 6.0) == 6.0
    assert clock.replaced == {"/a": 1, "/b": 1}


def test_the_turn_that_sets_a_unit_upright_is_told_of_any_mounting():
    rng = np.random.default_rng(5)
    for angles in rng.uniform(-3.0, 3.0, (50, 3)):
        felt = from_angles(*angles).T @ (0.0, 0.0, 9.8)
        roll, pitch = map(float, re.findall(r"-?\d+\.\d\d", _upright(felt)))
        upright = from_angles(roll, pitch, 0.7) @ felt
        assert upright[2] == pytest.approx(9.8, abs=0.01)

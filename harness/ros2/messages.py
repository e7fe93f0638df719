"""The robot's messages as those of ROS 2, and back.

Sources: sensor_msgs, nav_msgs and geometry_msgs of ROS 2; REP 103 (axes) and REP 145 (IMU).
"""

import math
from array import array
from itertools import product
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Pose, PoseStamped, PoseWithCovarianceStamped, Quaternion
from nav_msgs.msg import OccupancyGrid as GridMessage
from nav_msgs.msg import Odometry as OdometryMessage
from sensor_msgs.msg import Imu as ImuMessage
from sensor_msgs.msg import LaserScan as ScanMessage
from sensor_msgs.msg import NavSatFix, NavSatStatus

from harness.recorded.messages import pose_of
from harness.task.ros2_params import Ros2Params
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import InputError
from navstack.localization.geodesy import LocalFrame
from navstack.types import FloatArray, GpsFix, Imu, LaserScan, Odometry, Pose2D, Twist2D

GRAVITY = 9.81  # [m/s2]
# [m] and [rad], as of RViz's button for an initial pose
START_STD, START_YAW_STD = 0.5, math.pi / 12.0
COARSEST = 10.0  # [m] of a cell
FASTEST = 100.0  # [m/s] or [rad/s] beyond which a command is none
NANOSECONDS = 1_000_000_000
BITS = 3  # by which a quaternion's numbers are moved so that its heading is read back exactly


def time_of(stamp: float) -> Time:
    """A time in [s] as a message, to the nanosecond."""
    total = round(stamp * NANOSECONDS)
    return Time(sec=total // NANOSECONDS, nanosec=total % NANOSECONDS)


def seconds(stamp: Any) -> float:
    """A message's time in [s], to the last bit as :func:`harness.recorded.messages.stamp_of`."""
    return float(stamp.sec) + float(stamp.nanosec) * 1e-9


def quaternion(yaw: float, pitch: float = 0.0) -> Quaternion:
    """A rotation by pitch, then by yaw [rad]."""
    half_yaw, half_pitch = 0.5 * yaw, 0.5 * pitch
    return Quaternion(
        w=math.cos(half_yaw) * math.cos(half_pitch),
        x=-math.sin(half_yaw) * math.sin(half_pitch),
        y=math.cos(half_yaw) * math.sin(half_pitch),
        z=math.sin(half_yaw) * math.cos(half_pitch),
    )


def pose_message(pose: Pose2D) -> Pose:
    """A pose in the plane."""
    message = Pose(orientation=quaternion(pose.yaw))
    message.position.x, message.position.y = pose.x, pose.y
    return message


def exact_pose_message(pose: Pose2D) -> Pose:
    """A pose in the plane whose heading is read back to the last bit.

    The nearest quaternion is read back as a neighbour in one case of five: those a few bits away
    are tried. Without success (one in 300) it is the nearest.
    """
    message = pose_message(pose)
    turn = message.orientation
    near_z, near_w = _neighbours(turn.z), _neighbours(turn.w)
    for z, w in product(near_z, near_w):
        turn.z, turn.w = z, w
        found = pose_of(PoseStamped(pose=message))
        if found is not None and found[2] == pose.yaw:
            return message
    return pose_message(pose)


def _neighbours(number: float) -> list[float]:
    """A number, and those a few bits above and below it."""
    found = [number]
    for side in (math.inf, -math.inf):
        near = number
        for _ in range(BITS):
            near = math.nextafter(near, side)
            found.append(near)
    return found


def goal_message(goal: Pose2D, stamp: float, frame: str) -> PoseStamped:
    """A goal as bt_navigator takes it on /goal_pose."""
    message = PoseStamped(pose=exact_pose_message(goal))
    message.header.frame_id, message.header.stamp = frame, time_of(stamp)
    return message


def start_message(start: Pose2D, stamp: float, frame: str) -> PoseWithCovarianceStamped:
    """A start as localizers take it on /initialpose."""
    message = PoseWithCovarianceStamped()
    message.header.frame_id, message.header.stamp = frame, time_of(stamp)
    message.pose.pose = exact_pose_message(start)
    covariance = np.zeros((6, 6))
    covariance[0, 0] = covariance[1, 1] = START_STD**2
    covariance[5, 5] = START_YAW_STD**2
    message.pose.covariance = covariance.ravel()
    return message


def scan_message(scan: LaserScan, offset: float, frame: str) -> ScanMessage:
    """A scan; ``offset`` [s] is the clock's time at the delivery's begin."""
    count = len(scan.ranges)
    message = ScanMessage(
        angle_min=scan.angle_min,
        angle_max=scan.angle_min + scan.angle_increment * max(count - 1, 0),
        angle_increment=scan.angle_increment,
        range_min=scan.range_min,
        range_max=scan.range_max,
    )
    message.ranges = scan.ranges.astype(np.float32).tolist()
    message.header.frame_id, message.header.stamp = frame, time_of(scan.stamp + offset)
    return message


def odometry_message(odometry: Odometry, offset: float, params: Ros2Params) -> OdometryMessage:
    """Wheel odometry."""
    message = OdometryMessage(child_frame_id=params.base_frame)
    message.header.frame_id = params.odom_frame
    message.header.stamp = time_of(odometry.stamp + offset)
    message.pose.pose = pose_message(odometry.pose)
    twist = message.twist.twist
    twist.linear.x, twist.linear.y = odometry.twist.linear_x, odometry.twist.linear_y
    twist.angular.z = odometry.twist.angular_z
    covariance = np.zeros((6, 6))
    covariance[0, 0] = odometry.velocity_std**2
    covariance[5, 5] = odometry.yaw_rate_std**2
    message.twist.covariance = covariance.ravel()
    return message


def imu_message(imu: Imu, offset: float, frame: str) -> ImuMessage:
    """An inertial measurement; without a heading the first covariance is -1, as ROS has it."""
    message = ImuMessage()
    message.header.frame_id, message.header.stamp = frame, time_of(imu.stamp + offset)
    if math.isnan(imu.yaw):
        message.orientation_covariance[0] = -1.0
    else:
        message.orientation = quaternion(imu.yaw, imu.pitch)
        message.orientation_covariance[8] = imu.yaw_std**2
    message.angular_velocity.z = imu.angular_velocity_z
    message.angular_velocity_covariance[8] = imu.yaw_rate_std**2
    message.linear_acceleration.x = imu.linear_acceleration_x
    message.linear_acceleration.y = imu.linear_acceleration_y
    message.linear_acceleration.z = GRAVITY
    return message


def fix_message(fix: GpsFix, offset: float, frame: str, site: LocalFrame) -> NavSatFix:
    """A position fix; ``site`` has the datum."""
    message = NavSatFix()
    message.header.frame_id, message.header.stamp = frame, time_of(fix.stamp + offset)
    message.status.status = NavSatStatus.STATUS_FIX
    message.status.service = NavSatStatus.SERVICE_GPS
    message.latitude, message.longitude = site.to_geodetic(fix.x, fix.y)
    covariance = np.zeros((3, 3))
    covariance[0, 0] = covariance[1, 1] = fix.position_std**2
    message.position_covariance = covariance.ravel()
    message.position_covariance_type = NavSatFix.COVARIANCE_TYPE_DIAGONAL_KNOWN
    return message


def map_message(grid: OccupancyGrid, frame: str) -> GridMessage:
    """A map as map_server publishes it."""
    message = GridMessage()
    message.header.frame_id = frame
    message.info.resolution = grid.resolution
    message.info.height, message.info.width = grid.data.shape
    message.info.origin = pose_message(grid.origin)
    # as rclpy takes it without a check of each number
    message.data = array("b", grid.data.astype(np.int8).tobytes())
    return message


def grid_of(message: Any) -> OccupancyGrid:
    """The map of a message, whose resolution is a float32 there.

    Raises:
        InputError: it is no map.
    """
    info = message.info
    origin = pose_of(PoseStamped(pose=info.origin))
    if origin is None or len(message.data) != info.width * info.height or not message.data:
        raise InputError(
            f"/map has {info.width} x {info.height} cells, {len(message.data)} values and the "
            f"origin {info.origin.position.x:g}, {info.origin.position.y:g}; that is no map"
        )
    if not 0.0 < info.resolution <= COARSEST:
        raise InputError(f"/map has cells of {info.resolution:g} m; up to {COARSEST:g} m are read")
    cells = np.array(message.data, dtype=np.int8).reshape(info.height, info.width)
    return OccupancyGrid(cells, round(info.resolution, 6), Pose2D(*origin))


def command_of(message: Any) -> Twist2D | None:
    """The command of a Twist or TwistStamped; None: one that no robot can follow."""
    twist = getattr(message, "twist", message)
    values: FloatArray = np.array((twist.linear.x, twist.linear.y, twist.angular.z))
    if not (np.abs(values) <= FASTEST).all():
        return None
    return Twist2D(*values.tolist())

"""What a ROS 2 message leaves of a measurement."""

from dataclasses import replace

import numpy as np

from navstack.types import GpsFix, Imu, LaserScan, Observation, Odometry, Pose2D

# digits after the point, of [s]: a message's nanoseconds
STAMP = 9
# of [rad] and [m]: a quaternion, and latitude and longitude, come back within less than half of it
ANGLE, POSITION = 9, 6


def as_messages(seen: Observation) -> Observation:
    """An observation that messages of ROS 2 carry without another loss.

    A scan's numbers are float32 in sensor_msgs/LaserScan. Times are in whole nanoseconds, headings
    in 1e-9 rad, and fixes in micrometres, for the way there and back does not end on the same bit.
    """
    odometry, imu, gps, scan = seen.odometry, seen.imu, seen.gps, seen.scan
    return Observation(
        round(seen.stamp, STAMP),
        odometry and _odometry(odometry),
        imu and _imu(imu),
        gps and _fix(gps),
        scan and _scan(scan),
    )


def _odometry(odometry: Odometry) -> Odometry:
    pose = odometry.pose
    turned = Pose2D(pose.x, pose.y, round(pose.yaw, ANGLE))
    return replace(odometry, stamp=round(odometry.stamp, STAMP), pose=turned)


def _imu(imu: Imu) -> Imu:
    return replace(imu, stamp=round(imu.stamp, STAMP), yaw=round(imu.yaw, ANGLE))


def _fix(fix: GpsFix) -> GpsFix:
    x, y = round(fix.x, POSITION), round(fix.y, POSITION)
    return replace(fix, stamp=round(fix.stamp, STAMP), x=x, y=y)


def _scan(scan: LaserScan) -> LaserScan:
    return replace(
        scan,
        stamp=round(scan.stamp, STAMP),
        ranges=scan.ranges.astype(np.float32).astype(np.float64),
        angle_min=float(np.float32(scan.angle_min)),
        angle_increment=float(np.float32(scan.angle_increment)),
        range_min=float(np.float32(scan.range_min)),
        range_max=float(np.float32(scan.range_max)),
    )

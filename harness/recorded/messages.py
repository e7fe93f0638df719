"""From ROS messages to the robot's own: planar, in the base frame, with the time of measurement."""

import math
from typing import Any

import numpy as np

from harness.recorded.mountings import Transform, from_quaternion
from navstack.geometry import normalize_angle
from navstack.types import FloatArray, GpsFix, Imu, LaserScan, Odometry, Pose2D, Twist2D

MOST_BEAMS = 100_000
_NO_FIX, _UNKNOWN_COVARIANCE = -1, 0  # of sensor_msgs/NavSatStatus and NavSatFix
_NOT_MEASURED = -1.0  # first covariance of what a sensor_msgs/Imu does not have
_GRAVITY = 9.80665  # [m/s2]
_LEVEL = 1e-12  # [rad] of tilt that is none
_UPRIGHT = 0.5  # [-] cosine of the tilt up to which a base is believed to stand on a slope
_LEAST_VARIANCE = 1e-12  # of [m], [rad] and their rates: a sensor that is right to 1e-6
_FARTHEST, _FASTEST = 1e7, 1e4  # [m], [m/s] and [rad/s] beyond which a number is none of a robot's


def stamp_of(message: Any) -> float:
    """The header's stamp in [s]."""
    return float(message.header.stamp.sec) + float(message.header.stamp.nanosec) * 1e-9


def laser_scan(message: Any, stamp: float, mounting: Transform) -> LaserScan | None:
    """A scan with beams counter-clockwise in the base frame; None: no beam can be used.

    A sensor that hangs upside down sees its beams mirrored. What is no number stays so; zero,
    negative ranges and minus infinity mean that the return was too near (REP 117) and stay below
    ``range_min``.
    """
    ranges = np.array(message.ranges, dtype=np.float64)
    count = len(ranges)
    start, step = float(message.angle_min), float(message.angle_increment)
    if count > 1 and not (math.isfinite(step) and step != 0.0):
        step = (float(message.angle_max) - start) / (count - 1)
    shortest, longest = float(message.range_min), float(message.range_max)
    if not math.isfinite(longest) or longest <= 0.0:
        finite = ranges[np.isfinite(ranges)]
        longest = float(finite.max(initial=0.0)) + 1.0
    is_whole = 1 < count <= MOST_BEAMS and abs(start) < 100.0 and 0.0 < abs(step) < math.pi
    if not is_whole or np.isnan(ranges).all():
        return None
    if mounting.rotation[2, 2] < 0.0:
        start, step = -start, -step
    if step < 0.0:
        ranges, start, step = ranges[::-1].copy(), start + (count - 1) * step, -step
    if not 0.0 < shortest < math.inf:
        shortest = 0.0
    pose = Pose2D(float(mounting.translation[0]), float(mounting.translation[1]), mounting.yaw)
    return LaserScan(stamp, ranges, start, step, shortest, longest, pose)


def odometry(message: Any, stamp: float, child: Transform) -> Odometry | None:
    """Wheel odometry of the base frame from that of a frame that stands at ``child`` in it.

    None: not numbers.
    """
    pose, twist = message.pose.pose, message.twist.twist
    turn = _turn(pose.orientation)
    numbers = (pose.position.x, pose.position.y)
    speeds = (twist.linear.x, twist.linear.y, twist.linear.z)
    rates = (twist.angular.x, twist.angular.y, twist.angular.z)
    is_plausible = _within(_FARTHEST, *numbers) and _within(_FASTEST, *speeds, *rates)
    if turn is None or not is_plausible:
        return None
    covariance = np.asarray(message.twist.covariance, dtype=np.float64)
    speed_std, rate_std = _deviation(covariance[0]), _deviation(covariance[35])
    base = Transform(turn, np.array((*numbers, 0.0))) @ child.inverse
    angular = child.rotation @ rates
    linear = child.rotation @ speeds + np.cross(child.translation, angular)
    planar = Twist2D(float(linear[0]), float(linear[1]), float(angular[2]))
    x, y, _ = base.translation.tolist()
    return Odometry(stamp, Pose2D(x, y, base.yaw), planar, speed_std, rate_std)


def imu(message: Any, stamp: float, mounting: Transform, heading: float = 0.0) -> Imu | None:
    """An inertial measurement in the base frame; None: no yaw rate, or no number.

    What the unit says that it does not measure (first covariance -1) is not there; accelerations
    are zeros then.

    The yaw is that of the base's x axis in the frame in which the unit gives its orientation (x
    east, y north by REP 103), less ``heading`` in [rad], where the map's x axis points in that
    frame. It is nan where the unit says that it has none (first covariance -1), or where the
    quaternion is none. A base that the orientation shows on a slope turns about the vertical, and
    its accelerations are without gravity, where the unit's have it (REP 145).
    """
    rate = message.angular_velocity
    if not _within(_FASTEST, rate.x, rate.y, rate.z):
        return None
    if message.angular_velocity_covariance[0] == _NOT_MEASURED:
        return None
    turns = mounting.rotation @ (rate.x, rate.y, rate.z)
    pushes = mounting.rotation @ (specific_force(message) or (0.0, 0.0, 0.0))
    yaw, yaw_std, up = math.nan, 0.0, np.array((0.0, 0.0, 1.0))
    turn = _turn(message.orientation)
    if turn is not None and message.orientation_covariance[0] != _NOT_MEASURED:
        # the base's x axis in the unit's frame is the first row
        ahead = turn @ mounting.rotation[0]
        yaw = normalize_angle(math.atan2(ahead[1], ahead[0]) - heading)
        yaw_std = _deviation_about_z(message.orientation_covariance, mounting)
        up = _upright(mounting.rotation @ turn[2])
    if pushes @ up > _GRAVITY / 2.0:
        pushes -= _GRAVITY * up
    rate_z = float(turns[1:] @ up[1:]) / float(up[1:] @ up[1:])  # of Euler's yaw, pitch and roll
    rate_std = _deviation_about_z(message.angular_velocity_covariance, mounting)
    return Imu(
        stamp,
        yaw,
        rate_z,
        float(pushes[0]),
        float(pushes[1]),
        yaw_std,
        rate_std,
        -math.asin(up[0]),
    )


def specific_force(message: Any) -> tuple[float, float, float] | None:
    """What an accelerometer feels along its own axes, in [m/s2]; None: there is none."""
    force = message.linear_acceleration
    if message.linear_acceleration_covariance[0] == _NOT_MEASURED:
        return None
    if not _within(_FASTEST, force.x, force.y, force.z):
        return None
    return float(force.x), float(force.y), float(force.z)


def _upright(up: FloatArray) -> FloatArray:
    """The vertical (3,) in the base frame; a unit with other axes than REP 103 is ignored.

    On level ground it is exact, for a quaternion's rounding is no slope.
    """
    if up[2] > _UPRIGHT and math.hypot(up[0], up[1]) > _LEVEL:
        return up
    return np.array((0.0, 0.0, 1.0))


def coordinates(message: Any) -> tuple[float, float] | None:
    """Latitude and longitude in degrees; None: the receiver had no fix."""
    latitude, longitude = float(message.latitude), float(message.longitude)
    is_place = abs(latitude) <= 90.0 and abs(longitude) <= 360.0
    if message.status.status <= _NO_FIX or not is_place or latitude == longitude == 0.0:
        return None
    return latitude, longitude


def gps_fix(
    message: Any,
    stamp: float,
    place: tuple[float, float],
    lever: FloatArray,
    yaw: float,
) -> GpsFix:
    """A fix of the base frame's origin.

    Args:
        message: a ``sensor_msgs/NavSatFix``.
        stamp: [s].
        place: [m] of the antenna in the local frame.
        lever: (3,) [m] of the antenna in the base frame.
        yaw: [rad] of the base, as far as it is known.
    """
    cos, sin = math.cos(yaw), math.sin(yaw)
    x = place[0] - cos * float(lever[0]) + sin * float(lever[1])
    y = place[1] - sin * float(lever[0]) - cos * float(lever[1])
    deviation = 0.0
    if message.position_covariance_type != _UNKNOWN_COVARIANCE:
        east, north = (float(message.position_covariance[i]) for i in (0, 4))
        deviation = _deviation((east + north) / 2.0)
    return GpsFix(stamp, x, y, deviation)


def pose_of(message: Any) -> tuple[float, float, float] | None:
    """x, y [m] and yaw [rad] of a PoseStamped, PoseWithCovarianceStamped or Odometry.

    None: not numbers.
    """
    pose = message.pose.pose if hasattr(message.pose, "pose") else message.pose
    turn = _turn(pose.orientation)
    if turn is None or not _within(_FARTHEST, pose.position.x, pose.position.y):
        return None
    return float(pose.position.x), float(pose.position.y), math.atan2(turn[1, 0], turn[0, 0])


def _turn(orientation: Any) -> FloatArray | None:
    return from_quaternion(orientation.x, orientation.y, orientation.z, orientation.w)


def _within(limit: float, *numbers: float) -> bool:
    return all(abs(number) <= limit for number in numbers)  # not so of what is no number


def _deviation(variance: float) -> float:
    """The standard deviation; 0, which means that none is stated, where the variance is none.

    Drivers that know none also write the smallest number there is.
    """
    if not _LEAST_VARIANCE < variance < math.inf:
        return 0.0
    return math.sqrt(variance)


def _deviation_about_z(covariance: FloatArray, mounting: Transform) -> float:
    """The deviation about the base's z axis of a covariance (9,) about the sensor's axes."""
    if covariance[0] == _NOT_MEASURED or not np.isfinite(covariance).all():
        return 0.0
    up = mounting.rotation[2]
    return _deviation(float(up @ np.reshape(covariance, (3, 3)) @ up))

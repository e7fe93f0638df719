"""The way that wheels and gyro measured."""

from dataclasses import dataclass

import numpy as np

from harness.identify.turning import Turning, gaps_of, integral
from harness.recorded.drive_log import LEAST_IMU, DriveLog
from navstack.geometry import rotation
from navstack.types import FloatArray


@dataclass(frozen=True, slots=True)
class WheelPath:
    """The way that wheels and gyro measured."""

    stamps: FloatArray  # (N,) [s]
    poses: FloatArray  # (N, 3) x, y [m] as the odometry has lengths, true yaw [rad]
    driven: FloatArray  # (N,) [m] length until then
    antenna: FloatArray  # (2,) x, y [m] of the receiver's, base frame

    def at(self, stamps: FloatArray) -> FloatArray:
        """Poses (M, 3) at other times."""
        columns = [np.interp(stamps, self.stamps, column) for column in self.poses.T]
        return np.column_stack(columns)

    def of_antenna(self, stamps: FloatArray, share: float = 1.0) -> FloatArray:
        """Places (M, 2) [m] of the antenna at other times, with lengths times ``share``."""
        x, y, yaw = self.at(stamps).T
        return np.column_stack((share * x, share * y)) + turned(self.antenna, yaw)

    def length(self, begin: FloatArray, end: FloatArray) -> FloatArray:
        """[m] driven between times (M,)."""
        found: FloatArray = np.interp(end, self.stamps, self.driven)
        found = found - np.interp(begin, self.stamps, self.driven)
        return found


def path_of(log: DriveLog, turning: Turning, with_gyro: bool = True) -> WheelPath:
    """The odometry's steps along the gyro's heading, or along its own without the turns' scale."""
    stamps, x, y, _ = log.odometry[:, :4].T
    yaw = log.yaws
    steps = np.column_stack((np.diff(x), np.diff(y)))
    middle = 0.5 * (yaw[1:] + yaw[:-1])
    ahead = np.cos(middle) * steps[:, 0] + np.sin(middle) * steps[:, 1]
    ahead[log.steps == 0.0] = 0.0
    turns = np.where(log.jumps, 0.0, np.diff(yaw) / turning.scale)
    if with_gyro and len(log.imu) > LEAST_IMU:
        turns = _by_gyro(log, turning, turns)
    heading = np.concatenate(((0.0,), np.cumsum(turns)))
    middle = 0.5 * (heading[1:] + heading[:-1])
    steps = ahead[:, None] * np.column_stack((np.cos(middle), np.sin(middle)))
    places = np.vstack((np.zeros(2), np.cumsum(steps, axis=0)))
    driven = np.concatenate(((0.0,), np.cumsum(np.abs(ahead))))
    return WheelPath(stamps, np.column_stack((places, heading)), driven, log.antenna)


def _by_gyro(log: DriveLog, turning: Turning, turns: FloatArray) -> FloatArray:
    """Turns (N - 1,) [rad] between rows of the odometry, as the gyro has them where it was on."""
    rates = log.gyro_rates - turning.bias
    times = log.imu_stamps - turning.delay
    begins, ends = log.stamps[:-1], log.stamps[1:]
    is_seen = (begins >= times[0]) & (ends <= times[-1])
    for gap in gaps_of(times):
        is_seen &= (ends <= times[gap]) | (begins >= times[gap + 1])
    found: FloatArray = np.where(is_seen, integral(times, rates, log.stamps), turns)
    return found


def turned(place: FloatArray, yaws: FloatArray) -> FloatArray:
    """A place (2,) in a frame that is turned by yaws (M,) [rad], (M, 2)."""
    cos, sin = np.cos(yaws), np.sin(yaws)
    x, y = place
    return np.column_stack((cos * x - sin * y, sin * x + cos * y))


def turn_onto(ours: FloatArray, theirs: FloatArray) -> FloatArray:
    """Rotation (2, 2) of points (n, 2) onto others (Umeyama 1991, no scale)."""
    a = ours - ours.mean(axis=0)
    b = theirs - theirs.mean(axis=0)
    angle = np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
    return rotation(angle)


def apart_when_laid(ours: FloatArray, theirs: FloatArray) -> FloatArray:
    """Errors (n, 2) of points (n, 2) that are moved and turned onto others (:func:`turn_onto`)."""
    turned = (ours - ours.mean(axis=0)) @ turn_onto(ours, theirs).T
    errors: FloatArray = turned - (theirs - theirs.mean(axis=0))
    return errors

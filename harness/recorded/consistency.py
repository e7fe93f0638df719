"""Whether the sensors of a log tell of one motion: wrong units, axes and frames show there."""

from array import array

import numpy as np

from navstack.types import FloatArray, Imu, LaserScan, Odometry

_WINDOW = 1.0  # [s] over which motions are compared
_LONGEST = 3.0  # [s] of such a window in a log with gaps
_MOVING, _FEWEST = 0.1, 10  # [m], [rad] of a window that counts; windows that decide
_FIT = (0.6, 1.7)  # [-] of two motions that one device tells
_SKID_FIT = (0.3, 3.0)  # [-] of gyro and wheels: those that skid turn farther than the robot


class Consistency:
    """Compares the motions that poses, velocities, gyro and headings tell."""

    def __init__(self) -> None:
        self._wheels = array("d")  # rows of stamp, x, y, yaw, vx, vy, yaw rate
        self._unit = array("d")  # rows of stamp, yaw, yaw rate
        self._scans, self._blind = 0, 0  # all, and those without a return

    def take(self, measured: object) -> None:
        """Take note of a measurement in the base frame; fixes do not count."""
        if isinstance(measured, Odometry):
            pose, twist = measured.pose, measured.twist
            row = (pose.x, pose.y, pose.yaw, twist.linear_x, twist.linear_y, twist.angular_z)
            self._wheels.extend((measured.stamp, *row))
        elif isinstance(measured, Imu):
            self._unit.extend((measured.stamp, measured.yaw, measured.angular_velocity_z))
        elif isinstance(measured, LaserScan):
            ranges = measured.ranges
            is_return = (ranges > measured.range_min) & (ranges <= measured.range_max)
            self._scans += 1
            self._blind += not is_return.any()

    def doubts(self) -> list[str]:
        """What does not fit, one line each; empty where all fits or too little moved."""
        wheels, unit = _rows(self._wheels, 7), _rows(self._unit, 3)
        headings = unit[np.isfinite(unit[:, 1])]
        gyro = unit[:, 0], _integral(unit[:, 0], unit[:, 2:])
        turning = wheels[:, 0], np.unwrap(wheels[:, 3])[:, None]
        heading = headings[:, 0], np.unwrap(headings[:, 1])[:, None]
        rates = wheels[:, 0], _integral(wheels[:, 0], wheels[:, 6:])
        velocities = wheels[:, 0], _integral(wheels[:, 0], _in_odometry_frame(wheels))
        found = [
            _doubt(
                _gain(velocities, (wheels[:, 0], wheels[:, 1:3])),
                _FIT,
                "the velocities of the odometry are {} times the motion of its poses: they have "
                "to be in m/s, in its child frame",
            ),
            _doubt(
                _gain(rates, turning),
                _FIT,
                "the yaw rates of the odometry are {} times the turning of its poses: they have "
                "to be in rad/s, counter-clockwise",
            ),
            _doubt(
                _gain(gyro, turning),
                _SKID_FIT,
                "the gyro turns {} times as far as the odometry: both have to be in rad and "
                "counter-clockwise",
            ),
            _doubt(
                _gain(heading, gyro),
                _FIT,
                "the heading of the inertial unit turns {} times as far as its gyro: both have to "
                "be in rad and counter-clockwise, the heading from east",
            ),
        ]
        if self._blind == self._scans >= _FEWEST:
            found.append(
                f"none of the {self._scans} scans has a return between range_min and range_max: "
                "all three have to be in m"
            )
        return [line for line in found if line]


Told = tuple[FloatArray, FloatArray]  # stamps (N,) [s], positions or angles (N, k) since the start


def _rows(numbers: "array[float]", columns: int) -> FloatArray:
    """Rows by stamp, each stamp once."""
    rows = np.array(numbers).reshape(-1, columns)
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    return rows[np.diff(rows[:, 0], prepend=-np.inf) > 0.0]


def _in_odometry_frame(wheels: FloatArray) -> FloatArray:
    """Velocities (N, 2) [m/s] along the axes of the poses."""
    cos, sin = np.cos(wheels[:, 3]), np.sin(wheels[:, 3])
    vx, vy = wheels[:, 4], wheels[:, 5]
    return np.column_stack((cos * vx - sin * vy, sin * vx + cos * vy))


def _integral(stamps: FloatArray, rates: FloatArray) -> FloatArray:
    """What rates (N, k) add up to since the first stamp (N, k)."""
    steps = np.diff(stamps)[:, None] * (rates[1:] + rates[:-1]) / 2.0
    return np.vstack((np.zeros((1, rates.shape[1])), np.cumsum(steps, axis=0)))[: len(stamps)]


def _gain(told: Told, known: Told) -> float | None:
    """Ratio of the reported motion to the known one: the median over windows with motion.

    None: there are too few such windows.
    """
    stamps, values = known
    if len(stamps) < 2 or len(told[0]) < 2:
        return None
    windows = np.unique(np.floor((stamps - stamps[0]) / _WINDOW))  # a clock may be set forward
    ends = np.searchsorted(stamps[:-1], stamps[0] + _WINDOW * windows)
    is_told = (stamps[ends] >= told[0][0]) & (stamps[ends] <= told[0][-1])
    ends = ends[is_told]
    columns = [np.interp(stamps[ends], told[0], column) for column in told[1].T]
    reported = np.diff(np.column_stack(columns), axis=0)
    true = np.diff(values[ends], axis=0)
    squares = (true**2).sum(axis=1)
    moves = (squares > _MOVING**2) & (np.diff(stamps[ends]) < _LONGEST)
    if moves.sum() < _FEWEST:
        return None
    return float(np.median((reported * true).sum(axis=1)[moves] / squares[moves]))


def _doubt(gain: float | None, fit: tuple[float, float], line: str) -> str:
    """The line with the gain, where that is outside the range that fits; else nothing."""
    if gain is None or fit[0] <= gain <= fit[1]:
        return ""
    return line.format(f"{gain:.3g}")

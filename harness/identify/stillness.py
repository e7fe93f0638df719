"""When the robot stood, and what its inertial unit and lidar read meanwhile."""

import numpy as np

from harness.identify.estimate import (
    Estimate,
    around,
    deviation_interval,
    robust_std,
    runs_of,
    unknown,
)
from harness.recorded.drive_log import DriveLog, period_of
from navstack.types import BoolArray, FloatArray, LaserScan

_WINDOW = 0.5  # [s] around a moment in which the robot must not move
_STILL, _STILL_TURN = 0.003, 0.002  # [m], [rad] of the odometry within it
_LEAST_STANDING = 5.0  # [s] of standing that gives a bias
_LEAST = 30  # readings that give a deviation
_NEAR = 0.3  # [m] between neighbours on one surface
_SCANS = 400  # at most that are looked at
STAND = "let it stand for 15 s with everything switched on"


def standing(log: DriveLog) -> BoolArray:
    """Which rows (N,) of the odometry are of a robot that stands."""
    stamps, x, y, _ = log.odometry[:, :4].T
    before, after = stamps - _WINDOW, stamps + _WINDOW

    def change(values: FloatArray) -> FloatArray:
        found: FloatArray = np.interp(after, stamps, values) - np.interp(before, stamps, values)
        return found

    moved = np.hypot(change(x), change(y))
    chosen: BoolArray = (moved < _STILL) & (np.abs(change(log.yaws)) < _STILL_TURN)
    return chosen


def at_rest(log: DriveLog, stamps: FloatArray) -> BoolArray:
    """Which of other stamps (M,) [s] are within the standing of the odometry."""
    still = standing(log)
    if not len(stamps) or not still.any():
        return np.zeros(len(stamps), dtype=bool)
    nearest = np.searchsorted(log.stamps, stamps).clip(0, len(still) - 1)
    inside = (stamps >= log.stamps[0]) & (stamps <= log.stamps[-1])
    chosen: BoolArray = still[nearest] & inside
    return chosen


def white_noise(key: str, values: FloatArray, period: float, method: str) -> Estimate:
    """White noise of a signal (N,) that otherwise changes slowly.

    The Allan deviation at the shortest time (IEEE Std 952-1997, annex C), from second differences,
    whose standard deviation is sqrt(6) times that of white noise and which a steady change leaves
    alone; by the median, for accelerations are outliers.
    """
    differences = np.diff(values, 2)
    if len(differences) < _LEAST:
        return unknown(key, STAND)
    value = robust_std(differences) / np.sqrt(6.0)
    # the median needs 1/0.37 times the values, and neighbours share two of three
    low, high = deviation_interval(max(round(len(differences) * 0.37 / 1.9), 3))
    seconds = len(values) * period
    return Estimate(key, float(value), value * low, value * high, seconds, method)


def imu_noise(log: DriveLog) -> list[Estimate]:
    """Bias and white noise of the gyro, white noise of the accelerometers."""
    keys = "imu_yaw_rate_bias_radps", "imu_yaw_rate_std_radps", "imu_acceleration_std_mps2"
    if len(log.imu) < _LEAST:
        return [unknown(key, "record /imu/data as well") for key in keys]
    period = period_of(log.imu_stamps)
    still = at_rest(log, log.imu_stamps)
    stood = float(still.sum() * period)
    rates, ahead = log.gyro_rates, log.imu[:, 3]
    method = "Allan deviation, standing"
    if stood < _LEAST_STANDING:
        still = np.ones(len(rates), dtype=bool)
        method = "second differences while driving"
    found = []
    if stood < _LEAST_STANDING:
        found.append(unknown(keys[0], STAND, stood))
    else:
        found.append(_bias(keys[0], rates[still], stood))
    found.append(white_noise(keys[1], rates[still], period, method))
    if log.has_accelerations:
        found.append(white_noise(keys[2], ahead[still], period, method))
    else:
        found.append(unknown(keys[2], "the inertial unit measures no accelerations"))
    return found


def _bias(key: str, rates: FloatArray, seconds: float) -> Estimate:
    """The mean (N,) with an interval by the means of ten parts, which see slow changes, too."""
    parts = np.array([part.mean() for part in np.array_split(rates, 10)])
    value = float(np.median(parts))
    half = 2.26 * float(parts.std(ddof=1)) / np.sqrt(10.0)
    return around(key, value, half, seconds, "mean, standing")


def imu_walk(log: DriveLog) -> Estimate:
    """Random walk of the gyro's bias, which only hours of standing show."""
    key = "imu_yaw_rate_bias_walk_radps_per_sqrt_s"
    if not len(log.imu):
        return unknown(key, "record /imu/data as well")
    period = period_of(log.imu_stamps)
    still = at_rest(log, log.imu_stamps)
    longest = max((part.stop - part.start for part in runs_of(still)), default=0) * period
    return unknown(key, "let it stand for an hour in a log of its own", longest)


def lidar_noise(log: DriveLog) -> list[Estimate]:
    """Noise of a range, and the share of beams that return nothing from a surface."""
    noise, dropout = "lidar_noise_std_m", "lidar_dropout"
    if len(log.scans) < 2:
        return [unknown(noise, "record /scan as well"), unknown(dropout, "record /scan as well")]
    stamps = np.array([scan.stamp for scan in log.scans])
    period = period_of(stamps)
    still = at_rest(log, stamps)
    found = []
    pairs = np.flatnonzero(still[1:] & still[:-1] & (np.diff(stamps) < 3.0 * period))[:_SCANS]
    differences = [_difference(log.scans[at], log.scans[at + 1]) for at in pairs]
    values = np.concatenate(differences) if differences else np.empty(0)
    if len(values) < 10 * _LEAST:
        found.append(unknown(noise, STAND, len(pairs) * period))
    else:
        value = robust_std(values) / np.sqrt(2.0)
        low, high = deviation_interval(max(len(values) // 6, 2))
        ends = value * low, value * high
        seconds = len(pairs) * period
        method = "ranges of successive scans, standing"
        found.append(Estimate(noise, value, *ends, seconds, method))
    chosen = log.scans[:: max(len(log.scans) // _SCANS, 1)]
    lost = np.array([_lost(scan) for scan in chosen])
    shares = np.array([part.sum(axis=0) for part in np.array_split(lost, 10) if len(part)])
    share = shares[:, 0].sum() / max(shares[:, 1].sum(), 1.0)
    parts = shares[:, 0] / np.maximum(shares[:, 1], 1.0)
    half = 2.26 * float(parts.std()) / np.sqrt(len(parts))
    half = max(half, 3.0 / max(float(shares[:, 1].sum()), 3.0))  # rule of three: none was lost
    ends = max(share - half, 0.0), share + half
    seconds = len(chosen) * period
    found.append(Estimate(dropout, float(share), *ends, seconds, "beams between returns"))
    return found


def _difference(before: LaserScan, after: LaserScan) -> FloatArray:
    """Differences of the ranges that both scans have."""
    if len(before.ranges) != len(after.ranges):
        return np.empty(0)
    has_both = _returned(before) & _returned(after)
    difference = after.ranges[has_both] - before.ranges[has_both]
    kept: FloatArray = difference[np.abs(difference) < _NEAR]
    return kept


def _returned(scan: LaserScan) -> BoolArray:
    """Which beams (n,) met something; many drivers write 0 or a large number where none did."""
    ranges = scan.ranges
    with np.errstate(invalid="ignore"):
        is_within = (ranges >= scan.range_min) & (ranges <= scan.range_max)
        found: BoolArray = is_within & (ranges > 0.0)
    return found


def _lost(scan: LaserScan) -> tuple[int, int]:
    """Beams without a return between neighbours on one surface, and all such beams."""
    ranges = scan.ranges
    has_return = _returned(scan)
    before, after = np.roll(ranges, 1), np.roll(ranges, -1)
    beside = np.roll(has_return, 1) & np.roll(has_return, -1)
    with np.errstate(invalid="ignore"):
        is_surface = beside & (np.abs(after - before) < _NEAR)
    return int(np.sum(is_surface & ~has_return)), int(np.sum(is_surface))

"""How the wheels measure turns, against the gyro."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from harness.identify.estimate import (
    Estimate,
    half_widths,
    robust_std,
    unknown,
    variance_components,
)
from harness.identify.stillness import at_rest
from harness.recorded.log import DriveLog
from navstack.types import BoolArray, FloatArray

_WINDOW = 0.5  # [s] over which turns are compared
_SMOOTH = 0.25  # [s] over which the gyro is averaged to tell turns from noise
_LEAST_TURNED = 6.0  # [rad] in all
_GRAVITY = 9.81  # [m/s2]
_FARTHEST = 6.0  # [-] standard deviations beyond which a window is an outlier
EIGHT = "drive a figure of eight, and turn on the spot both ways, with /imu/data"


@dataclass(frozen=True, slots=True)
class Turning:
    """The odometry's turns against the gyro's."""

    scale: float  # [-] odometry's turn over the true one
    bias: float  # [rad/s] of the gyro
    delay: float  # [s] by which the gyro's stamps are later than the odometry's
    estimates: tuple[Estimate, ...]


def fit_turning(log: DriveLog) -> Turning:
    """Scale, noise and slip of the odometry's turns.

    Least squares over windows, weighted with the variances that are found: y = s (x - b t) with
    turns y of the odometry and x of the gyro.
    """
    if len(log.imu) < 100:
        return _nothing("record /imu/data as well", 0.0)
    delay, delay_half = _delay(log)
    edges, kept = _windows(log)
    stamps, yaw = log.odometry[:, 0], np.unwrap(log.odometry[:, 3])
    turned = np.diff(np.interp(edges, stamps, yaw))
    gyro = _integral(log.imu[:, 0] - delay, log.imu[:, 2], edges)
    if np.abs(gyro[kept]).sum() < _LEAST_TURNED:
        return _nothing(EIGHT, float(kept.sum() * _WINDOW))
    lateral = np.abs(log.odometry[:, 4] * log.odometry[:, 5]) / _GRAVITY
    slipping = gyro * _integral(stamps, lateral, edges) / _WINDOW
    columns = np.column_stack((gyro, np.full(len(gyro), _WINDOW), slipping))
    causes = np.column_stack((_moved(log, edges), _swept(log, edges), np.full(len(gyro), _WINDOW)))
    middle = edges[:-1] + 0.5 * _WINDOW
    return _fit(columns, turned, causes, kept, middle, (delay, delay_half))


def _fit(
    columns: FloatArray,
    turned: FloatArray,
    causes: FloatArray,
    kept: BoolArray,
    middle: FloatArray,
    delays: tuple[float, float],
) -> Turning:
    delay, delay_half = delays
    weights: FloatArray = np.ones(len(turned))
    values: FloatArray = np.zeros(2)
    components = [(0.0, 0.0, 0.0)] * 3
    for _ in range(3):
        weighted = columns[kept, :2] * weights[kept, None]
        values = np.linalg.lstsq(weighted, turned[kept] * weights[kept], rcond=None)[0]
        residuals = turned - columns[:, :2] @ values
        components = variance_components(residuals[kept], causes[kept])
        deviations = np.sqrt(causes @ np.square([each[0] for each in components]) + 1e-12)
        kept = kept & (np.abs(residuals) < _FARTHEST * deviations)
        weights = 1.0 / deviations
    weighted = columns[kept, :2] * weights[kept, None]
    errors = residuals[kept] * weights[kept]
    half = half_widths(weighted, errors, middle[kept])
    scale, bias = float(values[0]), float(-values[1] / values[0])
    seconds = float(kept.sum() * _WINDOW)
    method = "turns of odometry and gyro over 0.5 s, weighted least squares"
    key = "odometry_angular_scale"
    found = [Estimate(key, scale, scale - half[0], scale + half[0], seconds, method)]
    for key, (value, low, high) in zip(
        ("odometry_yaw_noise_per_distance", "odometry_yaw_noise_per_turn"), components, strict=False
    ):
        found.append(_noise(key, value, low, high, seconds))
    found.append(_slip(columns[kept], errors, weights[kept], middle[kept], scale, seconds))
    ends = delay - delay_half, delay + delay_half
    how = "least squares of both yaw rates"
    found.append(Estimate("imu_stamp_delay_s", delay, *ends, seconds, how))
    return Turning(scale, bias, delay, tuple(found))


def _noise(key: str, value: float, low: float, high: float, seconds: float) -> Estimate:
    """A deviation, or why it is none."""
    if low <= 0.0 and high > 3.0 * value:
        what = "straight on for 100 m" if key.endswith("distance") else "on the spot both ways"
        return unknown(key, f"drive {what}, with /imu/data", seconds)
    return Estimate(key, value, low, high, seconds, "variance of the turns, maximum likelihood")


def _slip(
    columns: FloatArray,
    errors: FloatArray,
    weights: FloatArray,
    middle: FloatArray,
    scale: float,
    seconds: float,
) -> Estimate:
    """The slip ratio per traction, from turns at speed."""
    key = "odometry_slip"
    advice = "drive curves at full speed, with /imu/data"
    design = columns * weights[:, None]
    values, *_ = np.linalg.lstsq(design, errors, rcond=None)
    half = float(half_widths(design, errors - design @ values, middle)[2]) / scale
    value = float(values[2]) / scale
    if half > 0.05:
        return unknown(key, advice, seconds)
    ends = value - half, value + half
    return Estimate(key, value, *ends, seconds, "turns against lateral acceleration")


def _nothing(advice: str, seconds: float) -> Turning:
    keys = (
        "odometry_angular_scale",
        "odometry_yaw_noise_per_distance",
        "odometry_yaw_noise_per_turn",
        "odometry_slip",
        "imu_stamp_delay_s",
    )
    return Turning(1.0, 0.0, 0.0, tuple(unknown(key, advice, seconds) for key in keys))


def _delay(log: DriveLog) -> tuple[float, float]:
    """[s] by which the gyro's stamps are later, with the half width of its interval."""
    stamps, rates = log.odometry[:, 0], log.odometry[:, 5]
    inside = (stamps > log.imu[0, 0] + 1.0) & (stamps < log.imu[-1, 0] - 1.0)
    stamps, rates = stamps[inside], rates[inside]

    def residuals(values: FloatArray) -> FloatArray:
        gyro = np.interp(stamps + values[0], log.imu[:, 0], log.imu[:, 2])
        found: FloatArray = values[1] * gyro + values[2] - rates
        return found

    starts = [np.array((delay, 1.0, 0.0)) for delay in np.arange(-0.4, 0.41, 0.05)]
    start = min(starts, key=lambda values: float(np.abs(residuals(values)).sum()))
    scale = max(robust_std(residuals(start)), 1e-4)
    steps = {"x_scale": (0.01, 0.01, 0.01), "diff_step": (1e-2, 1e-4, 1e-4)}
    solution = least_squares(residuals, start + 1e-4, loss="soft_l1", f_scale=scale, **steps)
    half = half_widths(solution.jac, solution.fun, stamps)
    return float(solution.x[0]), float(half[0])


def _windows(log: DriveLog) -> tuple[FloatArray, BoolArray]:
    """Edges of the windows [s], and which of them have no gap in odometry or gyro."""
    first = max(log.odometry[0, 0], log.imu[0, 0]) + 0.5
    last = min(log.odometry[-1, 0], log.imu[-1, 0]) - 0.5
    edges = np.arange(first, last, _WINDOW)
    kept = np.ones(max(len(edges) - 1, 0), dtype=bool)
    for stamps in (log.odometry[:, 0], log.imu[:, 0]):
        steps = np.diff(stamps)
        longest = max(5.0 * float(np.median(steps)), 0.1)
        for gap in np.flatnonzero(steps > longest):
            kept &= (edges[1:] < stamps[gap]) | (edges[:-1] > stamps[gap + 1])
    return edges, kept


def _integral(stamps: FloatArray, values: FloatArray, edges: FloatArray) -> FloatArray:
    """Integrals (n - 1,) of a signal between edges (n,), by the trapezoidal rule."""
    steps = np.diff(stamps) * 0.5 * (values[1:] + values[:-1])
    areas = np.concatenate(((0.0,), np.cumsum(steps)))
    found: FloatArray = np.diff(np.interp(edges, stamps, areas))
    return found


def _moved(log: DriveLog, edges: FloatArray) -> FloatArray:
    """[m] driven in each window by the poses."""
    steps = np.hypot(np.diff(log.odometry[:, 1]), np.diff(log.odometry[:, 2]))
    return _summed(log.odometry[:, 0], steps, edges)


def _swept(log: DriveLog, edges: FloatArray) -> FloatArray:
    """[rad] turned in each window, without sign; the gyro's noise and bias are no turns."""
    stamps, rates = log.imu[:, 0], log.imu[:, 2]
    still = at_rest(log, stamps)
    bias = float(np.median(rates[still])) if still.any() else 0.0
    width = max(round(_SMOOTH / float(np.median(np.diff(stamps)))), 1)
    smooth = np.convolve(rates - bias, np.full(width, 1.0 / width), mode="same")
    smooth[still] = 0.0
    return _integral(stamps, np.abs(smooth), edges)


def _summed(stamps: FloatArray, steps: FloatArray, edges: FloatArray) -> FloatArray:
    sums = np.concatenate(((0.0,), np.cumsum(steps)))
    found: FloatArray = np.diff(np.interp(edges, stamps, sums))
    return found

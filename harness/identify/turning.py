"""How the wheels measure turns, against the gyro."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from harness.identify.estimate import (
    Estimate,
    around,
    half_widths,
    robust_std,
    unknown,
    variance_components,
)
from harness.identify.stillness import at_rest
from harness.recorded.drive_log import DriveLog, period_of
from navstack.types import BoolArray, FloatArray, IntArray

_LONG, _WINDOW = 3.0, 0.5  # [s] over which turns are compared: for the scale, for the noise
_LEAST_TURN = 0.05  # [rad] in a window that tells of the scale
_UNSURE = 0.1  # [-] half interval from which the scale is not identifiable
_STAMPS = 0.001  # [s] that a delay may be off however many turns there are
_STEP = 0.1  # [s] over which turns are compared to find the delay
_SMOOTH = 0.25  # [s] over which the gyro is averaged to tell turns from noise
_LEAST_TURNED = 3.0  # [rad] in all
_LEAST_TOGETHER, _LEAST_WINDOWS = 10, 3  # rows of odometry beside the gyro's; windows with a turn
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


@dataclass(frozen=True, slots=True)
class _Windows:
    """Turns of odometry and gyro in windows without gaps."""

    middle: FloatArray  # (n,) [s]
    turned: FloatArray  # (n,) [rad] by the odometry
    columns: FloatArray  # (n, 3) gyro's turn [rad], length [s], turn times lateral traction
    causes: FloatArray  # (n, 3) of variance: driven [m], turned [rad], length [s]


def fit_turning(log: DriveLog) -> Turning:
    """Scale, noise and slip of the odometry's turns.

    Weighted least squares: y = s (x - b t) with turns y of the odometry and x of the gyro. Long
    windows give the scale, for wheels that are filtered lag in short ones; short ones the noise.
    """
    if len(log.imu) < 100:
        return _nothing("record /imu/data as well", 0.0)
    if np.sum(_with_gyro(log, log.stamps)) < _LEAST_TOGETHER:
        return _nothing(EIGHT, 0.0)
    delay, delay_half = _delay(log)
    long, short = (_windows(log, delay, length) for length in (_LONG, _WINDOW))
    has_turned = np.abs(short.columns[:, 0]).sum() >= _LEAST_TURNED
    if not has_turned or np.sum(long.causes[:, 1] > _LEAST_TURN) < _LEAST_WINDOWS:
        return _nothing(EIGHT, len(short.middle) * _WINDOW)
    values, half = _scale_of(long)
    scale, bias = float(values[0]), float(-values[1] / values[0])
    seconds = len(long.middle) * _LONG
    method = f"turns of odometry and gyro over {_LONG:g} s, weighted least squares"
    key = "odometry_angular_scale"
    first = unknown(key, EIGHT, seconds)
    if half < _UNSURE:
        first = around(key, scale, half, seconds, method)
    how = "least squares of both yaw rates"
    late = around("imu_stamp_delay_s", delay, delay_half, seconds, how)
    noise = _noise_of(short, values, scale)
    return Turning(scale, bias, delay, (first, *noise, late))


def _scale_of(windows: _Windows) -> tuple[FloatArray, float]:
    """Scale and intercept (2,), and the half width of the scale's interval.

    Only by windows with a turn: the others tell nothing of the scale, and the gyro's noise in them
    would pull it down.
    """
    kept = windows.causes[:, 1] > _LEAST_TURN
    weights = 1.0 / np.sqrt(windows.causes[:, 1] + _LEAST_TURN)
    values: FloatArray = np.zeros(2)
    errors: FloatArray = np.zeros(len(kept))
    for _ in range(3):
        design = windows.columns[:, :2] * weights[:, None]
        solved, *_ = np.linalg.lstsq(design[kept], windows.turned[kept] * weights[kept], rcond=None)
        values = solved.astype(np.float64)
        errors = windows.turned * weights - design @ values
        kept = kept & (np.abs(errors) < _FARTHEST * robust_std(errors[kept]) + 1e-12)
    half = half_widths(design[kept], errors[kept], windows.middle[kept])
    return values, float(half[0])


def _noise_of(windows: _Windows, values: FloatArray, scale: float) -> list[Estimate]:
    """Noise by distance and by turn, and slip."""
    residuals = windows.turned - windows.columns[:, :2] @ values
    kept = np.ones(len(residuals), dtype=bool)
    for _ in range(2):
        components = variance_components(residuals[kept], windows.causes[kept])
        found = np.square([each[0] for each in components])
        deviations = np.sqrt(windows.causes @ found + 1e-12)
        kept &= np.abs(residuals) < _FARTHEST * deviations
    seconds = float(kept.sum() * _WINDOW)
    keys = "odometry_yaw_noise_per_distance", "odometry_yaw_noise_per_turn"
    noise = [_noise(key, *each, seconds) for key, each in zip(keys, components, strict=False)]
    weights = 1.0 / deviations[kept]
    errors = residuals[kept] * weights
    slip = _slip(windows.columns[kept], errors, weights, windows.middle[kept], scale, seconds)
    return [*noise, slip]


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
    return around(key, value, half, seconds, "turns against lateral acceleration")


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
    """[s] by which the gyro's stamps are later, with the half width of its interval.

    Against the poses, for drivers filter the yaw rate that they report: a Husky's is 0.35 s late.
    """
    edges = np.arange(log.imu_stamps[0], log.imu_stamps[-1], _STEP)
    stamps = edges[:-1] + 0.5 * _STEP
    inside = _with_odometry(log, stamps)
    stamps, begins = stamps[inside], edges[:-1][inside]
    turns = integral(log.imu_stamps, log.gyro_rates, edges)[inside] / _STEP

    def residuals(values: FloatArray) -> FloatArray:
        """The gyro's mean rates less the odometry's, which has less noise and is moved in time."""
        moved = begins + 1.0 - values[0]
        ends = np.interp(moved + _STEP, log.stamps, log.yaws)
        rates = (ends - np.interp(moved, log.stamps, log.yaws)) / _STEP
        found: FloatArray = values[1] * turns + values[2] - rates
        return found

    # 1 s more than the delay, so that relative steps are some
    starts = [np.array((1.0 + delay, 1.0, 0.0)) for delay in np.arange(-0.4, 0.41, 0.05)]
    start = min(starts, key=lambda values: float(np.abs(residuals(values)).sum()))
    scale = max(robust_std(residuals(start)), 1e-4)
    steps = {"x_scale": (0.01, 0.01, 0.01), "diff_step": (1e-2, 1e-4, 1e-4)}
    solution = least_squares(residuals, start + 1e-4, loss="soft_l1", f_scale=scale, **steps)
    half = half_widths(solution.jac, solution.fun, stamps)
    return float(solution.x[0]) - 1.0, math.hypot(float(half[0]), _STAMPS)


def _with_odometry(log: DriveLog, stamps: FloatArray) -> BoolArray:
    """Which stamps (N,) [s] have a second of odometry before and after them, without a jump."""
    found: BoolArray = (stamps > log.stamps[0] + 1.0) & (stamps < log.stamps[-1] - 1.0)
    for jump in log.stamps[:-1][log.jumps]:
        found &= np.abs(stamps - jump) > 1.0
    return found


def _with_gyro(log: DriveLog, stamps: FloatArray) -> BoolArray:
    """Which stamps (N,) [s] have a second of the gyro before and after them."""
    found: BoolArray = (stamps > log.imu_stamps[0] + 1.0) & (stamps < log.imu_stamps[-1] - 1.0)
    return found


def _windows(log: DriveLog, delay: float, length: float) -> _Windows:
    """Windows of a length [s] that have no gap in odometry or gyro."""
    first = max(log.stamps[0], log.imu_stamps[0]) + 0.5
    last = min(log.stamps[-1], log.imu_stamps[-1]) - 0.5
    edges = np.arange(first, last, length)
    kept = np.ones(max(len(edges) - 1, 0), dtype=bool)
    for stamps in (log.stamps, log.imu_stamps):
        for gap in gaps_of(stamps):
            kept &= (edges[1:] < stamps[gap]) | (edges[:-1] > stamps[gap + 1])
    stamps, yaw = log.stamps, log.yaws
    gyro = integral(log.imu_stamps - delay, log.gyro_rates, edges)
    lateral = np.abs(log.speeds * log.yaw_rates) / _GRAVITY
    slipping = gyro * integral(stamps, lateral, edges) / length
    lengths = np.full(len(gyro), length)
    return _Windows(
        edges[:-1][kept] + 0.5 * length,
        np.diff(np.interp(edges, stamps, yaw))[kept],
        np.column_stack((gyro, lengths, slipping))[kept],
        np.column_stack((_moved(log, edges), _swept(log, edges), lengths))[kept],
    )


def gaps_of(stamps: FloatArray) -> IntArray:
    """The rows (n,) after which stamps (N,) [s] have a gap."""
    steps = np.diff(stamps)
    found: IntArray = np.flatnonzero(steps > max(5.0 * float(np.median(steps)), 0.1))
    return found


def integral(stamps: FloatArray, values: FloatArray, edges: FloatArray) -> FloatArray:
    """Integrals (n - 1,) of a signal between edges (n,), by the trapezoidal rule."""
    steps = np.diff(stamps) * 0.5 * (values[1:] + values[:-1])
    return _summed(stamps, steps, edges)


def _moved(log: DriveLog, edges: FloatArray) -> FloatArray:
    """[m] driven in each window by the poses."""
    return _summed(log.stamps, log.steps, edges)


def _swept(log: DriveLog, edges: FloatArray) -> FloatArray:
    """[rad] turned in each window, without sign; the gyro's noise and bias are no turns."""
    stamps, rates = log.imu_stamps, log.gyro_rates
    still = at_rest(log, stamps)
    bias = float(np.median(rates[still])) if still.any() else 0.0
    width = max(round(_SMOOTH / period_of(stamps)), 1)
    smooth = np.convolve(rates - bias, np.full(width, 1.0 / width), mode="same")
    smooth[still] = 0.0
    return integral(stamps, np.abs(smooth), edges)


def _summed(stamps: FloatArray, steps: FloatArray, edges: FloatArray) -> FloatArray:
    sums = np.concatenate(((0.0,), np.cumsum(steps)))
    found: FloatArray = np.diff(np.interp(edges, stamps, sums))
    return found

"""How the wheels measure distances, and where the lidar is, from scans and fixes.

Scale, mounting and time offset are found together, from the motions between pairs of scans and
those of the wheels (Censi et al., "Simultaneous calibration of odometry and sensor parameters for
mobile robots", IEEE T-RO 29(2), 2013). Fixes give the scale by the shape of the path.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from harness.identify.estimate import (
    Estimate,
    around,
    deviation_interval,
    half_widths,
    robust_std,
    unknown,
    variance_components,
)
from harness.identify.fix_filter import fit_filter, track_of
from harness.identify.scan_match import Surfaces, match
from harness.identify.wheel_path import WheelPath, apart_when_laid
from harness.recorded.drive_log import DriveLog
from harness.recorded.trajectory import motions_between
from navstack.types import FloatArray

_PAIR = 0.7  # [s] between the scans of a pair
_MOST_PAIRS = 600
_LEAST_PAIRS = 20
_UNSURE = 0.1  # [m], [rad] half interval from which a mounting is not identifiable
# [-] the same of a scale: twice what wheels are off before calibration (Borenstein & Feng 1996,
# UMBmark), which is known without a log
_UNSURE_SCALE = 0.02
_WINDOW = 20.0  # [s] in which a path is laid on its fixes
_LEAST_FIXES, _LEAST_SPREAD = 12, 1.0  # in a window; [m] root mean square about their middle
# of 1/scale, x, y, yaw and delay of the lidar: points on curved walls and stamps bias the matching
_FLOORS = (3e-4, 0.002, 0.002, 0.001, 0.001)
_FIRST_DEVIATION = 0.03  # [m] of a motion between scans, before it is known
_FARTHEST = 5.0  # [-] deviations beyond which a motion is an outlier
_LONGEST_GAP = 1.0  # [s] of the odometry within a pair or window
YARD = "drive a figure of eight among walls, with /scan"
STREET = "drive 100 m in the open, with /fix"


@dataclass(frozen=True, slots=True)
class Travel:
    """What scans or fixes tell about the wheels."""

    scale: Estimate  # [-] odometry's length over the true one
    estimates: tuple[Estimate, ...]


def fit_scans(log: DriveLog, path: WheelPath) -> Travel:
    """Scale, noise of lengths, and the lidar's mounting, from scans."""
    keys = "lidar_x_m", "lidar_y_m", "lidar_yaw_rad", "lidar_stamp_delay_s"
    noise = "odometry_linear_noise"
    scale_key = "odometry_linear_scale"
    pairs, motions = _matched(log, path)
    if len(pairs) < _LEAST_PAIRS:
        advice = YARD if log.scans else "record /scan as well"
        missing = tuple(unknown(key, advice) for key in (noise, *keys))
        return Travel(unknown(scale_key, advice), missing)
    begin, end = pairs.T
    lengths = path.length(begin, end)
    deviations = np.full(len(pairs), _FIRST_DEVIATION)

    def errors_of(values: FloatArray) -> FloatArray:
        moved = motions_between(path.at(begin - values[4]), path.at(end - values[4]))
        return _lidar_motion(moved, values) - motions

    def residuals(values: FloatArray) -> FloatArray:
        errors = errors_of(values)
        turns = errors[:, 2] / 0.005
        return np.concatenate((errors[:, 0] / deviations, errors[:, 1] / deviations, turns))

    values = np.array((1.0, *_mount_of(log), 0.0))
    components = [(0.0, 0.0, 0.0)] * 2
    for _ in range(3):
        solution = least_squares(residuals, values, loss="soft_l1", diff_step=1e-4)
        values = solution.x
        along = _forward(errors_of(values), values[3])
        kept = np.abs(along) < _FARTHEST * deviations
        causes = np.column_stack((np.ones(len(pairs)), lengths))
        components = variance_components(along[kept], causes[kept])
        found = np.square([each[0] for each in components])
        deviations = np.sqrt(causes @ found + 1e-8)
    stamps = np.tile(begin, 3)
    half = np.hypot(half_widths(solution.jac, _weighted(solution.fun), stamps), _FLOORS)
    seconds = float(np.sum(end - begin))
    method = "motions between scans (ICP) and of the wheels, least squares"
    scale = 1.0 / float(values[0])
    estimates = [_linear_noise(noise, components[1], scale, seconds)]
    for number, key in enumerate(keys, start=1):
        estimates.append(_mounted(key, float(values[number]), float(half[number]), seconds, method))
    first = around(scale_key, scale, half[0] * scale**2, seconds, method)
    if half[0] > _UNSURE_SCALE:
        first = unknown(scale_key, YARD, seconds)
    return Travel(first, tuple(estimates))


def _linear_noise(
    key: str,
    component: tuple[float, float, float],
    scale: float,
    seconds: float,
) -> Estimate:
    value, low, high = component
    if low <= 0.0 and high > 3.0 * value:
        return unknown(key, f"{YARD}, for 100 m", seconds)
    method = "variance of the motions, maximum likelihood"
    return Estimate(key, value * scale, low * scale, high * scale, seconds, method)


def _mounted(key: str, value: float, half: float, seconds: float, method: str) -> Estimate:
    if half > _UNSURE:
        return unknown(key, YARD, seconds)
    return around(key, value, half, seconds, method)


def _weighted(residuals: FloatArray) -> FloatArray:
    """Residuals as the soft loss weighs them."""
    found: FloatArray = residuals / (1.0 + residuals**2) ** 0.25
    return found


def _forward(errors: FloatArray, mount_yaw: float) -> FloatArray:
    """Errors (n,) [m] along the robot, from those in the lidar's frame."""
    found: FloatArray = np.cos(mount_yaw) * errors[:, 0] - np.sin(mount_yaw) * errors[:, 1]
    return found


def _lidar_motion(moved: FloatArray, values: FloatArray) -> FloatArray:
    """The lidar's motions (n, 3) that follow from the base's; values: 1/scale, x, y, yaw, delay."""
    share, x, y, yaw, _ = values
    cos, sin = np.cos(moved[:, 2]), np.sin(moved[:, 2])
    dx = share * moved[:, 0] + cos * x - sin * y - x
    dy = share * moved[:, 1] + sin * x + cos * y - y
    cos_yaw, sin_yaw = np.cos(yaw), np.sin(yaw)
    return np.column_stack((cos_yaw * dx + sin_yaw * dy, cos_yaw * dy - sin_yaw * dx, moved[:, 2]))


def _mount_of(log: DriveLog) -> tuple[float, float, float]:
    """Where the log says that the lidar is."""
    pose = log.scans[0].sensor_pose
    return pose.x, pose.y, pose.yaw


def _matched(log: DriveLog, path: WheelPath) -> tuple[FloatArray, FloatArray]:
    """Times (n, 2) [s] of pairs of scans, and the lidar's motions (n, 3) between them."""
    pairs: list[tuple[float, float]] = []
    motions: list[FloatArray] = []
    gaps = np.flatnonzero(np.diff(path.stamps) > _LONGEST_GAP)
    begins, ends = path.stamps[gaps], path.stamps[gaps + 1]
    mount = np.array((1.0, *_mount_of(log), 0.0)) if log.scans else np.zeros(5)
    before: Surfaces | None = None
    last = following = -np.inf
    step = max(_PAIR, log.duration / _MOST_PAIRS)  # from pair to pair
    for scan in log.scans:
        stamp = scan.stamp
        is_inside = path.stamps[0] < stamp < path.stamps[-1]
        if not is_inside or (stamp < following if before is None else stamp < last + _PAIR - 1e-3):
            continue
        after = Surfaces.of(scan)
        is_whole = not np.any((begins < stamp) & (ends > last))
        if before is not None and is_whole and stamp - last < 2.0 * _PAIR:
            ends_at = np.array(((last,), (stamp,)))
            moved = motions_between(path.at(ends_at[0]), path.at(ends_at[1]))
            motion = match(before, after, _lidar_motion(moved, mount)[0])
            if motion is not None:
                pairs.append((last, stamp))
                motions.append(motion)
        following = last + step
        is_next = before is None or stamp >= following - 1e-3
        before = after if is_next else None
        last = stamp
    return np.array(pairs).reshape(-1, 2), np.array(motions).reshape(-1, 3)


def fit_fixes(log: DriveLog, path: WheelPath, linear_noise: float) -> Travel:
    """Scale, the fixes' delay and white noise, from the shape of the path."""
    keys = "gps_position_std_m", "gps_stamp_delay_s"
    scale_key = "odometry_linear_scale"
    windows = _windows(log, path)
    if not windows:
        advice = STREET if len(log.fixes) else "record /fix as well"
        return Travel(unknown(scale_key, advice), tuple(unknown(key, advice) for key in keys))

    def residuals(values: FloatArray) -> FloatArray:
        parts = [_laid(window, path, *values) for window in windows]
        return np.concatenate(parts).ravel()

    first = residuals(np.array((1.0, 0.0)))
    spread = max(robust_std(first), 1e-3)
    steps = {"x_scale": (0.01, 0.05), "diff_step": (1e-3, 1e-2)}
    start = np.array((1.0, 1e-2))
    solution = least_squares(residuals, start, loss="soft_l1", f_scale=spread, **steps)
    stamps = np.repeat(np.concatenate([window[:, 0] for window in windows]), 2)
    half = half_widths(solution.jac, solution.fun, stamps)
    delay = float(solution.x[1])
    seconds = float(sum(window[-1, 0] - window[0, 0] for window in windows))
    noise = _white(keys[0], windows, path, solution.x, linear_noise, seconds)
    method = "path laid on the fixes in windows of 20 s, least squares"
    late = unknown(keys[1], STREET, seconds)
    if half[1] < 0.2:
        late = around(keys[1], delay, half[1], seconds, method)
    return Travel(_scale_of(scale_key, log, path, spread, seconds), (noise, late))


def _scale_of(key: str, log: DriveLog, path: WheelPath, white: float, seconds: float) -> Estimate:
    """Scale of lengths by all fixes; ``white`` [m] is about their noise."""
    track = track_of(path, log.fixes)
    if track is None:
        return unknown(key, STREET, seconds)
    fit = fit_filter(track, white)
    scale = 1.0 / fit.share
    half = fit.half * scale**2
    if half > _UNSURE_SCALE:
        return unknown(key, STREET, seconds)
    method = "Kalman filter of wheels and fixes, maximum likelihood"
    return around(key, scale, half, seconds, method)


def _windows(log: DriveLog, path: WheelPath) -> list[FloatArray]:
    """The fixes (n, 4) of each window in which the robot moved enough."""
    found = []
    for begin in np.arange(path.stamps[0] + 1.0, path.stamps[-1] - 1.0, _WINDOW):
        end = min(begin + _WINDOW, path.stamps[-1] - 1.0)
        fixes = log.fixes[(log.fixes[:, 0] >= begin) & (log.fixes[:, 0] < end)]
        inside = path.stamps[(path.stamps >= begin) & (path.stamps < end)]
        if len(fixes) < _LEAST_FIXES or len(inside) < 2 or np.diff(inside).max() > _LONGEST_GAP:
            continue
        places = path.at(fixes[:, 0])[:, :2]
        if np.sqrt(places.var(axis=0).sum()) >= _LEAST_SPREAD:
            found.append(fixes)
    return found


def _laid(fixes: FloatArray, path: WheelPath, share: float, delay: float) -> FloatArray:
    """Errors (n, 2) [m] of the path that is moved and turned onto the fixes (Umeyama 1991)."""
    return apart_when_laid(path.of_antenna(fixes[:, 0] - delay, share), fixes[:, 1:3])


def _white(
    key: str,
    windows: list[FloatArray],
    path: WheelPath,
    values: FloatArray,
    linear_noise: float,
    seconds: float,
) -> Estimate:
    """White noise of the fixes, by second differences without the wheels' own."""
    parts, lengths = [], []
    for window in windows:
        errors = _laid(window, path, *values)
        steady = np.abs(np.diff(window[:, 0], 2)) < 0.1 * np.median(np.diff(window[:, 0]))
        parts.append(np.diff(errors, 2, axis=0)[steady].ravel())
        lengths.append(path.length(window[:-1, 0], window[1:, 0]))
    differences = np.concatenate(parts)
    if len(differences) < 20:
        return unknown(key, STREET, seconds)
    of_wheels = linear_noise**2 * float(np.concatenate(lengths).mean()) / 6.0
    value = float(np.sqrt(max(robust_std(differences) ** 2 / 6.0 - of_wheels, 1e-8)))
    low, high = deviation_interval(max(round(len(differences) * 0.37 / 1.9), 3))
    method = "second differences of the fixes less the path"
    return Estimate(key, value, value * low, value * high, seconds, method)

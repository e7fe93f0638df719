"""The drive as the world has it: dead time, a first-order lag, limited acceleration.

Fitted to commands and odometry by least squares of the simulated output (output-error method:
Ljung 1999, System Identification, ch. 4 and 7).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from harness.identify.estimate import Estimate, around, half_widths, unknown
from harness.recorded.drive_log import period_of
from navstack.jit import njit
from navstack.types import BoolArray, FloatArray

STEP = 0.01  # [s] of the simulation
SILENT = 0.5  # [s] without a command after which drives stop by themselves
_AFTER = 2.0  # [s] after such a pause that is not used
_LATEST = 1.5  # [s] of dead time at most
_DEAD_TIMES = np.arange(0.0, 0.61, 0.05)  # [s] from which the fit may begin
_TRIED = 3  # of them, the best ones: the sum of squares has several minima
_UNSURE = 0.3  # [-] half interval over value from which a value is not identifiable
_UNSURE_TIME = 0.1  # [s] the same of a time
_LEAST_MOVING = 10.0  # [s] that a drive needs
_LIMITED = 0.5  # [s] at a limit that a fit of it needs
# [-] of the odometry's period within which a time is known at best: nobody says when in it the
# wheels were read; and of a limit, for real drives are no servos of first order
_TIME_FLOOR, _LIMIT_FLOOR = 0.25, 0.015


@njit()
def follow(targets: FloatArray, dt: float, lag: float, up: float, down: float) -> FloatArray:
    """Speeds (N,) of a drive that follows targets (N,): the world's servo, exact within a step.

    Args:
        targets: [m/s] or [rad/s], each held for ``dt``; the drive stands at first.
        dt: [s].
        lag: [s] time constant.
        up: acceleration away from zero, per second.
        down: acceleration towards zero, per second.
    """
    speeds = np.empty(len(targets))
    now = 0.0
    share = 1.0 - np.exp(-dt / lag)
    for number in range(len(targets)):
        change = (targets[number] - now) * share
        limit = dt * (up if change * now >= 0.0 else down)
        now += min(max(change, -limit), limit)
        speeds[number] = now
    return speeds


@dataclass(frozen=True, slots=True)
class DriveFit:
    """The parameters of one axis of the drive."""

    dead_time: float  # [s]
    lag: float  # [s]
    up: float  # [m/s2] or [rad/s2]
    down: float  # [m/s2] or [rad/s2]
    gain: float  # [-] measured over commanded speed
    estimates: tuple[Estimate, ...]

    def speeds_at(self, stamps: FloatArray, commands: FloatArray) -> FloatArray:
        """Measured speeds (N,) that follow from commands (M, 2) of stamp and value."""
        return self.gain * _simulated(
            stamps, commands, (self.dead_time, self.lag, self.up, self.down)
        )


def _simulated(
    stamps: FloatArray,
    commands: FloatArray,
    drive: tuple[float, float, float, float],
) -> FloatArray:
    """Speeds (N,) at the stamps; ``drive`` is dead time, lag, acceleration up and down.

    A target is the mean of the commands that arrive within a step, so that the result changes
    smoothly with the dead time.
    """
    dead_time, lag, up, down = drive
    edges = np.arange(stamps[0] - 1.0, stamps[-1] + 2.0 * STEP, STEP)
    held = np.append(commands[:, 0], max(edges[-1], commands[-1, 0]) + 1.0)
    areas = np.concatenate(((0.0,), np.cumsum(commands[:, 1] * np.diff(held))))
    targets = np.diff(np.interp(edges - dead_time, held, areas)) / STEP
    speeds = follow(targets, STEP, lag, up, down)
    result: FloatArray = np.interp(stamps, edges[1:], speeds)
    return result


def used(stamps: FloatArray, commands: FloatArray) -> BoolArray:
    """Which stamps (N,) [s] have commands before them without a pause."""
    latest = np.searchsorted(commands[:, 0], stamps, side="right") - 1
    age = stamps - commands[latest.clip(0), 0]
    chosen: BoolArray = (latest >= 0) & (age <= SILENT)
    pauses = np.flatnonzero(np.diff(commands[:, 0]) > SILENT) + 1
    for begin in commands[pauses, 0]:
        chosen &= ~((stamps >= begin) & (stamps < begin + _AFTER))
    return chosen


def fit_drive(
    prefix: str,
    unit: str,
    measured: FloatArray,
    commands: FloatArray,
    is_symmetric: bool,
) -> DriveFit | None:
    """Fit one axis.

    Args:
        prefix: of the values' names, e.g. ``linear``.
        unit: of an acceleration, as it ends a name.
        measured: (N, 2) stamp [s] and speed by the odometry.
        commands: (M, 2) stamp [s] and speed.
        is_symmetric: whether speeding up and braking have one limit.

    Returns:
        The fit; None: there are no commands, or the axis hardly moves.
    """
    if len(commands) < 20:
        return None
    measured = measured[used(measured[:, 0], commands)]
    period = period_of(measured[:, 0]) if len(measured) > 2 else 0.0
    moving = np.abs(measured[:, 1]) > 0.05 * np.abs(measured[:, 1]).max(initial=0.0) + 1e-6
    if np.sum(moving) * period < _LEAST_MOVING or np.ptp(commands[:, 1]) < 1e-3:
        return None
    stamps, speeds = measured[:, 0], measured[:, 1]

    def residuals(values: FloatArray) -> FloatArray:
        drive = (values[0], *np.exp(values[1:4]))
        found: FloatArray = values[4] * _simulated(stamps, commands, drive) - speeds
        return found

    starts = _starts(stamps, speeds, residuals)
    values, half = _solution(residuals, starts, stamps, is_symmetric)
    time_floor = _TIME_FLOOR * period
    lag_floor = time_floor / float(np.exp(values[1]))
    half = np.hypot(half, (time_floor, lag_floor, _LIMIT_FLOOR, _LIMIT_FLOOR, 0.0))
    seconds = float(np.sum(moving) * period)
    limited = _limited(stamps, commands, values)
    estimates = _estimates(prefix, unit, values, half, seconds, limited, is_symmetric)
    lag, up, down = np.exp(values[1:4]).tolist()
    return DriveFit(float(values[0]), lag, up, down, float(values[4]), estimates)


def _solution(
    residuals: Callable[[FloatArray], FloatArray],
    starts: list[FloatArray],
    stamps: FloatArray,
    is_symmetric: bool,
) -> tuple[FloatArray, FloatArray]:
    """The best values (5,) that least squares find from some starts, and half their intervals.

    Dead time [s], logarithms of lag and accelerations, gain; the second acceleration is the first
    one if ``is_symmetric``.
    """

    def expand(free: FloatArray) -> FloatArray:
        if not is_symmetric:
            return free
        return np.insert(free, 3, free[2])

    if is_symmetric:
        starts = [np.delete(start, 3) for start in starts]
    size = len(starts[0])
    scale = 3.0 * max(float(np.median(np.abs(residuals(expand(starts[0]))))), 1e-4)
    bounds = np.array([(-0.05, _LATEST)] + [(-7.0, 5.0)] * (size - 2) + [(0.2, 5.0)]).T
    solutions = [
        least_squares(
            lambda free: residuals(expand(free)),
            np.clip(start, bounds[0] + 1e-6, bounds[1] - 1e-6),
            bounds=bounds,
            loss="soft_l1",
            f_scale=scale,
            x_scale=np.array([0.02] + [0.2] * (size - 2) + [0.02]),
            diff_step=1e-3,
            max_nfev=40,
        )
        for start in starts
    ]
    solution = min(solutions, key=lambda each: float(each.cost))
    half = half_widths(solution.jac, _weighted(solution.fun, scale), stamps)
    return expand(solution.x), expand(half)


def _starts(
    stamps: FloatArray,
    speeds: FloatArray,
    residuals: Callable[[FloatArray], FloatArray],
) -> list[FloatArray]:
    """The best of some dead times, with accelerations as the odometry shows them; best first."""
    period = period_of(stamps)
    width = max(1, round(0.2 / period))
    slopes = np.abs(speeds[width:] - speeds[:-width]) / (stamps[width:] - stamps[:-width])
    limit = max(float(np.percentile(slopes, 98.0)), 1e-2)
    best = []
    for dead in _DEAD_TIMES:
        tried = [
            np.array((dead, np.log(lag), np.log(share * limit), np.log(share * limit), 1.0))
            for lag in (0.05, 0.2)
            for share in (0.6, 1.0, 1.5)
        ]
        sums = [float(np.abs(residuals(start)).sum()) for start in tried]
        best.append((min(sums), tried[int(np.argmin(sums))]))
    best.sort(key=lambda pair: pair[0])
    return [start for _, start in best[:_TRIED]]


def _weighted(residuals: FloatArray, scale: float) -> FloatArray:
    """Residuals as the loss weighs them; the solver's Jacobian is weighed already."""
    scaled: FloatArray = residuals / np.sqrt(1.0 + (residuals / scale) ** 2) ** 0.5
    return scaled


def _limited(stamps: FloatArray, commands: FloatArray, values: FloatArray) -> tuple[float, float]:
    """[s] for which the simulated drive is at its limit, speeding up and braking."""
    lag, up, down = np.exp(values[1:4])
    grid = np.arange(stamps[0], stamps[-1], STEP)
    speeds = _simulated(grid, commands, (values[0], lag, up, down))
    rates = np.abs(np.diff(speeds)) / STEP
    is_up = np.diff(np.abs(speeds)) > 0.0
    at_up = np.sum(is_up & (rates > 0.97 * up)) * STEP
    at_down = np.sum(~is_up & (rates > 0.97 * down)) * STEP
    return float(at_up), float(at_down)


def _estimates(
    prefix: str,
    unit: str,
    values: FloatArray,
    half: FloatArray,
    seconds: float,
    limited: tuple[float, float],
    is_symmetric: bool,
) -> tuple[Estimate, ...]:
    method = "least squares of the simulated drive"
    turn_or_drive = "turn on the spot" if prefix == "angular" else "drive straight on"
    key, found = f"{prefix}_dead_time_s", []
    advice = f"{turn_or_drive} in steps of the command, ten times or more"
    if half[0] < _UNSURE_TIME:
        found.append(around(key, float(values[0]), half[0], seconds, method))
    else:
        found.append(unknown(key, advice, seconds))
    rows = [("lag_s", 1, 2.0 * _UNSURE, seconds)]
    if is_symmetric:
        rows.append((f"max_acceleration_{unit}", 2, _UNSURE, sum(limited)))
    else:
        rows.append((f"max_acceleration_{unit}", 2, _UNSURE, limited[0]))
        rows.append((f"max_deceleration_{unit}", 3, _UNSURE, limited[1]))
    for name, place, most, data in rows:
        key, value = f"{prefix}_{name}", float(np.exp(values[place]))
        is_reached = place == 1 or data >= _LIMITED
        if half[place] < most and is_reached:
            low, high = value * np.exp(-half[place]), value * np.exp(half[place])
            found.append(Estimate(key, value, float(low), float(high), data, method))
        else:
            found.append(unknown(key, f"{advice}, from standing to full speed and back", data))
    gain = around(f"{prefix}_command_gain", float(values[4]), half[4], seconds, method)
    found.append(gain)
    return tuple(found)

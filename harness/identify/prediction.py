"""How well identified values predict the half of the log that they were not fitted to."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from harness.identify.drive_model import DriveFit, used
from harness.identify.estimate import BLOCK, half_widths
from harness.identify.turning import Turning
from harness.identify.wheel_path import WheelPath, path_of, turn_onto, turned
from harness.recorded.drive_log import DriveLog, period_of
from harness.recorded.trajectory import motions_between
from harness.world.physics.robot import RobotParams
from navstack.geometry import rotation
from navstack.types import FloatArray

LONG = 10.0  # [s]
_EVERY = 2.0  # [s] between the moments that are predicted from
_LEAST = 5  # predictions
_FINEST = 0.02  # [s] steps of a predicted path, or the odometry's period where that is longer


@dataclass(frozen=True, slots=True)
class PredictionError:
    """Root mean square errors of predicted positions."""

    against: str  # what measured: odometry, gyro or fixes
    horizon_s: float
    n: int  # predictions
    identified_m: float
    default_m: float  # of the default robot
    constant_twist_m: float  # of one that keeps its speed and yaw rate
    # 95 % interval of the default robot's error less that of the identified one
    gain_low_m: float
    gain_high_m: float

    @property
    def gain_m(self) -> float:
        """[m] by which the default robot's error is larger."""
        return self.default_m - self.identified_m

    def as_json(self) -> dict[str, Any]:
        """As ``navbench identify --json`` has it."""
        row = asdict(self)
        low, high = row.pop("gain_low_m"), row.pop("gain_high_m")
        gain = {"value": self.gain_m, "low": low, "high": high, "n": self.n}
        return row | {"better_than_default_m": gain}


@dataclass(frozen=True, slots=True)
class Predictor:
    """What a model needs to predict."""

    linear: DriveFit
    angular: DriveFit


def default_drive(robot: RobotParams) -> Predictor:
    """The drive of a robot file that nobody has fitted."""
    shared = robot.compute_latency, robot.servo_time_constant
    linear = DriveFit(*shared, robot.max_acceleration, robot.max_deceleration, 1.0, ())
    turn = robot.max_yaw_acceleration
    return Predictor(linear, DriveFit(*shared, turn, turn, 1.0, ()))


def predict_commands(
    log: DriveLog,
    fitted: Predictor,
    default: Predictor,
    since: float,
) -> list[PredictionError]:
    """Errors of the motion that follows from the commands, against the odometry.

    Args:
        log: the whole drive.
        fitted: to the log before ``since``.
        default: to compare with.
        since: [s] from when on predictions are tried.
    """
    stamps = log.stamps
    period = period_of(stamps)
    step = max(period, _FINEST)
    grid = np.arange(since, stamps[-1], step)
    if len(grid) < 2 or not len(log.commands):
        return []
    has_commands = used(grid, log.commands)
    measured = _twists(log, grid)
    models = [np.column_stack(_speeds(model, grid, log)) for model in (fitted, default)]
    found = []
    for horizon in (step, LONG):
        count = max(round(horizon / step), 1)
        starts = np.arange(0, len(grid) - count - 1, max(round(_EVERY / step), 1))
        starts = starts[[bool(has_commands[at : at + count].all()) for at in starts]]
        if len(starts) < _LEAST:
            continue
        errors: list[list[float]] = [[], [], []]
        for at in starts:
            window = slice(at + 1, at + count + 1)
            truth = _end(measured[window], step)
            constant = np.repeat(measured[at : at + 1], count, axis=0)
            predicted = [model[window] for model in models]
            for found_errors, twists in zip(errors, [*predicted, constant], strict=True):
                off = _end(twists, step) - truth
                found_errors.append(float(np.hypot(*off)))
        found.append(_summary("odometry", horizon, grid[starts], errors))
    return found


def _speeds(model: Predictor, grid: FloatArray, log: DriveLog) -> tuple[FloatArray, FloatArray]:
    return (
        model.linear.speeds_at(grid, log.commands[:, (0, 1)]),
        model.angular.speeds_at(grid, log.commands[:, (0, 2)]),
    )


def _end(twists: FloatArray, step: float) -> FloatArray:
    """Where speeds and yaw rates (n, 2), each held for a step [s], lead to: x, y [m]."""
    yaw = np.cumsum(twists[:, 1]) * step
    middle = yaw - 0.5 * twists[:, 1] * step
    x = np.sum(twists[:, 0] * np.cos(middle))
    y = np.sum(twists[:, 0] * np.sin(middle))
    return np.array((x, y)) * step


def predict_turns(log: DriveLog, turning: Turning, since: float) -> list[PredictionError]:
    """Errors of the way by the wheels alone, against the one along the gyro's heading.

    For logs without commands. Both robots have the wheels' lengths: turns are compared.

    Args:
        log: the whole drive.
        turning: identified before ``since``.
        since: [s] from when on predictions are tried.
    """
    if len(log.imu) < _LEAST:
        return []
    measured, ours = path_of(log, turning), path_of(log, turning, with_gyro=False)
    plain = path_of(log, Turning(1.0, 0.0, 0.0, ()), with_gyro=False)
    stamps = log.stamps
    found = []
    for horizon in (period_of(stamps), LONG):
        starts = np.arange(since, min(stamps[-1], log.imu_stamps[-1]) - horizon - 1.0, _EVERY)
        if len(starts) < _LEAST:
            continue
        truth, *models = (
            motions_between(path.at(starts), path.at(starts + horizon))[:, :2]
            for path in (measured, ours, plain)
        )
        models.append(_arcs(_twists(log, starts), horizon))
        errors = [np.hypot(*(model - truth).T) for model in models]
        found.append(_summary("gyro", horizon, starts, errors))
    return found


def _arcs(twists: FloatArray, seconds: float) -> FloatArray:
    """Where constant speeds and yaw rates (n, 2) lead to: x, y (n, 2) [m]."""
    half = 0.5 * twists[:, 1] * seconds
    chord = twists[:, 0] * seconds * np.sinc(half / np.pi)
    return np.column_stack((chord * np.cos(half), chord * np.sin(half)))


def predict_fixes(
    log: DriveLog,
    path: WheelPath,
    scale: float,
    since: float,
) -> list[PredictionError]:
    """Errors of the displacements by wheels and gyro against those of the fixes.

    For logs without commands. A displacement is turned as the fixes before it say.

    Args:
        log: the whole drive.
        path: by wheels and gyro, identified before ``since``.
        scale: [-] of its lengths, likewise.
        since: [s] from when on predictions are tried.
    """
    fixes = log.fixes[(log.fixes[:, 0] >= since) & (log.fixes[:, 0] <= path.stamps[-1])]
    if len(fixes) < 2 * _LEAST:
        return []
    plain = path_of(log, Turning(1.0, 0.0, 0.0, ()), with_gyro=False)
    period = period_of(fixes[:, 0])
    found = []
    for horizon in (period, LONG):
        ends = np.searchsorted(fixes[:, 0], fixes[:, 0] + horizon - 0.25 * period)
        starts = np.flatnonzero(ends < len(fixes))
        starts = starts[:: max(round(0.2 * horizon / period), 1)]
        ends = ends[starts]
        kept = np.abs(fixes[ends, 0] - fixes[starts, 0] - horizon) < 0.5 * period + 0.05
        rows, stamps = [], []
        for start, end in zip(starts[kept], ends[kept], strict=True):
            row = _displacements(fixes, int(start), int(end), path, scale, plain, log)
            if row is not None:
                rows.append(row)
                stamps.append(float(fixes[start, 0]))
        if len(rows) >= _LEAST:
            found.append(
                _summary("fixes", horizon, np.array(stamps), list(zip(*rows, strict=True)))
            )
    return found


# [s] of fixes that give the heading: of 10, 20, 40, 80 and all the best on the first half of a
# Husky's log, with its gyro and by the wheels alone; fixes wander by metres in less
_BEFORE = 40.0
_LEAST_DRIVEN = 2.0  # [m] in that time


def _displacements(
    fixes: FloatArray,
    start: int,
    end: int,
    path: WheelPath,
    scale: float,
    plain: WheelPath,
    log: DriveLog,
) -> tuple[float, float, float] | None:
    """Errors [m] of three predictions of a fix; None: the heading is not known.

    All begin at the last fix, for the wander of fixes changes slowly. Constant twist begins with
    the heading of the identified robot.
    """
    t0, t1 = fixes[start, 0], fixes[end, 0]
    past = log.fixes[(log.fixes[:, 0] > t0 - _BEFORE) & (log.fixes[:, 0] <= t0)]
    if len(past) < 4:
        return None
    moved = fixes[end, 1:3] - fixes[start, 1:3]
    turns, results = [], []
    for way, share in ((path, 1.0 / scale), (plain, 1.0)):
        places = way.of_antenna(past[:, 0], share)
        if np.ptp(places, axis=0).max() < _LEAST_DRIVEN:
            return None
        turns.append(turn_onto(places, past[:, 1:3]))
        here, there = way.of_antenna(np.array((t0, t1)), share)
        results.append(float(np.hypot(*(turns[-1] @ (there - here) - moved))))
    begin = np.array((t0,))
    twists, yaw = _twists(log, begin), path.at(begin)[0, 2]
    swing = np.diff(turned(path.antenna, np.array((0.0, twists[0, 1] * (t1 - t0)))), axis=0)[0]
    ahead = rotation(yaw) @ (_arcs(twists, t1 - t0)[0] + swing)
    results.append(float(np.hypot(*(turns[0] @ ahead - moved))))
    return results[0], results[1], results[2]


def _twists(log: DriveLog, stamps: FloatArray) -> FloatArray:
    """Speeds and yaw rates (n, 2) of the odometry at times (n,) [s]."""
    speeds = np.interp(stamps, log.stamps, log.speeds)
    return np.column_stack((speeds, np.interp(stamps, log.stamps, log.yaw_rates)))


def _summary(
    against: str,
    horizon: float,
    stamps: FloatArray,
    errors: Sequence[Sequence[float] | FloatArray],
) -> PredictionError:
    """Errors of the identified robot, the default robot and constant twist from times (n,) [s]."""
    squares = [np.square(each) for each in errors]
    ours, default, constant = (float(np.sqrt(each.mean())) for each in squares)
    differences = squares[1] - squares[0]
    both = max(ours + default, 1e-12)
    gain = float(differences.mean()) / both
    block = max(2.0 * horizon, BLOCK)
    ones = np.ones((len(stamps), 1))
    half = half_widths(ones, differences - differences.mean(), stamps, block)
    half_gain = float(half[0]) / both
    return PredictionError(
        against,
        horizon_s=horizon,
        n=len(stamps),
        identified_m=ours,
        default_m=default,
        constant_twist_m=constant,
        gain_low_m=gain - half_gain,
        gain_high_m=gain + half_gain,
    )

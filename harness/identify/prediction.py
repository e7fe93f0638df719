"""How well identified values predict the half of the log that they were not fitted to."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from harness.identify.drive_model import DriveFit, used
from harness.identify.travel import WheelPath, path_of
from harness.identify.turning import Turning
from harness.recorded.log import DriveLog
from harness.world.physics.robot import RobotParams
from navstack.types import FloatArray

LONG = 10.0  # [s]
_EVERY = 2.0  # [s] between the moments that are predicted from
_LEAST = 5  # predictions
_FINEST = 0.02  # [s] steps of a predicted path, or the odometry's period where that is longer


@dataclass(frozen=True, slots=True)
class PredictionError:
    """Root mean square errors of predicted positions."""

    horizon_s: float
    n: int  # predictions
    identified_m: float
    default_m: float  # of the default robot
    constant_twist_m: float  # of one that keeps its speed and yaw rate

    def as_json(self) -> dict[str, Any]:
        """As ``navbench identify --json`` has it."""
        return asdict(self)


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
    log: DriveLog, fitted: Predictor, default: Predictor, since: float
) -> list[PredictionError]:
    """Errors of the motion that follows from the commands, against the odometry.

    Args:
        log: the whole drive.
        fitted: to the log before ``since``.
        default: to compare with.
        since: [s] from when on predictions are tried.
    """
    stamps = log.odometry[:, 0]
    period = float(np.median(np.diff(stamps)))
    step = max(period, _FINEST)
    grid = np.arange(since, stamps[-1], step)
    if len(grid) < 2 or not len(log.commands):
        return []
    has_commands = used(grid, log.commands)
    measured = np.column_stack([np.interp(grid, stamps, log.odometry[:, 4 + n]) for n in (0, 1)])
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
            kept = np.repeat(measured[at : at + 1], count, axis=0)
            for list_, twists in zip(errors, (*[m[window] for m in models], kept), strict=True):
                list_.append(float(np.hypot(*(_end(twists, step) - truth))))
        found.append(_summary(horizon, errors))
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


def predict_fixes(
    log: DriveLog, path: WheelPath, scale: float, since: float
) -> list[PredictionError]:
    """Errors of the wheels' displacements against those of the fixes, over one step and 10 s.

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
    period = float(np.median(np.diff(fixes[:, 0])))
    found = []
    for horizon in (period, LONG):
        ends = np.searchsorted(fixes[:, 0], fixes[:, 0] + horizon - 0.25 * period)
        starts = np.flatnonzero(ends < len(fixes))
        starts = starts[:: max(round(0.2 * horizon / period), 1)]
        ends = ends[starts]
        kept = np.abs(fixes[ends, 0] - fixes[starts, 0] - horizon) < 0.5 * period + 0.05
        starts, ends = starts[kept], ends[kept]
        errors: list[list[float]] = [[], [], []]
        for start, end in zip(starts, ends, strict=True):
            row = _displacements(fixes, int(start), int(end), path, scale, plain, log)
            if row is not None:
                for list_, value in zip(errors, row, strict=True):
                    list_.append(value)
        if len(errors[0]) >= _LEAST:
            found.append(_summary(horizon, errors))
    return found


_BEFORE = 10.0  # [s] of fixes that give the heading
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
    """Errors [m] of three predictions of a fix; None: the heading is not known."""
    t0, t1 = fixes[start, 0], fixes[end, 0]
    past = fixes[(fixes[:, 0] > t0 - _BEFORE) & (fixes[:, 0] <= t0)]
    if len(past) < 4:
        return None
    results = []
    twist = _twist_at(log, t0)
    for way, share in ((path, 1.0 / scale), (plain, 1.0)):
        places = share * way.at(past[:, 0])[:, :2]
        if np.ptp(places, axis=0).max() < _LEAST_DRIVEN:
            return None
        turn, shift = _alignment(places, past[:, 1:3])
        there = share * way.at(np.array((t1,)))[0, :2]
        results.append(float(np.hypot(*(turn @ there + shift - fixes[end, 1:3]))))
    turn, shift = _alignment(plain.at(past[:, 0])[:, :2], past[:, 1:3])
    x, y, yaw = plain.at(np.array((t0,)))[0]
    speed, rate = twist
    count = max(round((t1 - t0) / _FINEST), 1)
    dx, dy = _end(np.tile((speed, rate), (count, 1)), (t1 - t0) / count)
    cos, sin = np.cos(yaw), np.sin(yaw)
    there = np.array((x + cos * dx - sin * dy, y + sin * dx + cos * dy))
    results.append(float(np.hypot(*(turn @ there + shift - fixes[end, 1:3]))))
    return results[0], results[1], results[2]


def _twist_at(log: DriveLog, stamp: float) -> tuple[float, float]:
    stamps = log.odometry[:, 0]
    return (
        float(np.interp(stamp, stamps, log.odometry[:, 4])),
        float(np.interp(stamp, stamps, log.odometry[:, 5])),
    )


def _alignment(ours: FloatArray, theirs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rotation (2, 2) and shift (2,) of points (n, 2) onto others (Umeyama 1991, no scale)."""
    a, b = ours - ours.mean(axis=0), theirs - theirs.mean(axis=0)
    angle = np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array(((cos, -sin), (sin, cos)))
    shift: FloatArray = theirs.mean(axis=0) - turn @ ours.mean(axis=0)
    return turn, shift


def _summary(horizon: float, errors: list[list[float]]) -> PredictionError:
    values = [float(np.sqrt(np.mean(np.square(each)))) for each in errors]
    return PredictionError(horizon, len(errors[0]), *values)

"""All of a robot that its log tells: each value with its interval, and how well it predicts."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from harness.identify.drive_model import DriveFit, fit_drive
from harness.identify.estimate import Estimate, combined, unknown, widened
from harness.identify.prediction import (
    PredictionError,
    Predictor,
    default_drive,
    predict_commands,
    predict_fixes,
    predict_turns,
)
from harness.identify.stillness import imu_noise, imu_walk, lidar_noise, standing, white_noise
from harness.identify.travel import fit_fixes, fit_scans
from harness.identify.turning import fit_turning
from harness.identify.wheel_path import path_of
from harness.recorded.drive_log import DriveLog, period_of
from harness.recorded.ros_messages import FIX, IMU, ODOMETRY, SCAN, TWIST
from harness.world.physics.robot import RobotParams
from navstack.types import FloatArray

STEPS = "record /cmd_vel, and drive in steps of the command: straight on, and turns on the spot"
PARTS = 5  # that progress counts
_LEAST_MOVING = 100  # rows of odometry that tell its noise
_NOISE = 0.02  # [m/sqrt(m)] of the wheels where it is not known
UPDATE_DISTANCE, UPDATE_ANGLE = 0.25, 0.2  # [m], [rad] defaults of AMCL's update_min_d, _a


@dataclass(frozen=True, slots=True)
class Identified:
    """What was found in a log."""

    estimates: dict[str, Estimate]  # by key, in the order of pages
    predictions: tuple[PredictionError, ...]
    predicts: str  # what was predicted

    def value(self, key: str) -> float | None:
        """A value; None: not identifiable."""
        return self.estimates[key].value


def identify(
    log: DriveLog, default: RobotParams, tell: Callable[[], None] = lambda: None
) -> Identified:
    """Identify everything that a log tells.

    Args:
        log: the drive.
        default: the robot that predictions are compared with.
        tell: hears of each of its :data:`PARTS` that is done.
    """
    linear, angular = _drive(log)
    tell()
    found = [*_drive_estimates(linear, angular)]
    turning = fit_turning(log)
    path = path_of(log, turning)
    tell()
    by_scans = fit_scans(log, path)
    tell()
    noise = next((each for each in by_scans.estimates if each.key == "odometry_linear_noise"), None)
    by_fixes = fit_fixes(log, path, (noise and noise.value) or _NOISE)
    tell()
    # both share the noise of the wheels
    scales = by_scans.scale, by_fixes.scale
    found.append(widened(combined(scales), scales))
    found += [*turning.estimates[:1], *by_scans.estimates[:1], *turning.estimates[1:4]]
    found += _twist_noise(log, linear, angular)
    found += [*imu_noise(log), imu_walk(log), turning.estimates[4]]
    found += [*by_fixes.estimates, *lidar_noise(log), *by_scans.estimates[1:]]
    found += _latencies(log)
    predictions, predicts = _predictions(log, default)
    tell()
    return Identified({each.key: each for each in found}, tuple(predictions), predicts)


def _drive(log: DriveLog) -> tuple[DriveFit | None, DriveFit | None]:
    odometry, commands = log.odometry, log.commands
    return (
        fit_drive("linear", "mps2", odometry[:, (0, 4)], commands[:, (0, 1)], False),
        fit_drive("angular", "radps2", odometry[:, (0, 5)], commands[:, (0, 2)], True),
    )


def _drive_estimates(linear: DriveFit | None, angular: DriveFit | None) -> list[Estimate]:
    """Dead time and lag of both axes as one, and the limits."""
    found: dict[str, Estimate] = {}
    for prefix, unit, fit in (("linear", "mps2", linear), ("angular", "radps2", angular)):
        names = ["dead_time_s", "lag_s", f"max_acceleration_{unit}", "command_gain"]
        if prefix == "linear":
            names.insert(3, f"max_deceleration_{unit}")
        for name in names:
            key = f"{prefix}_{name}"
            found[key] = unknown(key, STEPS)
        if fit is not None:
            found |= {each.key: each for each in fit.estimates}
    both = []
    for name in ("dead_time_s", "lag_s"):
        pair = (found[f"linear_{name}"], found[f"angular_{name}"])
        both.append(replace(widened(combined(pair), pair), key=name))
    return [*both, *found.values()]


def _twist_noise(
    log: DriveLog,
    linear: DriveFit | None,
    angular: DriveFit | None,
) -> list[Estimate]:
    """White noise of the reported speed and yaw rate, less what the commands explain."""
    stamps = log.stamps
    period = period_of(stamps)
    found = []
    for key, column, command, fit in (
        ("odometry_velocity_std_mps", 4, 1, linear),
        ("odometry_yaw_rate_std_radps", 5, 2, angular),
    ):
        values = log.odometry[:, column]
        if fit is not None:
            values = values - fit.speeds_at(stamps, log.commands[:, (0, command)])
        # encoders that stand read exactly zero
        values = values[~standing(log)]
        if len(values) < _LEAST_MOVING:
            found.append(unknown(key, STEPS))
            continue
        found.append(white_noise(key, values, period, "second differences of the twist, moving"))
    return found


_LATE = (  # kind, key of its latency, what to record where there are no stamps
    # a controller stamps a command with the pose that it is computed from (as Nav2's pure pursuit)
    (TWIST, "computing_latency_s", "record commands as geometry_msgs/TwistStamped"),
    (ODOMETRY, "odometry_latency_s", "record the topic as well"),
    (IMU, "imu_latency_s", "record the topic as well"),
    (FIX, "gps_latency_s", "record the topic as well"),
    (SCAN, "lidar_latency_s", "record /scan as well"),
)


def _latencies(log: DriveLog) -> list[Estimate]:
    """[s] from stamps to arrivals of commands, odometry, inertial unit, fixes and scans."""
    found = []
    for kind, key, advice in _LATE:
        late = log.delays.get(kind, np.empty(0))
        if len(late) < 2:
            found.append(unknown(key, advice))
            continue
        low, value, high = np.percentile(late, (2.5, 50.0, 97.5)).tolist()
        how = "arrivals less stamps"
        found.append(Estimate(key, value, low, high, log.duration, how))
    return found


def first_part(log: DriveLog, end: float) -> DriveLog:
    """The log before a time [s]."""

    def before(rows: FloatArray) -> FloatArray:
        return rows[rows[:, 0] < end]

    return replace(
        log,
        commands=before(log.commands),
        odometry=before(log.odometry),
        imu=before(log.imu),
        fixes=before(log.fixes),
        scans=[],
    )


def _predictions(log: DriveLog, default: RobotParams) -> tuple[list[PredictionError], str]:
    """Errors on the second half of the log, by what was found in the first."""
    middle = 0.5 * log.duration
    half = first_part(log, middle)
    if len(half.odometry) < 100:
        return [], "the log is too short for predictions"
    linear, angular = _drive(half)
    if linear is not None and angular is not None:
        errors = predict_commands(log, Predictor(linear, angular), default_drive(default), middle)
        return errors, "from commands"
    turning = fit_turning(half)
    scale = fit_fixes(half, path_of(half, turning), _NOISE).scale.value or 1.0
    errors = predict_turns(log, turning, middle)
    errors += predict_fixes(log, path_of(log, turning), scale, middle)
    why = "there are no commands"
    if len(half.commands):
        why = "the first half has too few steps of the commands"
    return errors, f"from wheels and gyro, for {why}"


def amcl_alphas(found: Identified) -> dict[str, float] | None:
    """AMCL's alpha1 to alpha4 that spread as the odometry does; None: its noise is not known.

    AMCL's deviations grow with the motion of an update (Thrun, Burgard & Fox 2005, table 5.6), the
    odometry's with its root: both agree for an update at the least distance and angle. The scales'
    errors count in full.
    """
    keys = ("odometry_yaw_noise_per_turn", "odometry_yaw_noise_per_distance")
    turn, drift = (found.value(key) for key in keys)
    along = found.value("odometry_linear_noise")
    if turn is None or drift is None or along is None:
        return None
    of_turn = (found.value("odometry_angular_scale") or 1.0) - 1.0
    of_way = (found.value("odometry_linear_scale") or 1.0) - 1.0
    return {
        "alpha1": turn**2 / UPDATE_ANGLE + of_turn**2,
        "alpha2": drift**2 / UPDATE_DISTANCE,
        "alpha3": along**2 / UPDATE_DISTANCE + of_way**2,
        "alpha4": 0.0,
    }

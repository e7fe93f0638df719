"""How well the simulator is the robot: the mission of a log, driven again in the world."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import t

from harness.identify.estimate import LEVEL
from harness.identify.wheel_path import apart_when_laid, turned
from harness.metrics.replay_log import TRACE_COLUMNS
from harness.recorded.drive_log import DriveLog
from harness.statistics.interval import Interval
from navstack.errors import InputError
from navstack.types import FloatArray

Place = tuple[float, float, float]  # x, y [m], yaw [rad], map frame

MOVING = 0.05  # [m/s] from which a robot drives
PARTS = 10  # of the way, in which speeds are compared
_LEAST_WAY = 3.0  # [m] between both ends of a mission
_LEAST_FIXES = 20  # fixes that tell of the localizer's error
_X, _Y, _SPEED, _BELIEVED = (
    TRACE_COLUMNS.index(name) for name in ("x_m", "y_m", "linear_x_mps", "believed_x_m")
)


@dataclass(frozen=True, slots=True)
class MissionDrive:
    """One drive of a mission, from its first motion to its last."""

    time: float  # [s]
    length: float  # [m]
    standing: float  # [s] in between
    speeds: FloatArray  # (PARTS,) [m/s] mean of each part of the way
    localization: float | None  # [m] root mean square error of the believed place; None: not known


@dataclass(frozen=True, slots=True)
class Twin:
    """A log beside simulated drives of its mission."""

    start: Place
    goal: Place
    real: MissionDrive
    simulated: tuple[MissionDrive, ...]
    arrived: int  # simulated drives that reached the goal

    def interval(self, value: Callable[[MissionDrive], float | None]) -> Interval | None:
        """Mean of a value over the simulated drives, with a 95 % interval; None: not known."""
        values = [each for each in map(value, self.simulated) if each is not None]
        if not values:
            return None
        mean, count = float(np.mean(values)), len(values)
        if count < 2:
            return Interval(mean, None, None, count)
        spread = float(np.std(values, ddof=1)) / math.sqrt(count)
        half = float(t.ppf(0.5 + 0.5 * LEVEL, count - 1)) * spread
        return Interval(mean, mean - half, mean + half, count)

    @property
    def simulated_speeds(self) -> FloatArray:
        """Mean speed (PARTS,) [m/s] of the simulated drives in each part of the way."""
        speeds = np.array([each.speeds for each in self.simulated])
        mean: FloatArray = speeds.mean(axis=0)
        return mean

    @property
    def speed_difference(self) -> float:
        """[m/s] root mean square over the parts of the way, simulated less real."""
        return float(np.sqrt(np.mean((self.simulated_speeds - self.real.speeds) ** 2)))

    def as_json(self) -> dict[str, Any]:
        """As ``navbench cost-log --json`` has it."""
        rows = {}
        for key, value in VALUES.items():
            simulated = self.interval(value)
            rows[key] = {
                "bag": value(self.real),
                "simulated": simulated and simulated.as_json(),
            }
        profile = {
            "bag_mps": self.real.speeds.tolist(),
            "simulated_mps": self.simulated_speeds.tolist(),
            "rms_difference_mps": self.speed_difference,
        }
        counts = {"n": len(self.simulated), "arrived": self.arrived}
        return {"start": self.start, "goal": self.goal, **counts, **rows, "speed_profile": profile}


VALUES: dict[str, Callable[[MissionDrive], float | None]] = {
    "time_s": lambda drive: drive.time,
    "distance_m": lambda drive: drive.length,
    "mean_speed_mps": lambda drive: drive.length / drive.time,
    "standing_s": lambda drive: drive.standing,
    "localization_error_m": lambda drive: drive.localization,
}


def mission_of(log: DriveLog) -> tuple[Place, Place]:
    """Where the log's robot began and ended, x, y [m] and yaw [rad] in the map frame.

    Raises:
        InputError: the log does not say, or the robot ended where it began.
    """
    if len(log.poses) < 2:
        raise InputError(
            "the log has no poses of a localizer, so that its mission on the map is not known; "
            "record /amcl_pose (geometry_msgs/msg/PoseWithCovarianceStamped) as well, or leave "
            "out --nav2"
        )
    (x, y, yaw), (goal_x, goal_y, goal_yaw) = log.poses[[0, -1], 1:4].tolist()
    apart = math.hypot(goal_x - x, goal_y - y)
    if apart < _LEAST_WAY:
        raise InputError(
            f"the log ends {apart:.1f} m from where it begins, which is no mission from A to B; "
            f"give a log whose ends are {_LEAST_WAY:g} m apart or more, or leave out --nav2"
        )
    return (x, y, yaw), (goal_x, goal_y, goal_yaw)


def real_drive(log: DriveLog, goal: Place, radius: float, fix_noise: float | None) -> MissionDrive:
    """The drive of a log, until it is as near its goal as a simulated one ends.

    Args:
        log: with poses.
        goal: where it ends.
        radius: [m] at which a simulated drive has arrived.
        fix_noise: [m] deviation of the fixes per axis, which is taken from their differences; None:
            the localizer uses fixes, which then do not tell its error.
    """
    apart = np.hypot(log.poses[:, 1] - goal[0], log.poses[:, 2] - goal[1])
    far = np.flatnonzero(apart > radius)
    end = math.inf
    if len(far):
        arrival = min(int(far[-1]) + 1, len(apart) - 1)
        end = log.poses[arrival, 0]
    rows = log.odometry[log.stamps <= end]
    return _drive("log", rows[:, 0], rows[:, 4], _believed_error(log, fix_noise))


def simulated_drive(trace: FloatArray) -> MissionDrive:
    """A drive of the world by its recording: rows of :data:`TRACE_COLUMNS`."""
    errors = np.hypot(*(trace[:, _BELIEVED : _BELIEVED + 2] - trace[:, _X : _Y + 1]).T)
    return _drive("world", trace[:, 0], trace[:, _SPEED], float(np.sqrt(np.mean(errors**2))))


def _drive(
    where: str,
    stamps: FloatArray,
    speeds: FloatArray,
    localization: float | None,
) -> MissionDrive:
    """A drive by its speeds (N,) [m/s] at times [s].

    Raises:
        InputError: there is none; ``where`` says in what.
    """
    moving = np.flatnonzero(np.abs(speeds) > MOVING)
    if len(moving) < 2:
        raise InputError(f"the robot hardly moves in the {where}; give a mission that it drives")
    part = slice(int(moving[0]), int(moving[-1]) + 1)
    stamps, speeds = stamps[part], np.abs(speeds[part])
    steps = np.diff(stamps)
    means = 0.5 * (speeds[1:] + speeds[:-1])
    driven = np.concatenate(((0.0,), np.cumsum(means * steps)))
    ends = np.interp(np.linspace(0.0, driven[-1], PARTS + 1), driven, stamps)
    times = np.maximum(np.diff(ends), 1e-9)
    length, time = float(driven[-1]), float(stamps[-1] - stamps[0])
    standing = float(steps[means < MOVING].sum())
    return MissionDrive(time, length, standing, length / PARTS / times, localization)


def _believed_error(log: DriveLog, fix_noise: float | None) -> float | None:
    """[m] by which the localizer's poses differ from the fixes, less the fixes' own noise."""
    stamps = log.poses[:, 0]
    fixes = log.fixes[(log.fixes[:, 0] > stamps[0]) & (log.fixes[:, 0] < stamps[-1])]
    if fix_noise is None or len(fixes) < _LEAST_FIXES:
        return None
    yaws = np.unwrap(log.poses[:, 3])
    columns = [np.interp(fixes[:, 0], stamps, each) for each in (*log.poses[:, 1:3].T, yaws)]
    believed = np.column_stack(columns[:2]) + turned(log.antenna, columns[2])
    errors = apart_when_laid(believed, fixes[:, 1:3])
    squared = float(np.mean(np.sum(errors**2, axis=1))) - 2.0 * fix_noise**2
    return math.sqrt(max(squared, 0.0))

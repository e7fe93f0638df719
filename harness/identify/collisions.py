"""Contacts in a log: changes of velocity that the drive cannot have made."""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from harness.identify.drive_model import used
from harness.identify.estimate import robust_std, runs_of
from harness.recorded.drive_log import DriveLog, period_of
from harness.world.physics.robot import RobotParams
from navstack.types import FloatArray

FALSE_ALARMS = 0.1  # [1/h] that noise alone may raise
LEAST_IMPULSE = 15.0  # [N s] below which a touch is not told from a joint of the pavement
# [-] of an impulse that is found which its strongest physics step exchanges, by which the published
# rule counts and pays: mean and standard deviation of 67 impacts of 45 to 100 N s, where the share
# decides, on 75 simulated drives among people
IN_A_STEP, IN_A_STEP_STD = 0.71, 0.15
_LIKELY = 40  # values of that share, equally likely
_WINDOW = 0.03  # [s] at least; the ground takes sideways motion away within 0.1 s
_MISFIT = 0.3  # [-] of the acceleration limits that the model of the drive may be off
_MERGED = 0.4  # [s] between impacts of one contact


@dataclass(frozen=True, slots=True)
class Impact:
    """A contact that was found."""

    stamp: float  # [s]
    impulse: float  # [N s] its largest
    direction: float  # [rad] of the push on the robot, base frame


@dataclass(frozen=True, slots=True)
class Impacts:
    """All contacts of a log."""

    found: tuple[Impact, ...]
    threshold: float  # [N s]
    false_alarms: float  # [1/h] that noise raises at this threshold
    source: str  # imu or odometry


def strongest_steps(impulse: float) -> FloatArray:
    """Equally likely impulses (n,) [N s] of the strongest physics step of an impact."""
    middles = (np.arange(_LIKELY) + 0.5) / _LIKELY
    shares = IN_A_STEP + IN_A_STEP_STD * norm.ppf(middles)
    steps: FloatArray = impulse * np.minimum(shares, 1.0)
    return steps


def find_impacts(log: DriveLog, robot: RobotParams) -> Impacts:
    """Find contacts, by the inertial unit or without it by the odometry's speed.

    Within a window the drive changes its speed as its servo does; what is measured beyond is a push
    over the mass. The threshold is such that white noise passes it :data:`FALSE_ALARMS` times an
    hour (Rayleigh distribution), plus a share of what the drive can do in a window.
    """
    if not log.has_accelerations:
        return _impacts(*_by_odometry(log, robot), robot, "odometry")
    seen = _impacts(*_by_imu(log, robot), robot, "imu")
    others = _impacts(*_by_odometry(log, robot), robot, "odometry")
    missed = [each for each in others.found if _is_unseen(log.imu_stamps, each.stamp)]
    found = sorted((*seen.found, *missed), key=lambda each: each.stamp)
    return replace(seen, found=tuple(found))


def _is_unseen(stamps: FloatArray, stamp: float) -> bool:
    """Whether the inertial unit had nothing within half a second of a time."""
    after = int(np.searchsorted(stamps, stamp))
    near = stamps[max(after - 1, 0) : after + 1]
    return bool(np.abs(near - stamp).min() > 0.5)


def _impacts(
    stamps: FloatArray, changes: FloatArray, window: float, robot: RobotParams, source: str
) -> Impacts:
    """Contacts by changes (n, 2) [m/s] of velocity that the drive does not explain."""
    sizes = np.hypot(changes[:, 0], changes[:, 1])
    deviation = max(robust_std(changes[:, 0]), robust_std(changes[:, 1]), 1e-6)
    windows = 3600.0 / max(period_of(stamps), 1e-3)  # [1/h]
    of_noise = deviation * math.sqrt(2.0 * math.log(windows / FALSE_ALARMS))
    strongest = max(robot.max_acceleration, robot.max_deceleration)
    threshold = max(of_noise + _MISFIT * strongest * window, LEAST_IMPULSE / robot.mass)
    expected = windows * math.exp(-0.5 * (threshold / deviation) ** 2)
    found = []
    for part in _joined(sizes > threshold, stamps):
        peak = part.start + int(np.argmax(sizes[part]))
        x, y = changes[peak].tolist()
        stamp = float(stamps[part.start]) - 0.5 * window
        found.append(Impact(stamp, robot.mass * float(sizes[peak]), math.atan2(y, x)))
    return Impacts(tuple(found), robot.mass * threshold, expected, source)


def _joined(chosen: "np.ndarray", stamps: FloatArray) -> list[slice]:
    """Stretches of what was chosen, those close together as one."""
    joined: list[slice] = []
    for part in runs_of(chosen):
        if joined and stamps[part.start] - stamps[joined[-1].stop - 1] < _MERGED:
            joined[-1] = slice(joined[-1].start, part.stop)
        else:
            joined.append(part)
    return joined


def _by_imu(log: DriveLog, robot: RobotParams) -> tuple[FloatArray, FloatArray, float]:
    """Ends (n,) [s] of windows, unexplained changes (n, 2) [m/s] of velocity, and their length."""
    stamps, rates = log.imu_stamps, log.gyro_rates
    period = period_of(stamps)
    count = max(math.ceil(_WINDOW / period - 1e-6), 1)
    steps = np.diff(stamps, prepend=stamps[0] - period)
    lateral = np.interp(stamps, log.stamps, log.speeds) * rates
    gained = steps[:, None] * log.imu[:, 3:5]
    gained[:, 1] -= steps * lateral
    sums = np.vstack((np.zeros(2), np.cumsum(gained, axis=0)))
    ends = np.arange(count, len(stamps))
    changes = sums[ends + 1] - sums[ends + 1 - count]
    # of the centre of mass: the unit is taken to be at the base frame's origin
    changes[:, 1] += robot.center_of_mass_x * (rates[ends] - rates[ends - count])
    is_whole = stamps[ends] - stamps[ends - count] < 2.0 * count * period
    begins = stamps[ends] - count * period
    changes[:, 0] -= _driven(log, robot, begins, count * period, changes[:, 0])
    return stamps[ends][is_whole], changes[is_whole], count * period


def _by_odometry(log: DriveLog, robot: RobotParams) -> tuple[FloatArray, FloatArray, float]:
    """As :func:`_by_imu`, from the odometry's speed; sideways nothing is known."""
    stamps, speeds = log.stamps, log.speeds
    period = period_of(stamps)
    count = max(math.ceil(_WINDOW / period - 1e-6), 1)
    changes = np.zeros((len(stamps) - count, 2))
    changes[:, 0] = speeds[count:] - speeds[:-count]
    changes[:, 0] -= _driven(log, robot, stamps[:-count], count * period, changes[:, 0])
    is_whole = stamps[count:] - stamps[:-count] < 2.0 * count * period
    return stamps[count:][is_whole], changes[is_whole], count * period


def _driven(
    log: DriveLog, robot: RobotParams, begins: FloatArray, window: float, gained: FloatArray
) -> FloatArray:
    """Changes (n,) [m/s] of speed by the servo in windows that begin at times [s].

    Of what was gained (n,) [m/s] that is what commands explain that hold at a window's begin or
    end; without commands whatever the drive can do.
    """
    strongest = max(robot.max_acceleration, robot.max_deceleration) * window
    least, most = np.full(len(begins), -strongest), np.full(len(begins), strongest)
    if len(log.commands):
        asked = [_asked(log, robot, begins, window, part * window) for part in (0.0, 0.5, 1.0)]
        is_asked = used(begins + 0.5 * window, log.commands)
        least = np.where(is_asked, np.min(asked, axis=0), least)
        most = np.where(is_asked, np.max(asked, axis=0), most)
    found: FloatArray = np.clip(gained, least, most)
    return found


def _asked(
    log: DriveLog, robot: RobotParams, begins: FloatArray, window: float, after: float
) -> FloatArray:
    """Changes (n,) [m/s] of speed by the commands that are heard some time [s] into windows."""
    before = np.interp(begins, log.stamps, log.speeds)
    heard = begins + after - robot.compute_latency
    latest = np.searchsorted(log.commands[:, 0], heard, side="right") - 1
    targets = np.where(latest >= 0, log.commands[latest.clip(0), 1], 0.0)
    targets = np.clip(targets, -robot.max_speed, robot.max_speed)
    wanted = (targets - before) * (1.0 - math.exp(-window / robot.servo_time_constant))
    limits = np.where(wanted * before >= 0.0, robot.max_acceleration, robot.max_deceleration)
    limits = limits * window
    found: FloatArray = np.clip(wanted, -limits, limits)
    return found

"""A recorded drive as arrays: commands, odometry, inertial unit, fixes and scans.

Pauses between its parts are no driving.
"""

from dataclasses import dataclass, field

import numpy as np

from navstack.types import BoolArray, FloatArray, LaserScan

PAUSE = 10.0  # [s] without odometry in which nobody records a drive
LEFT = 2.0  # [s] that is left of a pause: more than filters and fits go on over
LEAST_IMU = 100  # messages of an inertial unit that is used
_SHOWN = 5  # pauses in a note
_FASTEST = 30.0  # [m/s] beyond which a step of the odometry is a jump
# [-] of the speed that it reports, likewise, at least [m/s]
_TIMES, _SLOW = 3.0, 3.0


@dataclass(slots=True, eq=False)
class DriveLog:
    """What a log holds; rows in the order of their stamps, each stamp once.

    The first column is the stamp in [s], less ``start``. A sensor that is missing has no rows.
    """

    start: float  # [s] that is taken from every stamp
    commands: FloatArray  # (N, 3) [s], forward [m/s], yaw rate [rad/s]; when it was sent
    odometry: FloatArray  # (N, 6) [s], x, y [m], yaw [rad], forward [m/s], yaw rate [rad/s]
    imu: FloatArray  # (N, 5) [s], yaw [rad] or nan, yaw rate [rad/s], ax, ay [m/s2], base frame
    # (N, 4) [s], x, y [m] of the antenna in a local frame, which begins anywhere; stated deviation
    # [m] or 0
    fixes: FloatArray
    poses: FloatArray  # (N, 4) [s], x, y [m], yaw [rad] where a localizer believed to be, map frame
    takeovers: FloatArray  # (N,) [s] when a person took over, by buttons and switches
    scans: list[LaserScan]  # their stamps less ``start``
    delays: dict[str, FloatArray]  # [s] arrival less stamp of each message, by kind
    has_mounting: bool  # of the lidar, in the log or from the user
    topics: dict[str, str]  # what was read: topic by kind
    files: str  # as the user named them
    resumed: FloatArray  # (n,) [s] of the first odometry after each pause, which is taken out
    antenna: FloatArray = field(default_factory=lambda: np.zeros(2))  # (2,) x, y [m], base frame

    @property
    def stamps(self) -> FloatArray:
        """[s] of the odometry, (N,)."""
        return self.odometry[:, 0]

    @property
    def yaws(self) -> FloatArray:
        """[rad] of the odometry without jumps of a turn, (N,)."""
        return np.unwrap(self.odometry[:, 3])

    @property
    def speeds(self) -> FloatArray:
        """[m/s] forward by the odometry, (N,)."""
        return self.odometry[:, 4]

    @property
    def yaw_rates(self) -> FloatArray:
        """[rad/s] by the odometry, (N,)."""
        return self.odometry[:, 5]

    @property
    def imu_stamps(self) -> FloatArray:
        """[s] of the inertial unit, (N,)."""
        return self.imu[:, 0]

    @property
    def gyro_rates(self) -> FloatArray:
        """[rad/s] yaw rates of the gyro, (N,)."""
        return self.imu[:, 2]

    @property
    def has_accelerations(self) -> bool:
        """Whether the inertial unit measures them; one without accelerometers has zeros."""
        return len(self.imu) > LEAST_IMU and bool(np.any(self.imu[:, 3:5]))

    @property
    def jumps(self) -> BoolArray:
        """Where the odometry begins anew or jumps, between its rows (N - 1,)."""
        return jumps_of(self.odometry)

    @property
    def steps(self) -> FloatArray:
        """[m] between rows of the odometry, (N - 1,); 0 over a pause and where it jumps."""
        steps = np.hypot(np.diff(self.odometry[:, 1]), np.diff(self.odometry[:, 2]))
        is_driven = ~self.jumps & ~np.isin(self.stamps[1:], self.resumed)
        driven: FloatArray = np.where(is_driven, steps, 0.0)
        return driven

    @property
    def duration(self) -> float:
        """[s] from the first to the last message of odometry."""
        if not len(self.odometry):
            return 0.0
        return float(self.stamps[-1] - self.stamps[0])


def period_of(stamps: FloatArray) -> float:
    """[s] between stamps (N,), the median; 0 where there are fewer than two."""
    if len(stamps) < 2:
        return 0.0
    return float(np.median(np.diff(stamps)))


def jumps_of(odometry: FloatArray) -> BoolArray:
    """Which steps between rows (N, 6) of odometry no robot drives that reports these speeds."""
    steps = np.hypot(np.diff(odometry[:, 1]), np.diff(odometry[:, 2]))
    speeds = np.abs(odometry[:, 4])
    fastest = np.maximum(_TIMES * np.maximum(speeds[1:], speeds[:-1]), _SLOW)
    found: BoolArray = steps > 0.1 + np.minimum(fastest, _FASTEST) * np.diff(odometry[:, 0])
    return found


def are_jumps(odometry: FloatArray) -> BoolArray:
    """Which steps between rows (N, 4 or more) of odometry no robot drives at all."""
    steps = np.hypot(np.diff(odometry[:, 1]), np.diff(odometry[:, 2]))
    found: BoolArray = steps > 0.05 + _FASTEST * np.diff(odometry[:, 0])
    return found


@dataclass(frozen=True, slots=True, eq=False)
class Pauses:
    """Times in which a log has no odometry."""

    begins: FloatArray  # (n,) [s] of the last odometry before
    ends: FloatArray  # (n,) [s] of the first odometry after

    @classmethod
    def between(cls, stamps: FloatArray) -> "Pauses":
        """The pauses between stamps (N,) [s] of odometry, in order."""
        at = np.flatnonzero(np.diff(stamps) > PAUSE)
        return cls(stamps[at], stamps[at + 1])

    def leave(self, stamps: FloatArray) -> BoolArray:
        """Which stamps (M,) [s] are within no pause."""
        latest = np.searchsorted(self.begins, stamps, side="left") - 1
        ends = np.append(self.ends, -np.inf)[latest]
        found: BoolArray = stamps >= ends
        return found

    def at_begins(self, stamps: FloatArray) -> FloatArray:
        """Stamps (M,) [s], those within a pause moved to its begin."""
        latest = np.searchsorted(self.begins, stamps, side="left") - 1
        found: FloatArray = np.where(
            self.leave(stamps), stamps, np.append(self.begins, 0.0)[latest]
        )
        return found

    def taken_out(self, stamps: FloatArray) -> FloatArray:
        """Stamps (M,) [s] within no pause, earlier by all but :data:`LEFT` of those before."""
        lost = np.concatenate(((0.0,), np.cumsum(self.ends - self.begins - LEFT)))
        found: FloatArray = stamps - lost[np.searchsorted(self.ends, stamps, side="right")]
        return found

    def note(self) -> str:
        """What is to be said of them; there is one."""
        lengths, times = self.ends - self.begins, self.taken_out(self.begins)
        rows = list(zip(lengths.tolist(), times.tolist(), strict=True))
        listed = [f"{length:.0f} s at {time:.0f} s" for length, time in rows[:_SHOWN]]
        if len(rows) > _SHOWN:
            listed.append(f"{len(rows) - _SHOWN} more times")
        return (
            f"the odometry pauses for {', '.join(listed)}; of each pause {LEFT:g} s are left in "
            "the times of the drive"
        )

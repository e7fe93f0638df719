"""The messages of the robot: what the brain receives, believes and commands.

Fields are named as in the ROS messages they stand for. SI units throughout; yaw in radians,
counter-clockwise from the x axis. Frames: ``map`` (fixed, x east, y north), ``odom`` (fixed at
power-on, drifts), ``base`` (on the robot, x forward, origin between the drive wheels).
"""

from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Float32Array = npt.NDArray[np.float32]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]
ByteArray = npt.NDArray[np.uint8]


class ArrayLayout(NamedTuple):
    """What compiled code knows of an array besides its numbers; all arrays are contiguous."""

    dimensions: int
    is_fixed: bool = False  # read only


# Arrays as kernels take them that Python calls (:func:`navstack.jit.argument_types`).
FloatVector = Annotated[npt.NDArray[np.float64], ArrayLayout(1)]
FloatMatrix = Annotated[npt.NDArray[np.float64], ArrayLayout(2)]
FloatCube = Annotated[npt.NDArray[np.float64], ArrayLayout(3)]
Float32Vector = Annotated[npt.NDArray[np.float32], ArrayLayout(1)]
Float32Matrix = Annotated[npt.NDArray[np.float32], ArrayLayout(2)]
Float32Cube = Annotated[npt.NDArray[np.float32], ArrayLayout(3)]
FixedFloat32Matrix = Annotated[npt.NDArray[np.float32], ArrayLayout(2, is_fixed=True)]
IntVector = Annotated[npt.NDArray[np.int64], ArrayLayout(1)]
IntMatrix = Annotated[npt.NDArray[np.int64], ArrayLayout(2)]
Int32Vector = Annotated[npt.NDArray[np.int32], ArrayLayout(1)]
Int32Matrix = Annotated[npt.NDArray[np.int32], ArrayLayout(2)]
Uint16Vector = Annotated[npt.NDArray[np.uint16], ArrayLayout(1)]
Uint16Matrix = Annotated[npt.NDArray[np.uint16], ArrayLayout(2)]
Uint32Matrix = Annotated[npt.NDArray[np.uint32], ArrayLayout(2)]
BoolVector = Annotated[npt.NDArray[np.bool_], ArrayLayout(1)]
BoolMatrix = Annotated[npt.NDArray[np.bool_], ArrayLayout(2)]
ByteVector = Annotated[npt.NDArray[np.uint8], ArrayLayout(1)]
ByteMatrix = Annotated[npt.NDArray[np.uint8], ArrayLayout(2)]
FixedInt8Matrix = Annotated[npt.NDArray[np.int8], ArrayLayout(2, is_fixed=True)]
FixedByteVector = Annotated[npt.NDArray[np.uint8], ArrayLayout(1, is_fixed=True)]
FixedByteMatrix = Annotated[npt.NDArray[np.uint8], ArrayLayout(2, is_fixed=True)]


class Generators(NamedTuple):
    """What a brain draws its chance from: one generator for each consumer."""

    planner: np.random.Generator
    localizer: np.random.Generator
    controller: np.random.Generator


@dataclass(frozen=True, slots=True)
class Pose2D:
    """A pose in the plane."""

    x: float = 0.0  # [m]
    y: float = 0.0  # [m]
    yaw: float = 0.0  # [rad]

    def as_array(self) -> FloatArray:
        """The pose as an array (3,): x, y, yaw."""
        return np.array((self.x, self.y, self.yaw))


@dataclass(frozen=True, slots=True)
class Twist2D:
    """A velocity in the base frame, after geometry_msgs/Twist."""

    linear_x: float = 0.0  # [m/s] forward
    linear_y: float = 0.0  # [m/s] to the left; 0 for a differential drive
    angular_z: float = 0.0  # [rad/s] counter-clockwise


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """A global plan in the map frame, after nav_msgs/Path. A new plan is a new object."""

    poses: FloatArray  # (N, 3): x [m], y [m], yaw [rad]
    stamp: float = 0.0  # [s] when it was planned

    def __len__(self) -> int:
        return len(self.poses)

    @property
    def length(self) -> float:
        """Length along the path in [m]."""
        return float(np.hypot(*np.diff(self.poses[:, :2], axis=0).T).sum())


@dataclass(frozen=True, slots=True, eq=False)
class LaserScan:
    """One planar scan, after sensor_msgs/LaserScan. A beam without a return reads ``inf``."""

    stamp: float  # [s]
    ranges: FloatArray  # (n,) [m]; inf: nothing within range_max
    angle_min: float  # [rad] of beam 0 in the sensor frame
    angle_increment: float  # [rad]
    range_min: float  # [m]
    range_max: float  # [m]
    sensor_pose: Pose2D = Pose2D()  # of the sensor in the base frame


@dataclass(frozen=True, slots=True)
class Odometry:
    """Wheel odometry, after nav_msgs/Odometry."""

    stamp: float  # [s]
    pose: Pose2D  # in the odom frame; drifts
    twist: Twist2D  # in the base frame
    velocity_std: float = 0.0  # [m/s] of the forward velocity; 0: not stated, as in ROS
    yaw_rate_std: float = 0.0  # [rad/s]; 0: not stated


@dataclass(frozen=True, slots=True)
class Imu:
    """Inertial measurement, after sensor_msgs/Imu."""

    stamp: float  # [s]
    yaw: float  # [rad] absolute orientation in the map frame; nan: the unit has none
    angular_velocity_z: float  # [rad/s]
    linear_acceleration_x: float  # [m/s2] in the base frame
    linear_acceleration_y: float  # [m/s2] in the base frame
    yaw_std: float = 0.0  # [rad]; 0: not stated, as in ROS
    yaw_rate_std: float = 0.0  # [rad/s]; 0: not stated
    pitch: float = 0.0  # [rad] of the base, positive downhill; 0 also where it is not stated


@dataclass(frozen=True, slots=True)
class GpsFix:
    """A position fix in the local map frame, after sensor_msgs/NavSatFix projected to metres."""

    stamp: float  # [s]
    x: float  # [m] of the base frame's origin
    y: float  # [m]
    position_std: float  # [m] standard deviation per axis that the receiver reports; 0: not stated


@dataclass(frozen=True, slots=True)
class Observation:
    """What arrived since the previous tick; None where nothing did.

    Only the newest of each kind is kept.
    """

    stamp: float  # [s] now
    odometry: Odometry | None = None
    imu: Imu | None = None
    gps: GpsFix | None = None
    scan: LaserScan | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """A body that no map shows and that may move, e.g. a person; in the map frame."""

    id: int  # the same as long as it is followed
    stamp: float  # [s]
    x: float  # [m] of its centre
    y: float  # [m]
    vx: float  # [m/s]
    vy: float  # [m/s]
    radius: float  # [m]
    covariance: FloatArray  # (4, 4) of x, y, vx, vy


class Health(Enum):
    """What a localizer says of itself."""

    TRACKING = "tracking"
    DEGRADED = "degraded"
    LOST = "lost"


def _no_covariance() -> FloatArray:
    return np.zeros((3, 3))


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """Where the robot believes it is, in the map frame."""

    pose: Pose2D
    covariance: FloatArray = field(default_factory=_no_covariance)  # (3, 3) of x, y, yaw
    health: Health = Health.TRACKING
    stamp: float = 0.0  # [s]


@dataclass(frozen=True, slots=True)
class RobotState:
    """What controllers and behaviors start from: believed pose and measured motion."""

    pose: Pose2D  # in the map frame
    twist: Twist2D  # in the base frame, from odometry
    stamp: float = 0.0  # [s]
    odom_pose: Pose2D = Pose2D()  # in the odom frame: drifts, but never jumps
    # [m] of the believed place, along the direction in which it is least sure
    position_std: float = 0.0

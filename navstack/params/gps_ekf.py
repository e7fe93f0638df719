"""Parameters of the GPS-EKF: this program's own node ``gps_ekf``.

Names are those of robot_localization (``ekf_node``, ``navsat_transform_node``) where the meaning is the same.
"""

import dataclasses
import math
from dataclasses import dataclass

from navstack.errors import ParameterError

ENGINES = ("kernel", "filterpy")
_POSITIVE = (
    *("odom0_velocity_std", "odom0_yaw_rate_std", "imu0_yaw_std", "imu0_yaw_rate_std", "gps0_position_std"),
    *("gps0_correlation_time", "gps0_rejection_threshold", "odom0_twist_rejection_threshold"),
    *("imu0_pose_rejection_threshold", "sensor_timeout", "history_length", "lost_above", "lost_after"),
    *("degraded_above", "degraded_after", "acceleration_noise", "acceleration_noise_without_imu"),
    "gps0_lockout_count",
)
_FREE = ("engine", "magnetic_declination_radians", "yaw_offset")


@dataclass(frozen=True, slots=True)
class GpsEkfParams:
    """Noise, gates and health of the GPS-EKF. A deviation that a message states itself takes precedence."""

    engine: str = "kernel"  # or filterpy: the same equations by filterpy's ExtendedKalmanFilter, several times slower

    odom0_velocity_std: float = 0.05  # [m/s] of a wheel odometry that states none
    odom0_yaw_rate_std: float = 0.05  # [rad/s] likewise
    odom0_scale_std: float = 0.01  # [-] wheel radius at the start; Borenstein & Feng 1996 find ~1 % uncalibrated
    odom0_scale_walk: float = 0.0003  # [1/sqrt(s)] tyres, load and ground: 1 % in 20 minutes; assumed
    odom0_twist_rejection_threshold: float = 4.0  # [-] Mahalanobis distance from which on a velocity counts less
    track_width: float = 0.5  # [m] between the wheels: what a slipping wheel's yaw rate says of its speed

    imu0_yaw_std: float = 0.05  # [rad] of an absolute orientation that states none; MEMS units' data sheets: 2 degrees
    imu0_yaw_rate_std: float = 0.01  # [rad/s] of one sample of a gyro that states none
    imu0_yaw_rate_bias_std: float = 0.01  # [rad/s] at the start; MEMS units' data sheets: 0.25 to 1 deg/s
    imu0_yaw_rate_bias_walk: float = 1e-4  # [rad/s/sqrt(s)] 0.006 rad/s in 1 h; ADIS16448 of EuRoC: 1.94e-5
    imu0_pose_rejection_threshold: float = 5.0  # [-] Mahalanobis distance from which on the offset is taken to have
    # jumped
    imu0_yaw_offset_std: float = math.pi / math.sqrt(3.0)  # [rad] of the absolute orientation's offset (declination,
    # mounting, iron) at the start; the default: anywhere. A calibrated dual-antenna heading: 0.05
    imu0_yaw_offset_walk: float = 0.02  # [rad/sqrt(s)] of that: 10 degrees in 75 s; assumed, for hard and soft iron
    # change a compass's deviation with the heading and the place (Caruso, SAE 970602, 1997)
    magnetic_declination_radians: float = 0.0  # [rad] added to the absolute orientation, as navsat_transform does
    yaw_offset: float = 0.0  # [rad] likewise
    imu0_relative: bool = False  # the first absolute orientation is taken for the heading of the start

    gps0_position_std: float = 2.0  # [m] per axis of a fix that states none; 2.5 m CEP, stand-alone receivers' data
    # sheets
    gps0_correlated_share: float = 0.9  # [-] of a fix's variance that is one error for many fixes (multipath,
    # atmosphere), a first-order Gauss-Markov process; assumed: receivers filter what is white
    gps0_correlation_time: float = 20.0  # [s] of that; multipath: 10 to 900 s (Joerger & Pervan 2020, NAVIGATION 67(3))
    gps0_rejection_threshold: float = 3.717  # [-] Mahalanobis distance; 1 of 1000 fixes is farther off (chi-square, 2)
    gps0_lockout_count: int = 5  # rejected fixes in succession after which the filter doubts itself
    gps0_lockout_time: float = 5.0  # [s] that they must span

    acceleration_noise: float = 0.3  # [m/s2/sqrt(Hz)] of the forward acceleration: gravity on slopes of 1 to 2 degrees
    acceleration_noise_without_imu: float = 1.0  # [m/s2/sqrt(Hz)] of a robot whose acceleration nobody measures
    position_noise: float = 0.02  # [m/sqrt(m)] slip in any direction: 0.2 m after 100 m; twice Thrun et al., sec. 5.4
    yaw_noise: float = 0.0005  # [rad/sqrt(s)] besides the gyro's: tilt, sampling; assumed

    sensor_timeout: float = 0.2  # [s] for which the last message of wheels or gyro holds
    history_length: float = 5.0  # [s] by which a message may be late
    degraded_above: float = 1.0  # [m] standard deviation along the worst direction
    lost_above: float = 3.0  # [m]
    degraded_after: float = 2.0  # [s] without an accepted fix
    lost_after: float = 60.0  # [s]

    def __post_init__(self) -> None:
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float) and not math.isfinite(value):
                raise ParameterError(f"gps_ekf: {field.name} {value} must be a finite number")
            if field.name in _POSITIVE and not value > 0.0:
                raise ParameterError(f"gps_ekf: {field.name} {value} must be more than 0")
            if field.name not in _FREE and value < 0.0:
                raise ParameterError(f"gps_ekf: {field.name} {value} must be 0 or more")
        if self.engine not in ENGINES:
            raise ParameterError(f"gps_ekf: engine {self.engine} must be one of {', '.join(ENGINES)}")
        if self.gps0_correlated_share >= 1.0:
            raise ParameterError(f"gps_ekf: gps0_correlated_share {self.gps0_correlated_share} must be less than 1")

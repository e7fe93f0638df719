"""Parameters of the GPS-EKF: this program's own node ``gps_ekf``.

Names are those of robot_localization (``ekf_node``, ``navsat_transform_node``) where the meaning is
the same.
"""

import math
from dataclasses import dataclass
from typing import Annotated

from navstack.ranges import (
    NOT_NEGATIVE,
    NotNegative,
    Parameters,
    Positive,
    PositiveInt,
    Quantity,
    less_than,
    one_of,
)

Engine = Annotated[str, one_of(("kernel", "filterpy"))]


@dataclass(frozen=True, slots=True)
class GpsEkfParams(Parameters, whose="gps_ekf", finite=True):
    """Noise, gates and health of the GPS-EKF.

    A deviation that a message states itself takes precedence.
    """

    # filterpy: the same equations by filterpy's ExtendedKalmanFilter, several times slower
    engine: Engine = "kernel"

    odom0_velocity_std: Positive = 0.05  # [m/s] of a wheel odometry that states none
    odom0_yaw_rate_std: Positive = 0.05  # [rad/s] likewise
    # [-] wheel radius at the start; Borenstein & Feng 1996 find ~1 % uncalibrated
    odom0_scale_std: NotNegative = 0.01
    # [1/sqrt(s)] tyres, load and ground: 1 % in 20 minutes; assumed
    odom0_scale_walk: NotNegative = 0.0003
    # [-] Mahalanobis distance from which on a velocity counts less
    odom0_twist_rejection_threshold: Positive = 4.0
    # [m] between the wheels: what a slipping wheel's yaw rate says of its speed
    track_width: NotNegative = 0.5

    # [rad] of an absolute orientation that states none; MEMS units' data sheets: 2 degrees
    imu0_yaw_std: Positive = 0.05
    imu0_yaw_rate_std: Positive = 0.01  # [rad/s] of one sample of a gyro that states none
    # [rad/s] at the start; MEMS units' data sheets: 0.25 to 1 deg/s
    imu0_yaw_rate_bias_std: NotNegative = 0.01
    # [rad/s/sqrt(s)] 0.006 rad/s in 1 h; ADIS16448 of EuRoC: 1.94e-5
    imu0_yaw_rate_bias_walk: NotNegative = 1e-4
    # [-] Mahalanobis distance from which on the offset is taken to have jumped
    imu0_pose_rejection_threshold: Positive = 5.0
    # [rad] of the absolute orientation's offset (declination, mounting, iron) at the start; the
    # default: any offset. A calibrated dual-antenna heading: 0.05
    imu0_yaw_offset_std: NotNegative = math.pi / math.sqrt(3.0)
    # [rad/sqrt(s)] of that: 10 degrees in 75 s; assumed, for hard and soft iron change a compass's
    # deviation with the heading and the place (Caruso, SAE 970602, 1997)
    imu0_yaw_offset_walk: NotNegative = 0.02
    # [rad] added to the absolute orientation, as navsat_transform does
    magnetic_declination_radians: Quantity = 0.0
    yaw_offset: Quantity = 0.0  # [rad] likewise
    # the first absolute orientation is taken for the heading of the start
    imu0_relative: bool = False

    # [m] per axis of a fix that states none; 2.5 m CEP, data sheets of stand-alone receivers
    gps0_position_std: Positive = 2.0
    # [-] of a fix's variance that is one error for many fixes (multipath, atmosphere), a
    # first-order Gauss-Markov process; assumed: receivers filter white noise
    gps0_correlated_share: Annotated[float, NOT_NEGATIVE, less_than(1)] = 0.9
    # [s] of that; multipath: 10 to 900 s (Joerger & Pervan 2020, NAVIGATION 67(3))
    gps0_correlation_time: Positive = 20.0
    # [-] Mahalanobis distance; 1 of 1000 fixes is farther off (chi-square, 2 degrees of freedom)
    gps0_rejection_threshold: Positive = 3.717
    # rejected fixes in succession after which the state counts as wrong
    gps0_lockout_count: PositiveInt = 5
    gps0_lockout_time: NotNegative = 5.0  # [s] that they must span

    # whether scans are aligned with the map, and correct the state where surfaces determine it
    scan0_alignment: bool = False

    # [m/s2/sqrt(Hz)] of the forward acceleration: gravity on slopes of 1 to 2 degrees
    acceleration_noise: Positive = 0.3
    # [m/s2/sqrt(Hz)] of a robot whose acceleration nobody measures
    acceleration_noise_without_imu: Positive = 1.0
    # [m/sqrt(m)] slip in any direction: 0.2 m after 100 m; twice Thrun et al., sec. 5.4
    position_noise: NotNegative = 0.02
    yaw_noise: NotNegative = 0.0005  # [rad/sqrt(s)] besides the gyro's: tilt, sampling; assumed

    sensor_timeout: Positive = 0.2  # [s] for which the last message of wheels or gyro holds
    history_length: Positive = 5.0  # [s] by which a message may be late
    degraded_above: Positive = 1.0  # [m] standard deviation along the worst direction
    lost_above: Positive = 3.0  # [m]
    degraded_after: Positive = 2.0  # [s] without an accepted fix
    lost_after: Positive = 60.0  # [s]

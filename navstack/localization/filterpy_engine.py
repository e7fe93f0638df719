"""The GPS-EKF's linear algebra by filterpy, in place of the compiled steps."""

import numpy as np

from navstack.localization import gps_ekf_kernels as kernels
from navstack.localization.gps_ekf_filter import Engine
from navstack.localization.gps_ekf_kernels import SIZE
from navstack.types import FloatArray


def filterpy_engine() -> Engine:
    """The extended Kalman filter of filterpy, in place of the compiled steps.

    filterpy is imported here: it brings scipy.stats along, which takes half a second.
    """
    from filterpy.kalman import ExtendedKalmanFilter

    ekf = ExtendedKalmanFilter(dim_x=SIZE, dim_z=1)

    def propagate(
        mean: FloatArray,
        covariance: FloatArray,
        dt: float,
        yaw_rate: float,
        gyro: float,
        acceleration: float,
        densities: FloatArray,
    ) -> None:
        """Predict with filterpy, but the state by the motion model."""
        ekf.P = covariance.copy()
        ekf.F = kernels.motion_jacobian(mean, dt, yaw_rate, gyro, acceleration)
        ekf.Q = kernels.process_noise(mean, dt, yaw_rate, gyro, densities)
        ekf.predict()
        kernels.move(mean, dt, yaw_rate, gyro, acceleration)
        covariance[:] = ekf.P

    def correct(
        mean: FloatArray,
        covariance: FloatArray,
        row: FloatArray,
        innovation: float,
        variance: float,
    ) -> None:
        ekf.x, ekf.P = mean.copy(), covariance.copy()
        ekf.update(innovation, lambda _: row[None, :], lambda _: np.zeros(1), R=variance)
        mean[:], covariance[:] = ekf.x, ekf.P

    return Engine(propagate, correct)

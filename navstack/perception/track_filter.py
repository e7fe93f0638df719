"""Kalman filters of many bodies at once: constant velocity, disturbed by white acceleration."""

import math

import numpy as np

from navstack.types import BoolArray, FloatArray, IntArray

_UNIT = np.eye(2)
_WHOLE = np.eye(4)


class TrackFilter:
    """States x, y [m], vx, vy [m/s] of N bodies with their covariances.

    All are predicted and updated together.

    The equations are those of ``filterpy.kalman.KalmanFilter`` (Labbe), on stacked matrices; the
    update is Joseph's.
    """

    def __init__(self, acceleration_std: float, initial_speed_std: float) -> None:
        """No bodies yet.

        Args:
            acceleration_std: [m/s2] along x and y, constant within a step and independent between
                steps.
            initial_speed_std: [m/s] along x and y of a new body.
        """
        self._acceleration_variance = acceleration_std**2
        self._initial_speed_variance = initial_speed_std**2
        self.states = np.empty((0, 4))
        self.covariances = np.empty((0, 4, 4))

    def __len__(self) -> int:
        return len(self.states)

    def predict(self, duration: float) -> None:
        """Move all bodies on by ``duration`` [s]."""
        step, noise = motion_of(duration, self._acceleration_variance)
        self.states = self.states @ step.T
        self.covariances = step @ self.covariances @ step.T + noise

    def distances(self, places: FloatArray, variances: FloatArray) -> FloatArray:
        """Squared Mahalanobis distances (N, M) of places (M, 2) [m] with variances (M,) [m2]."""
        ways = places[None, :, :] - self.states[:, None, :2]
        spread = self.covariances[:, None, :2, :2] + variances[None, :, None, None] * _UNIT
        a = spread[..., 0, 0]
        b = spread[..., 0, 1]
        c = spread[..., 1, 1]
        x = ways[..., 0]
        y = ways[..., 1]
        squared: FloatArray = (c * x * x - 2.0 * b * x * y + a * y * y) / (a * c - b * b)
        return squared

    def ahead(self, bodies: IntArray, duration: float) -> tuple[FloatArray, FloatArray]:
        """States (K, 4) and covariances (K, 4, 4) of some bodies ``duration`` [s] later."""
        step, noise = motion_of(duration, self._acceleration_variance)
        return self.states[bodies] @ step.T, step @ self.covariances[bodies] @ step.T + noise

    def update(self, bodies: IntArray, places: FloatArray, variances: FloatArray) -> FloatArray:
        """Take in one measured place (2,) [m] for each of ``bodies`` (K,).

        Returns:
            How dense [1/m2] the places expected before were at the measured ones (K,).
        """
        if not len(bodies):
            return np.empty(0)
        covariances = self.covariances[bodies]
        noise = variances[:, None, None] * _UNIT
        spread = covariances[:, :2, :2] + noise
        inverse = np.linalg.inv(spread)
        off = places - self.states[bodies, :2]
        squared = (off[:, None, :] @ inverse @ off[:, :, None])[:, 0, 0]
        gains = covariances[:, :, :2] @ inverse
        self.states[bodies] += (gains @ off[:, :, None])[:, :, 0]
        rest = np.broadcast_to(_WHOLE, covariances.shape).copy()
        rest[:, :, :2] -= gains
        self.covariances[bodies] = rest @ covariances @ _transposed(
            rest
        ) + gains @ noise @ _transposed(gains)
        density: FloatArray = np.exp(-0.5 * squared) / (
            2.0 * math.pi * np.sqrt(np.linalg.det(spread))
        )
        return density

    def add(self, places: FloatArray, variances: FloatArray) -> None:
        """Begin to follow bodies at places (K, 2) [m]; they may move anywhere."""
        count = len(places)
        new = np.zeros((count, 4, 4))
        new[:, 0, 0] = new[:, 1, 1] = variances
        new[:, 2, 2] = new[:, 3, 3] = self._initial_speed_variance
        self.states = np.concatenate((self.states, np.column_stack((places, np.zeros((count, 2))))))
        self.covariances = np.concatenate((self.covariances, new))

    def keep(self, chosen: BoolArray) -> None:
        """Forget all bodies but the ``chosen`` (N,) ones."""
        self.states = self.states[chosen]
        self.covariances = self.covariances[chosen]


def motion_of(duration: float, acceleration_variance: float) -> tuple[FloatArray, FloatArray]:
    """The matrix (4, 4) that moves x, y, vx, vy on by ``duration`` [s], and the added covariance.

    The covariance is that of ``filterpy.common.Q_discrete_white_noise``: constant acceleration
    within the step.
    """
    step = _WHOLE.copy()
    noise = np.zeros((4, 4))
    step[0, 2] = step[1, 3] = duration
    noise[0, 0] = noise[1, 1] = 0.25 * duration**4 * acceleration_variance
    shared = 0.5 * duration**3 * acceleration_variance
    noise[0, 2] = noise[1, 3] = noise[2, 0] = noise[3, 1] = shared
    noise[2, 2] = noise[3, 3] = duration**2 * acceleration_variance
    return step, noise


def turned(
    states: FloatArray, covariances: FloatArray, angle: float
) -> tuple[FloatArray, FloatArray]:
    """States (N, 4) and covariances (N, 4, 4), turned by ``angle`` [rad] about the origin."""
    cos = math.cos(angle)
    sin = math.sin(angle)
    rotation = np.zeros((4, 4))
    rotation[:2, :2] = rotation[2:, 2:] = (cos, -sin), (sin, cos)
    return states @ rotation.T, rotation @ covariances @ rotation.T


def _transposed(matrices: FloatArray) -> FloatArray:
    return np.swapaxes(matrices, 1, 2)

"""How the robot drove: measures of a trajectory sampled at equal steps of time."""

import numpy as np

from navstack.types import FloatArray

# [s] length of the window that speed and lateral acceleration are smoothed over
SMOOTHING_TIME = 0.5
SMOOTHING_ORDER = 3  # of the polynomial fitted in it


def distance_driven(x: FloatArray, y: FloatArray) -> float:
    """Length in [m] of the line through the positions (T,)."""
    return float(np.hypot(np.diff(x), np.diff(y)).sum())


def success_weighted_path_length(arrived: bool, shortest: float, driven: float) -> float:
    """SPL of one delivery: 0 on failure, else shortest over driven length.

    Anderson et al. 2018, arXiv:1807.06757. A path that is shorter than ``shortest`` [m], because
    the goal has a radius, counts as the shortest.
    """
    if not arrived or shortest <= 0.0:
        return float(arrived)
    return shortest / max(shortest, driven)


def jerk(speed: FloatArray, period: float) -> FloatArray:
    """Second derivative in [m/s3] of a speed (T,) [m/s] sampled every ``period`` [s].

    See :func:`smoothed`.
    """
    return smoothed(speed, period, derivative=2)


def lateral_acceleration(speed: FloatArray, yaw_rate: FloatArray, period: float) -> FloatArray:
    """Speed times yaw rate in [m/s2], smoothed; see :func:`smoothed`."""
    return smoothed(speed * yaw_rate, period)


def smoothed(values: FloatArray, period: float, derivative: int = 0) -> FloatArray:
    """A derivative of the cubic fitted to each :data:`SMOOTHING_TIME` of values (T,).

    Savitzky and Golay 1964 (Analytical Chemistry 36, 1627). Only whole windows count: the result is
    shorter by all but one of a window's samples, and empty where there are too few values.
    """
    half = max(2, round(0.5 * SMOOTHING_TIME / period))
    if len(values) < 2 * half + 1:
        return np.empty(0)
    times = np.arange(-half, half + 1) * period
    # Row k of the pseudo-inverse gives the coefficient of t^k, which is the k-th derivative over k
    # factorial.
    weights = np.linalg.pinv(np.vander(times, SMOOTHING_ORDER + 1, increasing=True))[derivative]
    factorial = (1.0, 1.0, 2.0)[derivative]
    result: FloatArray = factorial * np.convolve(values, weights[::-1], mode="valid")
    return result


def wrapped(angles: FloatArray) -> FloatArray:
    """Angles in [rad] brought to -pi..pi."""
    result: FloatArray = (angles + np.pi) % (2.0 * np.pi) - np.pi
    return result

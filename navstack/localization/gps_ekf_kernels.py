"""The GPS-EKF's motion model and linear algebra.

The state (9,) is x, y [m], yaw [rad], speed of the wheels' surface [m/s], gyro bias [rad/s], scale
[-] by which the robot moves more than its wheels turn, offset of the inertial unit's absolute
orientation [rad], and the error [m] along x and y that one fix shares with the next.

The speed is the wheels', not the ground's: a measurement of it is then linear and says nothing of
the scale. With the product of the two in the measurement the filter takes its own noise for
knowledge of the scale.
"""

import math

import numpy as np

from navstack.jit import njit
from navstack.types import FloatArray, FloatMatrix, FloatVector

X, Y, YAW, SPEED, BIAS, SCALE, OFFSET, GPS_X, GPS_Y = range(9)
SIZE = 9


@njit()
def move(mean: FloatArray, dt: float, yaw_rate: float, gyro: float, acceleration: float) -> None:
    """Move a state by constant yaw rate and acceleration, in place.

    The position follows the heading at half time with the speed at half time (midpoint rule).

    Args:
        mean: (9,) the state.
        dt: [s].
        yaw_rate: [rad/s] as measured.
        gyro: 1 if a gyro measured it and its bias is to be taken off; 0 if the wheels did.
        acceleration: [m/s2] forward.
    """
    turn = (yaw_rate - gyro * mean[BIAS]) * dt
    middle = mean[YAW] + 0.5 * turn
    distance = (1.0 + mean[SCALE]) * (mean[SPEED] + 0.5 * acceleration * dt) * dt
    mean[X] += distance * math.cos(middle)
    mean[Y] += distance * math.sin(middle)
    mean[YAW] += turn
    mean[SPEED] += acceleration * dt


@njit()
def motion_jacobian(
    mean: FloatArray, dt: float, yaw_rate: float, gyro: float, acceleration: float
) -> FloatArray:
    """The derivative (9, 9) of :func:`move`'s result by the state."""
    middle = mean[YAW] + 0.5 * (yaw_rate - gyro * mean[BIAS]) * dt
    counted = (mean[SPEED] + 0.5 * acceleration * dt) * dt
    scale = 1.0 + mean[SCALE]
    along_x, along_y = math.cos(middle), math.sin(middle)
    jacobian = np.eye(SIZE)
    jacobian[X, YAW], jacobian[Y, YAW] = -scale * counted * along_y, scale * counted * along_x
    jacobian[X, SPEED], jacobian[Y, SPEED] = scale * along_x * dt, scale * along_y * dt
    jacobian[X, SCALE], jacobian[Y, SCALE] = counted * along_x, counted * along_y
    jacobian[YAW, BIAS] = -gyro * dt
    jacobian[X, BIAS] = -0.5 * gyro * dt * jacobian[X, YAW]
    jacobian[Y, BIAS] = -0.5 * gyro * dt * jacobian[Y, YAW]
    return jacobian


@njit()
def process_noise(
    mean: FloatArray, dt: float, yaw_rate: float, gyro: float, densities: FloatArray
) -> FloatArray:
    """The covariance (9, 9) that white noise adds while the state moves.

    Noise of yaw rate and acceleration is integrated into heading, speed and position (Bar-Shalom,
    Li & Kirubarajan 2001, sec. 6.2.2: dt, dt^2/2, dt^3/3).

    Args:
        mean: (9,) the state before.
        dt: [s].
        yaw_rate: [rad/s] as in :func:`move`.
        gyro: as in :func:`move`.
        densities: (6,) power spectral densities of yaw rate [rad2/s], acceleration [m2/s3],
            position [m2/s], gyro bias [rad2/s3], scale [1/s] and offset [rad2/s].
    """
    middle = mean[YAW] + 0.5 * (yaw_rate - gyro * mean[BIAS]) * dt
    along_x, along_y = math.cos(middle), math.sin(middle)
    across_x, across_y = -mean[SPEED] * along_y, mean[SPEED] * along_x
    half, third = 0.5 * dt * dt, dt * dt * dt / 3.0
    turn, push = densities[0], densities[1]
    noise = np.zeros((SIZE, SIZE))
    noise[X, X] = (
        third * (turn * across_x * across_x + push * along_x * along_x) + densities[2] * dt
    )
    noise[Y, Y] = (
        third * (turn * across_y * across_y + push * along_y * along_y) + densities[2] * dt
    )
    noise[X, Y] = noise[Y, X] = third * (turn * across_x * across_y + push * along_x * along_y)
    noise[X, YAW] = noise[YAW, X] = half * turn * across_x
    noise[Y, YAW] = noise[YAW, Y] = half * turn * across_y
    noise[X, SPEED] = noise[SPEED, X] = half * push * along_x
    noise[Y, SPEED] = noise[SPEED, Y] = half * push * along_y
    noise[YAW, YAW], noise[SPEED, SPEED] = turn * dt, push * dt
    noise[BIAS, BIAS] = densities[3] * dt
    noise[SCALE, SCALE] = densities[4] * dt
    noise[OFFSET, OFFSET] = densities[5] * dt
    return noise


@njit(ahead=True)
def propagate(
    mean: FloatVector,
    covariance: FloatMatrix,
    dt: float,
    yaw_rate: float,
    gyro: float,
    acceleration: float,
    densities: FloatVector,
) -> None:
    """Predict in place: ``P = F P F' + Q``; F's few entries off the diagonal, rows first."""
    jacobian = motion_jacobian(mean, dt, yaw_rate, gyro, acceleration)
    noise = process_noise(mean, dt, yaw_rate, gyro, densities)
    for j in range(SIZE):
        for i in (X, Y):  # each row needs rows below it as they were
            covariance[i, j] += (
                jacobian[i, YAW] * covariance[YAW, j]
                + jacobian[i, SPEED] * covariance[SPEED, j]
                + jacobian[i, BIAS] * covariance[BIAS, j]
                + jacobian[i, SCALE] * covariance[SCALE, j]
            )
        covariance[YAW, j] += jacobian[YAW, BIAS] * covariance[BIAS, j]
    for i in range(SIZE):
        for j in (X, Y):
            covariance[i, j] += (
                jacobian[j, YAW] * covariance[i, YAW]
                + jacobian[j, SPEED] * covariance[i, SPEED]
                + jacobian[j, BIAS] * covariance[i, BIAS]
                + jacobian[j, SCALE] * covariance[i, SCALE]
            )
        covariance[i, YAW] += jacobian[YAW, BIAS] * covariance[i, BIAS]
    for i in range(SIZE):
        for j in range(SIZE):
            covariance[i, j] += noise[i, j]
    move(mean, dt, yaw_rate, gyro, acceleration)


@njit(ahead=True)
def correct(
    mean: FloatVector, covariance: FloatMatrix, row: FloatVector, innovation: float, variance: float
) -> None:
    """Correct in place by one scalar measurement: ``x += K nu``, ``P -= K S K'``.

    Args:
        mean: (9,) the state.
        covariance: (9, 9) of the state.
        row: (9,) derivative of the measurement by the state.
        innovation: measured less expected.
        variance: of the measurement.
    """
    projected = np.zeros(SIZE)
    spread = variance
    for i in range(SIZE):
        for j in range(SIZE):
            projected[i] += covariance[i, j] * row[j]
        spread += row[i] * projected[i]
    for i in range(SIZE):
        gain = projected[i] / spread
        mean[i] += gain * innovation
        for j in range(SIZE):
            covariance[i, j] -= gain * projected[j]


@njit(ahead=True)
def age_shared_error(
    mean: FloatVector, covariance: FloatMatrix, decay: float, variance: float
) -> None:
    """Age the error that fixes share, in place: a first-order Gauss-Markov process.

    Args:
        mean: (9,) the state.
        covariance: (9, 9) of the state.
        decay: [-] ``exp(-dt / correlation time)``.
        variance: [m2] per axis in the long run.
    """
    for k in (GPS_X, GPS_Y):
        mean[k] *= decay
        for j in range(SIZE):
            covariance[k, j] *= decay
        for i in range(SIZE):
            covariance[i, k] *= decay
        covariance[k, k] += variance * (1.0 - decay * decay)


@njit(ahead=True)
def fix_innovation(
    mean: FloatVector, covariance: FloatMatrix, x: float, y: float, variance: float
) -> tuple[float, float, float]:
    """How far a fix lies from where the state expects it.

    Args:
        mean: (9,) the state.
        covariance: (9, 9) of the state.
        x: [m] of the fix.
        y: [m] of the fix.
        variance: [m2] per axis of the fix's white error.

    Returns:
        Innovation along x and y [m], and its normalized square ``nu' S^-1 nu``.
    """
    dx, dy = x - mean[X] - mean[GPS_X], y - mean[Y] - mean[GPS_Y]
    xx = covariance[X, X] + 2.0 * covariance[X, GPS_X] + covariance[GPS_X, GPS_X] + variance
    yy = covariance[Y, Y] + 2.0 * covariance[Y, GPS_Y] + covariance[GPS_Y, GPS_Y] + variance
    xy = covariance[X, Y] + covariance[X, GPS_Y] + covariance[GPS_X, Y] + covariance[GPS_X, GPS_Y]
    return dx, dy, (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy)

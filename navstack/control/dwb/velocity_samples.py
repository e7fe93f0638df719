"""The velocities that DWB tries: every reachable combination, in Nav2's order.

Their last bits are Nav2's, too.
"""

import numpy as np

from navstack.jit import njit
from navstack.params.dwb import EPSILON
from navstack.types import FloatArray, IntArray

# of kinematic_parameters.hpp, in [m2/s2] and [rad/s]: the spacing of single precision at 1
_FLOAT_EPSILON = float(np.finfo(np.float32).eps)


@njit()
def project_velocity(
    start: float,
    acceleration: float,
    deceleration: float,
    dt: float,
    target: float,
) -> float:
    """The velocity ``dt`` seconds after ``start`` on the way to ``target``.

    The deceleration is negative.
    """
    if start < target:
        return min(target, start + acceleration * dt)
    return max(target, start + deceleration * dt)


@njit()
def axis_samples(current: float, limits: FloatArray, count: int, time: float) -> FloatArray:
    """Velocities of one axis by repeated addition, and 0 where the range straddles it.

    ``limits`` (4,): least and largest velocity, acceleration, deceleration. After
    ``one_d_velocity_iterator.hpp``; ``low + i * increment`` would differ in the last bit, which
    decides the number of steps of a trajectory.
    """
    current = min(max(current, limits[0]), limits[1])
    high = project_velocity(current, limits[2], limits[3], time, limits[1])
    low = project_velocity(current, limits[2], limits[3], time, limits[0])
    increment = 1.0
    if abs(low - high) >= EPSILON:
        increment = (high - low) / (max(2, count) - 1)
    # the tolerance may let some more through
    samples = np.empty(int((high - low + EPSILON) / increment) + 3)
    n = 0
    value = low
    zero_due = True
    while value <= high + EPSILON:
        samples[n] = value
        n += 1
        if (
            zero_due
            and value < 0.0
            and value + increment > 0.0
            and value + increment <= high + EPSILON
        ):
            samples[n] = 0.0
            n += 1
            zero_due = False
        value += increment
    return samples[:n]


@njit()
def combine(
    current: FloatArray,
    limits: FloatArray,
    counts: IntArray,
    speeds: FloatArray,
    acceleration_time: float,
) -> FloatArray:
    """Combinations (K, 3) of the axes' samples; none stands still, is too fast or too slow.

    ``speeds`` (3,): min_speed_xy, max_speed_xy, min_speed_theta; a negative limit is none. After
    ``kinematic_parameters.hpp``.
    """
    xs = axis_samples(current[0], limits[0], counts[0], acceleration_time)
    ys = axis_samples(current[1], limits[1], counts[1], acceleration_time)
    thetas = axis_samples(current[2], limits[2], counts[2], acceleration_time)
    samples = np.empty((len(xs) * len(ys) * len(thetas), 3))
    n = 0
    for vx in xs:
        for vy in ys:
            squared = vx * vx + vy * vy
            if speeds[1] >= 0.0 and squared > speeds[1] * speeds[1] + _FLOAT_EPSILON:
                continue
            crawls = (
                speeds[0] >= 0.0
                and squared + _FLOAT_EPSILON < speeds[0] * speeds[0]
                and speeds[2] >= 0.0
            )
            for yaw_rate in thetas:
                if (crawls and abs(yaw_rate) + _FLOAT_EPSILON < speeds[2]) or (
                    squared == 0.0 and yaw_rate == 0.0
                ):
                    continue
                samples[n, 0] = vx
                samples[n, 1] = vy
                samples[n, 2] = yaw_rate
                n += 1
    return samples[:n]

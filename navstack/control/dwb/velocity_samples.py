"""The velocities that DWB tries: every reachable combination, in Nav2's order and with Nav2's last bits."""

import math

import numpy as np

from navstack.jit import njit
from navstack.params.dwb import DwbParams
from navstack.types import FloatArray, IntArray, Twist2D

EPSILON = 1e-5  # [m/s, rad/s] tolerance of all comparisons in one_d_velocity_iterator.hpp


class VelocitySampler:
    """Samples (K, 3) of vx, vy, yaw rate, after ``xy_theta_iterator.cpp``: x varies slowest, the yaw rate fastest."""

    def __init__(self, params: DwbParams, acceleration_time: float) -> None:
        """``acceleration_time`` [s] is how long the robot may accelerate from its velocity to a sample."""
        p = params
        self.acceleration_time = acceleration_time
        self.axes = np.array(  # (3, 4) per axis: least and largest velocity, acceleration, deceleration
            (
                (p.min_vel_x, p.max_vel_x, p.acc_lim_x, p.decel_lim_x),
                (p.min_vel_y, p.max_vel_y, p.acc_lim_y, p.decel_lim_y),
                (-p.max_vel_theta, p.max_vel_theta, p.acc_lim_theta, p.decel_lim_theta),
            )
        )
        self.counts = np.array((p.vx_samples, p.vy_samples, p.vtheta_samples))
        self.speeds = np.array((p.min_speed_xy, p.max_speed_xy, p.min_speed_theta), dtype=np.float64)
        self._params = p

    def limit_speed(self, limit: float, is_percentage: bool) -> None:
        """Scale the largest velocities of all axes alike (``KinematicsHandler::setSpeedLimit``).

        As upstream an absolute limit [m/s] that is not below ``max_speed_xy`` changes nothing: an earlier limit stays.
        A ``limit`` of 0 takes every limit back.
        """
        p = self._params
        most = np.array((p.max_vel_x, p.max_vel_y, p.max_vel_theta, p.max_speed_xy))
        if limit != 0.0 and is_percentage:
            most = most * limit / 100.0
        elif 0.0 < limit < p.max_speed_xy:
            most = np.append(most[:3] * (limit / p.max_speed_xy), limit)
        elif limit != 0.0:
            return
        self.axes[:, 1] = most[:3]
        self.axes[2, 0] = -most[2]
        self.speeds[1] = most[3]

    def sample(self, velocity: Twist2D) -> FloatArray:
        """The samples (K, 3) that can be reached from ``velocity``."""
        current = np.array((velocity.linear_x, velocity.linear_y, velocity.angular_z))
        samples: FloatArray = combine(current, self.axes, self.counts, self.speeds, self.acceleration_time)
        return samples


@njit()
def project_velocity(start: float, acceleration: float, deceleration: float, dt: float, target: float) -> float:
    """The velocity ``dt`` seconds after ``start`` on the way to ``target``; the deceleration is negative."""
    if start < target:
        return min(target, start + acceleration * dt)
    return max(target, start + deceleration * dt)


@njit()
def axis_samples(current: float, limits: FloatArray, count: int, time: float) -> FloatArray:
    """Velocities of one axis, by repeated addition of the increment, and 0 where the range straddles it.

    ``limits`` (4,): least and largest velocity, acceleration, deceleration. After ``one_d_velocity_iterator.hpp``;
    ``low + i * increment`` would differ in the last bit, which decides the number of steps of a trajectory.
    """
    current = min(max(current, limits[0]), limits[1])
    high = project_velocity(current, limits[2], limits[3], time, limits[1])
    low = project_velocity(current, limits[2], limits[3], time, limits[0])
    increment = 1.0
    if abs(low - high) >= EPSILON:
        increment = (high - low) / (max(2, count) - 1)
    samples = np.empty(int((high - low + EPSILON) / increment) + 3)  # the tolerance may let some more through
    n = 0
    value = low
    zero_due = True
    while value <= high + EPSILON:
        samples[n] = value
        n += 1
        if zero_due and value < 0.0 and value + increment > 0.0 and value + increment <= high + EPSILON:
            samples[n] = 0.0
            n += 1
            zero_due = False
        value += increment
    return samples[:n]


@njit()
def combine(
    current: FloatArray, limits: FloatArray, counts: IntArray, speeds: FloatArray, acceleration_time: float
) -> FloatArray:
    """All combinations (K, 3) of the axes' samples that are neither standstill nor too fast nor too slow.

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
            if speeds[1] >= 0.0 and squared > speeds[1] * speeds[1] + EPSILON:
                continue
            crawls = speeds[0] >= 0.0 and squared + EPSILON < speeds[0] * speeds[0] and speeds[2] >= 0.0
            for yaw_rate in thetas:
                if (crawls and abs(yaw_rate) + EPSILON < speeds[2]) or (squared == 0.0 and yaw_rate == 0.0):
                    continue
                samples[n, 0] = vx
                samples[n, 1] = vy
                samples[n, 2] = yaw_rate
                n += 1
    return samples[:n]


def largest_steps(params: DwbParams) -> int:
    """An upper bound of the steps of any sample's trajectory."""
    if params.discretize_by_time:
        return max(1, math.ceil(params.sim_time / params.time_granularity))
    vx = max(abs(params.min_vel_x), abs(params.max_vel_x))
    vy = max(abs(params.min_vel_y), abs(params.max_vel_y))
    linear = (math.hypot(vx, vy) + 2.0 * EPSILON) * params.sim_time / params.linear_granularity
    angular = (params.max_vel_theta + 2.0 * EPSILON) * params.sim_time / params.angular_granularity
    return max(1, math.ceil(max(linear, angular)))

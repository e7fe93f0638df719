"""The trajectories that DWB compares."""

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np

from navstack.control.dwb.choice_kernels import Sampling
from navstack.control.dwb.kernels import roll_out, step_counts
from navstack.control.dwb.velocity_samples import combine
from navstack.errors import UnknownNameError
from navstack.params.dwb import DwbParams
from navstack.types import FloatArray, IntArray, Pose2D, Twist2D

STANDARD = "dwb_plugins::StandardTrajectoryGenerator"
LIMITED_ACCEL = "dwb_plugins::LimitedAccelGenerator"
GENERATORS = (STANDARD, LIMITED_ACCEL)


class Rollouts:
    """K trajectories of at most T poses in the map frame.

    A shorter one repeats its last pose to the end of its row.

    They are driven when the first pose is asked for. The arrays are reused: they hold until the
    next cycle.
    """

    def __init__(
        self,
        commands: FloatArray,
        steps: IntArray,
        lengths: IntArray,
        sim_time: float,
        drive: Callable[[], tuple[FloatArray, FloatArray, FloatArray]],
    ) -> None:
        """Trajectories whose poses ``drive`` makes: x, y and yaw."""
        # (K, 3) vx [m/s], vy [m/s], yaw rate [rad/s]: commanded if the trajectory wins
        self.commands = commands
        self.steps = steps  # (K,) steps of simulated time
        # (K,) poses: the start, one per step, and (if so set) the last one again
        self.lengths = lengths
        self.sim_time = sim_time  # [s] that each trajectory lasts
        self._drive = drive

    @cached_property
    def _poses(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self._drive()

    @property
    def x(self) -> FloatArray:
        """(K, T) in [m]."""
        return self._poses[0]

    @property
    def y(self) -> FloatArray:
        """(K, T) in [m]."""
        return self._poses[1]

    @property
    def yaw(self) -> FloatArray:
        """(K, T) in [rad], not wrapped."""
        return self._poses[2]

    def yaw_at(self, time: float) -> FloatArray:
        """Heading (K,) in [rad] after ``time`` seconds, interpolated between the poses."""
        position = np.minimum(time / self.sim_time * self.steps, self.steps)
        index = np.minimum(position.astype(np.int64), self.steps - 1)
        rows = np.arange(len(index))
        before = self.yaw[rows, index]
        after = self.yaw[rows, index + 1]
        heading: FloatArray = before + (position - index) * (after - before)
        return heading


class RolloutGenerator:
    """Makes the rollouts of one cycle, after Nav2's two trajectory generators.

    The standard one samples what can be reached within ``sim_time`` and ramps up to it; the limited
    one samples what can be reached within one control period and drives that at once.
    """

    def __init__(self, params: DwbParams, controller_frequency: float) -> None:
        """Prepare the sampling.

        Raises:
            UnknownNameError: ``trajectory_generator_name`` does not exist.
        """
        name = params.trajectory_generator_name
        if name not in GENERATORS:
            raise UnknownNameError("trajectory generator", name, GENERATORS)
        self._params = p = params
        axes = (
            (p.min_vel_x, p.max_vel_x, p.acc_lim_x, p.decel_lim_x),
            (p.min_vel_y, p.max_vel_y, p.acc_lim_y, p.decel_lim_y),
            (-p.max_vel_theta, p.max_vel_theta, p.acc_lim_theta, p.decel_lim_theta),
        )
        limits = [axis[2:] for axis in axes]
        reach = p.sim_time
        if name == LIMITED_ACCEL:
            limits = [(math.inf, -math.inf)] * 3
            reach = p.sim_period or 1.0 / controller_frequency
        self.sampling = Sampling(
            np.array(axes, dtype=np.float64),
            np.array((p.vx_samples, p.vy_samples, p.vtheta_samples)),
            np.array((p.min_speed_xy, p.max_speed_xy, p.min_speed_theta), dtype=np.float64),
            np.array(
                (reach, p.sim_time, p.linear_granularity, p.angular_granularity), dtype=np.float64
            ),
            np.array(limits, dtype=np.float64),
        )
        stays_in_line = p.min_vel_y == p.max_vel_y == 0.0
        self.ends_suffice = stays_in_line and not (p.discretize_by_time or p.limit_vel_cmd_in_traj)
        self._length = params.largest_steps + 1 + params.include_last_point
        self._buffer = np.empty((3, 0, self._length))

    def limit_speed(self, limit: float, is_percentage: bool) -> None:
        """Scale the largest velocities of all axes alike (``KinematicsHandler::setSpeedLimit``).

        As upstream an absolute limit [m/s] that is not below ``max_speed_xy`` changes nothing: an
        earlier limit stays. A ``limit`` of 0 takes every limit back.
        """
        p = self._params
        most = np.array((p.max_vel_x, p.max_vel_y, p.max_vel_theta, p.max_speed_xy))
        if limit != 0.0 and is_percentage:
            most = most * limit / 100.0
        elif 0.0 < limit < p.max_speed_xy:
            most = np.append(most[:3] * (limit / p.max_speed_xy), limit)
        elif limit != 0.0:
            return
        self.sampling.axes[:, 1] = most[:3]
        self.sampling.axes[2, 0] = -most[2]
        self.sampling.speeds[1] = most[3]

    def sample(self, velocity: Twist2D) -> FloatArray:
        """The samples (K, 3) of vx, vy, yaw rate that can be reached, in Nav2's order.

        x varies slowest, the yaw rate fastest (``xy_theta_iterator.cpp``).
        """
        current = np.array((velocity.linear_x, velocity.linear_y, velocity.angular_z))
        s = self.sampling
        samples: FloatArray = combine(current, s.axes, s.counts, s.speeds, s.times[0])
        return samples

    def generate(self, pose: Pose2D, velocity: Twist2D) -> Rollouts:
        """The trajectories from ``pose`` at ``velocity``."""
        p = self._params
        samples = self.sample(velocity)
        count = len(samples)
        if count > self._buffer.shape[1]:
            self._buffer = np.empty((3, count, self._length))
        if p.discretize_by_time:
            steps = np.full(count, max(1, math.ceil(p.sim_time / p.time_granularity)))
        else:
            steps = step_counts(samples, p.sim_time, p.linear_granularity, p.angular_granularity)
        first = np.empty((count, 3))

        def drive() -> tuple[FloatArray, FloatArray, FloatArray]:
            x, y, yaw = (self._buffer[i, :count] for i in range(3))
            start = np.array((velocity.linear_x, velocity.linear_y, velocity.angular_z))
            roll_out(
                pose.as_array(),
                start,
                samples,
                self.sampling.limits,
                steps,
                p.sim_time,
                x,
                y,
                yaw,
                first,
            )
            return x, y, yaw

        rollouts = Rollouts(samples, steps, steps + 1 + p.include_last_point, p.sim_time, drive)
        if p.limit_vel_cmd_in_traj and count > 0:
            _ = rollouts.x  # which finds the first velocities
            rollouts.commands = first
        return rollouts

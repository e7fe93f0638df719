"""Keeps commands within speed and acceleration limits (``velocity_smoother.cpp``, Jazzy)."""

import math
from typing import NamedTuple

from navstack.params.safety import VelocitySmootherParams
from navstack.types import Twist2D

Axes = tuple[float, float, float]  # linear x, linear y, angular z
Pair = tuple[float, float]

_STANDSTILL = Twist2D()


class AxisBounds(NamedTuple):
    """Limits of one axis."""

    low: float  # [m/s] or [rad/s] least velocity
    high: float
    speeding_up: float  # largest change in one cycle
    slowing_down: float


class VelocitySmoother:
    """Called at ``smoothing_frequency``.

    Moves the output towards the newest command as fast as the limits allow.

    Where Nav2 publishes nothing (before the first command, and once it has stopped for want of
    commands) the output is standstill, which is what Nav2 published last.
    """

    def __init__(self, params: VelocitySmootherParams) -> None:
        self._params = params
        rate = params.smoothing_frequency
        self._bounds = [
            AxisBounds(
                low=params.min_velocity[axis],
                high=params.max_velocity[axis],
                speeding_up=params.max_accel[axis] / rate,
                slowing_down=-params.max_decel[axis] / rate,
            )
            for axis in range(3)
        ]
        self.reset()

    def reset(self) -> None:
        """Forget all commands; the robot stands."""
        self._command: Axes | None = None
        self._command_stamp = 0.0  # [s]
        self._last: Axes = (0.0, 0.0, 0.0)  # before the deadband
        self._stopped = False

    def receive(self, command: Twist2D, stamp: float) -> None:
        """Take a new command that arrived at ``stamp`` [s].

        One that is not finite is left out (``validateTwist``).
        """
        axes = _axes(command)
        if all(map(math.isfinite, axes)):
            self._command, self._command_stamp = axes, stamp

    def smooth(self, command: Twist2D | None, measured: Twist2D, stamp: float) -> Twist2D:
        """The velocity to send to the base at time ``stamp`` [s].

        Args:
            command: what the controller asked for since the last call; None: nothing new.
            measured: odometry, the starting point in CLOSED_LOOP.
            stamp: now.
        """
        if command is not None:
            self.receive(command, stamp)
        if self._command is None:
            return _STANDSTILL
        if stamp - self._command_stamp > self._params.velocity_timeout:
            if self._stopped or self._last == (0.0, 0.0, 0.0):
                self._stopped = True
                return _STANDSTILL
            self._command = (0.0, 0.0, 0.0)
        self._stopped = False
        if self._params.feedback == "CLOSED_LOOP":
            self._last = _axes(measured)
        self._last = self._step(self._last, self._command)
        output = list(self._last)
        for axis, deadband in enumerate(self._params.deadband_velocity):
            if abs(output[axis]) < deadband:
                output[axis] = 0.0
        return Twist2D(*output)

    def _step(self, current: Axes, command: Axes) -> Axes:
        """One cycle from ``current`` towards ``command``.

        Per axis the deceleration limits the change where the speed falls or changes its sign.
        """
        axes = zip(current, command, self._bounds, strict=True)
        changes = [_change(now, asked, bounds) for now, asked, bounds in axes]
        scale = 1.0
        if self._params.scale_velocities:
            scale = min(_scale(*change) for change in changes)
        x, y, theta = (
            now + min(max(scale * change, -limit), limit)
            for now, (change, limit) in zip(current, changes, strict=True)
        )
        return x, y, theta


def _change(now: float, asked: float, bounds: AxisBounds) -> Pair:
    """The change that is wanted of one axis, and the largest of one cycle."""
    wanted = min(max(asked, bounds.low), bounds.high)
    if abs(wanted) >= abs(now) and now * wanted >= 0.0:
        return wanted - now, bounds.speeding_up
    return wanted - now, bounds.slowing_down


def _scale(change: float, limit: float) -> float:
    """Share of the wanted change that an axis can follow (``findEtaConstraint``)."""
    if abs(change) > limit > 0.0:
        return limit / abs(change)
    return 1.0


def _axes(twist: Twist2D) -> Axes:
    return twist.linear_x, twist.linear_y, twist.angular_z

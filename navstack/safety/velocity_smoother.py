"""Keeps commands within speed and acceleration limits.

Nav2_velocity_smoother (``velocity_smoother.cpp``, Jazzy).
"""

import math

from navstack.params.safety import VelocitySmootherParams
from navstack.types import Twist2D

Axes = tuple[float, float, float]  # linear x, linear y, angular z
Pair = tuple[float, float]

_STANDSTILL = Twist2D()


class VelocitySmoother:
    """Called at ``smoothing_frequency``.

    Moves the output towards the newest command as fast as the limits allow.

    Where Nav2 publishes nothing (before the first command, and once it has stopped for want of
    commands) the output is standstill, which is what Nav2 published last.
    """

    def __init__(self, params: VelocitySmootherParams) -> None:
        self._params = params
        p = params
        self._bounds = tuple(
            (low, high, accel / p.smoothing_frequency, -decel / p.smoothing_frequency)
            for low, high, accel, decel in zip(
                p.min_velocity, p.max_velocity, p.max_accel, p.max_decel, strict=True
            )
        )  # per axis: least and largest velocity, largest change in one cycle while speeding up, while slowing down
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
        current = self._last if self._params.feedback == "OPEN_LOOP" else _axes(measured)
        self._last = self._step(current, self._command)
        deadbands = zip(self._last, self._params.deadband_velocity, strict=True)
        return Twist2D(*(0.0 if abs(velocity) < dead else velocity for velocity, dead in deadbands))

    def _step(self, current: Axes, command: Axes) -> Axes:
        """One cycle from ``current`` towards ``command``.

        Per axis the deceleration limits the change where the speed falls or changes its sign.
        """
        axes = zip(current, command, self._bounds, strict=True)
        changes = [_change(now, asked, *bounds) for now, asked, bounds in axes]
        scale = min(_scale(*change) for change in changes) if self._params.scale_velocities else 1.0
        x, y, theta = (
            now + min(max(scale * change, -limit), limit)
            for now, (change, limit) in zip(current, changes, strict=True)
        )
        return x, y, theta


def _change(
    now: float, asked: float, low: float, high: float, speeding_up: float, slowing_down: float
) -> Pair:
    """The change that is wanted of one axis, and the largest of one cycle."""
    wanted = min(max(asked, low), high)
    return wanted - now, speeding_up if abs(wanted) >= abs(
        now
    ) and now * wanted >= 0.0 else slowing_down


def _scale(change: float, limit: float) -> float:
    """Share of the wanted change that an axis can follow (``findEtaConstraint``)."""
    return limit / abs(change) if abs(change) > limit > 0.0 else 1.0


def _axes(twist: Twist2D) -> Axes:
    return twist.linear_x, twist.linear_y, twist.angular_z

"""Keeps commands within speed and acceleration limits: nav2_velocity_smoother (``velocity_smoother.cpp``, Jazzy)."""

from navstack.params.safety import VelocitySmootherParams
from navstack.types import Twist2D

Axes = tuple[float, float, float]  # linear x, linear y, angular z

_STANDSTILL = Twist2D()


class VelocitySmoother:
    """Called at ``smoothing_frequency``; moves the output towards the newest command as fast as the limits allow.

    Where Nav2 publishes nothing (before the first command, and once it has stopped for want of commands) the output
    is standstill, which is what Nav2 published last.
    """

    def __init__(self, params: VelocitySmootherParams) -> None:
        self._params = params
        self._max_steps: tuple[tuple[float, float], ...] = tuple(
            (accel / params.smoothing_frequency, -decel / params.smoothing_frequency)
            for accel, decel in zip(params.max_accel, params.max_decel, strict=True)
        )  # per axis, largest change in one cycle while speeding up, while slowing down
        self.reset()

    def reset(self) -> None:
        """Forget all commands; the robot stands."""
        self._command: Axes | None = None
        self._command_stamp = 0.0  # [s]
        self._last: Axes = (0.0, 0.0, 0.0)  # before the deadband
        self._stopped = False

    def receive(self, command: Twist2D, stamp: float) -> None:
        """Take a new command that arrived at ``stamp`` [s]."""
        self._command = _axes(command)
        self._command_stamp = stamp

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
        self._last = self._step(current, self._clamped(self._command))
        return Twist2D(*(self._without_deadband(axis, value) for axis, value in enumerate(self._last)))

    def _clamped(self, command: Axes) -> Axes:
        x, y, theta = (
            min(max(value, low), high)
            for value, low, high in zip(command, self._params.min_velocity, self._params.max_velocity, strict=True)
        )
        return x, y, theta

    def _step(self, current: Axes, command: Axes) -> Axes:
        """One cycle from ``current`` towards ``command``."""
        scale = self._common_scale(current, command) if self._params.scale_velocities else 1.0
        x, y, theta = (
            now + min(max(scale * (wanted - now), -limit), limit)
            for now, wanted, limit in zip(current, command, self._limits(current, command), strict=True)
        )
        return x, y, theta

    def _limits(self, current: Axes, command: Axes) -> Axes:
        """Largest change per axis: the deceleration's where the speed falls or changes its sign."""
        x, y, theta = (
            speeding_up if abs(wanted) >= abs(now) and now * wanted >= 0.0 else slowing_down
            for now, wanted, (speeding_up, slowing_down) in zip(current, command, self._max_steps, strict=True)
        )
        return x, y, theta

    def _common_scale(self, current: Axes, command: Axes) -> float:
        """Share of the wanted change that the most limited axis can follow (``findEtaConstraint``)."""
        scale = 1.0
        for now, wanted, limit in zip(current, command, self._limits(current, command), strict=True):
            change = abs(wanted - now)
            if change > limit > 0.0:
                scale = min(scale, limit / change)
        return scale

    def _without_deadband(self, axis: int, value: float) -> float:
        return 0.0 if abs(value) < self._params.deadband_velocity[axis] else value


def _axes(twist: Twist2D) -> Axes:
    return twist.linear_x, twist.linear_y, twist.angular_z

"""Noisy control sequences and the trajectories that they make.

All arrays are single precision, as in Nav2, and have a row per time and a column per trajectory, so
that inner loops run over trajectories. Positions are relative to the robot's, along the axes of the
map frame.
"""

import math
from typing import NamedTuple

import numpy as np

from navstack.jit import njit
from navstack.types import Float32Array, Float32Cube, Float32Matrix, Float32Vector

_BLOCK = 256  # trajectories rolled out together: their last poses stay in the fastest cache
# [rad] in one step, up to which the series below are exact to single precision
_SMALL_TURN = np.float32(0.7)


class MppiRollouts(NamedTuple):
    """T poses of each of B trajectories.

    Row 0 is reached after one step at the measured velocity.
    """

    controls: Float32Cube  # (A, T + 1, B) v, w and, of a robot that drives sideways, vy: see there
    x: Float32Matrix  # (T, B) [m] from the robot
    y: Float32Matrix  # (T, B) [m] from the robot
    yaw: Float32Matrix  # (T, B) [rad] not normalized
    cosine: Float32Matrix  # (T, B) of yaw
    sine: Float32Matrix  # (T, B)

    @staticmethod
    def empty(steps: int, count: int, axes: int = 2) -> "MppiRollouts":
        """Room for ``count`` trajectories of ``steps`` poses."""
        controls = np.zeros((axes, steps + 1, count), dtype=np.float32)
        return MppiRollouts(
            controls, *(np.zeros((steps, count), dtype=np.float32) for _ in range(5))
        )

    @property
    def v(self) -> Float32Array:
        """(T + 1, B) [m/s] rows 0..T-1: velocities.

        Rows 1..T: the controls, the last one not limited.
        """
        v: Float32Array = self.controls[0]
        return v

    @property
    def w(self) -> Float32Array:
        """(T + 1, B) [rad/s] likewise."""
        w: Float32Array = self.controls[1]
        return w

    @property
    def vy(self) -> Float32Array | None:
        """(T + 1, B) [m/s] likewise, to the left; None: the robot does not drive sideways."""
        return self.controls[2] if len(self.controls) > 2 else None


@njit(ahead=True)
def add_noise(sequence: Float32Vector, noise: Float32Matrix, controls: Float32Matrix) -> None:
    """Write ``sequence`` (T,) plus ``noise`` (T, B) into rows 1..T of ``controls`` (T + 1, B)."""
    for t in range(len(sequence)):
        wanted = sequence[t]
        for b in range(noise.shape[1]):
            controls[t + 1, b] = wanted + noise[t, b]


@njit(ahead=True)
def limit_changes(
    controls: Float32Matrix, start: np.float32, rise: np.float32, fall: np.float32
) -> None:
    """Limit the changes of controls (T + 1, B) per step to [``fall``, ``rise``].

    After a control that is not positive ``rise`` bounds the fall and ``fall`` the rise. Row 0
    becomes ``start``. The last row stays as it is, as in ``MotionModel::predict``: no pose depends
    on it.
    """
    for b in range(controls.shape[1]):
        controls[0, b] = start
    for t in range(1, len(controls) - 1):
        for b in range(controls.shape[1]):
            last = controls[t - 1, b]
            least = last + fall if last > 0.0 else last - rise
            most = last + rise if last > 0.0 else last - fall
            controls[t, b] = min(most, max(controls[t, b], least))


@njit(ahead=True)
def roll_out(
    rollouts: MppiRollouts, start_yaw: np.float32, dt: np.float32, largest_turn: np.float32
) -> None:
    """Drive forward and turning velocities, rows 0..T-1 of the controls; the poses are written.

    All begin at the same velocity. Each step is a straight line along the heading with which it
    begins (``Optimizer::integrateStateVelocities``). Heading's cosine and sine follow by rotation,
    in steps of at most ``largest_turn`` [rad].
    """
    controls, x, y, yaw, cosine, sine = rollouts
    v = controls[0]
    w = controls[1]
    steps, count = x.shape
    x[0] = v[0, 0] * np.float32(math.cos(start_yaw)) * dt
    y[0] = v[0, 0] * np.float32(math.sin(start_yaw)) * dt
    yaw[0] = start_yaw + w[0, 0] * dt
    cosine[0] = np.float32(math.cos(yaw[0, 0]))
    sine[0] = np.float32(math.sin(yaw[0, 0]))
    for begin in range(0, count, _BLOCK):
        part = slice(begin, min(count, begin + _BLOCK))
        for t in range(1, steps):
            advance(x[t - 1, part], v[t, part], cosine[t - 1, part], dt, x[t, part])
            advance(y[t - 1, part], v[t, part], sine[t - 1, part], dt, y[t, part])
            turn(yaw[t - 1, part], w[t, part], dt, yaw[t, part])
            if largest_turn <= _SMALL_TURN:
                rotate(
                    cosine[t - 1, part],
                    sine[t - 1, part],
                    w[t, part],
                    dt,
                    cosine[t, part],
                    sine[t, part],
                )
            else:
                for b in range(begin, min(count, begin + _BLOCK)):
                    cosine[t, b] = np.float32(math.cos(yaw[t, b]))
                    sine[t, b] = np.float32(math.sin(yaw[t, b]))


@njit(ahead=True)
def drift(rollouts: MppiRollouts, start_yaw: np.float32, dt: np.float32) -> None:
    """Add to the positions what the sideways velocities, rows 0..T-1 of the controls, make."""
    x = rollouts.x
    y = rollouts.y
    cosine = rollouts.cosine
    sine = rollouts.sine
    vy = rollouts.controls[2]
    way_x = np.full(x.shape[1], -vy[0, 0] * np.float32(math.sin(start_yaw)) * dt)
    way_y = np.full(x.shape[1], vy[0, 0] * np.float32(math.cos(start_yaw)) * dt)
    for t in range(len(x)):
        if t > 0:
            for b in range(x.shape[1]):
                way_x[b] -= vy[t, b] * sine[t - 1, b] * dt
                way_y[b] += vy[t, b] * cosine[t - 1, b] * dt
        for b in range(x.shape[1]):
            x[t, b] += way_x[b]
            y[t, b] += way_y[b]


@njit()
def advance(
    last: Float32Array,
    speed: Float32Array,
    share: Float32Array,
    dt: np.float32,
    after: Float32Array,
) -> None:
    """A coordinate (n,) after ``dt`` at the ``share`` of a speed that lies along it."""
    for b in range(len(after)):
        after[b] = last[b] + speed[b] * share[b] * dt


@njit()
def turn(last: Float32Array, rate: Float32Array, dt: np.float32, after: Float32Array) -> None:
    """Yaws (n,) after ``dt``."""
    for b in range(len(after)):
        after[b] = last[b] + rate[b] * dt


@njit()
def rotate(
    last_cosine: Float32Array,
    last_sine: Float32Array,
    rate: Float32Array,
    dt: np.float32,
    cosine: Float32Array,
    sine: Float32Array,
) -> None:
    """Headings' cosines and sines (n,) after ``dt`` at small yaw rates."""
    for b in range(len(rate)):
        turn_cosine, turn_sine = _small_cosine_sine(rate[b] * dt)
        c = last_cosine[b]
        s = last_sine[b]
        cosine[b] = c * turn_cosine - s * turn_sine
        sine[b] = s * turn_cosine + c * turn_sine


@njit()
def _small_cosine_sine(angle: np.float32) -> tuple[np.float32, np.float32]:
    """Cosine and sine in single precision of an angle up to ``_SMALL_TURN``, by Taylor series."""
    one = np.float32(1.0)
    q = angle * angle
    cosine = one - q * np.float32(1 / 2) * (
        one
        - q * np.float32(1 / 12) * (one - q * np.float32(1 / 30) * (one - q * np.float32(1 / 56)))
    )
    sine = angle * (
        one
        - q * np.float32(1 / 6) * (one - q * np.float32(1 / 20) * (one - q * np.float32(1 / 42)))
    )
    return cosine, sine

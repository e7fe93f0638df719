"""The robot's model in numba: the same as :mod:`~navstack.control.mpc.robot_model`."""

import math

import numpy as np

from navstack.jit import njit
from navstack.types import FloatArray, FloatMatrix, FloatVector

X, Y, YAW, V, OMEGA, A, ALPHA = range(7)  # of a state


@njit()
def advance(
    state: FloatArray,
    j: float,
    ja: float,
    dt: float,
    out: FloatArray,
) -> None:
    """Write the state (7,) after ``dt`` [s] under jerks ``j`` [m/s3], ``ja`` [rad/s3]."""
    yaw = state[2]
    v = state[3]
    omega = state[4]
    a = state[5]
    alpha = state[6]
    half = 0.5 * dt
    v_mid = v + half * (a + 0.5 * half * j)
    v_end = v + dt * (a + half * j)
    yaw_mid = yaw + half * (omega + half * (alpha / 2.0 + half * ja / 6.0))
    yaw_end = yaw + dt * (omega + dt * (alpha / 2.0 + dt * ja / 6.0))
    out[0] = state[0] + dt / 6.0 * (
        v * math.cos(yaw) + 4.0 * v_mid * math.cos(yaw_mid) + v_end * math.cos(yaw_end)
    )
    out[1] = state[1] + dt / 6.0 * (
        v * math.sin(yaw) + 4.0 * v_mid * math.sin(yaw_mid) + v_end * math.sin(yaw_end)
    )
    out[2] = yaw_end
    out[3] = v_end
    out[4] = omega + dt * (alpha + half * ja)
    out[5] = a + dt * j
    out[6] = alpha + dt * ja


@njit(ahead=True)
def rollout(start: FloatVector, jerks: FloatMatrix, steps: FloatVector) -> FloatArray:
    """The states (N + 1, 7) from ``start`` (7,) under jerks (N, 2) held for ``steps`` (N,) [s]."""
    states = np.empty((len(jerks) + 1, 7))
    states[0] = start
    for k in range(len(jerks)):
        advance(states[k], jerks[k, 0], jerks[k, 1], steps[k], states[k + 1])
    return states


@njit(ahead=True)
def shifted(jerks: FloatMatrix, steps: FloatVector, elapsed: float) -> FloatArray:
    """The jerks (N, 2) on the same grid, ``elapsed`` [s] later.

    Each step takes the mean over its time; 0 beyond.
    """
    count = len(jerks)
    moved = np.zeros_like(jerks)
    begin = elapsed
    for k in range(count):
        end = begin + steps[k]
        known = 0.0
        for i in range(count):
            overlap = min(end, known + steps[i]) - max(begin, known)
            if overlap > 0.0:
                moved[k] += overlap / steps[k] * jerks[i]
            known += steps[i]
        begin = end
    return moved

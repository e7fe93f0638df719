"""Inner loops of the critics that look at velocities."""

import numpy as np

from navstack.jit import njit
from navstack.types import Float32Array


@njit()
def mean_size(values: Float32Array, steps: int) -> Float32Array:
    """Mean absolute value (B,) of the first ``steps`` rows."""
    total = np.zeros(values.shape[1], dtype=np.float32)
    for t in range(steps):
        _add_size(values[t], total)
    return total / np.float32(steps)


@njit()
def _add_size(row: Float32Array, total: Float32Array) -> None:
    for b in range(len(total)):
        total[b] += abs(row[b])


@njit(ahead="float32[:, ::1], int64, float32, float32")
def sum_outside(values: Float32Array, steps: int, least: np.float32, most: np.float32) -> Float32Array:
    """By how much the first ``steps`` rows lie outside [``least``, ``most``], in all (B,)."""
    total = np.zeros(values.shape[1], dtype=np.float32)
    for t in range(steps):
        _add_outside(values[t], least, most, total)
    return total


@njit()
def _add_outside(row: Float32Array, least: np.float32, most: np.float32, total: Float32Array) -> None:
    zero = np.float32(0.0)
    for b in range(len(total)):
        total[b] += max(row[b] - most, zero) + max(least - row[b], zero)


@njit()
def sum_below(values: Float32Array, steps: int, least: np.float32) -> Float32Array:
    """By how much the absolute values of the first ``steps`` rows are below ``least``, in all (B,)."""
    total = np.zeros(values.shape[1], dtype=np.float32)
    for t in range(steps):
        for b in range(values.shape[1]):
            total[b] += max(least - abs(values[t, b]), np.float32(0.0))
    return total


@njit()
def sum_too_tight(v: Float32Array, w: Float32Array, steps: int, radius: np.float32) -> Float32Array:
    """By how much the radii of the curves in the first ``steps`` rows are below ``radius`` [m], in all (B,)."""
    total = np.zeros(v.shape[1], dtype=np.float32)
    for t in range(steps):
        for b in range(v.shape[1]):
            if w[t, b] != np.float32(0.0):  # straight on is no curve; Nav2 divides by zero where it stands, too
                total[b] += max(radius - abs(v[t, b]) / abs(w[t, b]), np.float32(0.0))
    return total

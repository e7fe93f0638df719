"""The inner loop of the critics that look at velocities."""

import numpy as np

from navstack.jit import njit
from navstack.types import Float32Array, Float32Matrix


@njit(ahead=True)
def sum_outside(
    values: Float32Matrix, steps: int, least: np.float32, most: np.float32
) -> Float32Array:
    """By how much the first ``steps`` rows lie outside [``least``, ``most``], in all (B,)."""
    total = np.zeros(values.shape[1], dtype=np.float32)
    for t in range(steps):
        _add_outside(values[t], least, most, total)
    return total


@njit()
def _add_outside(
    row: Float32Array, least: np.float32, most: np.float32, total: Float32Array
) -> None:
    zero = np.float32(0.0)
    for b in range(len(total)):
        total[b] += max(row[b] - most, zero) + max(least - row[b], zero)

"""The control sequence: its update by samples, its limits, its smoothing (``optimizer.cpp``)."""

import math

import numpy as np

from navstack.jit import njit
from navstack.types import Float32Array, Float32Matrix, Float32Vector

# Savitzky and Golay's quadratic filter over nine points (``utils.hpp``).
_FILTER = (np.array((-21, 14, 39, 54, 59, 54, 39, 14, -21)) / 231).astype(np.float32)
HISTORY = 4  # commands of late that the filter looks back on
_SHORTEST = 21  # values of a sequence that is smoothed
_LANES = 16  # partial sums, so that the processor adds several at once


@njit(ahead=True)
def add_control_costs(
    controls: Float32Matrix, sequence: Float32Vector, factor: np.float32, costs: Float32Vector
) -> None:
    """Add ``factor`` times the samples' distance from ``sequence`` (T,), along it.

    The samples are rows 1..T of ``controls``.
    """
    for t in range(len(sequence)):
        wanted = sequence[t]
        if wanted != np.float32(0.0):
            _add_deviation(controls[t + 1], wanted, factor * wanted, costs)


@njit()
def _add_deviation(
    row: Float32Array, wanted: np.float32, factor: np.float32, costs: Float32Array
) -> None:
    for b in range(len(costs)):
        costs[b] += factor * (row[b] - wanted)


@njit(ahead=True)
def softmax(costs: Float32Vector, temperature: np.float32) -> Float32Array:
    """Shares (B,) of the trajectories in the next sequence; cheaper ones get more."""
    least = costs[0]
    for b in range(len(costs)):
        least = min(least, costs[b])
    shares = np.empty_like(costs)
    total = np.float32(0.0)
    for b in range(len(costs)):
        shares[b] = np.float32(math.exp((least - costs[b]) / temperature))
        total += shares[b]
    for b in range(len(costs)):
        shares[b] /= total
    return shares


@njit(ahead=True)
def weighted_mean(controls: Float32Matrix, shares: Float32Vector, sequence: Float32Vector) -> None:
    """Write the mean of rows 1..T of ``controls``, weighted by ``shares``, to ``sequence`` (T,)."""
    for t in range(len(sequence)):
        sequence[t] = _dot(controls[t + 1], shares)


@njit()
def _dot(a: Float32Array, b: Float32Array) -> np.float32:
    """Inner product, in an order that does not depend on the machine."""
    sums = np.zeros(_LANES, dtype=np.float32)
    whole = len(a) // _LANES * _LANES
    for begin in range(0, whole, _LANES):
        for lane in range(_LANES):
            sums[lane] += a[begin + lane] * b[begin + lane]
    total = np.float32(0.0)
    for lane in range(_LANES):
        total += sums[lane]
    for i in range(whole, len(a)):
        total += a[i] * b[i]
    return total


@njit(ahead=True)
def limit(
    sequence: Float32Vector,
    least: np.float32,
    most: np.float32,
    fall: np.float32,
    rise: np.float32,
) -> None:
    """Keep a sequence (T,) in [``least``, ``most``], and its changes in [``fall``, ``rise``].

    After a value that is not positive ``rise`` bounds the fall and ``fall`` the rise
    (``applyControlSequenceConstraints``).
    """
    last = min(most, max(sequence[0], least))
    sequence[0] = last
    for t in range(1, len(sequence)):
        wanted = min(most, max(sequence[t], least))
        if last > 0.0:
            last = min(last + rise, max(wanted, last + fall))
        else:
            last = min(last - fall, max(wanted, last - rise))
        sequence[t] = last


def limit_curvature(v: Float32Array, w: Float32Array, radius: np.float32) -> None:
    """Turn no tighter than ``radius`` [m] (``AckermannMotionModel::applyConstraints``)."""
    most = np.abs(v) / radius
    w[:] = np.clip(w, -most, most)


@njit(ahead=True)
def smooth(sequence: Float32Vector, history: Float32Vector) -> None:
    """Smooth a sequence (T,) that follows on ``history`` (4,), the commands of late.

    A short one stays as it is.

    The last value stays, too; beyond it the filter sees it repeated (``savitskyGolayFilter``).
    """
    length = len(sequence)
    if length < _SHORTEST:
        return
    reach = len(_FILTER) // 2
    padded = np.empty(length + 2 * reach, dtype=np.float32)
    padded[:reach] = history
    padded[reach : reach + length] = sequence
    padded[reach + length :] = sequence[-1]
    for t in range(length - 1):
        total = np.float32(0.0)
        for i in range(len(_FILTER)):
            total += _FILTER[i] * padded[t + i]
        sequence[t] = total

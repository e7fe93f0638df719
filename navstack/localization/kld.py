"""KLD-adaptive sampling and the clusters of particles, both on a histogram of poses.

Fox 2003; Nav2's ``pf.c``.

The histogram has Nav2's bins (``pf_kdtree.c``). Yaw is not normalised: particles that differ by a
full turn fall into different bins, as in Nav2.
"""

import math

import numpy as np
import numpy.typing as npt

from navstack.jit import njit
from navstack.types import BoolVector, FloatArray, FloatMatrix, FloatVector, IntArray

BIN_LENGTH = 0.5  # [m] along x and y
BIN_ANGLE = math.radians(10.0)  # [rad]

_HALF = 1 << 20  # bins on either side of 0: 524 km
FAR = 262_144.0  # [m] from the map frame's origin from which on places are taken from another one
_EMPTY = np.int64(-1)
# 2^64 over the golden ratio: Fibonacci hashing (Knuth, vol. 3, sec. 6.4)
_MIXER = np.uint64(0x9E3779B97F4A7C15)


@njit()
def sample_limit(bins: int, fewest: int, most: int, error: float, quantile: float) -> int:
    """How many particles are enough where they fill ``bins`` bins.

    Of a single bin Nav2 asks for ``most``.

    With them the distance between true and sampled distribution is below ``error`` with the
    probability of which ``quantile`` is the normal distribution's (Fox 2003, eq. 7).
    """
    if bins <= 1:
        return most
    b = 2.0 / (9.0 * (bins - 1))
    x = 1.0 - b + math.sqrt(b) * quantile
    return min(max(math.ceil((bins - 1) / (2.0 * error) * x * x * x), fewest), most)


@njit(ahead=True)
def origin_near(poses: FloatMatrix) -> tuple[float, float]:
    """Where x and y [m] of poses (N, 3) are counted from: 0, or whole bins where they are far.

    A map in UTM's coordinates has northings of millions of metres.
    """
    x = 0.0
    y = 0.0
    if abs(poses[0, 0]) > FAR:
        x = BIN_LENGTH * math.floor(poses[0, 0] / BIN_LENGTH)
    if abs(poses[0, 1]) > FAR:
        y = BIN_LENGTH * math.floor(poses[0, 1] / BIN_LENGTH)
    return x, y


@njit(inline="always")
def _key(x: float, y: float, yaw: float) -> np.int64:
    """The bin of a pose, as one number."""
    i = np.int64(math.floor(x / BIN_LENGTH)) + _HALF
    j = np.int64(math.floor(y / BIN_LENGTH)) + _HALF
    k = np.int64(math.floor(yaw / BIN_ANGLE)) + _HALF
    return (i << 42) | (j << 21) | k


@njit(inline="always")
def _slot(keys: IntArray, key: np.int64) -> np.int64:
    """Where a key stands, or would stand, in a table whose length is a power of two."""
    mask = len(keys) - 1
    slot = np.int64((np.uint64(key) * _MIXER) >> np.uint64(32)) & mask
    while keys[slot] != _EMPTY and keys[slot] != key:
        slot = (slot + 1) & mask
    return slot


@njit()
def _empty_table(count: int) -> IntArray:
    """A table for ``count`` keys, at most half full."""
    size = 2
    while size < 2 * count:
        size *= 2
    return np.full(size, _EMPTY, np.int64)


@njit()
def count_bins(poses: FloatArray) -> int:
    """How many bins poses (N, 3) fill."""
    keys, bins = _empty_table(len(poses)), 0
    x, y = origin_near(poses)
    for j in range(len(poses)):
        key = _key(poses[j, 0] - x, poses[j, 1] - y, poses[j, 2])
        slot = _slot(keys, key)
        if keys[slot] == _EMPTY:
            keys[slot] = key
            bins += 1
    return bins


@njit(ahead=True)
def resample(
    poses: FloatMatrix,
    cumulative: FloatVector,
    strays: FloatMatrix,
    is_stray: BoolVector,
    draws: FloatVector,
    fewest: int,
    error: float,
    quantile: float,
) -> FloatArray:
    """Draw particles until there are enough for the bins that they fill, or all draws are used.

    Args:
        poses: (N, 3) to draw from.
        cumulative: (N,) sums of their weights.
        strays: (M, 3) poses that are taken as they are ...
        is_stray: (M,) ... where this is true.
        draws: (M,) uniform in [0, 1).
        fewest: particles.
        error: see :func:`sample_limit`.
        quantile: see :func:`sample_limit`.

    Returns:
        (n, 3); n is one more than the limit, as in Nav2, and at most M.
    """
    most = len(draws)
    drawn = np.empty((most, 3))
    keys, bins = _empty_table(most), 0
    total = cumulative[-1]
    x, y = origin_near(poses)
    for n in range(most):
        if is_stray[n]:
            drawn[n] = strays[n]
        else:
            above = np.searchsorted(cumulative, draws[n] * total, side="right")
            drawn[n] = poses[min(above, len(cumulative) - 1)]
        key = _key(drawn[n, 0] - x, drawn[n, 1] - y, drawn[n, 2])
        slot = _slot(keys, key)
        if keys[slot] == _EMPTY:
            keys[slot] = key
            bins += 1
        if n + 1 > sample_limit(bins, fewest, most, error, quantile):
            return drawn[: n + 1]
    return drawn


@njit(ahead=True)
def label_clusters(poses: FloatMatrix) -> npt.NDArray[np.int64]:
    """The cluster (N,) of each pose: bins that touch, at a corner at least, form one.

    Numbered as they appear.
    """
    keys = _empty_table(len(poses))
    clusters = np.full(len(keys), _EMPTY, np.int64)  # of the bin in each slot
    slots = np.empty(len(poses), np.int64)
    x, y = origin_near(poses)
    for j in range(len(poses)):
        key = _key(poses[j, 0] - x, poses[j, 1] - y, poses[j, 2])
        slots[j] = _slot(keys, key)
        keys[slots[j]] = key
    labels = np.empty(len(poses), np.int64)
    waiting = np.empty(len(poses), np.int64)  # slots of bins whose neighbours are to be looked at
    count = 0
    for j in range(len(poses)):
        if clusters[slots[j]] == _EMPTY:
            clusters[slots[j]] = count
            waiting[0] = slots[j]
            _spread(keys, clusters, waiting)
            count += 1
        labels[j] = clusters[slots[j]]
    return labels


@njit()
def _spread(keys: IntArray, clusters: IntArray, waiting: IntArray) -> None:
    """Give the cluster of the first waiting bin to all that touch it, also through others."""
    left = 1
    while left > 0:
        left -= 1
        at = waiting[left]
        for neighbour in range(27):
            i, j, k = neighbour // 9 - 1, neighbour // 3 % 3 - 1, neighbour % 3 - 1
            slot = _slot(keys, keys[at] + (i << 42) + (j << 21) + k)
            if keys[slot] != _EMPTY and clusters[slot] == _EMPTY:
                clusters[slot] = clusters[at]
                waiting[left] = slot
                left += 1

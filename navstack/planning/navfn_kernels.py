"""NavFn's field: costs, potentials and the map's border (nav2_navfn_planner/navfn.cpp).

Cells are numbered n = y * width + x; ``potential``, ``costs`` and ``dirty`` are flat arrays.
Arithmetic is float32 where navfn.cpp has float and float64 where it has double, so that potentials
agree bit for bit.

While a wave runs, a cell that waits in a buffer carries the negative of its potential: the flag
costs no memory access of its own, and a waiting cell fails the "would I lower it" test by itself.
The map's border is lethal in NavFn; what is open there is marked as waiting for the time of the
wave.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from navstack.costmap.costmap import NO_INFORMATION
from navstack.jit import njit
from navstack.types import (
    ByteArray,
    ByteVector,
    FixedByteVector,
    Float32Array,
    Float32Vector,
    Uint32Matrix,
)

Buffers = npt.NDArray[np.uint32]  # cell numbers

POT_HIGH = np.float32(1.0e10)  # the potential of a cell that the wave has not reached
COST_NEUTRAL = np.float32(50.0)  # cost of crossing a free cell
COST_FACTOR = 0.8  # by which the costmap's cost counts
COST_OBSTACLE = np.float32(254.0)
COST_HIGHEST = 253.0  # cost of crossing the dearest cell that is no obstacle, and an unknown one
LEAST_OBSTACLE = 253  # costmap value from which on a cell is an obstacle
PRIORITY_STEP = np.float32(100.0)  # 2 * COST_NEUTRAL, by which the threshold rises
BUFFER_SIZE = 10000  # PRIORITYBUFSIZE of navfn.hpp: what does not fit is dropped, as upstream
BLOCK_SHIFT = np.uint64(6)
BLOCK_SIZE = 64  # 1 << BLOCK_SHIFT; cells are marked dirty in blocks of this many
NO_BOUND = np.empty(0, dtype=np.float32)  # for a wave that may go everywhere
INV_SQRT2 = 0.707106781  # to as many digits as navfn.cpp has
# the quadratic that stands for the planar wave's square root
WAVE_2 = -0.2301
WAVE_1 = 0.5307
WAVE_0 = 0.7040


class NavfnField(NamedTuple):
    """A potential, and what its wave needs."""

    potential: Float32Vector  # (height * width,) POT_HIGH where the wave has not been
    dirty: ByteVector  # (blocks,) set where the wave writes
    costs: FixedByteVector  # (height * width,) of the costmap
    crossing: Float32Vector  # (256,) from cost_tables
    gain: Float32Vector  # (256,) from cost_tables
    width: int
    buffers: Uint32Matrix  # (3, size)


def cost_tables(allow_unknown: bool) -> tuple[Float32Array, Float32Array]:
    """Cost of crossing a cell, and the gain that justifies a visit, by cost 0..255 (setCostmap).

    The gain is infinite for obstacles, so that the wave never enters them.
    """
    crossing = np.minimum(
        np.trunc(float(COST_NEUTRAL) + COST_FACTOR * np.arange(256)), COST_HIGHEST
    )
    crossing[LEAST_OBSTACLE:] = COST_OBSTACLE
    if allow_unknown:
        crossing[NO_INFORMATION] = COST_HIGHEST
    gain = np.where(crossing < COST_OBSTACLE, INV_SQRT2 * crossing, np.inf)
    return crossing.astype(np.float32), gain.astype(np.float32)


@njit(ahead=True)
def clear_potential(potential: Float32Vector, dirty: ByteVector) -> None:
    """Set the potential back to POT_HIGH in the dirty blocks only.

    Their number is a multiple of 8.
    """
    words = dirty.view(np.uint64)
    for w in range(words.size):
        if words[w] == 0:
            continue
        for i in range(8 * w, 8 * w + 8):
            if dirty[i]:
                dirty[i] = 0
                potential[i * BLOCK_SIZE : min(potential.size, (i + 1) * BLOCK_SIZE)] = POT_HIGH


@njit()
def set_border(
    potential: Float32Array,
    costs: ByteArray,
    gain: Float32Array,
    width: int,
    value: float,
) -> None:
    """Write ``value`` into the outermost cells that are no obstacles.

    Most maps end in those, and stay unwritten.
    """
    last_row = potential.size - width
    for x in range(width):
        set_open(potential, costs, gain, x, value)
        set_open(potential, costs, gain, last_row + x, value)
    for row in range(0, potential.size, width):
        set_open(potential, costs, gain, row, value)
        set_open(potential, costs, gain, row + width - 1, value)


@njit(inline="always")
def set_open(
    potential: Float32Array,
    costs: ByteArray,
    gain: Float32Array,
    n: int,
    value: float,
) -> None:
    """Write ``value`` into a cell that is no obstacle."""
    if gain[costs[n]] < POT_HIGH:
        potential[n] = value


@njit(ahead=True)
def round_half_away(value: float) -> int:
    """C's round(): halves go away from zero."""
    return int(math.copysign(math.floor(abs(value) + 0.5), value))

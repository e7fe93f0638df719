"""Hot loops that repair NavFn's potential where the costmap has changed; conventions as in navfn_kernels."""

# mypy: disable-error-code="arg-type, assignment, return-value"
# as in the other kernels: mypy takes 32-bit numbers for mistakes

import numpy as np
from numba import njit

from navstack.planning.navfn_kernels import BLOCK_SIZE, COST_OBSTACLE, POT_HIGH, Buffers, run_wave, set_border, unmark
from navstack.types import ByteArray, Float32Array

SETTLED = 2  # a dirty block that has not been written since it was last rolled back


@njit(cache=True)
def take_in_changes(
    potential: Float32Array,
    costs: ByteArray,
    known: ByteArray,
    crossing: Float32Array,
    width: int,
    window: tuple[int, int, int, int],
    only_cheaper: bool,
) -> float:
    """Bring ``known`` (height * width,) costs up to date in a window and find how deep the changes reach.

    ``window`` is x0, xn, y0, yn in cells, off the map's border, xn and yn exclusive. ``only_cheaper``: leave out cells
    that have become costlier. Returns the lowest potential that a changed cell or one of its four neighbours has:
    potentials below it do not depend on the changes, for the wave spreads from low to high. POT_HIGH: no change, or
    none that the wave has come near.
    """
    x0, xn, y0, yn = window
    level = POT_HIGH
    for y in range(y0, yn):
        for n in range(y * width + x0, y * width + xn):
            if costs[n] == known[n] or (only_cheaper and crossing[costs[n]] > crossing[known[n]]):
                continue
            known[n] = costs[n]
            beside = min(potential[n - 1], potential[n + 1])
            above = min(potential[n - width], potential[n + width])
            level = min(level, potential[n], beside, above)
    return level


@njit(cache=True)
def roll_back(potential: Float32Array, dirty: ByteArray, tops: Float32Array, level: float) -> None:
    """Set the potentials of ``level`` and above back to POT_HIGH.

    ``tops`` (blocks,) keeps the highest potential of each block that is SETTLED, not written since; blocks whose top
    lies well below the level are passed over.
    """
    for i in range(dirty.size):
        if dirty[i] and (dirty[i] != SETTLED or tops[i] >= level):
            top = np.float32(0.0)
            for n in range(i * BLOCK_SIZE, min(potential.size, (i + 1) * BLOCK_SIZE)):
                if potential[n] >= level:
                    potential[n] = POT_HIGH
                elif potential[n] > top:
                    top = potential[n]
            tops[i] = top
            dirty[i] = SETTLED


@njit(cache=True)
def seed_edge(
    potential: Float32Array,
    tops: Float32Array,
    dirty: ByteArray,
    costs: ByteArray,
    gain: Float32Array,
    width: int,
    level: float,
    buffer: Buffers,
) -> int:
    """Let the unreached neighbours of the cells just below ``level`` wait; returns how many.

    It ends where the next block might not fit into the buffer any more.
    """
    lowest = level - COST_OBSTACLE  # a cell costs less to cross
    count = 0
    for i in range(dirty.size):
        if dirty[i] and tops[i] >= lowest:
            for n in range(i * BLOCK_SIZE, min(potential.size, (i + 1) * BLOCK_SIZE)):
                if lowest <= potential[n] < level:
                    count = push_unreached(potential, costs, gain, width, n, buffer, count)
        if count > buffer.size - 4 * BLOCK_SIZE:
            break
    return count


@njit(cache=True)
def push_unreached(
    potential: Float32Array, costs: ByteArray, gain: Float32Array, width: int, n: int, buffer: Buffers, count: int
) -> int:
    """Let those of the four neighbours of a cell wait that are open and unreached; returns the new count."""
    for m in (n - 1, n + 1, n - width, n + width):
        if potential[m] == POT_HIGH and gain[costs[m]] < POT_HIGH:
            buffer[count] = m
            potential[m] = -POT_HIGH
            count += 1
    return count


@njit(cache=True)
def respread(
    potential: Float32Array,
    dirty: ByteArray,
    tops: Float32Array,  # (blocks,) see roll_back
    costs: ByteArray,
    crossing: Float32Array,
    gain: Float32Array,
    width: int,
    source: int,
    target: int,
    level: float,  # of potential, > COST_OBSTACLE
    buffers: Buffers,
    margin: float,
) -> float:
    """Forget the potentials of ``level`` and above, then spread the wave again from those below to ``target``.

    Returns what :func:`run_wave` does, or -1.0 where more cells would wait than the buffers hold.
    """
    roll_back(potential, dirty, tops, level)
    set_border(potential, width, -POT_HIGH)
    count = seed_edge(potential, tops, dirty, costs, gain, width, level, buffers[0])
    if count > buffers[0].size - 4 * BLOCK_SIZE:
        unmark(potential, buffers[0], count)
        threshold = np.float32(-1.0)
    else:
        threshold = run_wave(
            potential,
            dirty,
            costs,
            crossing,
            gain,
            width,
            target,
            False,
            buffers,
            count,
            np.float32(level),
            margin,
            tops[:0],  # no bound
            POT_HIGH,
        )
    set_border(potential, width, POT_HIGH)
    potential[source] = 0.0
    return threshold

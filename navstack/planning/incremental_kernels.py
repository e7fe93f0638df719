"""Hot loops that repair NavFn's potential where the costmap has changed.

Conventions as in navfn_kernels.
"""

# mypy: disable-error-code="arg-type, assignment, call-overload, return-value"
# as in the other kernels: mypy takes 32-bit numbers for mistakes

import math

import numpy as np

from navstack.costmap.costmap import Box
from navstack.jit import njit
from navstack.planning.navfn_kernels import (
    BLOCK_SIZE,
    COST_OBSTACLE,
    POT_HIGH,
    Buffers,
    NavfnField,
    set_border,
)
from navstack.planning.navfn_wave import run_wave, unmark
from navstack.types import (
    ByteArray,
    ByteVector,
    FixedByteVector,
    Float32Array,
    Float32Vector,
    FloatMatrix,
)

SETTLED = 2  # a dirty block that has not been written since it was last rolled back
UNSETTLED = np.uint64(0x0101010101010101)  # eight dirty blocks that have been


@njit()
def differ(one: ByteArray, other: ByteArray, begin: int) -> bool:
    """Whether two arrays differ in BLOCK_SIZE places.

    Loops of fixed length over bytes become vector instructions.
    """
    found = np.uint8(0)
    first = np.uint64(begin)
    for j in range(np.uint64(BLOCK_SIZE)):
        found = np.uint8(found | np.uint8(one[first + j] ^ other[first + j]))
    return bool(found != 0)


@njit(ahead=True)
def take_in_changes(
    potential: Float32Vector,
    costs: FixedByteVector,
    known: ByteVector,
    crossing: Float32Vector,
    width: int,
    window: Box,
    only_cheaper: bool,
) -> float:
    """Bring ``known`` (height * width,) costs up to date in a window; how deep changes reach.

    ``window`` is x0, xn, y0, yn in cells, off the map's border, xn and yn exclusive.
    ``only_cheaper``: leave out cells that have become costlier. Returns the lowest potential that a
    changed cell or one of its four neighbours has: potentials below it do not depend on the
    changes, for the wave spreads from low to high. POT_HIGH: no change, or none that the wave has
    come near.
    """
    x0, xn, y0, yn = window
    level = POT_HIGH
    for y in range(y0, yn):
        for x in range(x0, xn, BLOCK_SIZE):
            begin = y * width + max(x0, min(x, xn - BLOCK_SIZE))
            end = y * width + min(x + BLOCK_SIZE, xn)
            if end - begin == BLOCK_SIZE and not differ(costs, known, begin):
                continue
            for n in range(begin, end):
                if costs[n] == known[n] or (
                    only_cheaper and crossing[costs[n]] > crossing[known[n]]
                ):
                    continue
                known[n] = costs[n]
                beside = min(potential[n - 1], potential[n + 1])
                above = min(potential[n - width], potential[n + width])
                level = min(level, potential[n], beside, above)
    return level


@njit(ahead=True)
def crosses_costlier(
    points: FloatMatrix,
    costs: FixedByteVector,
    known: ByteVector,
    crossing: Float32Vector,
    width: int,
) -> bool:
    """Whether one of the points (n, 2) [cells] lies in a cell that costs more than ``known``."""
    for i in range(points.shape[0]):
        n = int(math.floor(points[i, 1] + 0.5)) * width + int(math.floor(points[i, 0] + 0.5))
        if crossing[costs[n]] > crossing[known[n]]:
            return True
    return False


@njit()
def roll_back(
    potential: Float32Array, dirty: ByteArray, tops: Float32Array, level: float, edge: Buffers
) -> int:
    """Set the potentials of ``level`` and above back to POT_HIGH.

    ``tops`` (blocks,) keeps the highest potential of each block that is SETTLED, not written since;
    blocks whose top lies well below the level are passed over. The blocks that hold cells just
    below the level are put into ``edge``.

    Returns:
        How many these are; those that ``edge`` has no room for are left out.
    """
    lowest = np.float32(level - COST_OBSTACLE)  # a cell costs less to cross
    words = dirty.view(np.uint64)
    count = 0
    for w in range(np.uint64(words.size)):
        if words[w] == 0 or not (words[w] & UNSETTLED or reaches(tops, 8 * w, lowest)):
            continue
        for i in range(8 * w, 8 * w + 8):
            if dirty[i] == 0 or (dirty[i] == SETTLED and tops[i] < lowest):
                continue
            if dirty[i] != SETTLED or tops[i] >= level:
                cut_block(potential, i, level, tops)
                dirty[i] = SETTLED
            if tops[i] >= lowest and count < edge.size:
                edge[count] = i
                count += 1
    return count


@njit(inline="always")
def reaches(tops: Float32Array, first: int, lowest: float) -> bool:
    """Whether one of eight tops is at least ``lowest``."""
    found = np.uint8(0)
    for i in range(np.uint64(8)):
        found = np.uint8(found | np.uint8(tops[np.uint64(first) + i] >= lowest))
    return bool(found != 0)


@njit()
def cut_block(potential: Float32Array, block: int, level: float, tops: Float32Array) -> None:
    """Set the potentials of ``level`` and above in a block to POT_HIGH.

    ``tops`` takes the highest of the others, or 0.

    Potentials are not negative: as whole numbers their bits have the same order, of which a highest
    one is found by vector instructions.
    """
    bits = potential.view(np.int32)
    top = np.int32(0)
    limit = np.float32(level)
    first = np.uint64(block * BLOCK_SIZE)
    if (block + 1) * BLOCK_SIZE <= potential.size:
        for j in range(np.uint64(BLOCK_SIZE)):
            stays = potential[first + j] < limit
            top = max(top, np.int32(bits[first + j] if stays else 0))
            potential[first + j] = potential[first + j] if stays else POT_HIGH
    else:
        for n in range(first, np.uint64(potential.size)):
            stays = potential[n] < limit
            top = max(top, np.int32(bits[n] if stays else 0))
            potential[n] = potential[n] if stays else POT_HIGH
    tops.view(np.int32)[block] = top


@njit()
def seed_edge(
    potential: Float32Array,
    edge: Buffers,
    costs: ByteArray,
    gain: Float32Array,
    width: int,
    level: float,
    buffer: Buffers,
) -> int:
    """Let the unreached neighbours of the cells just below ``level``, in the blocks ``edge``, wait.

    Returns how many.

    It ends where the next block might not fit into the buffer any more.
    """
    lowest = level - COST_OBSTACLE
    flags = np.empty(BLOCK_SIZE, dtype=np.uint8)
    words = flags.view(np.uint64)
    count = 0
    for i in edge:
        begin = np.uint64(i * BLOCK_SIZE)
        flag_edge(potential, begin, width, level, flags)
        for w in range(words.size):
            if words[w] == 0:
                continue
            for j in range(8 * w, 8 * w + 8):
                n = begin + np.uint64(j)
                if flags[j] and n < potential.size and lowest <= potential[n] < level:
                    count = push_unreached(potential, costs, gain, width, n, buffer, count)
        if count > buffer.size - 4 * BLOCK_SIZE:
            break
    return count


@njit()
def flag_edge(
    potential: Float32Array, begin: int, width: int, level: float, flags: ByteArray
) -> None:
    """Flag the cells of a block just below ``level`` beside which a cell is unreached.

    In blocks that reach into the map's first or last row all are flagged.
    """
    row = np.uint64(width)
    one = np.uint64(1)
    if begin < row or begin + np.uint64(BLOCK_SIZE) + row > potential.size:
        flags[:] = 1
        return
    lowest = np.float32(level - COST_OBSTACLE)
    below = np.float32(level)
    for j in range(np.uint64(BLOCK_SIZE)):
        n = begin + j
        beside = (potential[n - one] == POT_HIGH) | (potential[n + one] == POT_HIGH)
        above = (potential[n - row] == POT_HIGH) | (potential[n + row] == POT_HIGH)
        flags[j] = (potential[n] >= lowest) & (potential[n] < below) & (beside | above)


@njit()
def push_unreached(
    potential: Float32Array,
    costs: ByteArray,
    gain: Float32Array,
    width: int,
    n: int,
    buffer: Buffers,
    count: int,
) -> int:
    """Let those of the four neighbours of a cell wait that are open and unreached.

    Returns the new count.
    """
    for m in (n - 1, n + 1, n - width, n + width):
        if potential[m] == POT_HIGH and gain[costs[m]] < POT_HIGH:
            buffer[count] = m
            potential[m] = -POT_HIGH
            count += 1
    return count


@njit(ahead=True)
def respread(
    field: NavfnField,
    tops: Float32Vector,  # (blocks,) see roll_back
    source: int,
    target: int,
    level: float,  # of potential, > COST_OBSTACLE
    margin: float,
    limit: float,  # see run_wave
) -> float:
    """Forget potentials of ``level`` and above, then spread the wave again to ``target``.

    Returns what :func:`run_wave` does, or -1.0 where more cells would wait than the buffers hold.
    """
    potential, dirty, costs, _, gain, width, buffers = field
    blocks = roll_back(potential, dirty, tops, level, buffers[1])
    set_border(potential, costs, gain, width, -POT_HIGH)
    count = seed_edge(potential, buffers[1, :blocks], costs, gain, width, level, buffers[0])
    if count > buffers[0].size - 4 * BLOCK_SIZE:
        unmark(potential, buffers[0], count)
        threshold = np.float32(-1.0)
    else:
        threshold = run_wave(
            field, target, False, count, np.float32(level), margin, tops[:0], np.float32(limit)
        )
    set_border(potential, costs, gain, width, POT_HIGH)
    potential[source] = 0.0
    return threshold

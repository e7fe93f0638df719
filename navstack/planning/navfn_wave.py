"""NavFn's wave spreads the potential cell by cell (updateCell, propNavFnDijkstra, propNavFnAstar).

Conventions as in :mod:`.navfn_kernels`.
"""

import math

import numpy as np

from navstack.jit import njit
from navstack.planning.navfn_kernels import (
    BLOCK_SHIFT,
    COST_NEUTRAL,
    COST_OBSTACLE,
    POT_HIGH,
    PRIORITY_STEP,
    WAVE_0,
    WAVE_1,
    WAVE_2,
    Buffers,
    NavfnField,
    set_border,
)
from navstack.planning.prefetch import prefetch
from navstack.types import ByteArray, Float32Array, Float32Vector

# cells whose visit is prepared while others are visited
FETCHED_AHEAD = 16
# of the straight line's cost that a potential is at least; WAVE_0 is a little low
STRAIGHT_SHARE = 0.99


@njit()
def planar_wave(
    left: float,
    right: float,
    up: float,
    down: float,
    cost: float,
) -> float:
    """Potential of a cell of crossing cost ``cost`` from its four neighbours' (updateCell).

    A planar wave through the two lowest neighbours, its square root approximated by a quadratic.
    """
    low = min(left, right)
    other = min(up, down)
    difference = low - other
    if difference < np.float32(0.0):
        difference = -difference
        other = low
    if difference >= cost:
        return np.float32(other + cost)
    ratio = np.float64(np.float32(difference / cost))
    factor = np.float32(WAVE_2 * ratio * ratio + WAVE_1 * ratio + WAVE_0)
    return np.float32(other + np.float32(cost * factor))


@njit()
def distance_cost(n: int, width: int, target_x: int, target_y: int) -> float:
    """A*'s heuristic: the straight line to the target through free cells (updateCellAstar)."""
    x = np.int64(n) % width
    y = np.int64(n) // width
    return np.float32(math.hypot(x - target_x, y - target_y) * COST_NEUTRAL)


@njit()
def remaining(
    n: int,
    ahead: Float32Array,
    width: int,
    target_x: int,
    target_y: int,
) -> float:
    """A lower bound of the cost from a cell to the target; see :func:`run_wave`."""
    if ahead.size > 0:
        return ahead[n]
    return np.float32(STRAIGHT_SHARE * distance_cost(n, width, target_x, target_y))


@njit()
def unmark(potential: Float32Array, buffer: Buffers, count: int) -> None:
    """Take the waiting mark off the cells of a buffer."""
    for i in range(count):
        n = np.uint64(buffer[np.uint64(i)])
        potential[n] = -potential[n]


@njit()
def seed_wave(
    potential: Float32Array,
    costs: ByteArray,
    gain: Float32Array,
    width: int,
    source: int,
    buffer: Buffers,
) -> int:
    """Put the source's neighbours into a buffer (initCost); returns how many."""
    potential[source] = np.float32(0.0)
    count = 0
    for n in (source + 1, source - 1, source - width, source + width):
        if 0 <= n < potential.size and potential[n] > gain[costs[n]]:
            buffer[count] = n
            count += 1
            potential[n] = -potential[n]
    return count


@njit()
def push_neighbours(
    field: NavfnField,
    buffer: Buffers,
    count: int,
    n: int,
    new: float,
    left: float,
    right: float,
    up: float,
    down: float,
) -> int:
    """Let the four neighbours of a cell wait whose potential ``new`` could lower theirs.

    Their potentials have been read already. Most of them wait or are lower: the first test spares
    reading their costs.

    Returns the new count.
    """
    potential = field.potential
    one = np.uint64(1)
    row = np.uint64(field.width)
    for m, value in ((n - one, left), (n + one, right), (n - row, up), (n + row, down)):
        if value > new and value > new + field.gain[field.costs[m]] and count < buffer.size:
            buffer[np.uint64(count)] = m
            potential[m] = -value
            count += 1
    return count


@njit(inline="always")
def fetch_cell(
    potential: Float32Array,
    costs: ByteArray,
    ahead: Float32Array,
    n: int,
    row: int,
) -> None:
    """Prefetch what a visit of cell ``n`` reads, but what has just been read to unmark it."""
    for m in (n - row, n + row):
        prefetch(potential, m)
        prefetch(costs, m)
    if ahead.size > 0:
        prefetch(ahead, n)


@njit()
def run_wave(
    field: NavfnField,
    target: int,
    use_astar: bool,
    n_current: int,
    threshold: float,
    margin: float,
    ahead: Float32Array,
    limit: float,
) -> float:
    """Visit the waiting cells and those they wake, until the target is reached.

    As propNavFnDijkstra and propNavFnAstar.

    The first ``n_current`` cells of the first buffer wait at the outset. Cells below the threshold
    are visited now, the others wait for the next one: buckets, not a heap. The wave ends once the
    target's potential + ``margin`` is at most the threshold. Upstream's limit of cycles is left
    out; it only makes small mazes fail.

    ``ahead`` bounds from below what remains from each cell to the target; where it is empty the
    straight line does. The wave does not go on from cells whose potential and bound exceed
    ``limit``: no way that costs less leads over them.

    Returns the threshold at the end: potentials below it by PRIORITY_STEP are final.
    """
    potential, dirty, costs, crossing, _, width, buffers = field
    current = buffers[0]
    following = buffers[1]
    overflow = buffers[2]
    # numba would compile what they are given to once more for a literal 0
    n_following = n_overflow = np.int64(0)
    target_x = target % width
    target_y = target // width
    one = np.uint64(1)
    row = np.uint64(width)
    while n_current > 0:
        unmark(potential, current, n_current)
        for i in range(n_current):
            n = np.uint64(current[np.uint64(i)])
            if i + FETCHED_AHEAD < n_current:
                later = np.uint64(current[np.uint64(i + FETCHED_AHEAD)])
                fetch_cell(potential, costs, ahead, later, row)
            left = potential[n - one]
            right = potential[n + one]
            up = potential[n - row]
            down = potential[n + row]
            new = planar_wave(abs(left), abs(right), abs(up), abs(down), crossing[costs[n]])
            if new >= abs(potential[n]):
                continue
            potential[n] = math.copysign(new, potential[n])
            dirty[n >> BLOCK_SHIFT] = 1
            if limit < POT_HIGH and new + remaining(n, ahead, width, target_x, target_y) > limit:
                continue
            if use_astar:
                new = np.float32(new + distance_cost(n, width, target_x, target_y))
            if new < threshold:
                n_following = push_neighbours(
                    field, following, n_following, n, new, left, right, up, down
                )
            else:
                n_overflow = push_neighbours(
                    field, overflow, n_overflow, n, new, left, right, up, down
                )
        current, following = following, current
        n_current = n_following
        n_following = np.int64(0)
        if n_current == 0:
            threshold = np.float32(threshold + PRIORITY_STEP)
            current, overflow = overflow, current
            n_current = n_overflow
            n_overflow = np.int64(0)
        if (
            target >= 0
            and abs(potential[target]) < POT_HIGH
            and abs(potential[target]) + margin <= threshold
        ):
            break
    unmark(potential, current, n_current)
    unmark(potential, overflow, n_overflow)
    return threshold if n_current > 0 or n_overflow > 0 else POT_HIGH


@njit(ahead=True)
def propagate(
    field: NavfnField,
    source: int,  # cell where the potential is 0
    target: int,  # cell whose potential ends the wave; -1: expand until nothing is left
    use_astar: bool,
    # of potential beyond the target; -inf: end when the target is reached, as upstream
    margin: float,
    ahead: Float32Vector,  # (height * width,) or empty, see run_wave
    limit: float,
) -> float:
    """Spread the potential from ``source`` to ``target``.

    See :func:`run_wave` for what it returns.
    """
    potential, dirty, costs, _, gain, width, buffers = field
    set_border(potential, costs, gain, width, -POT_HIGH)
    n_current = seed_wave(potential, costs, gain, width, source, buffers[0])
    dirty[source >> BLOCK_SHIFT] = 1
    threshold = COST_OBSTACLE
    if use_astar:
        threshold = np.float32(
            threshold + distance_cost(source, width, target % width, target // width)
        )
    threshold = run_wave(
        field, target, use_astar, n_current, threshold, margin, ahead, np.float32(limit)
    )
    set_border(potential, costs, gain, width, POT_HIGH)
    potential[source] = 0.0
    return threshold

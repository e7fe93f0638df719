"""A* over poses: the loop that Hybrid-A* and the state lattice share (``a_star.cpp``, ``node_hybrid.cpp``)."""

import heapq
import math
from typing import NamedTuple

import numpy as np

from navstack.jit import njit
from navstack.planning.dubins import curve, is_curve_free, shortest_word, stands_free
from navstack.planning.ompl_kernels import has_room, is_free
from navstack.planning.smac.grid_kernels import FULL_COST, NEIGHBOURS, is_closed, octile
from navstack.planning.smac.motions import IN_PLACE, STRAIGHT, Motions
from navstack.types import BoolArray, ByteArray, Float32Array, FloatArray, IntArray

ROOMY, NARROW = 1, 2
_EMPTY = -1
_MIX = np.uint64(0x9E3779B97F4A7C15)  # Knuth's multiplicative hash, 2^64 / golden ratio


class Ground(NamedTuple):
    """Where the robot may be; lengths in [cells]."""

    costs: ByteArray  # (height, width)
    blocked: BoolArray  # (256,) costs that the centre must not have
    footprint: FloatArray  # (N, 2) convex
    reach: float  # its circumscribed radius
    allow_unknown: bool
    room: ByteArray  # (height, width) whether a cell's surroundings are free: 0 not yet asked, else ROOMY or NARROW


class Penalties(NamedTuple):
    """What makes one way dearer than another of the same length."""

    reverse: float
    change: float
    non_straight: float
    cost: float
    retrospective: float
    rotation: float


class Expansion(NamedTuple):
    """When a curve is tried that leads straight to the goal; lengths in [cells]."""

    ratio: float
    max_length: float
    max_cost: int
    radius: float  # of the curve
    reverses: bool  # backwards all the way, too


class Goal(NamedTuple):
    """Where to, and when to be content with less; lengths in [cells]."""

    pose: FloatArray  # (3,)
    heading: int  # number of its heading
    tolerance: float
    max_iterations: int
    max_on_approach_iterations: int
    coarse: int  # cells along an edge of one of the heuristic's
    window: float  # about the goal, within which the length of Dubins' curve counts; 0: nowhere
    radius: float  # of that curve


@njit(cache=True)
def slot(keys: IntArray, key: int) -> int:
    """Where a key stands in an open-addressing table, or would."""
    mask = np.uint64(len(keys) - 1)
    at = (np.uint64(key) * _MIX) >> np.uint64(20)
    while True:
        at &= mask
        if keys[np.int64(at)] == key or keys[np.int64(at)] == _EMPTY:
            return int(at)
        at += np.uint64(1)


@njit(cache=True)
def lowest_cost(costs: ByteArray, column: int, row: int, coarse: int) -> int:
    """The lowest cost of a square of cells."""
    lowest = 255
    for y in range(row * coarse, min((row + 1) * coarse, costs.shape[0])):
        for x in range(column * coarse, min((column + 1) * coarse, costs.shape[1])):
            lowest = min(lowest, costs[y, x])
    return lowest


class Field(NamedTuple):
    """The cost of the way to the goal, however the robot is turned, as far as it was asked for."""

    coarse: int  # cells along the edge of one of its squares
    columns: int
    rows: int
    towards_x: int  # the robot's square
    towards_y: int
    goal_x: int  # the goal's square
    goal_y: int
    buried: float  # [squares] about an occupied goal that the way may lead through what is occupied; free: less than 0
    ways: Float32Array  # (rows * columns,) [squares]
    is_known: BoolArray  # (rows * columns,)


@njit(cache=True)
def make_field(ground: Ground, start: FloatArray, goal: Goal) -> tuple[Field, list[tuple[float, int]]]:
    """A field in which only the goal's square is waiting."""
    coarse = goal.coarse
    columns, rows = (ground.costs.shape[1] + coarse - 1) // coarse, (ground.costs.shape[0] + coarse - 1) // coarse
    ways = np.full(columns * rows, np.inf, dtype=np.float32)
    goal_x, goal_y = int(goal.pose[0]) // coarse, int(goal.pose[1]) // coarse
    target = goal_y * columns + goal_x
    ways[target] = 0.0
    is_known = np.zeros(columns * rows, dtype=np.bool_)
    is_buried = is_closed(lowest_cost(ground.costs, goal_x, goal_y, coarse), ground.allow_unknown)
    buried = goal.tolerance / coarse if is_buried else -1.0
    towards_x, towards_y = int(start[0]) // coarse, int(start[1]) // coarse
    field = Field(coarse, columns, rows, towards_x, towards_y, goal_x, goal_y, buried, ways, is_known)
    return field, [(0.0, target)]


@njit(cache=True)
def way_to_goal(
    ground: Ground, field: Field, waiting: list[tuple[float, int]], cost_penalty: float, x: float, y: float
) -> float:
    """The cost of the way from a place to the goal, [cells]; inf: there is none.

    The search from the goal goes on, in A*'s order towards the robot, until the square of the place is known: what is
    known stays known, whichever is asked for next.
    """
    wanted = int(y) // field.coarse * field.columns + int(x) // field.coarse
    while not field.is_known[wanted] and len(waiting) > 0:
        _, n = heapq.heappop(waiting)
        if field.is_known[n]:
            continue
        field.is_known[n] = True
        row, column = n // field.columns, n % field.columns
        for k in range(8):
            u, v = column + NEIGHBOURS[k, 0], row + NEIGHBOURS[k, 1]
            if not (0 <= u < field.columns and 0 <= v < field.rows):
                continue
            m = v * field.columns + u
            if field.is_known[m]:
                continue
            cost = lowest_cost(ground.costs, u, v, field.coarse)
            if is_closed(cost, ground.allow_unknown):
                if math.hypot(u - field.goal_x, v - field.goal_y) > field.buried:
                    continue
                cost = 0  # nobody drives there: the way tells how far from the goal the robot is
            length = math.sqrt(2.0) if k >= 4 else 1.0
            way = field.ways[n] + length * (1.0 + cost_penalty * min(float(cost), FULL_COST) / FULL_COST)
            if way < field.ways[m]:
                field.ways[m] = way
                heapq.heappush(waiting, (way + octile(u - field.towards_x, v - field.towards_y), m))
    return field.coarse * float(field.ways[wanted]) if field.is_known[wanted] else math.inf


@njit(cache=True)
def step_cost(penalties: Penalties, length: float, cost: int, kind: int, backwards: int, before: int) -> float:
    """What a motion costs, [cells] (NodeHybrid::getTraversalCost).

    Args:
        penalties: of the planner.
        length: of the motion [cells].
        cost: of the cell where it ends.
        kind: of the motion.
        backwards: 1: it leads backwards.
        before: kind of the motion before; -1: it is the first.
    """
    share = min(float(cost), FULL_COST) / FULL_COST
    if kind == IN_PLACE:
        return penalties.rotation * (1.0 + penalties.cost * share)
    way = length * (1.0 - penalties.retrospective + penalties.cost * share)
    if kind != STRAIGHT:
        way *= penalties.non_straight
        if before != kind and before >= 0 and before != STRAIGHT:
            way *= 1.0 + penalties.change / penalties.non_straight
    return way * penalties.reverse if backwards else way


@njit(cache=True)
def curve_to(ground: Ground, expansion: Expansion, start: FloatArray, goal: FloatArray) -> FloatArray:
    """Poses (n, 3) of a free curve from pose to pose that is short and cheap enough; none: (0, 3)."""
    best, shortest = np.empty((0, 3)), expansion.max_length
    for backwards in range(2 if expansion.reverses else 1):
        first, last = start.copy(), goal.copy()
        if backwards:  # a way driven backwards is the way forwards of a robot that looks the other way
            first[2] += math.pi
            last[2] += math.pi
        _, t, p, q = shortest_word(first, last, expansion.radius)
        if t + p + q > shortest:
            continue
        poses = curve(first, last, expansion.radius, 1.0)
        if backwards:
            poses[:, 2] -= math.pi
        if not is_curve_free(ground.costs, ground.blocked, ground.footprint, ground.reach, ground.allow_unknown, poses):
            continue
        dearest = 0
        for i in range(len(poses)):
            cost = ground.costs[int(poses[i, 1]), int(poses[i, 0])]
            dearest = max(dearest, 0 if cost == 255 else cost)
        if dearest <= expansion.max_cost:
            best, shortest = poses, t + p + q
    return best


class Nodes(NamedTuple):
    """Poses that a search has come to; room for more than there are."""

    places: FloatArray  # (room, 2) [cells]
    headings: IntArray  # (room,) their numbers
    parents: IntArray  # (room,) -1: none
    by: IntArray  # (room,) the parent's motion
    travelled: FloatArray  # (room,) cost of the way to it
    ahead: FloatArray  # (room,) at least that of the way on
    is_done: BoolArray  # (room,)
    keys: IntArray  # (4 * room,) open-addressing table: cell and heading ..
    numbers: IntArray  # (4 * room,) .. -> node


@njit(cache=True)
def make_nodes(room: int) -> Nodes:
    """Room for nodes, of which there are none."""
    return Nodes(
        np.empty((room, 2)),
        np.empty(room, dtype=np.int64),
        np.empty(room, dtype=np.int64),
        np.empty(room, dtype=np.int64),
        np.empty(room),
        np.empty(room),
        np.zeros(room, dtype=np.bool_),
        np.full(4 * room, _EMPTY, dtype=np.int64),
        np.empty(4 * room, dtype=np.int64),
    )


@njit(cache=True)
def more_nodes(nodes: Nodes, count: int) -> Nodes:
    """The same nodes with twice the room."""
    larger = make_nodes(2 * len(nodes.headings))
    larger.places[:count] = nodes.places[:count]
    larger.headings[:count] = nodes.headings[:count]
    larger.parents[:count] = nodes.parents[:count]
    larger.by[:count] = nodes.by[:count]
    larger.travelled[:count] = nodes.travelled[:count]
    larger.ahead[:count] = nodes.ahead[:count]
    larger.is_done[:count] = nodes.is_done[:count]
    for i in range(len(nodes.keys)):
        if nodes.keys[i] != _EMPTY:
            at = slot(larger.keys, nodes.keys[i])
            larger.keys[at], larger.numbers[at] = nodes.keys[i], nodes.numbers[i]
    return larger


@njit(cache=True, inline="always")
def key_of(ground: Ground, x: float, y: float, heading: int, bins: int) -> int:
    """The number of a cell and a heading."""
    return int((int(y) * ground.costs.shape[1] + int(x)) * bins + heading)


@njit(cache=True)
def expand(
    ground: Ground,
    motions: Motions,
    goal: Goal,
    penalties: Penalties,
    field: Field,
    waiting: list[tuple[float, int]],
    nodes: Nodes,
    count: int,
    heap: list[tuple[float, int]],
    n: int,
) -> int:
    """Take in where the motions from node ``n`` lead; returns how many nodes there are now."""
    x, y, b = nodes.places[n, 0], nodes.places[n, 1], nodes.headings[n]
    before = -1 if nodes.parents[n] < 0 else motions.kinds[nodes.headings[nodes.parents[n]], nodes.by[n]]
    height, width = ground.costs.shape
    bins, each = motions.ends.shape
    for k in range(each):
        last = motions.counts[b, k] - 1
        if last < 0:
            continue
        end_x, end_y = x + motions.poses[b, k, last, 0], y + motions.poses[b, k, last, 1]
        if not (0.0 <= end_x < width and 0.0 <= end_y < height):
            continue
        end = motions.ends[b, k]
        key = key_of(ground, end_x, end_y, end, bins)
        at = slot(nodes.keys, key)
        m = nodes.numbers[at] if nodes.keys[at] == key else -1
        cost, kind = ground.costs[int(end_y), int(end_x)], motions.kinds[b, k]
        way = step_cost(penalties, motions.lengths[b, k], cost, kind, motions.is_reverse[b, k], before)
        total = nodes.travelled[n] + way
        if m >= 0 and (nodes.is_done[m] or total >= nodes.travelled[m]):
            continue
        if not is_motion_free(ground, x, y, motions.poses[b, k, : last + 1]):
            continue
        if m < 0:
            left = way_to_goal(ground, field, waiting, penalties.cost, end_x, end_y)
            if left == math.inf:
                continue
            if octile(goal.pose[0] - end_x, goal.pose[1] - end_y) < goal.window:
                pose = np.array((end_x, end_y, motions.headings[end]))
                _, t, p, q = shortest_word(pose, goal.pose, goal.radius)
                left = max(left, t + p + q)
            m, nodes.keys[at], nodes.numbers[at] = count, key, count
            nodes.ahead[m] = left
            count += 1
        nodes.places[m, 0], nodes.places[m, 1], nodes.headings[m] = end_x, end_y, end
        nodes.parents[m], nodes.by[m], nodes.travelled[m] = n, k, total
        heapq.heappush(heap, (total + nodes.ahead[m], m))
    return count


@njit(cache=True)
def is_roomy(ground: Ground, x: float, y: float) -> bool:
    """Whether the robot stands free at a place however it is turned; kept per cell, to the safe side."""
    if not is_free(ground.costs, ground.blocked, x, y):
        return False
    column, row = int(x), int(y)
    if ground.room[row, column] == 0:
        reach = ground.reach + math.sqrt(0.5)
        is_open = has_room(ground.costs, column + 0.5, row + 0.5, reach, ground.allow_unknown)
        ground.room[row, column] = ROOMY if is_open else NARROW
    return bool(ground.room[row, column] == ROOMY)


@njit(cache=True)
def is_motion_free(ground: Ground, x: float, y: float, poses: FloatArray) -> bool:
    """Whether the robot stands free at every pose (n, 3) of a motion from (x, y)."""
    pose = np.empty(3)
    for i in range(len(poses)):
        pose[0], pose[1], pose[2] = x + poses[i, 0], y + poses[i, 1], poses[i, 2]
        if is_roomy(ground, pose[0], pose[1]):
            continue
        if not stands_free(ground.costs, ground.blocked, ground.footprint, ground.reach, ground.allow_unknown, pose):
            return False
    return True


class Found(NamedTuple):
    """What came of a search."""

    node: int  # the last one of the way; -1: there is none
    nodes: Nodes
    curve: FloatArray  # (m, 3) from there to the goal; empty: it is the goal, or near enough
    iterations: int


@njit(cache=True)
def search_poses(
    ground: Ground, motions: Motions, start: FloatArray, heading: int, goal: Goal, penalties: Penalties, way: Expansion
) -> Found:
    """A* from a pose (3,) [cells, cells, rad] with the number of its heading, over motions, to a goal."""
    bins, each = motions.ends.shape
    field, waiting = make_field(ground, start, goal)
    nodes, count, nothing = make_nodes(1 << 12), 1, np.empty((0, 3))
    nodes.places[0], nodes.headings[0], nodes.parents[0] = start[:2], heading, -1
    nodes.by[0], nodes.travelled[0] = -1, 0.0
    nodes.ahead[0] = way_to_goal(ground, field, waiting, penalties.cost, start[0], start[1])
    first = key_of(ground, start[0], start[1], heading, bins)
    at = slot(nodes.keys, first)
    nodes.keys[at], nodes.numbers[at] = first, 0
    heap = [(nodes.ahead[0], 0)]
    nearest, best, until_curve, iterations, approaching = math.inf, -1, 0.0, 0, 0
    while len(heap) > 0 and iterations < goal.max_iterations and nodes.ahead[0] < math.inf:
        _, n = heapq.heappop(heap)
        if nodes.is_done[n]:
            continue
        nodes.is_done[n] = True
        iterations += 1
        x, y, b = nodes.places[n, 0], nodes.places[n, 1], nodes.headings[n]
        if int(x) == int(goal.pose[0]) and int(y) == int(goal.pose[1]) and b == goal.heading:
            return Found(n, nodes, nothing, iterations)
        if nodes.ahead[n] < nearest:
            nearest, best = nodes.ahead[n], n
        between = max(nearest / way.ratio, math.ceil(way.ratio))
        until_curve = min(until_curve - 1.0, between)
        if until_curve <= 0.0:
            until_curve = between
            if math.hypot(goal.pose[0] - x, goal.pose[1] - y) <= way.max_length:
                poses = curve_to(ground, way, np.array((x, y, motions.headings[b])), goal.pose)
                if len(poses) > 0:
                    return Found(n, nodes, poses, iterations)
        approaching += nearest <= goal.tolerance
        if approaching > goal.max_on_approach_iterations:
            break
        if count + each > len(nodes.headings):
            nodes = more_nodes(nodes, count)
        count = expand(ground, motions, goal, penalties, field, waiting, nodes, count, heap, n)
    return Found(best if nearest <= goal.tolerance else -1, nodes, nothing, iterations)

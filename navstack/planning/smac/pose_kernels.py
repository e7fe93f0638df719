"""A* over poses for Hybrid-A* and the state lattice (``a_star.cpp``, ``node_hybrid.cpp``)."""

import heapq
import math
from typing import NamedTuple

import numpy as np

from navstack.costmap.costmap import NO_INFORMATION
from navstack.jit import njit
from navstack.planning.dubins import curve, is_curve_free, shortest_word, stands_free
from navstack.planning.ompl_kernels import has_room, is_free
from navstack.planning.smac.grid_kernels import FULL_COST, octile
from navstack.planning.smac.heuristic_kernels import HeuristicField, make_field, way_to_goal
from navstack.planning.smac.motions import IN_PLACE, STRAIGHT, Motions
from navstack.planning.smac.node_kernels import Nodes, key_of, make_nodes, more_nodes, slot
from navstack.planning.smac.pose_problem import (
    NARROW,
    ROOMY,
    Expansion,
    Goal,
    Penalties,
    SearchGround,
)
from navstack.types import ByteArray, FloatArray


@njit()
def step_cost(
    penalties: Penalties, length: float, cost: int, kind: int, backwards: int, changes: bool
) -> float:
    """What a motion costs, [cells] (getTraversalCost of NodeHybrid and NodeLattice).

    Args:
        penalties: of the planner.
        length: of the motion [cells].
        cost: of the cell that counts.
        kind: of the motion.
        backwards: 1: it leads backwards.
        changes: the motion before has another side.
    """
    share = min(float(cost), FULL_COST) / FULL_COST
    if kind == IN_PLACE:
        return penalties.rotation * (1.0 + penalties.cost * share)
    way = length * (1.0 - penalties.retrospective + penalties.cost * share)
    if kind != STRAIGHT:
        way *= penalties.non_straight
        if changes:
            way *= 1.0 + penalties.change / penalties.non_straight
    if backwards:
        way *= penalties.reverse
    return way


@njit()
def dearest(costs: ByteArray, x: float, y: float, poses: FloatArray) -> int:
    """The highest cost under the poses (n, 3) of a motion from (x, y) [cells] that ends inside."""
    height, width = costs.shape
    most = 0
    for i in range(len(poses)):
        px = x + poses[i, 0]
        py = y + poses[i, 1]
        if 0.0 <= px < width and 0.0 <= py < height:
            most = max(most, int(costs[int(py), int(px)]))
    return most


@njit()
def cost_of_motion(
    costs: ByteArray,
    motions: Motions,
    penalties: Penalties,
    x: float,
    y: float,
    b: int,
    k: int,
    before: int,
) -> float:
    """What motion ``k`` of heading ``b`` costs from (x, y) [cells], [cells].

    ``before`` is the side of the motion that led there; -1: none did.
    """
    poses = motions.poses[b, k, : motions.counts[b, k]]
    if motions.by_dearest:
        cost = dearest(costs, x, y, poses)
    else:
        cost = int(costs[int(y + poses[-1, 1]), int(x + poses[-1, 0])])
    changes = before >= 0 and before != motions.sides[b, k]
    return step_cost(
        penalties,
        motions.lengths[b, k],
        cost,
        motions.kinds[b, k],
        motions.is_reverse[b, k],
        changes,
    )


@njit()
def curve_to(
    ground: SearchGround, expansion: Expansion, start: FloatArray, goal: FloatArray
) -> FloatArray:
    """Poses (n, 3) of a free curve from pose to pose that is short and cheap enough.

    None: (0, 3).
    """
    best = np.empty((0, 3))
    shortest = expansion.max_length
    for backwards in range(2 if expansion.reverses else 1):
        first = start.copy()
        last = goal.copy()
        # a way driven backwards is the way forwards of a robot that looks the other way
        if backwards:
            first[2] += math.pi
            last[2] += math.pi
        _, t, p, q = shortest_word(first, last, expansion.radius)
        if t + p + q > shortest:
            continue
        poses = curve(first, last, expansion.radius, 1.0)
        if backwards:
            poses[:, 2] -= math.pi
        if not is_curve_free(
            ground.costs,
            ground.blocked,
            ground.footprint,
            ground.reach,
            ground.allow_unknown,
            poses,
        ):
            continue
        dearest = 0
        for i in range(len(poses)):
            cost = ground.costs[int(poses[i, 1]), int(poses[i, 0])]
            if cost != NO_INFORMATION:
                dearest = max(dearest, cost)
        if dearest <= expansion.max_cost:
            best = poses
            shortest = t + p + q
    return best


@njit()
def expand(
    ground: SearchGround,
    motions: Motions,
    goal: Goal,
    penalties: Penalties,
    field: HeuristicField,
    waiting: list[tuple[float, int]],
    nodes: Nodes,
    count: int,
    heap: list[tuple[float, int]],
    n: int,
) -> int:
    """Take in where the motions from node ``n`` lead; returns how many nodes there are now."""
    x = nodes.places[n, 0]
    y = nodes.places[n, 1]
    b = nodes.headings[n]
    before = -1  # the side of the motion that led here
    if nodes.parents[n] >= 0:
        before = motions.sides[nodes.headings[nodes.parents[n]], nodes.by[n]]
    height, width = ground.costs.shape
    bins, each = motions.ends.shape
    for k in range(each):
        last = motions.counts[b, k] - 1
        if last < 0:
            continue
        end_x = x + motions.poses[b, k, last, 0]
        end_y = y + motions.poses[b, k, last, 1]
        if not (0.0 <= end_x < width and 0.0 <= end_y < height):
            continue
        end = motions.ends[b, k]
        key = key_of(ground, end_x, end_y, end, bins)
        at = slot(nodes.keys, key)
        m = nodes.numbers[at] if nodes.keys[at] == key else -1
        way = cost_of_motion(ground.costs, motions, penalties, x, y, b, k, before)
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
            m = count
            nodes.keys[at] = key
            nodes.numbers[at] = count
            nodes.ahead[m] = left
            count += 1
        nodes.places[m, 0] = end_x
        nodes.places[m, 1] = end_y
        nodes.headings[m] = end
        nodes.parents[m] = n
        nodes.by[m] = k
        nodes.travelled[m] = total
        heapq.heappush(heap, (total + nodes.ahead[m], m))
    return count


@njit()
def is_roomy(ground: SearchGround, x: float, y: float) -> bool:
    """Whether the robot stands free at a place however it is turned.

    Kept per cell, to the safe side.
    """
    if not is_free(ground.costs, ground.blocked, x, y):
        return False
    column = int(x)
    row = int(y)
    if ground.room[row, column] == 0:
        reach = ground.reach + math.sqrt(0.5)
        is_open = has_room(ground.costs, column + 0.5, row + 0.5, reach, ground.allow_unknown)
        ground.room[row, column] = ROOMY if is_open else NARROW
    return bool(ground.room[row, column] == ROOMY)


@njit()
def is_motion_free(ground: SearchGround, x: float, y: float, poses: FloatArray) -> bool:
    """Whether the robot stands free at every pose (n, 3) of a motion from (x, y)."""
    pose = np.empty(3)
    for i in range(len(poses)):
        pose[0] = x + poses[i, 0]
        pose[1] = y + poses[i, 1]
        pose[2] = poses[i, 2]
        if is_roomy(ground, pose[0], pose[1]):
            continue
        if not stands_free(
            ground.costs, ground.blocked, ground.footprint, ground.reach, ground.allow_unknown, pose
        ):
            return False
    return True


class Found(NamedTuple):
    """What came of a search."""

    node: int  # the last one of the way; -1: there is none
    nodes: Nodes
    curve: FloatArray  # (m, 3) from there to the goal; empty: it is the goal, or near enough
    iterations: int


@njit()
def search_poses(
    ground: SearchGround,
    motions: Motions,
    start: FloatArray,
    heading: int,
    goal: Goal,
    penalties: Penalties,
    way: Expansion,
) -> Found:
    """A* over motions from a pose (3,) [cells, cells, rad] with its heading's number to a goal."""
    bins, each = motions.ends.shape
    field, waiting = make_field(ground, start, goal)
    # for a literal numba would compile what takes it once more
    count = int(np.int64(1))
    nothing = np.empty((0, 3))
    nodes = make_nodes(count << 12)
    nodes.places[0] = start[:2]
    nodes.headings[0] = heading
    nodes.parents[0] = -1
    nodes.by[0] = -1
    nodes.travelled[0] = 0.0
    nodes.ahead[0] = way_to_goal(ground, field, waiting, penalties.cost, start[0], start[1])
    first = key_of(ground, start[0], start[1], heading, bins)
    at = slot(nodes.keys, first)
    nodes.keys[at] = first
    nodes.numbers[at] = 0
    heap = [(nodes.ahead[0], 0)]
    nearest = math.inf
    best = -1
    until_curve = 0.0
    iterations = 0
    approaching = 0
    while len(heap) > 0 and iterations < goal.max_iterations and nodes.ahead[0] < math.inf:
        _, n = heapq.heappop(heap)
        if nodes.is_done[n]:
            continue
        nodes.is_done[n] = True
        iterations += 1
        x = nodes.places[n, 0]
        y = nodes.places[n, 1]
        b = nodes.headings[n]
        if int(x) == int(goal.pose[0]) and int(y) == int(goal.pose[1]) and b == goal.heading:
            return Found(n, nodes, nothing, iterations)
        if nodes.ahead[n] < nearest:
            nearest = nodes.ahead[n]
            best = n
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

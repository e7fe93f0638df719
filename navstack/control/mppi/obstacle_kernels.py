"""Inner loops of the critics that look at the costmap."""

import math

import numpy as np
import numpy.typing as npt

from navstack.control.footprint_cost import outline_cost, walk_outline
from navstack.control.mppi.body import OUTLINE_SLACK, CollisionBody, clearance
from navstack.control.mppi.rollouts import MppiRollouts
from navstack.costmap.costmap import (
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Grid,
)
from navstack.jit import njit
from navstack.types import BoolArray, ByteArray, ByteMatrix, Float32Array, FloatArray, IntArray

CellArray = npt.NDArray[np.int32]
_CELLS = (0.0, 0.0, 1.0)  # the grid of places that are given in cells


@njit()
def pose_costs(
    x: Float32Array,
    y: Float32Array,
    costs: ByteArray,
    frame: tuple[np.float32, np.float32, np.float32],
    cells: CellArray,
    found: ByteArray,
) -> None:
    """Find the costs (n,) of the cells under points (n,); NO_INFORMATION off the map.

    ``frame``: x and y of the costmap's origin [m], and cells per [m]; ``cells`` (n,) receives their
    indices in the flattened costmap, -1 off the map.
    """
    height = np.int32(costs.shape[0])
    width = np.int32(costs.shape[1])
    zero = np.float32(0.0)
    outside = np.int32(-1)
    origin_x, origin_y, scale = frame
    for b in range(len(cells)):
        fx = (x[b] - origin_x) * scale
        fy = (y[b] - origin_y) * scale
        inside = (fx >= zero) & (fy >= zero) & (fx < np.float32(width)) & (fy < np.float32(height))
        cell = np.int32(fy) * width + np.int32(fx)
        cells[b] = cell if inside else outside
    flat = costs.reshape(-1)
    for b in range(len(cells)):
        found[b] = NO_INFORMATION
        if cells[b] >= 0:
            found[b] = flat[cells[b]]


@njit()
def is_collision(cost: int, uses_outline: bool, tracks_unknown: bool) -> bool:
    """Whether a cost under outline or centre means collision (``CostCritic::inCollision``)."""
    if cost == INSCRIBED_INFLATED_OBSTACLE:
        return not uses_outline
    return cost == LETHAL_OBSTACLE or (cost == NO_INFORMATION and not tracks_unknown)


@njit()
def _in_reach(
    t: int,
    rollouts: MppiRollouts,
    found: ByteArray,
    check_from: int,
    hits: BoolArray,
    room: Float32Array,
    seen: IntArray,
    scale: float,
    radius: float,
    asked: CellArray,
) -> int:
    """Put the trajectories that may touch something at their poses ``t`` into ``asked``.

    Returns how many there are. The others are free in the middle, have collided, or have not left
    their ``room`` [cells] since they were looked at. ``scale``: cells per [m]; ``radius``: [cells].
    """
    x = rollouts.x
    y = rollouts.y
    yaw = rollouts.yaw
    count = 0
    for b in range(len(found)):
        asked[count] = b
        count += (found[b] >= check_from) & (not hits[b])
    left = 0
    for i in range(count):
        b = asked[i]
        dx = x[t, b] - x[seen[b], b]
        dy = y[t, b] - y[seen[b], b]
        turned = yaw[t, b] - yaw[seen[b], b]
        asked[left] = b
        left += not math.sqrt(dx * dx + dy * dy) * scale + abs(turned) * radius <= room[b]
    return left


@njit()
def touch_outlines(
    t: int,
    rollouts: MppiRollouts,
    found: ByteArray,
    check_from: int,
    costs: ByteArray,
    grid: Grid,
    body: CollisionBody,
    has_unknown: bool,
    room: Float32Array,
    seen: IntArray,
    hits: BoolArray,
) -> None:
    """Add to ``hits`` (B,) the trajectories whose outlines collide at their poses ``t``, of (T, B).

    Only trajectories whose centre costs, ``found``, are ``check_from`` or more are looked at. Each
    look tells how far the body may move before it can touch anything: ``room`` in cells from the
    pose ``seen``; both are updated. Every test is made for all bodies before the next test, without
    branches: the processor would often predict them wrongly.
    """
    x = rollouts.x
    y = rollouts.y
    cosine = rollouts.cosine
    sine = rollouts.sine
    corners = body.corners
    circles = body.circles
    radius = body.radius
    reach = body.reach
    height, width = costs.shape
    scale = 1.0 / grid[2]
    asked = np.empty(len(found) + 1, dtype=np.int32)
    count = _in_reach(t, rollouts, found, check_from, hits, room, seen, scale, radius, asked)
    left = 0
    for i in range(count):
        b = asked[i]
        cx = (x[t, b] - grid[0]) * scale
        cy = (y[t, b] - grid[1]) * scale
        seen[b] = t
        room[b] = np.float32(-1.0)
        if not has_unknown:
            room[b] = clearance(
                costs, cx, cy, cosine[t, b], sine[t, b], circles, body.free_radius, radius, reach
            )
        asked[left] = b
        left += room[b] < np.float32(0.0)
    for i in range(left):
        b = asked[i]
        cx = (x[t, b] - grid[0]) * scale
        cy = (y[t, b] - grid[1]) * scale
        worst = walk_outline(costs, _CELLS, corners, cx, cy, cosine[t, b], sine[t, b], True)
        hits[b] = is_collision(worst, True, body.tracks_unknown)
        if not has_unknown:
            edge = min(min(cx, width - cx), min(cy, height - cy)) - radius
            room[b] = min(edge, reach[worst] - OUTLINE_SLACK)


@njit()
def _add_costs(
    found: ByteArray,
    near: np.float32,
    critical: np.float32,
    share: np.float32,
    scores: Float32Array,
) -> None:
    """Add costs (n,) to scores: ``critical`` from ``near`` on, a ``share`` of them below it."""
    for b in range(len(found)):
        cost = np.float32(found[b])
        scores[b] += critical if cost >= near else cost * share


@njit(ahead=True)
def cost_scores(
    rollouts: MppiRollouts,
    step: int,
    costs: ByteMatrix,
    grid: Grid,
    body: CollisionBody,
    has_unknown: bool,
    near_collision_cost: int,
    critical_cost: np.float32,
    collision_cost: np.float32,
    repels: bool,
) -> tuple[Float32Array, BoolArray]:
    """Sums (B,) of the costs under every ``step``-th pose (T, B), and which trajectories collide.

    After ``cost_critic.cpp``, which looks at T // ``step`` poses; here it is one at least. A pose
    at ``near_collision_cost`` or more counts ``critical_cost``, a trajectory that collides
    ``collision_cost`` in all. Other poses count only where obstacles repel, ``repels``. Free space
    costs nothing.
    """
    steps, count = rollouts.x.shape
    scores = np.zeros(count, dtype=np.float32)
    hits = np.zeros(count, dtype=np.bool_)
    frame = (np.float32(grid[0]), np.float32(grid[1]), np.float32(1.0 / grid[2]))
    cells = np.empty(count, dtype=np.int32)
    found = np.empty(count, dtype=np.uint8)
    room = np.full(count, np.float32(-1.0))
    seen = np.zeros(count, dtype=np.int64)
    near = np.float32(max(near_collision_cost, 1))
    share = np.float32(repels)
    look_from = int(math.ceil(max(body.check_from, 1.0)))
    for t in range(0, max(steps // step, 1) * step, step):
        pose_costs(rollouts.x[t], rollouts.y[t], costs, frame, cells, found)
        _add_costs(found, near, critical_cost, share, scores)
        if not body.uses_outline:
            for b in range(count):
                if found[b] >= INSCRIBED_INFLATED_OBSTACLE:
                    hits[b] |= is_collision(found[b], False, body.tracks_unknown)
            continue
        touch_outlines(
            t, rollouts, found, look_from, costs, grid, body, has_unknown, room, seen, hits
        )
    for b in range(count):
        if hits[b]:
            scores[b] = collision_cost
    return scores, hits


@njit()
def obstacle_scores(
    rollouts: MppiRollouts,
    costs: ByteArray,
    grid: Grid,
    body: CollisionBody,
    distances: FloatArray,
    inscribed_radius: float,
    margin: float,
    extent: float,
) -> tuple[Float32Array, Float32Array, BoolArray]:
    """How far trajectories (T, B) reach into ``margin`` and ``extent`` [m], and which collide.

    After ``obstacles_critic.cpp``. ``distances`` (256,) [m] from the centre to the nearest obstacle
    by cost. An ``extent`` of inf: nothing is known of distances; of -inf: obstacles do not repel.
    """
    x = rollouts.x
    y = rollouts.y
    cosine = rollouts.cosine
    sine = rollouts.sine
    steps, count = x.shape
    near = np.zeros(count, dtype=np.float32)
    repulsion = np.zeros(count, dtype=np.float32)
    hits = np.zeros(count, dtype=np.bool_)
    frame = (np.float32(grid[0]), np.float32(grid[1]), np.float32(1.0 / grid[2]))
    cells = np.empty(count, dtype=np.int32)
    found = np.empty(count, dtype=np.uint8)
    everywhere = body.uses_outline and body.check_from < 1.0
    for t in range(steps):
        pose_costs(x[t], y[t], costs, frame, cells, found)
        for b in range(count):
            cost = int(found[b])
            if hits[b] or (cost == 0 and not everywhere):
                continue
            by_outline = body.uses_outline and cells[b] >= 0 and cost >= body.check_from
            if by_outline:
                yaw = math.atan2(sine[t, b], cosine[t, b])
                cost = outline_cost(costs, grid, body.footprint, x[t, b], y[t, b], yaw)
                if cost == 0:
                    continue
            if is_collision(cost, body.uses_outline, body.tracks_unknown):
                hits[b] = True
                continue
            if extent == math.inf:
                continue
            distance = distances[cost] - inscribed_radius * (not by_outline)
            if distance < margin:
                near[b] += np.float32(margin - distance)
            if extent > -math.inf:
                repulsion[b] += np.float32(extent - distance)
    return near, repulsion, hits

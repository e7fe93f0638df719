"""Inner loops of the critics that look at the costmap."""

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from navstack.control.footprint_cost import outline_cost
from navstack.control.mppi.body import OUTLINE_SLACK, Body, clearance, outline_worst
from navstack.costmap.costmap import FREE_SPACE, INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, NO_INFORMATION
from navstack.types import BoolArray, ByteArray, Float32Array, FloatArray

CellArray = npt.NDArray[np.int32]
Grid = tuple[float, float, float]  # origin x, origin y, resolution in [m], as seen from the robot


@njit(cache=True)
def pose_costs(
    x: Float32Array,
    y: Float32Array,
    costs: ByteArray,
    origin_x: np.float32,
    origin_y: np.float32,
    scale: np.float32,
    cells: CellArray,
    found: ByteArray,
) -> None:
    """Find the costs (n,) of the cells under points (n,); NO_INFORMATION off the map.

    ``scale``: cells per [m]; ``cells`` (n,) is room for what is computed on the way.
    """
    height, width = np.int32(costs.shape[0]), np.int32(costs.shape[1])
    _cells(x, y, origin_x, origin_y, scale, width, height, cells)
    flat = costs.reshape(-1)
    for b in range(len(cells)):
        found[b] = NO_INFORMATION if cells[b] < 0 else flat[cells[b]]


@njit(cache=True)
def _cells(
    x: Float32Array,
    y: Float32Array,
    origin_x: np.float32,
    origin_y: np.float32,
    scale: np.float32,
    width: np.int32,
    height: np.int32,
    cells: CellArray,
) -> None:
    """Indices (n,) of the cells under points (n,) in the flattened costmap; -1 off the map."""
    zero, outside = np.float32(0.0), np.int32(-1)
    for b in range(len(cells)):
        fx, fy = (x[b] - origin_x) * scale, (y[b] - origin_y) * scale
        inside = (fx >= zero) & (fy >= zero) & (fx < np.float32(width)) & (fy < np.float32(height))
        cell = np.int32(fy) * width + np.int32(fx)
        cells[b] = cell if inside else outside


@njit(cache=True)
def is_collision(cost: int, uses_outline: bool, tracks_unknown: bool) -> bool:
    """Whether a cost under the robot, outline or centre, means collision (``CostCritic::inCollision``)."""
    if cost == INSCRIBED_INFLATED_OBSTACLE:
        return not uses_outline
    return cost == LETHAL_OBSTACLE or (cost == NO_INFORMATION and not tracks_unknown)


@njit(cache=True)
def under_outlines(
    found: ByteArray,
    hits: BoolArray,
    check_from: float,
    x: Float32Array,
    y: Float32Array,
    cosine: Float32Array,
    sine: Float32Array,
    costs: ByteArray,
    grid: Grid,
    corners: FloatArray,
    circles: FloatArray,
    free_radius: float,
    radius: float,
    reach: FloatArray,
    has_unknown: bool,
    room: Float32Array,
) -> ByteArray:
    """The greatest costs (B,) under the outlines of bodies, where those of their centres, ``found``, ask for a look.

    FREE_SPACE stands for any cost that is no obstacle. ``hits``: bodies not to look at; ``room`` is renewed; the rest
    is that of :class:`Body`, whose arrays are faster one by one.
    """
    worst = found.copy()
    height, width = costs.shape
    scale = 1.0 / grid[2]
    for b in range(len(found)):
        if found[b] == FREE_SPACE or found[b] < check_from or hits[b]:
            continue
        worst[b] = FREE_SPACE
        if room[b] >= np.float32(0.0):
            continue
        cx, cy = (x[b] - grid[0]) * scale, (y[b] - grid[1]) * scale
        if not has_unknown:
            room[b] = clearance(costs, cx, cy, cosine[b], sine[b], circles, free_radius, radius, reach)
        if room[b] < np.float32(0.0):
            worst[b] = outline_worst(costs, cx, cy, cosine[b], sine[b], corners)
            if not has_unknown:
                edge = min(min(cx, width - cx), min(cy, height - cy)) - radius
                room[b] = min(edge, reach[worst[b]] - OUTLINE_SLACK)
    return worst


@njit(cache=True)
def _use_up(
    x: Float32Array,
    last_x: Float32Array,
    y: Float32Array,
    last_y: Float32Array,
    yaw: Float32Array,
    last_yaw: Float32Array,
    scale: np.float32,
    radius: np.float32,
    room: Float32Array,
) -> None:
    """Subtract from ``room`` (n,) what points within ``radius`` of the base have moved at most, in cells."""
    for b in range(len(room)):
        dx, dy = x[b] - last_x[b], y[b] - last_y[b]
        room[b] -= math.sqrt(dx * dx + dy * dy) * scale + abs(yaw[b] - last_yaw[b]) * radius


@njit(cache=True)
def cost_scores(
    x: Float32Array,
    y: Float32Array,
    yaw: Float32Array,
    cosine: Float32Array,
    sine: Float32Array,
    step: int,
    costs: ByteArray,
    grid: Grid,
    body: Body,
    has_unknown: bool,
    near_collision_cost: int,
    critical_cost: np.float32,
    collision_cost: np.float32,
    repels: bool,
) -> tuple[Float32Array, BoolArray]:
    """Sums (B,) of the costs under every ``step``-th pose (T, B), and which trajectories collide (``cost_critic.cpp``).

    A pose at ``near_collision_cost`` or more counts ``critical_cost``, a trajectory that collides ``collision_cost`` in
    all. Others count only if obstacles ``repels``.
    """
    _, corners, circles, free_radius, radius, reach, uses_outline, check_from, tracks_unknown = body
    steps, count = x.shape
    scores = np.zeros(count, dtype=np.float32)
    hits = np.zeros(count, dtype=np.bool_)
    origin_x, origin_y, scale = np.float32(grid[0]), np.float32(grid[1]), np.float32(1.0 / grid[2])
    cells, found = np.empty(count, dtype=np.int32), np.empty(count, dtype=np.uint8)
    room = np.full(count, np.float32(-1.0))  # [cells] that a body may still move before it can touch anything
    for t in range(0, steps, step):
        pose_costs(x[t], y[t], costs, origin_x, origin_y, scale, cells, found)
        worst = found
        if uses_outline:
            if t > 0:
                _use_up(x[t], x[t - step], y[t], y[t - step], yaw[t], yaw[t - step], scale, np.float32(radius), room)
            worst = under_outlines(
                found,
                hits,
                check_from,
                x[t],
                y[t],
                cosine[t],
                sine[t],
                costs,
                grid,
                corners,
                circles,
                free_radius,
                radius,
                reach,
                has_unknown,
                room,
            )
        for b in range(count):
            cost = found[b]
            if cost == 0 or hits[b]:
                continue
            if is_collision(worst[b], uses_outline, tracks_unknown):
                scores[b], hits[b] = collision_cost, True
                continue
            if cost >= near_collision_cost:
                scores[b] += critical_cost
            elif repels:
                scores[b] += np.float32(cost)
    return scores, hits


@njit(cache=True)
def obstacle_scores(
    x: Float32Array,
    y: Float32Array,
    cosine: Float32Array,
    sine: Float32Array,
    costs: ByteArray,
    grid: Grid,
    body: Body,
    distances: FloatArray,
    inscribed_radius: float,
    margin: float,
    extent: float,
) -> tuple[Float32Array, Float32Array, BoolArray]:
    """How far trajectories (T, B) reach into the ``margin`` and into ``extent`` [m], and which collide.

    ``distances`` (256,) [m] from the centre to the nearest obstacle by cost; ``obstacles_critic.cpp``. A ``extent`` of
    inf: nothing is known of distances; of -inf: obstacles do not repel.
    """
    steps, count = x.shape
    near = np.zeros(count, dtype=np.float32)
    repulsion = np.zeros(count, dtype=np.float32)
    hits = np.zeros(count, dtype=np.bool_)
    origin_x, origin_y, scale = np.float32(grid[0]), np.float32(grid[1]), np.float32(1.0 / grid[2])
    cells, found = np.empty(count, dtype=np.int32), np.empty(count, dtype=np.uint8)
    for t in range(steps):
        pose_costs(x[t], y[t], costs, origin_x, origin_y, scale, cells, found)
        for b in range(count):
            cost = int(found[b])
            if cost == 0 or hits[b]:
                continue
            by_outline = body.uses_outline and cost != NO_INFORMATION and cost >= body.check_from
            if by_outline:
                yaw = math.atan2(sine[t, b], cosine[t, b])
                cost = outline_cost(costs, grid[0], grid[1], grid[2], body.footprint, x[t, b], y[t, b], yaw)
                if cost == 0:
                    continue
            if is_collision(cost, body.uses_outline, body.tracks_unknown):
                hits[b] = True
                continue
            if extent == math.inf:
                continue
            distance = distances[cost] - (0.0 if by_outline else inscribed_radius)
            if distance < margin:
                near[b] += np.float32(margin - distance)
            if extent > -math.inf:
                repulsion[b] += np.float32(extent - distance)
    return near, repulsion, hits

"""Walking by the social force model: see :mod:`harness.world.people.social_forces`."""

import math

from harness.task.shortest_paths import line_of_sight
from harness.world.people.edges import Edges, cell_of, keep_inside
from harness.world.people.social_forces import (
    FAR,
    TINY,
    Forces,
    from_edge,
    from_person,
    from_robot,
)
from harness.world.people.walk_kernels import Walks
from navstack.jit import njit
from navstack.types import BoolArray, FloatArray, IntArray

# what somebody needs: nothing, a new goal, a new path to the same goal
BUSY, RESTLESS, LOST = 0, 1, 2

# [m] from the goal from which somebody has arrived; others may stand on the goal itself
_ARRIVAL = 1.0
_CORNER = 0.5  # [m] from a corner of the path from which the next one counts
_LOOK_PERIOD = 0.5  # [s] between looks whether the way to the next corner is still open


@njit()
def walk_among_others(
    dt: float,
    forces: Forces,
    robot: FloatArray,
    aware: BoolArray,
    walks: Walks,
    looks: FloatArray,
    before: FloatArray,
    edges: Edges,
    after: FloatArray,
    needs: IntArray,
) -> int:
    """Move everybody by ``dt``, all from the same instant (semi-implicit Euler).

    Args:
        dt: [s].
        forces: :class:`Forces`.
        robot: (6,) centre x, y [m], cosine and sine of the yaw, vx, vy [m/s]; map frame.
        aware: (n,) who notices the robot.
        walks: where everybody goes. Changed in place.
        looks: (n,) [s] until each looks at the way again. Changed in place.
        before: (n, 4) x, y [m], vx, vy [m/s].
        edges: :class:`Edges` of the walkable area.
        after: (n, 4) output: as ``before``.
        needs: (n,) output: BUSY, RESTLESS or LOST.

    Returns:
        How many are not BUSY.
    """
    number, fastest, speeds = 0, 0.0, walks.speeds
    for i in range(len(speeds)):
        fastest = max(fastest, speeds[i])
    farthest = FAR * forces.person_range + forces.look_ahead * forces.top_speed * fastest
    for i in range(len(speeds)):
        ex, ey = _heading(i, walks, before)
        needs[i] = _need(i, dt, walks, looks, before, edges)
        if needs[i] != BUSY:
            number += 1
        ax, ay = _acceleration(
            i, forces, robot, aware[i], ex, ey, speeds[i], before, farthest, edges
        )
        vx, vy = before[i, 2] + dt * ax, before[i, 3] + dt * ay
        speed, top = math.hypot(vx, vy), forces.top_speed * speeds[i]
        if speed > top:
            vx, vy = vx * top / speed, vy * top / speed
        after[i, 0], after[i, 1], after[i, 2], after[i, 3] = keep_inside(
            before[i, 0], before[i, 1], vx, vy, dt, forces.edge_distance, edges
        )
    return number


@njit()
def _acceleration(
    i: int,
    forces: Forces,
    robot: FloatArray,
    is_aware: bool,
    ex: float,
    ey: float,
    speed: float,
    states: FloatArray,
    farthest: float,
    edges: Edges,
) -> tuple[float, float]:
    """Of person ``i``, heading for (ex, ey) at ``speed`` [m/s], in [m/s2].

    Nobody beyond ``farthest`` [m] matters.
    """
    x, y, vx, vy = states[i, 0], states[i, 1], states[i, 2], states[i, 3]
    ax = (speed * ex - vx) / forces.relaxation_time  # eq. 2
    ay = (speed * ey - vy) / forces.relaxation_time
    for j in range(len(states)):
        if j != i and abs(states[j, 0] - x) < farthest and abs(states[j, 1] - y) < farthest:
            fx, fy = from_person(
                forces, x, y, ex, ey, states[j, 0], states[j, 1], states[j, 2], states[j, 3]
            )
            ax, ay = ax + fx, ay + fy
    fx, fy = from_robot(forces, x, y, vx, vy, ex, ey, robot, is_aware)
    wx, wy = from_edge(forces, x, y, edges)
    return ax + fx + wx, ay + fy + wy


@njit()
def _heading(i: int, walks: Walks, states: FloatArray) -> tuple[float, float]:
    """Unit vector towards the next corner of the path, (0, 0) when standing.

    Counts off corners that are reached.
    """
    points, counts, next_point = walks.points, walks.counts, walks.next_point
    while next_point[i] < counts[i]:
        k = next_point[i]
        dx, dy = points[i, k, 0] - states[i, 0], points[i, k, 1] - states[i, 1]
        distance = math.hypot(dx, dy)
        if distance > (_ARRIVAL if k == counts[i] - 1 else _CORNER):
            return dx / distance, dy / distance
        next_point[i] += 1
    return 0.0, 0.0


@njit()
def _need(
    i: int, dt: float, walks: Walks, looks: FloatArray, states: FloatArray, edges: Edges
) -> int:
    """What person ``i`` needs; see :func:`walk_among_others`."""
    points, next_point, pauses = walks.points, walks.next_point, walks.pauses
    if next_point[i] >= walks.counts[i]:
        pauses[i] -= dt
        return RESTLESS if pauses[i] <= TINY else BUSY
    looks[i] -= dt
    if looks[i] > 0.0:
        return BUSY
    looks[i] += _LOOK_PERIOD
    row, column = cell_of(states[i, 0], states[i, 1], edges)
    corner_row, corner_column = cell_of(
        points[i, next_point[i], 0], points[i, next_point[i], 1], edges
    )
    return BUSY if line_of_sight(edges.walkable, row, column, corner_row, corner_column) else LOST

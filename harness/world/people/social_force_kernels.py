"""The social force model: accelerations of people, and their integration.

Helbing & Molnar 1995 (Phys. Rev. E 51, 4282), equations by their number there. The walls are the
edges of the walkable area, read from a grid of signed distances.
"""

import math
from typing import NamedTuple

from harness.task.shortest_paths import line_of_sight
from harness.world.people.edges import (
    Edges,
    away_from_edge,
    cell_of,
    edge_distance,
    keep_inside,
)
from harness.world.people.params import PedestrianParams
from harness.world.people.walk_kernels import Walks
from navstack.jit import njit, tuple_of
from navstack.types import BoolArray, FloatArray, IntArray

# what somebody needs: nothing, a new goal, a new path to the same goal
BUSY, RESTLESS, LOST = 0, 1, 2

# [m] from the goal from which somebody has arrived; others may stand on the goal itself
_ARRIVAL = 1.0
_CORNER = 0.5  # [m] from a corner of the path from which the next one counts
_LOOK_PERIOD = 0.5  # [s] between looks whether the way to the next corner is still open
_FAR = 10.0  # [-] ranges of the potential beyond which it is not felt: exp(-10)
_TINY = 1e-6  # [m]
BY_SIGHT_ANGLE = -1.0  # [-] an anisotropy that says: weigh others by the sight angle


class Forces(NamedTuple):
    """Constants of the model, SI units; :class:`SocialForceParams` explains them."""

    relaxation_time: float
    person_strength: float
    person_range: float
    look_ahead: float
    wall_strength: float
    wall_range: float
    sight_cosine: float
    unseen_weight: float
    top_speed: float
    body_stiffness: float
    radius: float
    robot_half_length: float
    robot_half_width: float
    robot_excess: float  # [m] by which the circle around the robot exceeds a person's
    edge_distance: float  # [m] from the edge of the walkable area that nobody goes below
    anisotropy: float  # [-] negative: by the sight angle
    robot_strength: float
    robot_range: float
    robot_is_round: bool  # felt alike on all sides


def force_constants(
    people: PedestrianParams, robot_half_size: tuple[float, float], agent_radius: float
) -> Forces:
    """The constants of :func:`walk_among_others`.

    Args:
        people: parameters of the people.
        robot_half_size: half length and half width [m] of the robot's body.
        agent_radius: [m] that the paths keep from the edges.
    """
    params = people.social_force
    anisotropy = params.anisotropy
    if anisotropy is None:
        anisotropy = BY_SIGHT_ANGLE
    robot_strength, robot_range = params.robot_strength, params.robot_range
    is_round = robot_strength is not None
    if robot_strength is None or robot_range is None:
        robot_strength, robot_range = params.person_strength, params.person_range
    half_length, half_width = robot_half_size
    forces: Forces = tuple_of(
        Forces,
        params,
        sight_cosine=math.cos(0.5 * min(params.sight_angle, 2.0 * math.pi)),
        radius=people.radius,
        robot_half_length=half_length,
        robot_half_width=half_width,
        robot_excess=math.hypot(half_length, half_width) - people.radius,
        edge_distance=min(people.radius, agent_radius),
        anisotropy=anisotropy,
        robot_strength=robot_strength,
        robot_range=robot_range,
        robot_is_round=is_round,
    )
    return forces


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
    farthest = _FAR * forces.person_range + forces.look_ahead * forces.top_speed * fastest
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
        return RESTLESS if pauses[i] <= _TINY else BUSY
    looks[i] -= dt
    if looks[i] > 0.0:
        return BUSY
    looks[i] += _LOOK_PERIOD
    row, column = cell_of(states[i, 0], states[i, 1], edges)
    corner_row, corner_column = cell_of(
        points[i, next_point[i], 0], points[i, next_point[i], 1], edges
    )
    return BUSY if line_of_sight(edges.walkable, row, column, corner_row, corner_column) else LOST


@njit()
def _is_felt(forces: Forces, rx: float, ry: float, ovx: float, ovy: float) -> bool:
    """Whether a robot that is (rx, ry) [m] away and drives at (ovx, ovy) [m/s] can matter."""
    reach = forces.look_ahead * (abs(ovx) + abs(ovy)) + _FAR * (forces.robot_range + forces.radius)
    return abs(rx) < reach and abs(ry) < reach


@njit()
def from_person(
    forces: Forces,
    x: float,
    y: float,
    ex: float,
    ey: float,
    ox: float,
    oy: float,
    ovx: float,
    ovy: float,
) -> tuple[float, float]:
    """Acceleration [m/s2] of somebody at (x, y) by another at (ox, oy).

    They head for (ex, ey) and (ovx, ovy). The ellipse of equations 3 and 4 covers where the other
    walks during ``look_ahead``. Bodies that overlap are pressed apart.
    """
    rx, ry = x - ox, y - oy
    fx, fy = _elliptical(forces, forces.person_strength, forces.person_range, rx, ry, ovx, ovy, 0.0)
    weight = _weight(forces, ex, ey, fx, fy)
    fx, fy = weight * fx, weight * fy
    distance = math.hypot(rx, ry)
    overlap = 2.0 * forces.radius - distance
    if overlap > 0.0 and distance > _TINY:
        fx += forces.body_stiffness * overlap * rx / distance
        fy += forces.body_stiffness * overlap * ry / distance
    return fx, fy


@njit()
def _weight(forces: Forces, ex: float, ey: float, fx: float, fy: float) -> float:
    """Of the force (fx, fy) on somebody who heads for (ex, ey): who is not seen counts less.

    By the sight angle (eq. 8), or smoothly (Johansson, Helbing & Shukla 2007, Adv. Complex Syst.
    10, eq. 9).
    """
    strength = math.hypot(fx, fy)
    ahead = ex * -fx + ey * -fy
    if forces.anisotropy < 0.0:
        return forces.unseen_weight if ahead < strength * forces.sight_cosine else 1.0
    if strength < _TINY:
        return 1.0
    return forces.anisotropy + (1.0 - forces.anisotropy) * 0.5 * (1.0 + ahead / strength)


@njit()
def _elliptical(
    forces: Forces,
    potential: float,
    reach: float,
    rx: float,
    ry: float,
    ovx: float,
    ovy: float,
    excess: float,
) -> tuple[float, float]:
    """Minus the gradient of V(b) at (rx, ry) [m] from the other.

    V is ``potential`` [m2/s2] that falls within ``reach`` [m]. The other is ``excess`` [m] thicker
    than a person. Exactly ahead of the other, where the gradient jumps, it points to the other's
    left: two who meet keep right.
    """
    sx, sy = forces.look_ahead * ovx, forces.look_ahead * ovy
    d1, d2 = math.hypot(rx, ry), math.hypot(rx - sx, ry - sy)
    both = d1 + d2
    squared = both * both - sx * sx - sy * sy
    b = 0.5 * math.sqrt(max(squared, 0.0))
    strength = potential / reach * math.exp(-max(b - excess, 0.0) / reach)
    if b < _TINY or d1 < _TINY or d2 < _TINY:
        ahead = math.hypot(sx, sy)
        return (-strength * sy / ahead, strength * sx / ahead) if ahead > _TINY else (strength, 0.0)
    scale = strength * both / (4.0 * b)
    return scale * (rx / d1 + (rx - sx) / d2), scale * (ry / d1 + (ry - sy) / d2)


@njit()
def from_robot(
    forces: Forces,
    x: float,
    y: float,
    vx: float,
    vy: float,
    ex: float,
    ey: float,
    robot: FloatArray,
    is_aware: bool,
) -> tuple[float, float]:
    """Acceleration [m/s2] of somebody at (x, y), velocity (vx, vy), by the robot.

    It counts as a person of its size with a rectangular body. The ellipse covers where it goes
    relative to the person (Johansson, Helbing & Shukla 2007, Adv. Complex Syst. 10, "elliptical
    specification II"): so people walk around a robot that stands, which by its own velocity alone
    they would only notice by walking into it. Who does not notice it is only pushed by its body.
    """
    rx, ry = x - robot[0], y - robot[1]
    if not _is_felt(forces, rx, ry, robot[4] - vx, robot[5] - vy):
        return 0.0, 0.0
    fx, fy = 0.0, 0.0
    if is_aware:
        potential, reach, excess = forces.robot_strength, forces.robot_range, forces.robot_excess
        fx, fy = _elliptical(forces, potential, reach, rx, ry, robot[4] - vx, robot[5] - vy, excess)
        weight = 1.0 if forces.robot_is_round else _weight(forces, ex, ey, fx, fy)
        fx, fy = weight * fx, weight * fy
    cos, sin = robot[2], robot[3]
    along, across = cos * rx + sin * ry, -sin * rx + cos * ry
    half_length, half_width = forces.robot_half_length, forces.robot_half_width
    dx = along - min(max(along, -half_length), half_length)  # from the nearest point of the body
    dy = across - min(max(across, -half_width), half_width)
    distance = math.hypot(dx, dy)
    if distance >= _TINY:
        dx, dy = dx / distance, dy / distance
        overlap = forces.radius - distance
    elif half_length - abs(along) < half_width - abs(across):  # inside: out by the nearest side
        dx, dy = math.copysign(1.0, along), 0.0
        overlap = forces.radius + half_length - abs(along)
    else:
        dx, dy = 0.0, math.copysign(1.0, across)
        overlap = forces.radius + half_width - abs(across)
    push = forces.body_stiffness * max(overlap, 0.0)
    return fx + push * (cos * dx - sin * dy), fy + push * (sin * dx + cos * dy)


@njit()
def from_edge(forces: Forces, x: float, y: float, edges: Edges) -> tuple[float, float]:
    """Acceleration [m/s2] of somebody at (x, y) away from the nearest edge (eq. 5)."""
    distance = edge_distance(x, y, edges)
    if distance > 20.0 * forces.wall_range:
        return 0.0, 0.0
    gx, gy = away_from_edge(x, y, edges)
    push = (
        forces.wall_strength / forces.wall_range * math.exp(-max(distance, 0.0) / forces.wall_range)
    )
    return push * gx, push * gy

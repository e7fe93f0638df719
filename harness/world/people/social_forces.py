"""The forces of the social force model, as accelerations of people.

Helbing & Molnar 1995 (Phys. Rev. E 51, 4282), equations by their number there. The walls are the
edges of the walkable area, read from a grid of signed distances.
"""

import math
from typing import NamedTuple

from harness.world.people.edges import Edges, away_from_edge, edge_distance
from harness.world.people.params import PedestrianParams
from navstack.jit import njit, tuple_of
from navstack.types import FloatArray

FAR = 10.0  # [-] ranges of the potential beyond which it is not felt: exp(-10)
TINY = 1e-6  # [m]
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
def _is_felt(forces: Forces, rx: float, ry: float, ovx: float, ovy: float) -> bool:
    """Whether a robot that is (rx, ry) [m] away and drives at (ovx, ovy) [m/s] can matter."""
    reach = forces.look_ahead * (abs(ovx) + abs(ovy)) + FAR * (forces.robot_range + forces.radius)
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
    if overlap > 0.0 and distance > TINY:
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
    if strength < TINY:
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
    if b < TINY or d1 < TINY or d2 < TINY:
        ahead = math.hypot(sx, sy)
        return (-strength * sy / ahead, strength * sx / ahead) if ahead > TINY else (strength, 0.0)
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
    if distance >= TINY:
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

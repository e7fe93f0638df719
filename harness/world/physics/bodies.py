"""The bodies of the physics server: the robot and the obstacles near it.

All bodies are rigid bodies in maximal coordinates, three times as fast here as PyBullet's
multi-bodies. The server has no gravity; the robot's weight is applied by its drive, and nothing
else falls. Collision groups let only pairs with the robot be tested.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from harness.world.map.scene import Obstacle, Scene
from harness.world.physics.contacts import Touched, Vector
from harness.world.physics.engine import bullet, set_dynamics
from harness.world.physics.robot import RobotParams
from harness.world.physics.touch_kernels import find_near, may_touch
from harness.world.truth import Partner
from navstack.types import FloatArray, IntArray, Pose2D

ROBOT, FIXED, PERSON = 1, 2, 4  # collision groups

_WALL = 0.05  # [m] thickness of the walls that stand for a polygon's edges
_RECTANGLE_TOLERANCE = 1e-6  # [-] cosine of the corners


class StaticIndex:
    """The obstacles of a scene, searchable by place."""

    def __init__(self, obstacles: tuple[Obstacle, ...]) -> None:
        self.obstacles = obstacles
        polygons = [obstacle.polygon for obstacle in obstacles]
        self._corners, self._first = _joined(polygons)
        self._boxes = np.array(
            [(*polygon.min(axis=0), *polygon.max(axis=0)) for polygon in polygons]
        ).reshape(-1, 4)
        self._found = np.empty(len(polygons), dtype=np.int64)

    def near(self, x: float, y: float, radius: float) -> tuple[list[int], float]:
        """Obstacles within ``radius`` [m]: their numbers, ascending, and the least distance [m]."""
        count, nearest = find_near(
            x,
            y,
            radius,
            self._corners,
            self._first,
            self._boxes,
            self._found,
        )
        return self._found[:count].tolist(), nearest


def _joined(polygons: list[FloatArray]) -> tuple[FloatArray, IntArray]:
    """The corners (M, 2) of all polygons, and where those of each begin (k + 1,)."""
    first: IntArray = np.cumsum([0, *map(len, polygons)])
    return np.concatenate([np.empty((0, 2)), *polygons]), first


@lru_cache(maxsize=4)
def static_index(scene: Scene) -> StaticIndex:
    """The index of a scene, made once per process."""
    return StaticIndex(scene.obstacles)


class NearObstacles:
    """Bodies of the obstacles near the robot; far ones would cost time in every step."""

    ACTIVE_RADIUS = 3.5  # [m] around the body's centre, of a robot that is not long
    BEYOND_REACH = 2.0  # [m] around any robot
    REFRESH_DISTANCE = 1.0  # [m] the robot moves before the choice is made anew
    # [m] between bodies that certainly do not touch in a step: what is closed in it, and a wall's
    # excess
    MARGIN = 0.15

    def __init__(
        self,
        client: int,
        index: StaticIndex,
        friction: float,
        robot: RobotParams,
    ) -> None:
        self._client = client
        self._half_size = robot.half_size
        # [m] of the body's middle from its centre of mass
        self._ahead, self._aside = robot.center[0] - robot.center_of_mass_x, robot.center[1]
        self._radius = max(self.ACTIVE_RADIUS, robot.reach + self.BEYOND_REACH)
        self._index = index
        self._friction = friction
        self.touchable: dict[int, Touched] = {}  # body -> what it is
        self._active: dict[int, int] = {}  # obstacle -> body
        # obstacle -> shape; PyBullet keeps shapes until its server is emptied
        self._prisms: dict[int, Prism] = {}
        self._center = (math.inf, math.inf)  # [m] where the choice was made
        self._clearance = 0.0  # [m] of the nearest obstacle from there

    def follow(self, x: float, y: float, reach: float) -> float:
        """Renew the choice for a robot at (x, y) if it is due.

        Returns:
            How far [m] it may go until the choice is due anew or something can be within ``reach``
            [m] of it; negative: something can be already.
        """
        moved = math.hypot(x - self._center[0], y - self._center[1])
        if moved > self.REFRESH_DISTANCE:
            self._renew(x, y)
            moved = 0.0
        free = self._clearance - moved - reach
        if free >= 0.0:
            free = min(free, self.REFRESH_DISTANCE - moved)
        return free

    def _renew(self, x: float, y: float) -> None:
        wanted, nearest = self._index.near(x, y, self._radius)
        self._center, self._clearance = (x, y), min(nearest, self._radius)
        kept = set(wanted)
        for number in [number for number in self._active if number not in kept]:
            body = self._active.pop(number)
            del self.touchable[body]
            bullet.removeBody(body, physicsClientId=self._client)
        for number in wanted:
            if number not in self._active:
                self._add(number)
        self._corners, self._first = _joined(
            [self._index.obstacles[number].polygon for number in wanted]
        )

    def can_touch(self, x: float, y: float, yaw: float) -> bool:
        """Whether a level robot may touch something in the coming step.

        Args:
            x: of its centre of mass [m].
            y: the same [m].
            yaw: [rad].
        """
        cos, sin = math.cos(yaw), math.sin(yaw)
        middle = (
            x + cos * self._ahead - sin * self._aside,
            y + sin * self._ahead + cos * self._aside,
        )
        return bool(
            may_touch(*middle, cos, sin, *self._half_size, self.MARGIN, self._corners, self._first)
        )

    def _add(self, number: int) -> None:
        obstacle = self._index.obstacles[number]
        if number not in self._prisms:
            self._prisms[number] = make_prism(self._client, obstacle.polygon, obstacle.height)
        prism = self._prisms[number]
        body = fixed_body(self._client, prism.shape, prism.center, self._friction)
        self._active[number] = body
        self.touchable[body] = Touched(Partner.PROPERTY, obstacle.kind, number)


def add_robot(client: int, robot: RobotParams) -> int:
    """The robot: a box above four small spheres, which carry it exactly level.

    The spheres are the treads of wheels and casters. They slide without friction; the drive pushes.
    """
    a, b = robot.half_size
    x, y, z = robot.center_of_mass
    foot, low = robot.foot_radius, robot.ground_clearance
    half_height = 0.5 * (robot.height - low)
    feet = [(fx - x, fy - y, foot - z) for fx, fy in robot.feet]
    box = (robot.center[0] - x, robot.center[1] - y, low + half_height - z)
    shape = bullet.createCollisionShapeArray(
        [bullet.GEOM_BOX] + [bullet.GEOM_SPHERE] * 4,
        radii=[0.0] + [foot] * 4,
        halfExtents=[(a, b, half_height)] + [(0.0, 0.0, 0.0)] * 4,
        collisionFramePositions=[box, *feet],
        physicsClientId=client,
    )
    body = rigid_body(client, robot.mass, shape, (0.0, 0.0, z))
    make_heavy(client, body, robot.mass, robot.inertia, robot.body_friction)
    bullet.setCollisionFilterGroupMask(body, -1, ROBOT, FIXED | PERSON, physicsClientId=client)
    return body


def put_robot(client: int, body: int, robot: RobotParams, pose: Pose2D, level: float) -> None:
    """Set the robot's body with its base frame at ``pose`` on ground at ``level`` [m]."""
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    cx, cy, cz = robot.center_of_mass
    x = pose.x + cos * cx - sin * cy
    y = pose.y + sin * cx + cos * cy
    orientation = (0.0, 0.0, math.sin(0.5 * pose.yaw), math.cos(0.5 * pose.yaw))
    bullet.resetBasePositionAndOrientation(body, (x, y, cz + level), orientation, client)


@dataclass(frozen=True, slots=True)
class Prism:
    """The collision shape of an obstacle."""

    shape: int  # number in the physics server
    center: tuple[float, float, float]  # [m] where its body goes, map frame


def make_prism(client: int, polygon: FloatArray, height: float) -> Prism:
    """The shape of an upright prism over a convex counter-clockwise polygon (N, 2).

    A rectangle is one box. Any other polygon is a ring of thin boxes along its edges, because
    PyBullet finds all contact points of two boxes at once, but those of other shapes one per step.
    At a sharp corner a wall may stick out by its thickness of 0.05 m.
    """
    x, y = polygon.mean(axis=0)
    boxes = _ring(polygon, height)
    if is_rectangle(polygon):
        boxes = [_rectangle(polygon, height)]
    shape = bullet.createCollisionShapeArray(
        [bullet.GEOM_BOX] * len(boxes),
        halfExtents=[half for half, _, _ in boxes],
        collisionFramePositions=[(px - x, py - y, 0.0) for _, (px, py), _ in boxes],
        collisionFrameOrientations=[
            (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw)) for _, _, yaw in boxes
        ],
        physicsClientId=client,
    )
    return Prism(int(shape), (float(x), float(y), 0.5 * height))


def is_rectangle(polygon: FloatArray) -> bool:
    """Whether a polygon (N, 2) has four right angles."""
    if len(polygon) != 4:
        return False
    edges = np.roll(polygon, -1, axis=0) - polygon
    edges = edges / np.hypot(*edges.T)[:, None]
    return bool(
        (np.abs((edges * np.roll(edges, -1, axis=0)).sum(axis=1)) < _RECTANGLE_TOLERANCE).all()
    )


# half extents [m], centre [m], yaw [rad]
_Box = tuple[tuple[float, float, float], tuple[float, float], float]


def _rectangle(polygon: FloatArray, height: float) -> _Box:
    along, across = polygon[1] - polygon[0], polygon[2] - polygon[1]
    half = (0.5 * float(np.hypot(*along)), 0.5 * float(np.hypot(*across)), 0.5 * height)
    x, y = polygon.mean(axis=0)
    return half, (float(x), float(y)), math.atan2(along[1], along[0])


def _ring(polygon: FloatArray, height: float) -> list[_Box]:
    boxes: list[_Box] = []
    for start, end in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        edge = end - start
        length = float(np.hypot(*edge))
        inwards = np.array((-edge[1], edge[0])) / length
        x, y = 0.5 * (start + end) + 0.5 * _WALL * inwards
        half = (0.5 * length, 0.5 * _WALL, 0.5 * height)
        boxes.append((half, (float(x), float(y)), math.atan2(edge[1], edge[0])))
    return boxes


def rigid_body(client: int, mass: float, shape: int, position: Vector) -> int:
    """A body of ``mass`` [kg] at ``position`` [m]."""
    body = bullet.createMultiBody(
        mass,
        shape,
        basePosition=position,
        useMaximalCoordinates=1,
        physicsClientId=client,
    )
    return int(body)


def fixed_body(
    client: int,
    shape: int,
    position: tuple[float, float, float],
    friction: float,
) -> int:
    """A body that nothing moves and only the robot touches."""
    body = rigid_body(client, 0.0, shape, position)
    bullet.changeDynamics(body, -1, lateralFriction=friction, physicsClientId=client)
    bullet.setCollisionFilterGroupMask(body, -1, FIXED, ROBOT, physicsClientId=client)
    return body


def make_heavy(client: int, body: int, mass: float, inertia: Vector, friction: float) -> None:
    """Set a body's mass [kg], its moments of inertia [kg m2] and its friction [-]."""
    # PyBullet sets an inertia only together with a mass.
    set_dynamics(client, body, mass=mass, localInertiaDiagonal=inertia, lateralFriction=friction)

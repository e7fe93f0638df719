"""Popcorn in a bucket that stands loose on the robot, as the published code spawns it.

The bucket is a rigid body on a deck, the robot's body up to there, which is moved as
:mod:`harness.world.cargo.cargo` moves a fixed bucket. Its sides keep the directions of the map, not
the robot's, when it is put there. It slides where friction does not hold it, tips over, and may
fall off the deck onto the ground, where the robot leaves it behind or pushes it along. Pieces count
as published: those within the box, with sides along the map's axes, about the bucket wherever it
lies. Source of both: CostNav @ 144b293, ``evaluation/food.py``.

Simplifications: walls and floor are thick for the solver's sake, and weigh as thin ones of one
cardboard do. The bucket tips over the edges of the space inside, until at 0.46 rad a wall stands on
the deck. The ground is level and as far below the deck as on level ground. Nothing but robot and
ground touches a bucket that lies there. Once the robot is ``_AWAY`` from it nothing moves any more.
"""

import itertools
import math

import numpy as np

from harness.world.cargo.bucket import SCALE, Box, add_boxes, build, hold, step_with, walls
from harness.world.cargo.cargo import CHECK_STEPS, BucketStep, Cargo
from harness.world.cargo.params import CargoParams
from harness.world.physics.engine import Server, bullet, set_dynamics
from harness.world.physics.motion_kernels import Quaternion, Vector
from harness.world.physics.params import PhysicsParams
from harness.world.physics.robot import RobotParams
from navstack.costmap.field_cache import cached_array, content_key
from navstack.types import BoolArray, FloatArray

_WALL = 0.02  # [m] thickness of the walls: no piece passes one in a step below 3 m/s
_FLOOR = 0.01  # [m] of the bucket's floor: a piece that gets through it in a step lies on the deck
_DECK = 0.1  # [m] thickness of the ground, and of the deck at least
_GROUND = 4.0  # [m] half the width of the ground that is kept below the robot
_FALLEN = 0.05  # [m] below its place, from which on a bucket has left the deck
_AWAY = 1.0  # [m] between the robot's reach and a bucket on the ground that is left behind
_LYING = 2.0  # [s] in which a bucket that has left the deck comes to rest beside a standing robot
_STANDING = 0.01  # [m/s, rad/s] below which a robot stands
_SETTLING = 1.0  # [s] from putting the bucket on the deck to the first count; published: 30 frames
_AT_REST = (0.0, 0.0, 0.0)
_LEVEL = (0.0, 0.0, 0.0, 1.0)


def make_cargo(params: CargoParams, robot: RobotParams, physics: PhysicsParams) -> Cargo | None:
    """The cargo of a world, to be reset; None: it has none."""
    dt = 1.0 / physics.rate
    if not params.pieces:
        return None
    if params.bucket == "free":
        return LooseCargo(params, physics.gravity, dt, robot)
    return Cargo(params, physics.gravity, dt)


class LooseCargo(Cargo):
    """The pieces and their loose bucket."""

    def __init__(self, params: CargoParams, gravity: float, dt: float, robot: RobotParams) -> None:
        """Build a bucket to be filled.

        Args:
            params: pieces and bucket.
            gravity: [m/s2].
            dt: [s] physics step.
            robot: on which the bucket stands.
        """
        super().__init__(params, gravity, dt)
        (cx, cy), (half_length, half_width) = robot.center, robot.half_size
        x, y, self._height = params.place_on(robot)
        # [m] centre from the bucket's place, half size
        self._deck = (cx - x, cy - y, half_length, half_width)
        self._thickness = max(self._height - _FLOOR - robot.ground_clearance, _DECK)  # [m]
        self._away = math.hypot(half_length, half_width) + _AWAY  # [m] of the deck's centre

    def reset(self, rng: np.random.Generator, yaw: float = 0.0, pieces: int | None = None) -> None:
        """See :meth:`Cargo.reset`."""
        self._yaw = -yaw  # [rad] of the bucket on the robot at the start
        super().reset(rng, yaw, pieces)

    @property
    def pieces_on_robot(self) -> int:
        """See :meth:`Cargo.pieces_on_robot`."""
        if self._left_deck is not None:
            return 0
        return super().pieces_on_robot

    def _begin(self) -> None:
        super()._begin()
        self._left_deck: int | None = None  # step in which the bucket did; None: not yet

    def _settled(self, pour: int) -> FloatArray:
        heap = super()._settled(pour)
        if not self.params.drop:
            return heap
        given = (self._standing, self._gravity, self._dt, self.params.drop, self._deck)
        key = content_key("heap after a drop 2", repr(given), pour, bullet.getAPIVersion())
        return cached_array(key, lambda: self._dropped(heap), is_of_map=False)

    def _dropped(self, heap: FloatArray) -> FloatArray:
        """The heap (n, 3) [m] after the fall of the bucket onto the deck, in the bucket's frame."""
        server = Server()
        try:
            deck, pieces = build(
                server.client, self.params, heap, self._dt, self._make_thin_deck_and_bucket
            )
            raised = (0.0, 0.0, SCALE * self.params.drop)
            self._put_bucket(server.client, raised, _LEVEL)
            for piece, place in zip(pieces, (SCALE * heap + raised).tolist(), strict=True):
                bullet.resetBasePositionAndOrientation(piece, place, _LEVEL, server.client)
            pull = (0.0, 0.0, -self._gravity)
            for _ in range(round(_SETTLING / self._dt)):
                step_with(server.client, deck, pull, _LEVEL, _AT_REST, self._dt)
            position, orientation = self._bucket_pose(server.client)
            places = [
                bullet.getBasePositionAndOrientation(each, server.client)[0] for each in pieces
            ]
        finally:
            server.close()
        local: FloatArray = (np.subtract(places, position) / SCALE) @ rotation_of(orientation)
        return local

    def _fill(self) -> None:
        heap = self._heap @ about_vertical(self._yaw).T
        self._held, self._pieces = build(
            self._client, self.params, heap, self._dt, self._make_deck_and_bucket
        )
        half = (SCALE * _GROUND, SCALE * _GROUND, SCALE * _DECK)
        self._ground = hold(self._client, [(half, _AT_REST)], self._factor, self.params.restitution)
        turned = (0.0, 0.0, math.sin(0.5 * self._yaw), math.cos(0.5 * self._yaw))
        self._put_bucket(self._client, _AT_REST, turned)

    @property
    def _factor(self) -> float:
        """Of friction with the bucket, which has the root of that with the pieces: a product."""
        root = math.sqrt(self.params.friction)
        if root == 0.0:
            return 0.0
        return self.params.bucket_friction / root

    def _make_thin_deck_and_bucket(self, client: int, params: CargoParams) -> int:
        """As thick as none of a robot, so that a heap is kept for robots of every height."""
        return self._make_on_deck(client, params, _DECK)

    def _make_deck_and_bucket(self, client: int, params: CargoParams) -> int:
        return self._make_on_deck(client, params, self._thickness)

    def _make_on_deck(self, client: int, params: CargoParams, thickness: float) -> int:
        height, inertia = mass_of_open_box(params)
        self._middle = SCALE * height
        lowered = [(half, (x, y, z - self._middle)) for half, (x, y, z) in bucket_boxes(params)]
        self._bucket = add_boxes(client, lowered, params.bucket_mass)
        self._put_bucket(client, _AT_REST, _LEVEL)
        set_dynamics(
            client,
            self._bucket,
            lateralFriction=math.sqrt(params.friction),
            restitution=math.sqrt(params.restitution),
            mass=params.bucket_mass,
            localInertiaDiagonal=[SCALE**2 * part for part in inertia],
        )
        return hold(client, [self._deck_box(thickness)], self._factor, 0.0)

    def _deck_box(self, thickness: float) -> Box:
        """A deck of a thickness [m] about the bucket, in the server's lengths."""
        x, y, half_length, half_width = (SCALE * length for length in self._deck)
        thick = 0.5 * SCALE * thickness
        return (half_length, half_width, thick), (x, y, -SCALE * _FLOOR - thick)

    def _pose(self) -> tuple[Vector, Quaternion]:
        return self._bucket_pose(self._client)

    def _bucket_pose(self, client: int) -> tuple[Vector, Quaternion]:
        """The centre of the bucket's floor, whose body's origin is the centre of mass."""
        middle, orientation = bullet.getBasePositionAndOrientation(self._bucket, client)
        x, y, z = (middle - self._middle * rotation_of(orientation)[:, 2]).tolist()
        return (x, y, z), orientation

    def _put_bucket(self, client: int, place: Vector, orientation: Quaternion) -> None:
        """Put the centre of the bucket's floor at a place, in the server's lengths."""
        middle = place + self._middle * rotation_of(orientation)[:, 2]
        bullet.resetBasePositionAndOrientation(self._bucket, middle.tolist(), orientation, client)

    def _advance(self, moved: BucketStep) -> None:
        if self._left_deck is None:
            super()._advance(moved)
            return
        lies = (self._steps - self._left_deck) * self._dt > _LYING
        if lies and self._is_left_behind:
            self._is_awake = False
        elif not lies or _is_moving(moved):
            self._calm_steps = 0
            super()._advance(moved)

    @property
    def _is_left_behind(self) -> bool:
        """Whether the bucket is out of the robot's way for good; looked at as the pieces are."""
        if self._steps % CHECK_STEPS:
            return False
        x, y, _ = self._pose()[0]
        turned = rotation_of(self._orientation)[:2, :2] @ self._deck[:2]
        return math.hypot(x / SCALE - turned[0], y / SCALE - turned[1]) > self._away

    def _simulate(self, moved: BucketStep) -> None:
        self._pull_ground_along(moved)
        super()._simulate(moved)

    def _pull_ground_along(self, moved: BucketStep) -> None:
        """Keep ground below the robot that passes as the robot moves."""
        east, north, _ = self._here(moved.velocity)
        passing = np.array((-east, -north, 0.0))
        # the coming step adds the pull
        velocity = SCALE * (passing - np.multiply(self._pull(moved), self._dt))
        x, y, _ = self._pose()[0]
        below = (x, y, -SCALE * (_FLOOR + self._height + _DECK))
        bullet.resetBasePositionAndOrientation(self._ground, below, _LEVEL, self._client)
        bullet.resetBaseVelocity(self._ground, velocity.tolist(), _AT_REST, self._client)

    def _rest(self) -> None:
        super()._rest()
        bullet.resetBaseVelocity(self._bucket, _AT_REST, _AT_REST, physicsClientId=self._client)

    def _look(self) -> None:
        super()._look()
        position, _ = self._pose()
        up = rotation_of(self._orientation)[:, 2]
        if self._left_deck is None and float(up @ position) < -SCALE * _FALLEN:
            self._left_deck = self._steps

    def _are_inside(self, places: FloatArray) -> BoolArray:
        _, orientation = self._pose()
        to_map = about_vertical(self._heading) @ rotation_of(orientation)
        return are_in_box_of(places, to_map, self.params)


def _is_moving(moved: BucketStep) -> bool:
    """Whether the robot drives or turns; turning may leave the bucket's place where it is."""
    return math.hypot(*moved.velocity) > _STANDING or math.hypot(*moved.spin) > _STANDING


def bucket_boxes(params: CargoParams) -> list[Box]:
    """Floor and walls in the server's lengths, from the centre of the floor."""
    half = 0.5 * SCALE * params.bucket_width
    floor = 0.5 * SCALE * _FLOOR
    around = walls(half, SCALE * params.bucket_height, 0.5 * SCALE * _WALL)
    return [((half, half, floor), (0.0, 0.0, -floor)), *around]


def mass_of_open_box(params: CargoParams) -> tuple[float, Vector]:
    """Height [m] of the centre of mass above the floor, and moments of inertia [kg m2] about it.

    Of a box without a lid from one thin material (textbook: plates and Steiner's theorem).
    """
    width, height = params.bucket_width, params.bucket_height
    per_area = params.bucket_mass / (width**2 + 4.0 * width * height)
    floor, wall = per_area * width**2, per_area * width * height
    middle = 4.0 * wall * 0.5 * height / params.bucket_mass
    upright = floor * width**2 / 6.0 + 4.0 * wall * width**2 / 3.0
    of_floor = floor * (width**2 / 12.0 + middle**2)
    of_wall = wall * (height**2 / 12.0 + (0.5 * height - middle) ** 2)
    flat = of_floor + 4.0 * of_wall + 2.0 * wall * width**2 * (1.0 / 4.0 + 1.0 / 12.0)
    return middle, (flat, flat, upright)


def are_in_box_of(places: FloatArray, to_map: FloatArray, params: CargoParams) -> BoolArray:
    """Which pieces lie in the box, with sides along the map's axes, about the bucket.

    Args:
        places: (n, 3) [m] centres, bucket's frame.
        to_map: (3, 3) rotation from the bucket's frame to the map's.
        params: the bucket; its inner space is taken, which has no thickness of walls.
    """
    half = 0.5 * params.bucket_width
    sides = ((-half, half), (-half, half), (0.0, params.bucket_height))
    corners = np.array(list(itertools.product(*sides))) @ to_map.T
    turned = places @ to_map.T
    within = (turned >= corners.min(axis=0)) & (turned <= corners.max(axis=0))
    inside: BoolArray = within.all(axis=1)
    return inside


def rotation_of(orientation: Quaternion) -> FloatArray:
    """The rotation (3, 3) of a quaternion."""
    rotation: FloatArray = np.array(bullet.getMatrixFromQuaternion(orientation)).reshape(3, 3)
    return rotation


def about_vertical(angle: float) -> FloatArray:
    """The rotation (3, 3) by an angle [rad] about the vertical."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array(((cos, -sin, 0.0), (sin, cos, 0.0), (0.0, 0.0, 1.0)))

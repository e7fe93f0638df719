"""Popcorn in an open bucket: every piece a body of its own, in a physics server of its own.

The server's frame moves along with the centre of the bucket's floor and keeps its directions: the bucket's acceleration
acts on all pieces as an equal pseudo-force, its rotation is that of the bucket's walls. So all six degrees of freedom
of the bucket reach the pieces.

Simplifications: pieces are equal spheres (friction and rolling friction stand for the irregular shape), without air
drag; they do not act back on the robot (50 g against 50 kg); the bucket is a square box fixed to the robot, unless
:mod:`harness.world.loose_cargo` lets it stand loose. Pieces that
have left the bucket's surroundings are lost for good. Pieces move only while the bucket is shaken or tilted beyond a
threshold and shortly afterwards, when they rest again; below it popcorn filled to 0.6 does not move. As they act on
nothing, their motion is worked out late, and not at all where no jolt could lift a liquid over the rim.
Lengths and accelerations are ten times the real ones, so that the contact solver's tolerances (about 1 mm)
are small against a piece; times are real.
"""

import dataclasses
import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from harness.world.engine import Server, bullet, set_dynamics
from harness.world.motion_kernels import Quaternion, Vector, lean_and_shake
from harness.world.truth import CargoState
from harness.world.world_params import CargoParams
from navstack.costmap.field_cache import cached_array, content_key
from navstack.types import BoolArray, FloatArray

Box = tuple[Vector, Vector]  # half extents, centre
Shaking = tuple[float, Vector, Quaternion, Vector]  # see lean_and_shake; acceleration, orientation and spin as given

SCALE = 10.0  # lengths in the server per real length
_WALL = 0.05  # [m] thickness of the bucket's walls, thick enough that no piece passes them in one step
_SETTLING = 3.0  # [s] in which the poured pieces come to rest
_POURS = 16  # differently poured heaps, each of which can be turned and mirrored in eight ways
_CHECK_STEPS = 12  # physics steps between two looks for lost pieces
_JOLT_TIME = 0.2  # [s] over which shaking is averaged: about how long a piece takes from wall to wall at 4 m/s2
_LEVEL = (0.0, 0.0, 0.0, 1.0)
_REST = (0.0, 0.0, 0.0)


class Cargo:
    """The pieces of one delivery after the other."""

    def __init__(self, params: CargoParams, gravity: float, dt: float) -> None:
        """Build a bucket to be filled.

        Args:
            params: pieces and bucket.
            gravity: [m/s2].
            dt: [s] physics step.
        """
        self.params = params
        self._gravity = gravity
        self._dt = dt
        self._standing = dataclasses.replace(params, bucket="fixed")  # in which the pieces were poured
        self._server: Server | None = None  # 28 MB, of use only once the bucket is shaken

    def reset(self, rng: np.random.Generator) -> None:
        """Fill the bucket; ``rng`` chooses among settled heaps and the eight ways to turn and mirror one."""
        pour, image = int(rng.integers(_POURS)), int(rng.integers(8))
        heap = turned(settled_heap(self._standing, self._gravity, self._dt, pour), image)
        self._heap = heap[is_inside(heap, self.params)]
        self._is_built = False  # in the server; many a delivery never shakes its cargo
        self._orientation: Quaternion = _LEVEL
        self._lost = 0
        self._at_start = len(self._heap)
        self.state = CargoState(self._at_start, 0)  # while the pieces move they are looked at ten times per second
        self._waiting: list[Shaking] | None = []  # all steps, none of which has spilled anything; None: one may have
        self._harmless = harmless_jolt(self._heap, self.params, self._gravity)
        self._jolt = 0.0  # [m/s2] mean of the shaking since the pieces rested
        self._begin()

    def _begin(self) -> None:
        self._is_awake = False
        self._heading = 0.0  # [rad] of the server's frame in the map frame
        self._calm_steps = 0
        self._steps = 0
        self._bucket_yaw = 0.0  # [rad] in the server's frame

    @property
    def is_awake(self) -> bool:
        """Whether the pieces move."""
        return self._is_awake

    @property
    def positions(self) -> FloatArray:
        """Centres (n, 3) in [m] of the pieces near the bucket, frame of the bucket's floor."""
        self._catch_up()
        if not self._is_built:
            return self._heap.copy()
        get, client = bullet.getBasePositionAndOrientation, self._client
        places = np.array([get(piece, physicsClientId=client)[0] for piece in self._pieces]).reshape(-1, 3)
        position, orientation = self._pose()
        rotation = np.array(bullet.getMatrixFromQuaternion(orientation)).reshape(3, 3)
        local: FloatArray = ((places - position) / SCALE) @ rotation
        return local

    def step(self, acceleration: Vector, orientation: Quaternion, spin: Vector) -> None:
        """Advance by one physics step.

        Args:
            acceleration: [m/s2] of the centre of the bucket's floor, map frame, without gravity.
            orientation: of the robot's body in the map frame.
            spin: [rad/s] of the robot's body, map frame.
        """
        shake = lean_and_shake(*acceleration, *orientation[:2], self._gravity)
        if self._waiting is not None:
            self._waiting.append((shake, acceleration, orientation, spin))
            before = self._jolt if self._is_awake else 0.0  # pieces at rest
            self._jolt = before + (shake - before) * self._dt / _JOLT_TIME
            if self._jolt > self._harmless:
                self._catch_up()
                return
        self._advance(shake, acceleration, orientation, spin)

    def _catch_up(self) -> None:
        """Simulate all steps since the beginning, and from now on each as it comes."""
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            self._begin()
            for shaking in waiting:
                self._advance(*shaking)

    def _advance(self, shake: float, acceleration: Vector, orientation: Quaternion, spin: Vector) -> None:
        is_simulated = self._waiting is None
        if shake > self.params.wake_acceleration:
            self._calm_steps = 0
            if not self._is_awake and is_simulated:
                self._wake(orientation)
            self._is_awake = True
        elif not self._is_awake:
            return
        self._calm_steps += 1
        if is_simulated:
            self._simulate(acceleration, orientation, spin)
        if self._calm_steps * self._dt > self.params.settle_time:
            self._is_awake = False
            if is_simulated:
                self._rest()
        elif is_simulated and self._steps % _CHECK_STEPS == 0:
            self._look()

    def close(self) -> None:
        """Free the physics server."""
        if self._server is not None:
            self._server.close()

    def _wake(self, orientation: Quaternion) -> None:
        """Choose the server's frame so that the bucket stands in it as it did when the pieces came to rest."""
        if not self._is_built:
            self._server = self._server or Server()
            self._client = self._server.client
            self._fill()
            self._is_built = True
        self._heading = _yaw(orientation) - self._bucket_yaw

    def _fill(self) -> None:
        """Build what is moved by hand, and the pieces."""
        self._held, self._pieces = build(self._client, self.params, self._heap, self._dt)

    def _pose(self) -> tuple[Vector, Quaternion]:
        """Where the centre of the bucket's floor is, in the server's lengths, and how it stands."""
        return _REST, self._orientation

    def _rest(self) -> None:
        self._look()
        for piece in self._pieces:
            bullet.resetBaseVelocity(piece, _REST, _REST, physicsClientId=self._client)

    def _simulate(self, acceleration: Vector, orientation: Quaternion, spin: Vector) -> None:
        client, (ax, ay, az) = self._client, acceleration
        cos, sin = math.cos(self._heading), math.sin(self._heading)
        pull = (-cos * ax - sin * ay, sin * ax - cos * ay, -self._gravity - az)  # [m/s2] on the pieces, server's frame
        self._orientation = in_frame(self._heading, orientation)
        self._bucket_yaw = _yaw(self._orientation)
        wx, wy, wz = spin
        spin_here = (cos * wx + sin * wy, -sin * wx + cos * wy, wz)
        step_with(client, self._held, pull, self._orientation, spin_here, self._dt)
        self._steps += 1

    def _look(self) -> None:
        """Count what is outside and remove what has left the bucket's surroundings."""
        places = self.positions
        far = (np.abs(places) > 4.0 * max(self.params.bucket_width, self.params.bucket_height)).any(axis=1)
        far |= places[:, 2] < -0.5 * self.params.bucket_height
        if far.any():
            for i in np.flatnonzero(far)[::-1].tolist():
                bullet.removeBody(self._pieces.pop(i), physicsClientId=self._client)
                self._lost += 1
        outside = self._lost + int((~is_inside(self.positions, self.params)).sum())
        self.state = CargoState(self._at_start, outside)


def harmless_jolt(heap: FloatArray, params: CargoParams, gravity: float) -> float:
    """Mean shaking [m/s2] over ``_JOLT_TIME`` up to which nothing is spilled.

    It is that by which a liquid as high as the highest piece just reaches the rim. Held, the shaking inclines the
    surface about its middle; as a shock it gives a speed, which is spent on the way up. Popcorn rubs, and bears more
    (docs/physics.md).

    Args:
        heap: centres (n, 3) [m] of the pieces at rest.
        params: pieces and bucket; one that stands loose bears nothing.
        gravity: [m/s2].
    """
    to_rim = params.bucket_height - float(heap[:, 2].max(initial=0.0))
    if params.bucket != "fixed" or to_rim <= 0.0:
        return 0.0
    return min(2.0 * gravity * to_rim / params.bucket_width, math.sqrt(2.0 * gravity * to_rim) / _JOLT_TIME)


def is_inside(places: FloatArray, params: CargoParams) -> BoolArray:
    """Which centres (n, 3) [m], bucket's frame, lie in the bucket's bounding box."""
    half, height = 0.5 * params.bucket_width, params.bucket_height
    return (np.abs(places[:, :2]) <= half).all(axis=1) & (places[:, 2] >= 0.0) & (places[:, 2] <= height)


def build(
    client: int,
    params: CargoParams,
    heap: FloatArray,
    dt: float,
    make_held: Callable[[int, CargoParams], int] | None = None,
) -> tuple[int, list[int]]:
    """Empty a server and fill it.

    Args:
        client: the server.
        params: pieces and bucket.
        heap: (n, 3) [m] where the pieces go.
        dt: [s] physics step.
        make_held: what is moved by hand, made in the server; None: the bucket.

    Returns:
        What is moved by hand, and the pieces.
    """
    bullet.resetSimulation(physicsClientId=client)
    bullet.setPhysicsEngineParameter(
        fixedTimeStep=dt, numSubSteps=0, numSolverIterations=20, deterministicOverlappingPairs=1, physicsClientId=client
    )
    held = (make_held or _bucket)(client, params)
    radius = SCALE * params.piece_radius
    shape = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=radius, physicsClientId=client)
    pieces: list[int] = []
    for place in (SCALE * heap).tolist():
        piece = bullet.createMultiBody(
            params.piece_mass, shape, basePosition=place, useMaximalCoordinates=1, physicsClientId=client
        )
        set_dynamics(
            client,
            piece,
            lateralFriction=math.sqrt(params.friction),  # PyBullet multiplies those of the two bodies
            rollingFriction=params.rolling_friction * SCALE * params.piece_radius,
            restitution=math.sqrt(params.restitution),
        )
        pieces.append(int(piece))
    return held, pieces


def _bucket(client: int, params: CargoParams) -> int:
    """Floor and four walls, moved by hand: so heavy that no piece moves it. Its origin is the floor's centre."""
    half, height, wall = 0.5 * SCALE * params.bucket_width, SCALE * params.bucket_height, 0.5 * SCALE * _WALL
    outer = half + 2.0 * wall
    boxes = [((outer, outer, wall), (0.0, 0.0, -wall)), *walls(half, height, wall)]
    return hold(client, boxes, math.sqrt(params.friction), params.restitution)


def walls(half: float, height: float, wall: float) -> list[Box]:
    """Four walls of half the thickness ``wall`` around a square floor of half the width ``half`` at height 0."""
    boxes: list[Box] = []
    for sign in (1.0, -1.0):
        boxes.append(((wall, half + 2.0 * wall, 0.5 * height), (sign * (half + wall), 0.0, 0.5 * height)))
        boxes.append(((half, wall, 0.5 * height), (0.0, sign * (half + wall), 0.5 * height)))
    return boxes


def hold(client: int, boxes: list[Box], friction: float, restitution: float) -> int:
    """A body of boxes that is moved by hand: so heavy that nothing moves it.

    Args:
        client: the server.
        boxes: half extents and centre of each, in the server's lengths.
        friction: the body's factor of the product of two.
        restitution: [-] of a bounce off it.
    """
    body = add_boxes(client, boxes, 1.0)
    given = {"lateralFriction": friction, "restitution": math.sqrt(restitution)}
    set_dynamics(client, body, mass=1e6, localInertiaDiagonal=(1e6, 1e6, 1e6), **given)
    return body


def add_boxes(client: int, boxes: list[Box], mass: float) -> int:
    """A rigid body of boxes, each half extents and centre, in the server's lengths; ``mass`` in [kg]."""
    shape = bullet.createCollisionShapeArray(
        [bullet.GEOM_BOX] * len(boxes),
        halfExtents=[extents for extents, _ in boxes],
        collisionFramePositions=[center for _, center in boxes],
        physicsClientId=client,
    )
    return int(bullet.createMultiBody(mass, shape, useMaximalCoordinates=1, physicsClientId=client))


def step_with(client: int, bucket: int, pull: Vector, orientation: Quaternion, spin: Vector, dt: float) -> None:
    """One physics step under a pull [m/s2] on all pieces, the bucket held at an orientation and spin [rad/s]."""
    x, y, z = (SCALE * component for component in pull)
    origin = (0.0, 0.0, 0.0)
    against = (-x * dt, -y * dt, -z * dt)  # [m/s] makes up for what the pull does to the bucket within the step
    bullet.setGravity(x, y, z, client)
    bullet.resetBasePositionAndOrientation(bucket, origin, orientation, client)
    bullet.resetBaseVelocity(bucket, against, spin, client)
    bullet.stepSimulation(client)


@lru_cache(maxsize=4 * _POURS)
def settled_heap(params: CargoParams, gravity: float, dt: float, pour: int = 0) -> FloatArray:
    """Centres (n, 3) in [m] of pieces that were poured into the bucket and came to rest; kept on disk between runs."""
    key = content_key("settled heap 1", repr(params), gravity, dt, pour, bullet.getAPIVersion())
    heap = cached_array(key, lambda: _settle(params, gravity, dt, pour))
    heap.setflags(write=False)
    return heap


def _settle(params: CargoParams, gravity: float, dt: float, pour: int) -> FloatArray:
    """Pour pieces into a bucket and wait until they rest."""
    server = Server()
    client = server.client
    try:
        bucket, pieces = build(client, params, _poured(params, pour), dt)
        for _ in range(round(_SETTLING / dt)):
            step_with(client, bucket, (0.0, 0.0, -gravity), _LEVEL, (0.0, 0.0, 0.0), dt)
        places = [bullet.getBasePositionAndOrientation(piece, physicsClientId=client)[0] for piece in pieces]
    finally:
        server.close()
    return np.array(places) / SCALE


def _poured(params: CargoParams, pour: int) -> FloatArray:
    """A loose lattice (n, 3) of pieces above the floor, shifted by layers; it collapses into a heap."""
    radius = params.piece_radius
    pitch = 2.1 * radius
    per_row = max(1, int((params.bucket_width - 2.0 * radius) / pitch) + 1)
    number = np.arange(params.pieces)
    layer, in_layer = np.divmod(number, per_row * per_row)
    row, column = np.divmod(in_layer, per_row)
    slack = 0.5 * (params.bucket_width - 2.0 * radius - (per_row - 1) * pitch)
    rng = np.random.default_rng(pour)
    shift = slack * rng.uniform(-0.9, 0.9, (int(layer.max()) + 1, 2))[layer]  # a layer moves as a whole
    flat = (np.stack((column, row), axis=1) - 0.5 * (per_row - 1)) * pitch + shift
    return np.column_stack((flat, radius + layer * pitch))


def turned(heap: FloatArray, which: int) -> FloatArray:
    """One of the eight symmetric images of a heap (n, 3) in a square bucket."""
    x, y, z = heap.T
    if which >= 4:
        y = -y
    for _ in range(which % 4):
        x, y = -y, x
    return np.column_stack((x, y, z))


def in_frame(heading: float, orientation: Quaternion) -> Quaternion:
    """An orientation, seen from a frame turned about the vertical by ``heading`` [rad]."""
    cos, sin = math.cos(0.5 * heading), -math.sin(0.5 * heading)
    x, y, z, w = orientation
    return cos * x - sin * y, cos * y + sin * x, cos * z + sin * w, cos * w - sin * z


def _yaw(orientation: Quaternion) -> float:
    x, y, z, w = orientation
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))

"""Popcorn in an open bucket: every piece a body of its own, in a physics server of its own.

The server's frame moves along with the centre of the bucket's floor and keeps its directions: the
bucket's acceleration acts on all pieces as an equal pseudo-force, its rotation is that of the
bucket's walls. So all six degrees of freedom of the bucket reach the pieces.

Simplifications: pieces are equal spheres (friction and rolling friction stand for the irregular
shape), without air drag; they do not act back on the robot (50 g against 50 kg); the bucket is a
square box fixed to the robot, unless
:mod:`harness.world.cargo.loose_cargo` lets it stand loose. Pieces that have left the bucket's
surroundings are lost for good. Pieces move only while the bucket is shaken or tilted beyond a
threshold and shortly afterwards, when they rest again; below it popcorn filled to 0.6 does not
move. As they act on nothing, their motion is worked out late, and not at all where no jolt could
lift a liquid over the rim. Lengths and accelerations are ten times the real ones, so that the
contact solver's tolerances (about 1 mm) are small against a piece; times are real.
"""

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from harness.world.cargo.bucket import SCALE, build, step_with
from harness.world.cargo.heap import POURS, settled_heap, turned
from harness.world.cargo.params import CargoParams
from harness.world.physics.engine import Server, bullet
from harness.world.physics.motion_kernels import Quaternion, Vector, lean_and_shake
from harness.world.truth import CargoState
from navstack.types import BoolArray, FloatArray

CHECK_STEPS = 12  # physics steps between two looks for lost pieces
# [s] over which shaking is averaged: about how long a piece takes from wall to wall at 4 m/s2
_JOLT_TIME = 0.2
_LEVEL = (0.0, 0.0, 0.0, 1.0)
_REST = (0.0, 0.0, 0.0)


class BucketStep(NamedTuple):
    """How the bucket's place on the robot moves in one physics step, map frame."""

    acceleration: Vector  # [m/s2] of the centre of the bucket's floor, without gravity
    velocity: Vector  # [m/s] of the same point after the step
    orientation: Quaternion  # of the robot's body
    spin: Vector  # [rad/s] of the robot's body


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
        self._wakes_at = params.wakes_at(gravity)
        self._dt = dt
        # in which the pieces were poured
        self._standing = dataclasses.replace(params, bucket="fixed", place=None, drop=0.0)
        self._server: Server | None = None  # 28 MB, of use only once the bucket is shaken

    def reset(self, rng: np.random.Generator, yaw: float = 0.0, pieces: int | None = None) -> None:
        """Fill the bucket.

        Args:
            rng: chooses among settled heaps and the eight ways to turn and mirror one.
            yaw: [rad] of the robot at the start; matters to a bucket that stands loose.
            pieces: how many are left of a heap, the lowest; None: all.
        """
        pour, image = int(rng.integers(POURS)), int(rng.integers(8))
        heap = turned(self._settled(pour), image)
        self._heap = lowest(heap[is_inside(heap, self.params)], pieces)
        self._is_built = False  # in the server; many a delivery never shakes its cargo
        self._orientation: Quaternion = _LEVEL
        self._lost = 0
        self._at_start = len(self._heap)
        # while the pieces move they are looked at ten times per second
        self.state = CargoState(self._at_start, 0)
        # all steps, none of which has spilled anything; None: one may have
        self._waiting: list[BucketStep] | None = []
        self._harmless = harmless_jolt(self._heap, self.params, self._gravity)
        self._jolt = 0.0  # [m/s2] mean of the shaking since the pieces rested
        self._begin()

    def _settled(self, pour: int) -> FloatArray:
        """Centres (n, 3) [m] of the pieces at rest in the standing bucket."""
        return settled_heap(self._standing, self._gravity, self._dt, pour)

    def _begin(self) -> None:
        self._is_awake = False
        self._heading = 0.0  # [rad] of the server's frame in the map frame
        self._calm_steps = 0
        self._steps = 0
        self._bucket_yaw = 0.0  # [rad] in the server's frame

    @property
    def pieces_on_robot(self) -> int:
        """In the bucket, if it stands on the robot."""
        return self.state.pieces_at_start - self.state.pieces_outside

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
        places = np.array(
            [get(piece, physicsClientId=client)[0] for piece in self._pieces]
        ).reshape(-1, 3)
        position, orientation = self._pose()
        rotation = np.array(bullet.getMatrixFromQuaternion(orientation)).reshape(3, 3)
        local: FloatArray = ((places - position) / SCALE) @ rotation
        return local

    def step(self, moved: BucketStep) -> None:
        """Advance by one physics step."""
        shake = self._shake(moved)
        if self._waiting is not None:
            self._waiting.append(moved)
            before = self._jolt if self._is_awake else 0.0  # pieces at rest
            self._jolt = before + (shake - before) * self._dt / _JOLT_TIME
            if self._jolt > self._harmless:
                self._catch_up()
                return
        self._advance(moved)

    def _shake(self, moved: BucketStep) -> float:
        """How far [m/s2] gravity seems to lean or grow in a step; see :func:`lean_and_shake`."""
        return lean_and_shake(*moved.acceleration, *moved.orientation[:2], self._gravity)

    def _catch_up(self) -> None:
        """Simulate all steps since the beginning, and from now on each as it comes."""
        waiting, self._waiting = self._waiting, None
        if waiting is not None:
            self._begin()
            for moved in waiting:
                self._advance(moved)

    def _advance(self, moved: BucketStep) -> None:
        is_simulated = self._waiting is None
        if self._shake(moved) > self._wakes_at:
            self._calm_steps = 0
            if not self._is_awake and is_simulated:
                self._wake(moved.orientation)
            self._is_awake = True
        elif not self._is_awake:
            return
        self._calm_steps += 1
        if is_simulated:
            self._simulate(moved)
        if self._calm_steps * self._dt > self.params.settle_time:
            self._is_awake = False
            if is_simulated:
                self._rest()
        elif is_simulated and self._steps % CHECK_STEPS == 0:
            self._look()

    def close(self) -> None:
        """Free the physics server."""
        if self._server is not None:
            self._server.close()

    def _wake(self, orientation: Quaternion) -> None:
        """Turn the server's frame: the bucket stands in it as when the pieces came to rest."""
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

    def _simulate(self, moved: BucketStep) -> None:
        self._orientation = in_frame(self._heading, moved.orientation)
        self._bucket_yaw = _yaw(self._orientation)
        spin = self._here(moved.spin)
        step_with(self._client, self._held, self._pull(moved), self._orientation, spin, self._dt)
        self._steps += 1

    def _here(self, vector: Vector) -> Vector:
        """A vector of the map frame, seen from the server's frame."""
        x, y, z = vector
        cos, sin = math.cos(self._heading), math.sin(self._heading)
        return cos * x + sin * y, -sin * x + cos * y, z

    def _pull(self, moved: BucketStep) -> Vector:
        """What the pieces feel [m/s2]: gravity and the frame's acceleration, server's frame."""
        x, y, z = self._here(moved.acceleration)
        return -x, -y, -self._gravity - z

    def _look(self) -> None:
        """Count what is outside and remove what has left the bucket's surroundings."""
        places = self.positions
        far = (np.abs(places) > 4.0 * max(self.params.bucket_width, self.params.bucket_height)).any(
            axis=1
        )
        far |= places[:, 2] < -0.5 * self.params.bucket_height
        if far.any():
            for i in np.flatnonzero(far)[::-1].tolist():
                bullet.removeBody(self._pieces.pop(i), physicsClientId=self._client)
                self._lost += 1
        outside = self._lost + int((~self._are_inside(self.positions)).sum())
        self.state = CargoState(self._at_start, outside)

    def _are_inside(self, places: FloatArray) -> BoolArray:
        """Which pieces (n, 3) [m], bucket's frame, count as being in the bucket."""
        return is_inside(places, self.params)


def lowest(heap: FloatArray, pieces: int | None) -> FloatArray:
    """The lowest of the pieces (n, 3) of a heap, in their order; None: all."""
    if pieces is None:
        return heap
    return heap[np.sort(np.argsort(heap[:, 2], kind="stable")[:pieces])]


def harmless_jolt(heap: FloatArray, params: CargoParams, gravity: float) -> float:
    """Mean shaking [m/s2] over ``_JOLT_TIME`` up to which nothing is spilled.

    It is that by which a liquid as high as the highest piece just reaches the rim. Held, the
    shaking inclines the surface about its middle; as a shock it gives a speed, which is spent on
    the way up. Popcorn rubs, and bears more.

    Args:
        heap: centres (n, 3) [m] of the pieces at rest.
        params: pieces and bucket; one that stands loose bears nothing.
        gravity: [m/s2].
    """
    to_rim = params.bucket_height - float(heap[:, 2].max(initial=0.0))
    if params.bucket != "fixed" or to_rim <= 0.0:
        return 0.0
    return min(
        2.0 * gravity * to_rim / params.bucket_width, math.sqrt(2.0 * gravity * to_rim) / _JOLT_TIME
    )


def is_inside(places: FloatArray, params: CargoParams) -> BoolArray:
    """Which centres (n, 3) [m], bucket's frame, lie in the bucket's bounding box."""
    half, height = 0.5 * params.bucket_width, params.bucket_height
    return (
        (np.abs(places[:, :2]) <= half).all(axis=1)
        & (places[:, 2] >= 0.0)
        & (places[:, 2] <= height)
    )


def in_frame(heading: float, orientation: Quaternion) -> Quaternion:
    """An orientation, seen from a frame turned about the vertical by ``heading`` [rad]."""
    cos, sin = math.cos(0.5 * heading), -math.sin(0.5 * heading)
    x, y, z, w = orientation
    return cos * x - sin * y, cos * y + sin * x, cos * z + sin * w, cos * w - sin * z


def _yaw(orientation: Quaternion) -> float:
    x, y, z, w = orientation
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))

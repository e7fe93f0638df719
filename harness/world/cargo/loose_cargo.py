"""Popcorn in a bucket that stands loose on the robot, as the published code spawns it.

The bucket is a rigid body on a deck, the robot's body seen from above, which is moved as
:mod:`harness.world.cargo.cargo` moves a fixed bucket. It slides where friction does not hold it,
tips over, and may fall off the deck; then all pieces are lost. Its walls are thick for the solver's
sake and have no mass of their own: the bucket's centre of mass is that of its floor, and it tips
over the edges of the space inside, until at 0.46 rad a wall stands on the deck.
"""

import math

import numpy as np

from harness.world.cargo.bucket import SCALE, Box, add_boxes, build, hold, walls
from harness.world.cargo.cargo import Cargo
from harness.world.cargo.params import CargoParams
from harness.world.physics.engine import bullet, set_dynamics
from harness.world.physics.motion_kernels import Quaternion, Vector
from harness.world.physics.params import PhysicsParams
from harness.world.physics.robot import RobotParams
from harness.world.truth import CargoState

_WALL = 0.02  # [m] thickness of the walls: no piece passes one in a step below 3 m/s
_FLOOR = 0.01  # [m] of the bucket's floor: a piece that gets through it in a step lies on the deck
_DECK = 0.1  # [m] thickness of the deck
_FALLEN = 0.05  # [m] below its place, from which on a bucket has left the deck
_AT_REST = (0.0, 0.0, 0.0)


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
            robot: on whose middle the bucket stands at the start.
        """
        super().__init__(params, gravity, dt)
        (cx, cy), (half_length, half_width) = robot.center, robot.half_size
        x, y, _ = robot.bucket
        # [m] centre from the bucket's place, half size
        self._deck = (cx - x, cy - y, half_length, half_width)

    def _fill(self) -> None:
        given = (self._client, self.params, self._heap, self._dt)
        self._held, self._pieces = build(*given, self._make_deck_and_bucket)

    def _make_deck_and_bucket(self, client: int, params: CargoParams) -> int:
        friction, height = math.sqrt(params.friction), SCALE * params.bucket_height
        half, floor, wall = (
            0.5 * SCALE * params.bucket_width,
            0.5 * SCALE * _FLOOR,
            0.5 * SCALE * _WALL,
        )
        boxes: list[Box] = [((half, half, floor), (0.0, 0.0, -floor)), *walls(half, height, wall)]
        self._bucket = add_boxes(client, boxes, params.bucket_mass)
        set_dynamics(
            client,
            self._bucket,
            lateralFriction=friction,
            restitution=math.sqrt(params.restitution),
        )
        x, y, half_length, half_width = (SCALE * length for length in self._deck)
        thick = 0.5 * SCALE * _DECK
        deck = ((half_length, half_width, thick), (x, y, -SCALE * _FLOOR - thick))
        return hold(
            client, [deck], params.bucket_friction / friction if friction > 0.0 else 0.0, 0.0
        )

    def _pose(self) -> tuple[Vector, Quaternion]:
        position, orientation = bullet.getBasePositionAndOrientation(self._bucket, self._client)
        return position, orientation

    def _rest(self) -> None:
        super()._rest()
        bullet.resetBaseVelocity(self._bucket, _AT_REST, _AT_REST, physicsClientId=self._client)

    def _look(self) -> None:
        super()._look()
        position, _ = self._pose()
        up = np.array(bullet.getMatrixFromQuaternion(self._orientation)).reshape(3, 3)[:, 2]
        if float(up @ position) < -SCALE * _FALLEN:
            self.state = CargoState(self._at_start, self._at_start)

"""Popcorn and its bucket as bodies of a physics server, ten times as large as they are."""

import math
from collections.abc import Callable

from harness.world.cargo.params import CargoParams
from harness.world.physics.engine import bullet, set_dynamics
from harness.world.physics.motion_kernels import Quaternion, Vector
from navstack.types import FloatArray

Box = tuple[Vector, Vector]  # half extents, centre

SCALE = 10.0  # lengths in the server per real length
# [m] thickness of the bucket's walls, thick enough that no piece passes them in one step
_WALL = 0.05


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
        fixedTimeStep=dt,
        numSubSteps=0,
        numSolverIterations=20,
        deterministicOverlappingPairs=1,
        physicsClientId=client,
    )
    held = (make_held or _bucket)(client, params)
    radius = SCALE * params.piece_radius
    shape = bullet.createCollisionShape(bullet.GEOM_SPHERE, radius=radius, physicsClientId=client)
    pieces: list[int] = []
    for place in (SCALE * heap).tolist():
        piece = bullet.createMultiBody(
            params.piece_mass,
            shape,
            basePosition=place,
            useMaximalCoordinates=1,
            physicsClientId=client,
        )
        set_dynamics(
            client,
            piece,
            # PyBullet multiplies those of the two bodies
            lateralFriction=math.sqrt(params.friction),
            rollingFriction=params.rolling_friction * SCALE * params.piece_radius,
            restitution=math.sqrt(params.restitution),
        )
        pieces.append(int(piece))
    return held, pieces


def _bucket(client: int, params: CargoParams) -> int:
    """Floor and four walls, moved by hand: so heavy that no piece moves it.

    Its origin is the floor's centre.
    """
    half, height, wall = (
        0.5 * SCALE * params.bucket_width,
        SCALE * params.bucket_height,
        0.5 * SCALE * _WALL,
    )
    outer = half + 2.0 * wall
    boxes = [((outer, outer, wall), (0.0, 0.0, -wall)), *walls(half, height, wall)]
    return hold(client, boxes, math.sqrt(params.friction), params.restitution)


def walls(half: float, height: float, wall: float) -> list[Box]:
    """Four walls around a square floor at height 0.

    ``half`` is half the floor's width, ``wall`` half the walls' thickness.
    """
    boxes: list[Box] = []
    for sign in (1.0, -1.0):
        boxes.append(
            ((wall, half + 2.0 * wall, 0.5 * height), (sign * (half + wall), 0.0, 0.5 * height))
        )
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
    """A rigid body of boxes, each half extents and centre, in the server's lengths.

    ``mass`` in [kg].
    """
    shape = bullet.createCollisionShapeArray(
        [bullet.GEOM_BOX] * len(boxes),
        halfExtents=[extents for extents, _ in boxes],
        collisionFramePositions=[center for _, center in boxes],
        physicsClientId=client,
    )
    return int(bullet.createMultiBody(mass, shape, useMaximalCoordinates=1, physicsClientId=client))


def step_with(
    client: int,
    bucket: int,
    pull: Vector,
    orientation: Quaternion,
    spin: Vector,
    dt: float,
) -> None:
    """One physics step under a pull [m/s2] on all pieces; the bucket is held as it stands."""
    x, y, z = (SCALE * component for component in pull)
    origin = (0.0, 0.0, 0.0)
    # [m/s] makes up for what the pull does to the bucket within the step
    against = (-x * dt, -y * dt, -z * dt)
    bullet.setGravity(x, y, z, client)
    bullet.resetBasePositionAndOrientation(bucket, origin, orientation, client)
    bullet.resetBaseVelocity(bucket, against, spin, client)
    bullet.stepSimulation(client)

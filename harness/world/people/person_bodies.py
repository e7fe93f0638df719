"""Upright capsules for people in the physics server."""

from harness.world.physics.bodies import PERSON, ROBOT, make_heavy, rigid_body
from harness.world.physics.contacts import Vector
from harness.world.physics.engine import bullet

_UPRIGHT = (0.0, 0.0, 0.0, 1.0)
_AT_REST = (0.0, 0.0, 0.0)
_CANNOT_TIP = (1e9, 1e9, 1e9)  # [kg m2]


def person_shape(client: int, radius: float, height: float, robot_height: float) -> int:
    """The shape of an upright capsule that stands on its origin; lengths in [m].

    An upright capsule touches an upright face along a line, whose ends carry the contact: two
    spheres, at the lower end of the capsule's cylinder and at its upper end or the robot's top,
    whichever is lower.
    """
    top = max(min(height - radius, robot_height), radius)
    shape = bullet.createCollisionShapeArray(
        [bullet.GEOM_SPHERE] * 2,
        radii=[radius] * 2,
        collisionFramePositions=[(0.0, 0.0, radius), (0.0, 0.0, top)],
        physicsClientId=client,
    )
    return int(shape)


def add_person(client: int, shape: int, mass: float, friction: float) -> int:
    """A body of a :func:`person_shape` that cannot tip."""
    body = rigid_body(client, mass, shape, (0.0, 0.0, 0.0))
    make_heavy(client, body, mass, _CANNOT_TIP, friction)
    bullet.setCollisionFilterGroupMask(body, -1, PERSON, ROBOT, physicsClientId=client)
    return body


def put_person(client: int, body: int, position: Vector, velocity: Vector) -> None:
    """Set a person's body at ``position`` [m] and in motion [m/s], map frame."""
    bullet.resetBasePositionAndOrientation(body, position, _UPRIGHT, client)
    bullet.resetBaseVelocity(body, velocity, _AT_REST, client)

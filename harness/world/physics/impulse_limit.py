"""No contact point with a person gives more than a limit, PhysX's ``maxContactImpulse``.

PhysX limits a point within its solver. Here what the solver gave beyond the limit is taken back
after the step: from the robot's velocity, spin, and the way that it made with them in the step. The
other points do not take over what one point leaves; friction stays.
"""

import dataclasses

import numpy as np

from harness.world.physics.contacts import ContactPoint, Motion
from harness.world.physics.engine import bullet
from harness.world.physics.motion_kernels import Quaternion
from harness.world.physics.robot import RobotParams
from harness.world.truth import Partner
from navstack.types import FloatArray


def limited(
    points: list[ContactPoint],
    most: float,
    motion: Motion,
    orientation: Quaternion,
    robot: RobotParams,
) -> tuple[list[ContactPoint], FloatArray, FloatArray]:
    """The contact points of a step with their limited impulses.

    Args:
        points: as the solver made them.
        most: [N s] of a point with a person.
        motion: of the robot after the step.
        orientation: of its body after the step.
        robot: its mass and inertia.

    Returns:
        The points; the changes (3,) of the robot's velocity [m/s] and spin [rad/s], map frame.
    """
    impulse, moment = np.zeros(3), np.zeros(3)
    kept: list[ContactPoint] = []
    for point in points:
        if point.touched.partner is Partner.PEDESTRIAN and point.impulse > most:
            back = (most - point.impulse) * np.array(point.normal)
            impulse += back
            moment += np.cross(np.subtract(point.position, motion.position), back)
            point = dataclasses.replace(point, impulse=most)
        kept.append(point)
    turn = np.array(bullet.getMatrixFromQuaternion(orientation)).reshape(3, 3)  # body to map
    spin: FloatArray = turn @ ((turn.T @ moment) / np.array(robot.inertia))
    return kept, impulse / robot.mass, spin


def shove(client: int, body: int, change: FloatArray, turn: FloatArray, dt: float) -> None:
    """Add ``change`` [m/s] to a body's velocity and ``turn`` [rad/s] to its spin.

    Its pose changes as if that had happened at the last step's beginning.
    """
    position, orientation = bullet.getBasePositionAndOrientation(body, client)
    velocity, spin = bullet.getBaseVelocity(body, client)
    angle = float(np.linalg.norm(turn)) * dt
    if angle > 0.0:
        small = bullet.getQuaternionFromAxisAngle((turn * dt / angle).tolist(), angle)
        orientation = bullet.multiplyTransforms(
            (0.0, 0.0, 0.0), small, (0.0, 0.0, 0.0), orientation
        )[1]
    bullet.resetBasePositionAndOrientation(
        body, np.add(position, change * dt).tolist(), orientation, client
    )
    bullet.resetBaseVelocity(
        body, np.add(velocity, change).tolist(), np.add(spin, turn).tolist(), client
    )

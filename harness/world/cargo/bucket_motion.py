"""How the bucket on the robot moves, and whether that shakes its pieces."""

import numpy as np

from harness.world.cargo.cargo import BucketStep
from harness.world.cargo.params import CargoParams
from harness.world.physics.motion_kernels import (
    ACCELERATION,
    GRAVITY,
    PLACE,
    RATE,
    THRESHOLD,
    VELOCITY,
    Quaternion,
    Vector,
    is_shaken,
    point_velocity,
)
from harness.world.physics.params import PhysicsParams
from harness.world.physics.robot import RobotParams


class BucketMotion:
    """Follows the centre of the bucket's floor from physics step to physics step."""

    def __init__(self, params: CargoParams, robot: RobotParams, physics: PhysicsParams) -> None:
        """Prepare for a bucket on a robot."""
        self._bucket = np.zeros(12)
        self._bucket[PLACE : PLACE + 3] = np.subtract(params.place_on(robot), robot.center_of_mass)
        self._bucket[RATE] = physics.rate
        self._bucket[GRAVITY] = physics.gravity
        self._bucket[THRESHOLD] = params.wakes_at(physics.gravity)

    def reset(self, orientation: Quaternion, velocity: Vector, spin: Vector) -> None:
        """Start an episode with the robot's body in this motion."""
        x, y, z = self._bucket[PLACE : PLACE + 3].tolist()
        moving = point_velocity(orientation, velocity, spin, x, y, z)
        self._bucket[VELOCITY : VELOCITY + 3] = moving

    def is_shaken(self, orientation: Quaternion, velocity: Vector, spin: Vector) -> bool:
        """Whether a step shakes or tilts the bucket beyond what its pieces bear at rest."""
        return is_shaken(orientation, velocity, spin, self._bucket)

    def step_of(self, orientation: Quaternion, spin: Vector) -> BucketStep:
        """The last step, in which the robot's body has come to this orientation and spin."""
        x, y, z = self._bucket[ACCELERATION:].tolist()
        vx, vy, vz = self._bucket[VELOCITY : VELOCITY + 3].tolist()
        return BucketStep((x, y, z), (vx, vy, vz), orientation, spin)

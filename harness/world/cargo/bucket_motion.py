"""How the bucket on the robot moves, and whether that shakes its pieces."""

import numpy as np

from harness.world.cargo.params import CargoParams
from harness.world.physics.motion_kernels import Quaternion, Vector, is_shaken, point_velocity
from harness.world.physics.params import PhysicsParams
from harness.world.physics.robot import RobotParams

# Places in the array of :func:`is_shaken`.
_PLACE, _VELOCITY, _LIMITS, _ACCELERATION = slice(3), slice(3, 6), slice(6, 9), slice(9, 12)


class BucketMotion:
    """Follows the centre of the bucket's floor from physics step to physics step."""

    def __init__(self, params: CargoParams, robot: RobotParams, physics: PhysicsParams) -> None:
        """Prepare for a bucket on a robot."""
        self._bucket = np.zeros(12)
        self._bucket[_PLACE] = np.subtract(robot.bucket, robot.center_of_mass)
        self._bucket[_LIMITS] = physics.rate, physics.gravity, params.wake_acceleration

    def reset(self, orientation: Quaternion, velocity: Vector, spin: Vector) -> None:
        """Start an episode with the robot's body in this motion."""
        x, y, z = self._bucket[_PLACE].tolist()
        self._bucket[_VELOCITY] = point_velocity(orientation, velocity, spin, x, y, z)

    def is_shaken(self, orientation: Quaternion, velocity: Vector, spin: Vector) -> bool:
        """Go on by a step; whether it shakes or tilts the bucket beyond what pieces bear at rest."""
        return is_shaken(orientation, velocity, spin, self._bucket)

    @property
    def acceleration(self) -> Vector:
        """Mean [m/s2] during the last step, map frame, without gravity."""
        x, y, z = self._bucket[_ACCELERATION].tolist()
        return x, y, z

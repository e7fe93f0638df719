"""What every sensor does."""

from abc import ABC, abstractmethod

import numpy as np

from harness.world.physics.body_state import BodyState
from navstack.types import FloatArray, GpsFix, Imu, LaserScan, Odometry

Measurement = Odometry | Imu | GpsFix | LaserScan


class Sensor(ABC):
    """Measures the true world imperfectly.

    Which measurement it makes is which field of the observation it fills.
    """

    @abstractmethod
    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Start an episode with the robot at ``body``.

        All noise comes from ``rng`` and its children.

        Each error draws from a generator of its own: the white noise from ``rng``, the others from
        its children, so that an error that is switched off leaves the others as they were.
        """

    @abstractmethod
    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Measurement | None:
        """One measurement; None: the sensor has none.

        Args:
            body: true motion of the robot now.
            pedestrians: (n, 4) x, y [m], vx, vy [m/s] in the map frame.
            stamp: [s] now.
        """

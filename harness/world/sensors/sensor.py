"""What every sensor does."""

from abc import ABC, abstractmethod
from typing import Generic, TypeVar

import numpy as np

from harness.world.physics.body_state import BodyState
from navstack.types import FloatArray

Message = TypeVar("Message", covariant=True)
Errors = tuple[float, ...]  # of a sensor, in an order of its own


class Sensor(ABC, Generic[Message]):
    """Measures the true world imperfectly; its messages are of the type ``Message``."""

    @abstractmethod
    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Start an episode with the robot at ``body``.

        Each error draws from a generator of its own, the white noise from ``rng``, the others from
        its children: an error that is switched off leaves the others as they were.
        """

    def lasting(self, stamp: float) -> Errors:
        """Its errors at ``stamp`` [s] that last beyond an episode; empty: it has none."""
        return ()

    def take_over(self, errors: Errors, age: float) -> None:
        """After a reset: go on with errors as they were ``age`` [s] before."""

    @abstractmethod
    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Message | None:
        """One measurement; None: the sensor has none.

        Args:
            body: true motion of the robot now.
            pedestrians: (n, 4) x, y [m], vx, vy [m/s] in the map frame.
            stamp: [s] now.
        """

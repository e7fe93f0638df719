"""What every world does: it is reset to a mission, stepped by commands, and knows the truth."""

from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np

from harness.task.mission import Mission
from harness.world.legacy import Legacy
from harness.world.truth import Truth
from navstack.types import Observation, Twist2D


class World(ABC):
    """A simulated world that holds one robot."""

    @abstractmethod
    def reset(
        self,
        mission: Mission,
        generators: Mapping[str, np.random.Generator],
        legacy: Legacy | None = None,
    ) -> Observation:
        """Put the robot at the start of a mission at time 0 and return the first observation.

        Args:
            mission: where it starts.
            generators: one each under ``pedestrians``, ``lidar``, ``odometry``, ``imu``, ``gps``
                and ``cargo``.
            legacy: of the robot's episode before; None: there was none.
        """

    @abstractmethod
    def step(self, command: Twist2D) -> Observation:
        """Advance by one tick under a velocity command; returns what the sensors delivered."""

    @abstractmethod
    def close_episode(self) -> Truth:
        """Finish what is still going on, such as contacts, and return the final truth."""

    @property
    @abstractmethod
    def truth(self) -> Truth:
        """The true state after the last step."""

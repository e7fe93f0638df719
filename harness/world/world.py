"""What every world does: it is reset to a mission, stepped by commands, and knows the truth."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.task.mission import Mission
from harness.world.sensors.sensor import Errors
from harness.world.truth import Truth
from navstack.types import Observation, Twist2D


@dataclass(frozen=True, slots=True)
class Legacy:
    """What an episode leaves to the next one of the same robot."""

    errors: Mapping[str, Errors]  # of each sensor, by its name
    pieces: int | None  # of the cargo in the bucket on the robot; None: it is filled anew
    age: float = 0.0  # [s] between the end of the one and the begin of the other


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
    def person_radius(self) -> float:
        """Of everybody's body [m]."""

    @property
    @abstractmethod
    def truth(self) -> Truth:
        """The true state after the last step."""

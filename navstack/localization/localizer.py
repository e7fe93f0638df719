"""What every localizer does."""

from abc import ABC, abstractmethod

import numpy as np

from navstack.types import Belief, Observation


class Localizer(ABC):
    """Turns observations into a belief about the robot's pose in the map frame."""

    @abstractmethod
    def reset(self, belief: Belief, rng: np.random.Generator) -> None:
        """Start over from an initial belief; all chance in localization is drawn from ``rng``."""

    @abstractmethod
    def update(self, observation: Observation) -> Belief:
        """Take in what arrived since the last call and return the belief at ``observation.stamp``."""

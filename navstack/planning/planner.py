"""What every global planner does."""

from abc import ABC, abstractmethod

import numpy as np

from navstack.costmap.costmap import Costmap
from navstack.types import Path, Pose2D


class Planner(ABC):
    """Finds a path through a costmap."""

    def reset(self, rng: np.random.Generator) -> None:  # noqa: B027 - most planners leave nothing to chance
        """Start a new goal; all chance of the plans to come is drawn from ``rng``."""

    @abstractmethod
    def plan(self, start: Pose2D, goal: Pose2D, costmap: Costmap, stamp: float = 0.0) -> Path:
        """A path from ``start`` to ``goal`` in the costmap's frame.

        Raises:
            PlanningError: start or goal outside the map or in an obstacle, or nothing connects them.
        """

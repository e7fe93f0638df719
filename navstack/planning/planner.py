"""What every global planner does."""

from abc import ABC, abstractmethod

from navstack.costmap.costmap import Costmap
from navstack.types import Path, Pose2D


class Planner(ABC):
    """Finds a path through a costmap."""

    @abstractmethod
    def plan(self, start: Pose2D, goal: Pose2D, costmap: Costmap, stamp: float = 0.0) -> Path:
        """A path from ``start`` to ``goal`` in the costmap's frame.

        Raises:
            PlanningError: start or goal outside the map or in an obstacle, or nothing connects them.
        """

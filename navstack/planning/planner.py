"""What every global planner does."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from navstack.costmap.costmap import Costmap
from navstack.types import FloatArray, Path, Pose2D


@dataclass(frozen=True, slots=True, eq=False)
class RobotShape:
    """What a planner may know of the robot's body."""

    footprint: FloatArray  # (N, 2) polygon [m], base frame, without padding
    # [m] around obstacles within which the costmap's costs mean contact (with padding)
    inscribed_radius: float


class Planner(ABC):
    """Finds a path through a costmap."""

    @property
    def improvement(self) -> tuple[tuple[float, float], ...]:
        """Wall time [s] and cost [m] whenever the last plan's best path got better.

        Most planners find one at once.
        """
        return ()

    def reset(self, rng: np.random.Generator) -> None:  # noqa: B027 - most planners leave nothing to chance
        """Start a new goal; all chance of the plans to come is drawn from ``rng``."""

    @abstractmethod
    def plan(self, start: Pose2D, goal: Pose2D, costmap: Costmap, stamp: float = 0.0) -> Path:
        """A path from ``start`` to ``goal`` in the costmap's frame.

        Raises:
            PlanningError: start or goal outside the map or in an obstacle, or nothing connects
                them.
        """

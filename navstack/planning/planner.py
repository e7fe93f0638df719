"""What every global planner does."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

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

    def reset(self, rng: np.random.Generator) -> None:  # noqa: B027 - most planners draw nothing
        """Start a new goal; all chance of the plans to come is drawn from ``rng``."""

    @abstractmethod
    def plan(
        self,
        start: Pose2D,
        goal: Pose2D,
        costmap: Costmap,
        stamp: float = 0.0,
    ) -> Path:
        """A path from ``start`` to ``goal`` in the costmap's frame.

        Raises:
            PlanningError: start or goal outside the map or in an obstacle, or nothing connects
                them.
        """


def convex_hull(shape: RobotShape | None) -> FloatArray:
    """The convex hull (N, 2) in [m] of the robot's footprint; a point where it is not known."""
    if shape is None:
        return np.zeros((3, 2))
    hull: FloatArray = shape.footprint[ConvexHull(shape.footprint).vertices]
    return hull

"""A delivery to make: from where, to where."""

from dataclasses import dataclass

from navstack.types import Pose2D


@dataclass(frozen=True, slots=True)
class Mission:
    """One delivery."""

    start: Pose2D  # true pose at the start, map frame
    goal: Pose2D
    shortest_path: float  # [m] along the walkable area

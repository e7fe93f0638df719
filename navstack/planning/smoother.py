"""What every path smoother does."""

from abc import ABC, abstractmethod

from navstack.costmap.costmap import Costmap
from navstack.types import Path


class Smoother(ABC):
    """Makes a planner's path smoother without leading it into obstacles."""

    refusal = ""  # why the last path, or a stretch of it, was given back as it came; empty: it was smoothed

    @abstractmethod
    def smooth(self, path: Path, costmap: Costmap) -> Path:
        """A smoother path with as many poses, the same stamp and the same ends, in the costmap's frame."""

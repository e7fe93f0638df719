"""What every controller does."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

from navstack.costmap.costmap import Costmap
from navstack.types import Path, RobotState, Twist2D


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """What a controller may know of the robot's vicinity."""

    costmap: Costmap  # local, in the map frame


class Controller(ABC):
    """Follows a plan. A new plan is recognised as a new object."""

    @abstractmethod
    def reset(self) -> None:
        """Forget everything about the previous goal."""

    @abstractmethod
    def compute_velocity(self, state: RobotState, plan: Path, surroundings: Surroundings) -> Twist2D:
        """The velocity to command now, in the base frame.

        Raises:
            ControlError: the plan cannot be followed; :class:`NoLegalVelocity` where every sample is rejected.
        """

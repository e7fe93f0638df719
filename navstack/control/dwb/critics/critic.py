"""What every critic does."""

from abc import ABC, abstractmethod

from navstack.control.dwb.pose_score import Measure
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import DwbScene
from navstack.types import FloatArray, Twist2D


class Critic(ABC):
    """Scores trajectories.

    The raw score is kept apart from its weight, so that a decision can be explained. Each cycle
    calls :meth:`prepare` with the scene and :meth:`debrief` with the command. Raw costs may be
    asked for until the next cycle; they must not depend on the command.
    """

    wants_tracks = False  # whether it looks at what moves about

    def __init__(self, scale: float) -> None:
        self._scale = scale

    def reset(self) -> None:  # noqa: B027 - most critics remember nothing
        """A new plan: forget what belongs to the previous one."""

    def prepare(self, scene: DwbScene) -> None:  # noqa: B027 - most critics need no preparation
        """Look once per cycle at what all trajectories share."""

    def scale(self, scene: DwbScene) -> float:
        """The weight of the raw costs; 0 leaves the critic out of this cycle."""
        return self._scale

    @abstractmethod
    def raw_costs(self, rollouts: Rollouts, scene: DwbScene) -> FloatArray:
        """One cost >= 0 per trajectory, (K, T) -> (K,); inf is the only "illegal"."""

    def measure(self, scene: DwbScene) -> Measure | None:
        """What the compiled search scores in this cycle.

        None: the search takes :meth:`raw_costs`.
        """
        return None

    def debrief(self, scene: DwbScene, command: Twist2D) -> None:  # noqa: B027
        """Hear what was commanded; standstill where every trajectory was illegal."""

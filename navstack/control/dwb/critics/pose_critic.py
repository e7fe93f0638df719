"""The base of the critics that score poses."""

from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.pose_score import AGGREGATION_TYPES, LAST, Measure, trajectory_scores
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import DwbScene
from navstack.errors import UnknownNameError
from navstack.types import FloatArray


class PoseCritic(Critic):
    """Scores by a compiled measure the last pose, or the sum or product over all poses."""

    kind: int  # of the measure

    def __init__(self, scale: float, aggregation_type: str, nose: float = 0.0) -> None:
        """``nose`` [m] ahead of the pose lies the scored point.

        Raises:
            UnknownNameError: the ``aggregation_type`` does not exist.
        """
        super().__init__(scale)
        name = aggregation_type.lower()
        if name not in AGGREGATION_TYPES:
            raise UnknownNameError("aggregation_type", aggregation_type, AGGREGATION_TYPES)
        self.measured = Measure(self.kind, AGGREGATION_TYPES.index(name), nose)

    def raw_costs(self, rollouts: Rollouts, scene: DwbScene) -> FloatArray:
        """The measure of each trajectory; inf if it is illegal."""
        r = rollouts
        costs: FloatArray = trajectory_scores(
            self.measured, r.x, r.y, r.yaw, r.lengths, scene.situation
        )
        return costs

    def measure(self, scene: DwbScene) -> Measure | None:
        """The measure of the last pose."""
        if self.measured.aggregation == LAST:
            return self.measured
        return None

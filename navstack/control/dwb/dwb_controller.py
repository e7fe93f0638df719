"""The dynamic window approach of Nav2.

Sample velocities, simulate them, let critics score, take the best.
"""

from collections.abc import Mapping

from navstack.control.controller import Controller, Surroundings
from navstack.control.decision import Alternative, DecisionRecord
from navstack.control.dwb.critics import build_critics
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.decision import Decision
from navstack.control.dwb.rollouts import RolloutGenerator
from navstack.control.dwb.scene import DwbScene
from navstack.control.dwb.scoring import Scoring
from navstack.control.plan_handling import PlanWindow
from navstack.errors import NoLegalVelocity
from navstack.params.dwb import DwbParams
from navstack.types import FloatArray, Path, Pose2D, RobotState, Twist2D


class DwbController(Controller):
    """``dwb_core::DWBLocalPlanner`` of Nav2 Jazzy.

    Nav2 stops scoring a trajectory once it is worse than the best so far
    (``short_circuit_trajectory_evaluation``), which never changes the winner. Here trajectories are
    compared by where they end, and only those that may win are scored in full.
    """

    def __init__(
        self,
        params: DwbParams,
        footprint: FloatArray,
        controller_frequency: float,
        critics: Mapping[str, Critic] | None = None,
    ) -> None:
        """Make the controller.

        Args:
            params: limits, sampling and critics.
            footprint: padded polygon (V, 2) in [m], base frame.
            controller_frequency: control cycles per second, in [Hz].
            critics: critics to use instead of those that ``params`` names.

        Raises:
            UnknownNameError: a critic, a generator or an aggregation type does not exist.
        """
        self._footprint = footprint
        self._generator = RolloutGenerator(params, controller_frequency)
        self._critics = dict(build_critics(params) if critics is None else critics)
        self.wants_tracks = any(critic.wants_tracks for critic in self._critics.values())
        self._scoring = Scoring(self._generator, self._critics)
        self._window = PlanWindow(
            params.prune_plan,
            params.prune_distance,
            params.forward_prune_distance,
            params.shorten_transformed_plan,
        )
        self._plan: Path | None = None
        self._goal = Pose2D()  # the plan's last pose
        self.last_decision: Decision | None = None

    def reset(self) -> None:
        """Forget the plan and everything remembered about it."""
        self._plan = None
        self.last_decision = None

    @property
    def decision(self) -> DecisionRecord | None:
        """See the base class."""
        if self.last_decision is None:
            return None
        return self.last_decision.record()

    @property
    def alternatives(self) -> tuple[Alternative, ...]:
        """See the base class: the second best, and the best of those at most half as fast."""
        if self.last_decision is None:
            return ()
        return self.last_decision.alternatives()

    def set_speed_limit(self, limit: float, is_percentage: bool) -> None:
        """Sample within the limit.

        See :meth:`~navstack.control.dwb.rollouts.RolloutGenerator.limit_speed`.
        """
        self._generator.limit_speed(limit, is_percentage)

    def compute_velocity(
        self, state: RobotState, plan: Path, surroundings: Surroundings
    ) -> Twist2D:
        """The best sampled velocity.

        Raises:
            InvalidPathError: the plan is empty or nowhere near the robot.
            NoLegalVelocity: every trajectory was rejected.
        """
        if plan is not self._plan:
            self._begin(plan)
        near = self._window.near(plan, state.pose, surroundings.costmap)
        decision = self.decide(state, near, self._goal, surroundings)
        if not decision.is_legal:
            raise NoLegalVelocity(decision.scores.rejections())
        return decision.command

    def decide(
        self,
        state: RobotState,
        near: FloatArray,
        goal: Pose2D,
        surroundings: Surroundings,
    ) -> Decision:
        """Choose among all samples by the plan ``near`` the robot (N, 3); remember the decision."""
        costmap = surroundings.costmap
        tracks = surroundings.tracks
        scene = DwbScene(
            state.pose, state.twist, state.stamp, goal, near, costmap, self._footprint, tracks
        )
        for critic in self._critics.values():
            critic.prepare(scene)
        decision = Decision(self._scoring, scene)
        for critic in self._critics.values():
            critic.debrief(scene, decision.command)
        self.last_decision = decision
        return decision

    def _begin(self, plan: Path) -> None:
        self._plan = plan
        if len(plan):
            self._goal = Pose2D(*plan.poses[-1].tolist())
        self._window.reset()
        for critic in self._critics.values():
            critic.reset()

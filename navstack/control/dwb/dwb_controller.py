"""The dynamic window approach of Nav2: sample velocities, simulate them, let critics score, take the best."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from navstack.control.controller import Controller, Surroundings
from navstack.control.decision import CriticScore, DecisionRecord
from navstack.control.dwb.critics import build_critics
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.kernels import add_weighted
from navstack.control.dwb.rollouts import RolloutGenerator, Rollouts
from navstack.control.dwb.scene import Scene
from navstack.control.plan_handling import PlanWindow
from navstack.errors import NoLegalVelocity
from navstack.params.dwb import DwbParams
from navstack.types import Float32Array, FloatArray, Path, Pose2D, RobotState, Twist2D


@dataclass(frozen=True, slots=True, eq=False)
class Decision:
    """How one cycle was decided. ``rollouts`` holds until the next cycle, the rest for good."""

    stamp: float  # [s]
    critics: tuple[str, ...]  # C names, in the order of evaluation
    scales: Float32Array  # (C,) weights; 0: not evaluated
    raw: FloatArray  # (C, K) raw score of every trajectory; inf: illegal
    totals: Float32Array  # (K,) weighted sums; inf: illegal
    best: int  # index of the chosen trajectory; the first of equals
    rollouts: Rollouts

    @property
    def is_legal(self) -> bool:
        """Whether any trajectory was legal."""
        return bool(np.isfinite(self.totals[self.best])) if len(self.totals) else False

    @property
    def command(self) -> Twist2D:
        """The chosen velocity; standstill if none is legal."""
        return Twist2D(*map(float, self.rollouts.commands[self.best])) if self.is_legal else Twist2D()

    @property
    def raw_scores(self) -> dict[str, float]:
        """Raw score of the chosen trajectory per critic."""
        return dict(zip(self.critics, self.raw[:, self.best].tolist(), strict=True))

    @property
    def weighted_scores(self) -> dict[str, float]:
        """Share of each critic in the chosen trajectory's total."""
        return dict(zip(self.critics, (self.raw[:, self.best] * self.scales).tolist(), strict=True))

    @property
    def rejections(self) -> dict[str, int]:
        """Trajectories rejected per critic; the first critic that objects counts."""
        illegal = np.isinf(self.raw[:, ~np.isfinite(self.totals)])  # the others have no infinite score
        first = illegal.argmax(axis=0)[illegal.any(axis=0)]
        counts = np.bincount(first, minlength=len(self.critics))
        return {name: int(count) for name, count in zip(self.critics, counts, strict=True) if count}

    def record(self) -> DecisionRecord:
        """The decision in short."""
        rejections = self.rejections
        raw = self.raw_scores if self.is_legal else {}
        weighted = self.weighted_scores if self.is_legal else {}
        scores = tuple(
            CriticScore(name, raw.get(name), weighted.get(name), rejections.get(name, 0)) for name in self.critics
        )
        return DecisionRecord(
            self.stamp,
            "DWBLocalPlanner",
            self.command,
            samples=len(self.totals),
            rejected=sum(rejections.values()),
            total=float(self.totals[self.best]) if self.is_legal else None,
            scores=scores,
        )


class DwbController(Controller):
    """``dwb_core::DWBLocalPlanner`` of Nav2 Jazzy.

    Nav2 stops scoring a trajectory once it is worse than the best so far (``short_circuit_trajectory_evaluation``);
    that never changes the winner, and here every critic scores all trajectories at once.
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
        self._critics = dict(critics) if critics is not None else build_critics(params)
        self._window = PlanWindow(
            params.prune_plan, params.prune_distance, params.forward_prune_distance, params.shorten_transformed_plan
        )
        self._plan: Path | None = None
        self.last_decision: Decision | None = None

    def reset(self) -> None:
        """Forget the plan and everything remembered about it."""
        self._plan = None
        self.last_decision = None

    @property
    def decision(self) -> DecisionRecord | None:
        """See the base class."""
        return None if self.last_decision is None else self.last_decision.record()

    def set_speed_limit(self, limit: float, is_percentage: bool) -> None:
        """Sample within the limit; see :meth:`~navstack.control.dwb.velocity_samples.VelocitySampler.limit_speed`."""
        self._generator.sampler.limit_speed(limit, is_percentage)

    def compute_velocity(self, state: RobotState, plan: Path, surroundings: Surroundings) -> Twist2D:
        """The best sampled velocity.

        Raises:
            InvalidPathError: the plan is empty or nowhere near the robot.
            NoLegalVelocity: every trajectory was rejected.
        """
        if plan is not self._plan:
            self._begin(plan)
        near = self._window.near(plan, state.pose, surroundings.costmap)
        decision = self.decide(state, near, Pose2D(*map(float, plan.poses[-1])), surroundings)
        if not decision.is_legal:
            raise NoLegalVelocity(decision.rejections)
        return decision.command

    def decide(self, state: RobotState, near: FloatArray, goal: Pose2D, surroundings: Surroundings) -> Decision:
        """Score all samples against the plan ``near`` the robot (N, 3) and remember the decision."""
        rollouts = self._generator.generate(state.pose, state.twist)
        scene = Scene(state.pose, state.twist, state.stamp, goal, near, surroundings.costmap, self._footprint)
        scene.locate(rollouts)
        raw = np.zeros((len(self._critics), len(rollouts.commands)))
        scales = np.zeros(len(self._critics), dtype=np.float32)
        for i, critic in enumerate(self._critics.values()):
            critic.prepare(scene)
            scales[i] = critic.scale(scene)
            if scales[i] != 0.0:
                raw[i] = critic.raw_costs(rollouts, scene)
        totals = add_weighted(raw, scales)
        best = int(totals.argmin()) if len(totals) else 0
        decision = Decision(state.stamp, tuple(self._critics), scales, raw, totals, best, rollouts)
        for critic in self._critics.values():
            critic.debrief(scene, decision.command)
        self.last_decision = decision
        return decision

    def _begin(self, plan: Path) -> None:
        self._plan = plan
        self._window.reset()
        for critic in self._critics.values():
            critic.reset()

"""Nav2's model predictive path integral controller."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from navstack.control.controller import Controller, Surroundings
from navstack.control.decision import CriticScore, DecisionRecord
from navstack.control.mppi.critics import build_critics
from navstack.control.mppi.optimizer import Optimizer, Solution
from navstack.control.mppi.path_handler import PathHandler
from navstack.control.mppi.scene import MppiScene
from navstack.errors import NoLegalVelocity
from navstack.params.mppi import MppiParams
from navstack.types import FloatArray, Path, Pose2D, RobotState, Twist2D

NAME = "MPPIController"


class _Cycle(NamedTuple):
    """What a decision record is made of."""

    scene: MppiScene
    solution: Solution | None  # None: all trajectories collide
    colliding: dict[str, int]


class MppiController(Controller):
    """``nav2_mppi_controller::MPPIController`` of Nav2 Jazzy.

    Where it differs from Jazzy: docs/mppi.md.
    """

    def __init__(
        self,
        params: MppiParams,
        footprint: FloatArray,
        controller_frequency: float,
        xy_goal_tolerance: float = 0.25,
    ) -> None:
        """Make the controller.

        Args:
            params: limits, sampling and critics.
            footprint: padded polygon (V, 2) in [m], base frame.
            controller_frequency: control cycles per second, in [Hz].
            xy_goal_tolerance: of the goal checker in [m]; only TwirlingCritic asks for it.

        Raises:
            ParameterError: the parameters do not fit the frequency.
        """
        self._params = params
        critics = build_critics(params, footprint, xy_goal_tolerance)
        self.wants_tracks = any(critic.wants_tracks for critic in critics)
        self._critics = tuple(critic.name for critic in critics)
        self._optimizer = Optimizer(params, critics, 1.0 / controller_frequency)
        self._path_handler = PathHandler(params)
        self.reset()

    def seed(self, rng: np.random.Generator) -> None:
        """See the base class."""
        self._optimizer.seed(rng)

    def reset(self) -> None:
        """Forget everything about the previous goal, the noise included."""
        self._plan: Path | None = None
        self._stamp = -math.inf  # [s] of the last cycle
        self._cycle: _Cycle | None = None  # the last
        self._optimizer.reset()

    @property
    def decision(self) -> DecisionRecord | None:
        """See the base class: scores of the chosen sequence, and trajectories in collision."""
        if self._cycle is None:
            return None
        scene, solution, colliding = self._cycle
        record = DecisionRecord(
            scene.stamp,
            NAME,
            Twist2D(),
            samples=self._params.batch_size,
            rejected=max(colliding.values(), default=0),
            scores=tuple(
                CriticScore(name, None, None, colliding.get(name, 0)) for name in self._critics
            ),
            status="failed",
        )
        if solution is None:
            return record
        scores = self._optimizer.score_alone(solution, scene)
        total = sum(score.weighted for score in scores if score.weighted is not None)
        return replace(
            record, command=solution.command, total=total, scores=scores, status="solved"
        )

    def set_speed_limit(self, limit: float, is_percentage: bool) -> None:
        """Lower the largest velocities in the ratio of ``limit`` to ``vx_max``, or to [%].

        0 lifts the limit.
        """
        self._optimizer.limit_speed(limit, is_percentage)

    def compute_velocity(
        self, state: RobotState, plan: Path, surroundings: Surroundings
    ) -> Twist2D:
        """The command from the mean of the sampled sequences.

        Raises:
            InvalidPathError: the plan is empty or nowhere near the robot.
            NoLegalVelocity: all trajectories collide.
        """
        period = self._params.reset_period
        if period is not None and state.stamp - self._stamp > period:
            self._optimizer.reset()
        self._stamp = state.stamp
        if plan is not self._plan:
            self._plan = plan
            self._path_handler.reset()
        path = self._path_handler.near(plan, state.pose, surroundings.costmap)
        goal = Pose2D(*map(float, plan.poses[-1]))
        unknown = self._params.local_costs.tracks_unknown
        scene = MppiScene(state, path, goal, surroundings.costmap, unknown, surroundings.tracks)
        try:
            solution = self._optimizer.solve(scene)
        except NoLegalVelocity as error:
            self._cycle = _Cycle(scene, None, error.rejections)
            raise
        self._cycle = _Cycle(scene, solution, solution.colliding)
        return solution.command

"""What the critics say of the trajectories of a cycle, and which of them is the best.

A critic is a class that scores all trajectories, for records, alternatives and other packages; the
kinds of
:mod:`.end_score` are the shipped ones once more in the compiled search, which finds the same choice
in a third of the time, and in which any other critic takes part with the costs that its class
gives.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from navstack.control.dwb.choice_kernels import best_command
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.end_score import GIVEN, NOTHING, EndScore
from navstack.control.dwb.end_score_kernels import Surface, Terms
from navstack.control.dwb.kernels import add_weighted
from navstack.control.dwb.rollouts import RolloutGenerator, Rollouts
from navstack.control.dwb.scene import Scene
from navstack.types import Float32Array, FloatArray, Twist2D


@dataclass(frozen=True, slots=True)
class Choice:
    """The trajectory that is driven."""

    index: int  # among the trajectories; the first of equals
    total: float  # weighted sum of its scores; inf: none is legal
    command: Twist2D  # standstill if none is legal


@dataclass(frozen=True, slots=True, eq=False)
class Scores:
    """What C critics say of K trajectories. ``rollouts`` holds until the next cycle, the rest for good."""

    critics: tuple[str, ...]  # C names, in the order of evaluation
    scales: Float32Array  # (C,) weights; 0: not evaluated
    raw: FloatArray  # (C, K) raw score of every trajectory; inf: illegal
    totals: Float32Array  # (K,) weighted sums; inf: illegal
    rollouts: Rollouts

    def best(self) -> Choice:
        """The trajectory with the least total."""
        best = int(self.totals.argmin()) if len(self.totals) else 0
        if len(self.totals) == 0 or not np.isfinite(self.totals[best]):
            return Choice(best, float("inf"), Twist2D())
        return Choice(best, float(self.totals[best]), self.command(best))

    def command(self, index: int) -> Twist2D:
        """The velocity of a trajectory."""
        return Twist2D(*self.rollouts.commands[index].tolist())

    def rejections(self) -> dict[str, int]:
        """Trajectories per critic, of which the first that objects counts.

        Without critics that reject none.
        """
        # the others have no infinite score
        illegal = np.isinf(self.raw[:, ~np.isfinite(self.totals)])
        first = illegal.argmax(axis=0)[illegal.any(axis=0)]
        counts = np.bincount(first, minlength=len(self.critics)).tolist()
        return {name: count for name, count in zip(self.critics, counts, strict=True) if count}


class Scoring:
    """Has the critics score the trajectories.

    All of them in full, or as far as it takes to find the best.
    """

    def __init__(self, generator: RolloutGenerator, critics: Mapping[str, Critic]) -> None:
        self._generator = generator
        self._critics = dict(critics)
        self._guess = 0  # index of the last choice, likely a good one again
        self._command: FloatArray = np.zeros(3)  # of the last choice: vx, vy, yaw rate

    def score_all(self, scene: Scene) -> Scores:
        """Every critic's raw costs of every trajectory."""
        rollouts = self._drive(scene)
        raw = np.zeros((len(self._critics), len(rollouts.commands)))
        scales = np.zeros(len(self._critics), dtype=np.float32)
        for i, critic in enumerate(self._critics.values()):
            scales[i] = critic.scale(scene)
            if scales[i] != 0.0:
                raw[i] = critic.raw_costs(rollouts, scene)
        return Scores(tuple(self._critics), scales, raw, add_weighted(raw, scales), rollouts)

    def best(self, scene: Scene) -> Choice | None:
        """The choice that all scores make, many times faster.

        None: it takes them, or no trajectory is legal.
        """
        pose, velocity, costmap = scene.pose, scene.velocity, scene.costmap
        if not self._generator.ends_suffice or velocity.linear_y != 0.0:
            return None
        asked = self._ask(scene)
        if asked is None:
            return None
        robot = (pose.x, pose.y, pose.yaw, velocity.linear_x, velocity.linear_y, velocity.angular_z)
        index, total = best_command(
            np.array(robot, dtype=np.float64),
            self._generator.sampling,
            *asked,
            scene.plan,
            (scene.goal.x, scene.goal.y),
            Surface(costmap.data, costmap.grid, scene.footprint),
            self._guess,
            self._command,
        )
        if index < 0:
            return None
        self._guess = index
        return Choice(int(index), float(total), Twist2D(*self._command.tolist()))

    def _ask(self, scene: Scene) -> tuple[Terms, FloatArray] | None:
        """What the critics score in this cycle, and the raw costs (G, K) of those that cannot say it in short.

        None: a weight is negative, so that what is not looked at yet may lower a total.
        """
        counted: list[tuple[int, float, float]] = []  # kind, number and scale
        given: list[FloatArray] = []
        for critic in self._critics.values():
            scale = critic.scale(scene)
            if scale == 0.0:
                continue
            if scale < 0.0:
                return None
            score = critic.end_score(scene)
            if score is None:
                score = EndScore(GIVEN, len(given))
                given.append(critic.raw_costs(self._drive(scene), scene))
            if score.kind != NOTHING:
                counted.append((score.kind, score.number, scale))
        table = np.array(counted, dtype=np.float64).reshape(-1, 3)
        terms = Terms(
            table[:, 0].astype(np.int64), table[:, 1].copy(), table[:, 2].astype(np.float32)
        )
        return terms, np.array(given, dtype=np.float64) if given else np.empty((0, 0))

    def _drive(self, scene: Scene) -> Rollouts:
        """The trajectories, once per scene."""
        if scene.rollouts is None:
            scene.rollouts = self._generator.generate(scene.pose, scene.velocity)
        return scene.rollouts

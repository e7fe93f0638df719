"""The critics' scores of the trajectories of a cycle, and the best trajectory.

A critic is a class that scores all trajectories. The shipped critics that read the map or the plan
score with kernels of :mod:`.pose_score`. The compiled search calls the same kernels and finds the
choice in a tenth of the time. Other critics take part in it with their raw costs.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from navstack.control.dwb.choice_kernels import GIVEN, Terms, best_command
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.kernels import add_weighted
from navstack.control.dwb.pose_score import NOTHING, Measure
from navstack.control.dwb.rollouts import RolloutGenerator, Rollouts
from navstack.control.dwb.scene import DwbScene
from navstack.plugin_answers import checked_costs
from navstack.types import Float32Array, FloatArray, Twist2D


@dataclass(frozen=True, slots=True)
class ChosenTrajectory:
    """The trajectory that is driven."""

    index: int  # among the trajectories; the first of equals
    total: float  # weighted sum of its scores; inf: none is legal
    command: Twist2D  # standstill if none is legal


@dataclass(frozen=True, slots=True, eq=False)
class Scores:
    """What C critics say of K trajectories. ``rollouts`` holds until the next cycle only."""

    critics: tuple[str, ...]  # C names, in the order of evaluation
    scales: Float32Array  # (C,) weights; 0: not evaluated
    raw: FloatArray  # (C, K) raw score of every trajectory; inf: illegal
    totals: Float32Array  # (K,) weighted sums; inf: illegal
    rollouts: Rollouts

    def best(self) -> ChosenTrajectory:
        """The trajectory with the least total."""
        if len(self.totals) == 0:
            return ChosenTrajectory(0, float("inf"), Twist2D())
        best = int(self.totals.argmin())
        if not np.isfinite(self.totals[best]):
            return ChosenTrajectory(best, float("inf"), Twist2D())
        return ChosenTrajectory(best, float(self.totals[best]), self.command(best))

    def command(self, index: int) -> Twist2D:
        """The velocity of a trajectory."""
        return Twist2D(*self.rollouts.commands[index].tolist())

    def rejections(self) -> dict[str, int]:
        """Rejected trajectories per critic; the first critic that objects counts."""
        # the others have no infinite score
        illegal = np.isinf(self.raw[:, ~np.isfinite(self.totals)])
        first = illegal.argmax(axis=0)[illegal.any(axis=0)]
        counts = np.bincount(first, minlength=len(self.critics)).tolist()
        return {name: count for name, count in zip(self.critics, counts, strict=True) if count}


class Scoring:
    """Has the critics score the trajectories: all in full, or as far as the choice needs."""

    def __init__(self, generator: RolloutGenerator, critics: Mapping[str, Critic]) -> None:
        self._generator = generator
        self._critics = dict(critics)
        self._guess = 0  # index of the last choice, likely a good one again
        self._command: FloatArray = np.zeros(3)  # of the last choice: vx, vy, yaw rate

    def score_all(self, scene: DwbScene) -> Scores:
        """Every critic's raw costs of every trajectory."""
        rollouts = self._drive(scene)
        raw = np.zeros((len(self._critics), len(rollouts.commands)))
        scales = np.zeros(len(self._critics), dtype=np.float32)
        for i, critic in enumerate(self._critics.values()):
            scales[i] = critic.scale(scene)
            if scales[i] != 0.0:
                raw[i] = _costs(critic, rollouts, scene)
        totals = add_weighted(raw, scales)
        totals[np.isinf(raw).any(axis=0)] = np.inf  # also where the weight is negative
        return Scores(tuple(self._critics), scales, raw, totals, rollouts)

    def best(self, scene: DwbScene) -> ChosenTrajectory | None:
        """The choice that :meth:`score_all` leads to, many times faster.

        None: the search does not apply, or found no legal trajectory.
        """
        if not self._generator.ends_suffice or scene.velocity.linear_y != 0.0:
            return None
        terms = self._terms(scene)
        if terms is None:
            return None
        index, total = best_command(
            self._generator.sampling, terms, scene.situation, self._guess, self._command
        )
        if index < 0:
            return None
        self._guess = index
        return ChosenTrajectory(int(index), float(total), Twist2D(*self._command.tolist()))

    def _terms(self, scene: DwbScene) -> Terms | None:
        """What the critics score in this cycle.

        None: a weight is negative, so that there are no lower bounds of totals.
        """
        kinds: list[int] = []
        noses: list[float] = []
        scales: list[float] = []
        given: dict[int, FloatArray] = {}  # raw costs (K,) of the critics without a measure
        for critic in self._critics.values():
            scale = critic.scale(scene)
            if scale == 0.0:
                continue
            if scale < 0.0:
                return None
            measure = critic.measure(scene)
            if measure is None:
                measure = Measure(GIVEN)
                given[len(kinds)] = _costs(critic, self._drive(scene), scene)
            if measure.kind != NOTHING:
                kinds.append(measure.kind)
                noses.append(measure.nose)
                scales.append(scale)
        costs = np.empty((len(kinds), max(map(len, given.values()), default=0)))
        for term, raw in given.items():
            costs[term] = raw
        return Terms(
            np.array(kinds, dtype=np.int64),
            np.array(noses, dtype=np.float64),
            np.array(scales, dtype=np.float32),
            costs,
        )

    def _drive(self, scene: DwbScene) -> Rollouts:
        """The trajectories, once per scene."""
        if scene.rollouts is None:
            scene.rollouts = self._generator.generate(scene.pose, scene.velocity)
        return scene.rollouts


def _costs(critic: Critic, rollouts: Rollouts, scene: DwbScene) -> FloatArray:
    costs = critic.raw_costs(rollouts, scene)
    return checked_costs(costs, len(rollouts.commands), critic)

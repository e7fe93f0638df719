"""How DWB decided one cycle."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from navstack.control.decision import CriticScore, DecisionRecord
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.kernels import add_weighted
from navstack.control.dwb.rollouts import RolloutGenerator, Rollouts
from navstack.control.dwb.scene import Scene
from navstack.types import Float32Array, FloatArray, Twist2D


@dataclass(frozen=True, slots=True, eq=False)
class Scores:
    """What C critics say of K trajectories. ``rollouts`` holds until the next cycle, the rest for good."""

    scales: Float32Array  # (C,) weights; 0: not evaluated
    raw: FloatArray  # (C, K) raw score of every trajectory; inf: illegal
    totals: Float32Array  # (K,) weighted sums; inf: illegal
    rollouts: Rollouts


def score_all(generator: RolloutGenerator, critics: Mapping[str, Critic], scene: Scene) -> Scores:
    """Have every critic, prepared for the ``scene``, score every trajectory."""
    rollouts = generator.generate(scene.pose, scene.velocity)
    scene.locate(rollouts)
    raw = np.zeros((len(critics), len(rollouts.commands)))
    scales = np.zeros(len(critics), dtype=np.float32)
    for i, critic in enumerate(critics.values()):
        scales[i] = critic.scale(scene)
        if scales[i] != 0.0:
            raw[i] = critic.raw_costs(rollouts, scene)
    return Scores(scales, raw, add_weighted(raw, scales), rollouts)


@dataclass(frozen=True, slots=True)
class Choice:
    """The trajectory that is driven."""

    index: int  # among the trajectories; the first of equals
    total: float  # weighted sum of its scores; inf: none is legal
    command: Twist2D  # standstill if none is legal

    @staticmethod
    def of(scores: Scores) -> "Choice":
        """The trajectory with the least total."""
        best = int(scores.totals.argmin()) if len(scores.totals) else 0
        if len(scores.totals) == 0 or not np.isfinite(scores.totals[best]):
            return Choice(best, float("inf"), Twist2D())
        return Choice(best, float(scores.totals[best]), Twist2D(*scores.rollouts.commands[best].tolist()))


class Decision:
    """How one cycle was decided.

    The choice is made for good. The scores of all trajectories are found when they are first asked for, which must be
    before the next cycle.
    """

    def __init__(
        self, generator: RolloutGenerator, critics: Mapping[str, Critic], scene: Scene, choice: Choice | None
    ) -> None:
        """``choice``: already known; None: it is made from the scores of all trajectories."""
        self._generator = generator
        self._critics = critics
        self._scene = scene
        self._scores: Scores | None = None
        self.choice = Choice.of(self.scores) if choice is None else choice

    @property
    def scores(self) -> Scores:
        """Of all trajectories."""
        if self._scores is None:
            self._scores = score_all(self._generator, self._critics, self._scene)
        return self._scores

    @property
    def critics(self) -> tuple[str, ...]:
        """C names, in the order of evaluation."""
        return tuple(self._critics)

    @property
    def is_legal(self) -> bool:
        """Whether any trajectory was legal."""
        return self.choice.total < float("inf")

    @property
    def command(self) -> Twist2D:
        """The chosen velocity; standstill if none is legal."""
        return self.choice.command

    @property
    def raw_scores(self) -> dict[str, float]:
        """Raw score of the chosen trajectory per critic."""
        return dict(zip(self.critics, self.scores.raw[:, self.choice.index].tolist(), strict=True))

    @property
    def weighted_scores(self) -> dict[str, float]:
        """Share of each critic in the chosen trajectory's total."""
        weighted = self.scores.raw[:, self.choice.index] * self.scores.scales
        return dict(zip(self.critics, weighted.tolist(), strict=True))

    @property
    def rejections(self) -> dict[str, int]:
        """Trajectories rejected per critic; the first critic that objects counts."""
        illegal = np.isinf(self.scores.raw[:, ~np.isfinite(self.scores.totals)])  # the others have no infinite score
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
            self._scene.stamp,
            "DWBLocalPlanner",
            self.command,
            samples=len(self.scores.totals),
            rejected=sum(rejections.values()),
            total=self.choice.total if self.is_legal else None,
            scores=scores,
        )

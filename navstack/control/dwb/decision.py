"""How DWB decided one cycle."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

import numpy as np

from navstack.control.decision import RUNNER_UP, SLOWER, Alternative, CriticScore, DecisionRecord
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


@dataclass(frozen=True, slots=True)
class Explanation:
    """What a decision tells of itself, critic by critic."""

    samples: int  # trajectories
    rejections: dict[str, int]  # of them per critic; the first critic that objects counts; without those without any
    raw: dict[str, float]  # score of the chosen trajectory per critic; no sense where none is legal
    weighted: dict[str, float]  # share of each critic in its total

    @staticmethod
    def of(scores: Scores, critics: Collection[str], index: int) -> "Explanation":
        """What the ``scores`` by ``critics`` (C names) tell of the trajectory ``index``, which was chosen."""
        illegal = np.isinf(scores.raw[:, ~np.isfinite(scores.totals)])  # the others have no infinite score
        first = illegal.argmax(axis=0)[illegal.any(axis=0)]
        counts = np.bincount(first, minlength=len(critics)).tolist()
        raw = scores.raw[:, index] if len(scores.totals) else np.zeros(len(critics))
        return Explanation(
            len(scores.totals),
            {name: count for name, count in zip(critics, counts, strict=True) if count},
            dict(zip(critics, raw.tolist(), strict=True)),
            dict(zip(critics, (raw * scores.scales).tolist(), strict=True)),
        )


class Decision:
    """How one cycle was decided.

    The choice is made for good. What else there is to tell is found when it is asked for, which must be before the
    next cycle.
    """

    def __init__(
        self,
        generator: RolloutGenerator,
        critics: Mapping[str, Critic],
        scene: Scene,
        choice: Choice | None,
        explain: Callable[[Scene], Explanation | None],
    ) -> None:
        """Take a choice, or make it.

        Args:
            generator: of the trajectories.
            critics: prepared for the scene.
            scene: what they saw.
            choice: already known; None: it is made from the scores of all trajectories.
            explain: tells of a known choice what those scores would tell, if it can.
        """
        self._generator = generator
        self._critics = critics
        self._scene = scene
        self._explain = explain
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
    def explanation(self) -> Explanation:
        """What there is to tell critic by critic."""
        told = self._explain(self._scene) if self._scores is None else None
        return told or Explanation.of(self.scores, self._critics, self.choice.index)

    def record(self) -> DecisionRecord:
        """The decision in short."""
        told, is_legal = self.explanation, self.is_legal
        return DecisionRecord(
            self._scene.stamp,
            "DWBLocalPlanner",
            self.command,
            samples=told.samples,
            rejected=sum(told.rejections.values()),
            total=self.choice.total if is_legal else None,
            scores=tuple(
                CriticScore(
                    name,
                    told.raw[name] if is_legal else None,
                    told.weighted[name] if is_legal else None,
                    told.rejections.get(name, 0),
                )
                for name in self._critics
            ),
        )

    def alternatives(self) -> tuple[Alternative, ...]:
        """The best of the other legal trajectories, and of those at most half as fast; none where all are illegal."""
        if not self.is_legal:
            return ()
        totals = self.scores.totals.astype(np.float64)
        totals[self.choice.index] = np.inf
        speeds = np.abs(self.scores.rollouts.commands[:, 0])
        is_slower = speeds <= 0.5 * abs(self.command.linear_x)
        best = {RUNNER_UP: int(totals.argmin()), SLOWER: int(np.where(is_slower, totals, np.inf).argmin())}
        return tuple(
            self._alternative(kind, index)
            for kind, index in best.items()
            if np.isfinite(totals[index]) and (kind != SLOWER or is_slower[index])
        )

    def _alternative(self, kind: str, index: int) -> Alternative:
        scores = self.scores
        raw = scores.raw[:, index]
        told = zip(self._critics, raw.tolist(), (raw * scores.scales).tolist(), strict=True)
        return Alternative(
            kind,
            Twist2D(*scores.rollouts.commands[index].tolist()),
            float(scores.totals[index]),
            tuple(CriticScore(name, one, other, 0) for name, one, other in told),
        )

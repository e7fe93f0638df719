"""How DWB decided one cycle."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property

import numpy as np

from navstack.control.decision import RUNNER_UP, SLOWER, Alternative, CriticScore, DecisionRecord
from navstack.control.dwb.scene import DwbScene
from navstack.control.dwb.scoring import Scores, Scoring


class Decision:
    """How one cycle was decided.

    The choice is made at once. Records are made when they are asked for, which must be before the
    next cycle.
    """

    def __init__(self, scoring: Scoring, scene: DwbScene) -> None:
        """Decide.

        Args:
            scoring: by critics that are prepared for the scene.
            scene: what they see.
        """
        self._scoring = scoring
        self._scene = scene
        self.choice = scoring.best(scene) or self.scores.best()
        self.command = self.choice.command  # standstill if no velocity is legal

    @cached_property
    def scores(self) -> Scores:
        """Of all trajectories."""
        return self._scoring.score_all(self._scene)

    @property
    def is_legal(self) -> bool:
        """Whether any trajectory was legal."""
        return self.choice.total < float("inf")

    def record(self) -> DecisionRecord:
        """The decision in short."""
        rejections = self.scores.rejections()
        record = DecisionRecord(
            self._scene.stamp,
            "DWBLocalPlanner",
            self.command,
            samples=len(self.scores.totals),
            rejected=sum(rejections.values()),
            scores=tuple(
                CriticScore(name, None, None, rejections.get(name, 0))
                for name in self.scores.critics
            ),
        )
        if not self.is_legal:
            return record
        scores = self._scores_of(self.choice.index, rejections)
        return replace(record, total=self.choice.total, scores=scores)

    def alternatives(self) -> tuple[Alternative, ...]:
        """The best of the other legal trajectories, and of those at most half as fast.

        Empty where all are illegal.
        """
        if not self.is_legal:
            return ()
        totals = self.scores.totals.astype(np.float64)
        totals[self.choice.index] = np.inf
        speeds = np.abs(self.scores.rollouts.commands[:, 0])
        is_slower = speeds <= 0.5 * abs(self.command.linear_x)
        candidates = {RUNNER_UP: totals, SLOWER: np.where(is_slower, totals, np.inf)}
        found = []
        for kind, costs in candidates.items():
            index = int(costs.argmin())
            if np.isfinite(costs[index]):
                command = self.scores.command(index)
                scores = self._scores_of(index, {})
                found.append(Alternative(kind, command, float(costs[index]), scores))
        return tuple(found)

    def _scores_of(self, index: int, rejections: Mapping[str, int]) -> tuple[CriticScore, ...]:
        """Raw score and share in the total of a trajectory, critic by critic."""
        scores = self.scores
        raw = scores.raw[:, index]
        shares = (raw * scores.scales).tolist()
        return tuple(
            CriticScore(name, value, share, rejections.get(name, 0))
            for name, value, share in zip(scores.critics, raw.tolist(), shares, strict=True)
        )

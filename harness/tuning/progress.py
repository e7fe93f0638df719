"""How far a study is."""

import math
from collections.abc import Sequence

import numpy as np

from harness.metrics import Row
from harness.statistics import Interval, bootstrap_mean
from harness.tuning.evaluation import Candidate, Evaluator
from harness.tuning.forecast import expected_gain
from harness.tuning.journal import Journal
from harness.tuning.result import Trial
from harness.tuning.search import Plan

DRAWS = 1000  # of the live interval


class Progress:
    """Counts, the best so far, and what is left."""

    def __init__(self, plan: Plan, journal: Journal, budget: float | None, later: int = 0) -> None:
        """Nothing is driven yet.

        Args:
            plan: of the study.
            journal: which keeps the time.
            budget: [s] of wall time; None: any.
            later: episodes that are driven after the search.
        """
        self._plan, self._journal, self._budget, self._later = plan, journal, budget, later
        self._driven, self._since = 0, 0  # episodes of this session, and of those the unfinished trial's
        self._last = journal.elapsed  # [s] when the last episode ended
        self.trials: list[Trial] = []
        self.best: Trial | None = None
        self.interval = Interval(None, None, None, 0)
        self.phase = "search"

    def episode(self, candidate: Candidate, row: Row) -> None:
        """One more episode was driven."""
        self._driven += 1
        self._since += 1
        self._last = self._journal.elapsed

    def trial(self, trial: Trial, incumbent: Trial, evaluator: Evaluator) -> None:
        """One more trial is over."""
        self.trials.append(trial)
        self._since = 0
        if self.best is not incumbent:
            self.best = incumbent
            self.interval = self._interval(evaluator.rows(incumbent.candidate, incumbent.missions))

    @property
    def driven(self) -> int:
        """Episodes of training so far."""
        return sum(len(trial.missions) for trial in self.trials)

    @property
    def saved(self) -> int:
        """Episodes that racing has spared."""
        total = len(self._plan.missions)
        return sum(total - len(trial.missions) for trial in self.trials if trial.state == "pruned")

    @property
    def remaining(self) -> float | None:
        """Wall time [s] that search, final choice and test are likely to take yet; None: too early to say.

        Counted in episodes, of which a trial takes as many as those before it did on average: it falls while a trial
        or an episode is being driven, too.
        """
        done, elapsed = len(self.trials) - 1, self._journal.elapsed
        if done < 1:
            return None
        each = sum(len(trial.missions) for trial in self.trials[1:]) / done
        episodes = max(each * (self._plan.trials - done) - self._since, 0.0) + self._later
        left = max(self._last / max(len(self._journal), 1) * episodes - (elapsed - self._last), 0.0)
        return left if self._budget is None else max(min(left, self._budget - elapsed), 0.0)

    @property
    def gain(self) -> float | None:
        """What the trials that are left are expected to add, see :mod:`harness.tuning.forecast`."""
        if self.best is None or len(self._plan.objectives) > 1:
            return None
        told = [trial.told[0] for trial in self.trials[1:] if trial.told]
        left = self._plan.trials - (len(self.trials) - 1)
        return expected_gain(told, self.best.values[0], self._error, left)

    @property
    def when(self) -> str:
        """How far the study is, in words."""
        if not self.trials:
            return "while the original was driven"
        done = len(self.trials) - 1
        return f"after {done} of {self._plan.trials} trials" if self.phase == "search" else f"during the {self.phase}"

    @property
    def text(self) -> str:
        """Everything in a line."""
        if self.phase != "search" or self.best is None:
            return f"{self.phase}: {self._driven} episodes driven"
        parts = [f"trial {len(self.trials) - 1}/{self._plan.trials}", f"best {self.best_text}"]
        parts.append(f"{self.driven} episodes, {self.saved} saved by racing")
        if self.remaining is not None:
            parts.append(f"about {self.remaining:.0f} s left")
        if self.gain is not None:
            parts.append(f"expected further gain {self.gain:.2f}")
        return ", ".join(parts)

    @property
    def best_text(self) -> str:
        """The incumbent and its score."""
        if self.best is None:
            return "none yet"
        low, high = self.interval.low, self.interval.high
        bounds = "" if low is None or high is None else f" ({low:.2f} .. {high:.2f})"
        return f"{self.best.values[0]:.2f}{bounds} of {self.best.candidate.name}"

    @property
    def _error(self) -> float:
        low, high = self.interval.low, self.interval.high
        return 0.0 if low is None or high is None else (high - low) / (2.0 * 1.96)

    def _interval(self, rows: Sequence[Row]) -> Interval:
        """Bootstrap interval of the first objective's mean form; of the best of many, hence too high."""
        scores = self._plan.objectives[0].scores(rows, rows)
        scores = scores[~np.isnan(scores)]
        if len(scores) < 2 or math.isclose(float(np.ptp(scores)), 0.0):
            return Interval(None, None, None, len(scores))
        return bootstrap_mean(scores, np.random.default_rng(0), DRAWS)

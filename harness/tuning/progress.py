"""How far a study is."""

import math
from collections.abc import Sequence

import numpy as np
from rich.table import Table
from scipy.integrate import quad
from scipy.stats import norm

from harness.metrics.columns import Row
from harness.statistics.interval import Interval
from harness.storage.texts import time_text
from harness.tuning.evaluation import Candidate, Evaluator
from harness.tuning.history import score_interval
from harness.tuning.journal import Journal
from harness.tuning.objective import score_text
from harness.tuning.result import PRUNED, Trial
from harness.tuning.search import Plan

SHOWN = 8  # trials of the live table
PACED = 4  # episodes after which the pace is known
LEAST = 10  # trials before anything can be said of what further ones may bring
WIDEST = 8.0  # standard deviations up to which their integral goes


class StudyProgress:
    """Counts, the best so far, and what is left."""

    def __init__(self, plan: Plan, journal: Journal, budget: float | None, later: int = 0) -> None:
        """Nothing is driven yet.

        Args:
            plan: of the study.
            journal: which keeps the time.
            budget: [s] of wall time; None: any.
            later: episodes that are driven after the search, at most.
        """
        self.plan, self._journal, self._budget, self._later = plan, journal, budget, later
        # episodes of this session, and of those the unfinished trial's or the later
        self._driven, self._since = 0, 0
        self.trials: list[Trial] = []
        self.best: Trial | None = None
        self.interval = Interval(None, None, None, 0)
        self.phase = "search"  # what is going on

    def episode(self, candidate: Candidate, row: Row) -> None:
        """One more episode was driven."""
        self._driven += 1
        self._since += 1

    def trial(self, trial: Trial, incumbent: Trial, evaluator: Evaluator) -> None:
        """One more trial is over."""
        self.trials.append(trial)
        self._since = 0
        if self.best is not incumbent:
            self.best = incumbent
            # of the best of many, hence too high
            rows = evaluator.rows(incumbent.candidate, incumbent.missions)
            self.interval = score_interval(self.plan.objectives[0], incumbent.values[0], rows, 0)

    def begin(self, phase: str, later: int | None = None) -> None:
        """Go on with what comes after the search.

        Args:
            phase: what it is called.
            later: episodes of all that comes, at most; None: as was said before.
        """
        if self.phase == "search":
            self._since = 0
        self.phase = phase
        if later is not None:
            self._later = later

    @property
    def remaining(self) -> float | None:
        """Wall time [s] that everything is likely to take yet; None: too early to say.

        Counted in episodes, of which a trial takes as many as those before it did on average, and
        what comes after the search as many as it can at most: it falls while a trial or an episode
        is being driven, too. What the budget leaves is the most.
        """
        done, elapsed, pace = len(self.trials) - 1, self._journal.elapsed, self._journal.pace
        if self.phase != "search":
            episodes = float(max(self._later - self._since, 0))
        elif done < 1:
            return None
        else:
            each = sum(len(trial.missions) for trial in self.trials[1:]) / done
            episodes = max(each * (self.plan.trials - done) - self._since, 0.0) + self._later
        # the episode that is being driven began when the last one ended
        left = pace * episodes - self._journal.idle
        if self._budget is not None:
            left = min(left, self._budget - elapsed)
        return max(left, 0.0)

    @property
    def gain(self) -> float | None:
        """What the trials that are left are expected to add, see :func:`expected_gain`."""
        if self.best is None or len(self.plan.objectives) > 1:
            return None
        told = [trial.told[0] for trial in self.trials[1:] if trial.told]
        low, high = self.interval.low, self.interval.high
        error = 0.0
        if not (low is None or high is None):
            error = (high - low) / (2.0 * 1.96)
        return expected_gain(
            told, self.best.values[0], error, self.plan.trials - (len(self.trials) - 1)
        )

    @property
    def when(self) -> str:
        """How far the study is, in words."""
        if not self.trials:
            return "while the original was driven"
        done = len(self.trials) - 1
        if self.phase == "search":
            return f"after {done} of {self.plan.trials} trials"
        return f"during the {self.phase}"

    @property
    def text(self) -> str:
        """Everything in a line."""
        if self.best is None and self.phase != "search":
            return f"{self.phase}: {self._driven} deliveries driven"
        if self.best is None:
            driven, all_missions = self._journal.timed, len(self.plan.missions)
            return f"original: {driven} of {all_missions} deliveries driven{self._over_budget}"
        if self.phase != "search":
            left = ""
            if self.remaining is not None and self._driven:
                left = f", at most about {time_text(self.remaining)} left"
            return f"{self.phase}: {self._since} of at most {self._later} deliveries driven{left}"
        low, high = self.interval.low, self.interval.high
        bounds = ""
        if not (low is None or high is None):
            bounds = f" [{self.text_of(low)}, {self.text_of(high)}]"
        best = f"best {self.text_of(self.best.values[0])}{bounds} of {self.best.candidate.name}"
        parts = [f"trial {len(self.trials) - 1}/{self.plan.trials}", best]
        driven = sum(len(trial.missions) for trial in self.trials)
        saved = sum(
            len(self.plan.missions) - len(trial.missions)
            for trial in self.trials
            if trial.state == PRUNED
        )
        parts.append(f"{driven} deliveries, {saved} saved by racing")
        if self.remaining is not None:
            parts.append(f"about {time_text(self.remaining)} left")
        if self.gain is not None:
            parts.append(f"expected further gain {self.text_of(self.gain)}")
        return ", ".join(parts)

    @property
    def _over_budget(self) -> str:
        """Whether the original's missions alone take longer than the budget; empty: no."""
        if self._budget is None or self._driven < PACED:
            return ""
        least = self._journal.pace * len(self.plan.missions)
        if least <= self._budget:
            return ""
        return f"; all of them take about {time_text(least)}, longer than the budget"

    def __rich__(self) -> Table:
        """The last trials, below everything in a line."""
        table = Table(title=self.text, title_justify="left", title_style="")
        for column in ("trial", "state", "episodes", "objective", "p"):
            table.add_column(column, justify="left" if column == "state" else "right")
        for trial in self.trials[-SHOWN:]:
            value = ""
            if trial.told:
                value = self.text_of(trial.told[0])
            p = ""
            if trial.p is not None:
                p = f"{trial.p:.3f}"
            mark = ""
            if self.best is trial:
                mark = "*"
            table.add_row(f"{mark}{trial.number}", trial.state, str(len(trial.missions)), value, p)
        return table

    def text_of(self, value: float) -> str:
        """A value of the first objective."""
        return score_text(self.plan.objectives[0].name, value)


def expected_gain(
    values: Sequence[float],
    best: float,
    error: float,
    remaining: int,
) -> float | None:
    """How much the best of ``remaining`` further trials is expected to exceed ``best``.

    As if they came from the normal distribution of the later half of what was tried, the noise of
    measuring a trial taken off its variance: the integral of 1 - Phi((x - mean) / sd)^remaining
    over all x above ``best`` (expected largest of normal variables: e.g. David and Nagaraja 2003,
    section 3.1). A sampler that still learns does better, one that has found the top worse;
    ``best`` was chosen for being large and so is too large itself.

    Args:
        values: what the sampler was told of each trial, in order.
        best: the incumbent's.
        error: standard error of a trial's value.
        remaining: number of trials.

    Returns:
        None: there are too few trials to say.
    """
    if len(values) < LEAST or remaining < 1:
        if remaining:
            return None
        return 0.0
    later = np.asarray(values[len(values) // 2 :])
    mean, deviation = float(later.mean()), math.sqrt(max(float(later.var(ddof=1)) - error**2, 0.0))
    if deviation == 0.0:
        return max(mean - best, 0.0)
    end = max(best, mean) + WIDEST * deviation
    gain, _ = quad(lambda x: 1.0 - norm.cdf(x, mean, deviation) ** remaining, best, end)
    return float(gain)

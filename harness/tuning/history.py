"""How the best trial of a study grew, with how sure its score is."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.audit.pairs import pair_up
from harness.economics.prices import Prices
from harness.metrics.columns import Row
from harness.statistics.bootstrap import percentile_interval
from harness.statistics.interval import Interval
from harness.tuning.evaluation import Evaluator
from harness.tuning.objective import Objective, parse_objectives
from harness.tuning.result import COMPLETE, StudyResult
from navstack.errors import InputError

DRAWS = 400  # bootstrap draws per interval


@dataclass(frozen=True, slots=True)
class Best:
    """A trial that was the best when it was driven."""

    number: int  # of the trial
    score: Interval  # of the first objective over training missions
    # [USD/run] on these by accounting of contacts; empty where the margin is undefined
    margins: Mapping[str, float]

    def as_json(self) -> Row:
        """The trial as one JSON object."""
        return {"trial": self.number, **self.score.as_json(), "accountings": dict(self.margins)}


def history(study: StudyResult, evaluator: Evaluator, prices: Prices) -> tuple[Best, ...]:
    """Trials that were better than all complete ones before them by a cent, the original first.

    Intervals are the bootstrap's over training missions, 95 %. They are of each trial alone: as the
    best of many is chosen, its score is too good (the report's optimism says by how much).
    """
    objective = parse_objectives(",".join(study.objectives))[0]
    found: list[Best] = []
    for trial in study.trials:
        if found:
            least = (found[-1].score.value or 0.0) + objective.resolution
        else:
            least = -math.inf
        if trial.state != COMPLETE or trial.values[0] <= least:
            continue
        rows = evaluator.rows(trial.candidate, trial.missions)
        scores = pair_up(rows, rows, prices, study.seed).scores
        margins = {accounting: each.incumbent for accounting, each in scores.items()}
        found.append(
            Best(
                trial.number, score_interval(objective, trial.values[0], rows, study.seed), margins
            )
        )
    return tuple(found)


def score_interval(objective: Objective, value: float, rows: Sequence[Row], seed: int) -> Interval:
    """An objective's value on some deliveries with its 95 % bootstrap interval.

    Without bounds where all are alike.
    """
    rng, n = np.random.default_rng(seed), len(rows)
    draws = np.array(
        [_value(objective, [rows[i] for i in rng.integers(0, n, n)]) for _ in range(DRAWS)]
    )
    known = draws[~np.isnan(draws)]
    if known.size < 2 or math.isclose(float(np.ptp(known)), 0.0, abs_tol=1e-12):
        return Interval(value, None, None, len(rows))
    return percentile_interval(value, draws, len(rows))


def _value(objective: Objective, rows: Sequence[Row]) -> float:
    """The objective; NaN where a resample has nothing of its kind."""
    try:
        return objective.value(rows, len(rows))
    except InputError:
        return math.nan

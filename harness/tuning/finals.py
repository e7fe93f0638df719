"""The final choice: the best few trials meet again on missions that had no part in choosing them.

The best of a hundred trials on few missions is one of the luckiest, too, and its score too good.
What is left of the few best on new missions is a fair sample of each, so that choosing among them
by it costs little of that luck. They are halved (Karnin, Koren and Somekh 2013, "Almost optimal
exploration in multi-armed bandits"): after each round the worse half drops out, and the others
drive twice as many missions. All drive the same ones, so that means differ as pairs do. The
original stays in to the end: where the last trial is no better on all missions, nothing is changed.
Missions that one of those that meet could not finish count for none of them: a worker that dies
says nothing of a file.
"""

import contextlib
import itertools
import math
from collections.abc import Sequence

from harness.audit.pairs import has_error
from harness.tuning.evaluation import Evaluator
from harness.tuning.objective import Objective, UndefinedError
from harness.tuning.result import COMPLETE, Finalist, Trial

MOST_LOST = 0.1  # share of its missions; a trial that loses more cannot be driven


def decide(
    trials: Sequence[Trial],
    count: int,
    missions: Sequence[int],
    objective: Objective,
    evaluator: Evaluator,
) -> tuple[Finalist, ...]:
    """Let the best ``count`` trials that drove all training missions meet the original.

    Returns all, the best first.

    Args:
        trials: of the study, the original's first.
        count: of trials beside the original; 0: there is no final choice.
        missions: for training, other ones than the trials drove.
        objective: the study's first.
        evaluator: that drives them.
    """
    if not count or not missions:
        return ()
    left = _rivals(trials, count, objective, evaluator)
    if not left:
        return ()
    out: list[Finalist] = []
    for driven, kept in schedule(len(left), len(missions)):
        order = _ranked(_meet(left, missions[:driven], objective, evaluator))
        out = [*order[kept:], *out]
        left = [trials[number] for number in sorted(each.number for each in order[:kept])]
    original, best = _meet([trials[0], trials[order[0].number]], missions, objective, evaluator)
    is_better = math.isfinite(original.value) and (
        best.shortfall < original.shortfall
        or (
            best.shortfall == original.shortfall
            and best.value > original.value + objective.resolution
        )
    )
    return (*((best, original) if is_better else (original, best)), *out)


def schedule(entrants: int, missions: int) -> tuple[tuple[int, int], ...]:
    """Of each round how many missions every trial has driven after it, and how many stay.

    The last leaves one.
    """
    rounds = max(math.ceil(math.log2(entrants)), 1)
    found, left = [], entrants
    for number in range(rounds):
        left = max(math.ceil(left / 2), 1)
        found.append((max(missions >> (rounds - 1 - number), 1), left))
    return tuple(found)


def most_episodes(count: int, missions: int) -> int:
    """Deliveries that the final choice of ``count`` trials and the original takes at most."""
    if not count or not missions:
        return 0
    total, before, left = missions, 0, count
    for driven, kept in schedule(count, missions):
        total, before, left = total + left * (driven - before), driven, kept
    return total


def _rivals(
    trials: Sequence[Trial],
    count: int,
    objective: Objective,
    evaluator: Evaluator,
) -> list[Trial]:
    """The best complete trials that drive otherwise than the original and than each other."""
    complete = [trial for trial in trials if trial.state == COMPLETE]

    def rank(trial: Trial) -> tuple[float, float, int]:
        shortfall = objective.shortfall(evaluator.rows(trial.candidate, trial.missions))
        return shortfall, -trial.values[0], trial.number

    different = {trial.candidate.key: trial for trial in sorted(complete, key=rank, reverse=True)}
    different.pop(trials[0].candidate.key, None)
    return sorted(different.values(), key=rank)[:count]


def _meet(
    trials: Sequence[Trial],
    missions: Sequence[int],
    objective: Objective,
    evaluator: Evaluator,
) -> list[Finalist]:
    """Let trials drive the same missions.

    Those count that all of them finished, but for trials that lost many.
    """
    driven = [evaluator.rows(trial.candidate, missions) for trial in trials]
    steady = [sum(map(has_error, rows)) <= MOST_LOST * len(rows) for rows in driven]
    judges = list(itertools.compress(driven, steady))
    sound = [not any(has_error(rows[place]) for rows in judges) for place in range(len(missions))]
    found = []
    for trial, rows, is_steady in zip(trials, driven, steady, strict=True):
        counted = []
        if is_steady:
            counted = list(itertools.compress(rows, sound))
        value, shortfall = -math.inf, math.inf
        with contextlib.suppress(UndefinedError):
            if counted:
                value, shortfall = (
                    objective.value(counted, len(counted)),
                    objective.shortfall(counted),
                )
        found.append(Finalist(trial.number, trial.candidate, len(counted), value, shortfall))
    return found


def _ranked(finalists: Sequence[Finalist]) -> list[Finalist]:
    """By the side condition, then by the objective; of equals the first one given comes first."""
    return sorted(finalists, key=lambda each: (each.shortfall, -each.value))

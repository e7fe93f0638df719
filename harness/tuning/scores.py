"""Scores of original and incumbent on training and unseen missions, with intervals."""

import contextlib
import itertools
from collections.abc import Sequence

import numpy as np

from harness.audit.pairs import has_error
from harness.economics.valuation import CENT, missions
from harness.metrics.columns import Row
from harness.statistics.paired import compare_pairs
from harness.tuning.objective import Objective, UndefinedError, is_money, parse_objectives
from harness.tuning.result import StudyResult

ALWAYS = ("margin", "sla")  # told of beside the objectives


def scores_document(result: StudyResult) -> Row:
    """Both files' scores on training and test missions, and the ``optimism`` of training.

    ``test`` and ``optimism`` are None where no test mission was driven.

    Differences are of the quantity's mean, incumbent less original, paired mission by mission, with
    the sign-flip test and the 95 % interval that inverts it; ``shortfall`` says by how much
    original and incumbent miss the objective's side condition. Optimism is the training difference
    less the test difference: what choosing the best of many on the same missions has added.
    """
    objectives = parse_objectives(",".join(dict.fromkeys((*result.objectives, *ALWAYS))))
    train = _scores(objectives, *result.train_rows, result.seed)
    if not result.is_tested:
        return {"train": train, "test": None, "optimism": None}
    test = _scores(objectives, *result.judged_rows, result.seed)
    optimism = {
        name: train[name]["difference"]["value"] - test[name]["difference"]["value"]
        for name in train
        if name in test
    }
    return {"train": train, "test": test, "optimism": optimism}


def _scores(
    objectives: Sequence[Objective],
    original: Sequence[Row],
    incumbent: Sequence[Row],
    seed: int,
) -> Row:
    """By name of the quantity; those that are undefined here are left out."""
    first, second = [], []
    for before, after in zip(original, incumbent, strict=True):
        if not (has_error(before) or has_error(after)):
            first.append(before)
            second.append(after)
    if not first:
        return {}
    scores = {}
    for objective in objectives:
        with contextlib.suppress(UndefinedError):
            scores[objective.name] = _score(objective, first, second, seed)
    return scores


def _score(
    objective: Objective,
    original: Sequence[Row],
    incumbent: Sequence[Row],
    seed: int,
) -> Row:
    measured = objective.measured
    before = measured.scores(original, original)
    after = measured.scores(incumbent, original)
    known = ~(np.isnan(before) | np.isnan(after))
    if not known.any():
        raise UndefinedError(
            f"objective '{objective.name}' is undefined on every mission for one of the two files"
        )
    # those of both, so that the difference is that of the two values
    kept = [list(itertools.compress(rows, known)) for rows in (original, incumbent)]
    paired = compare_pairs(
        before[known], after[known], missions(kept[0]), np.random.default_rng(seed),
        CENT if is_money(objective.name) else 0.0,
    )  # fmt: skip
    values = [measured.value(rows, len(rows)) for rows in kept]
    return {
        "original": values[0],
        "incumbent": values[1],
        "shortfall": [objective.shortfall(rows) for rows in (original, incumbent)],
        "difference": paired.difference.as_json(),
        "p": paired.p,
        "pairs_needed": paired.needed,
    }

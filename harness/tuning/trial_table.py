"""Trials as arrays: where each parameter lay in its range, and what came of it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.tuning.evaluation import Value
from harness.tuning.result import FAILED, Trial
from harness.tuning.space import Parameter, Space
from navstack.types import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class TrialTable:
    """Trials that were driven; of pruned ones the objective is the estimate for all missions that the sampler had."""

    parameters: tuple[Parameter, ...]
    trials: tuple[Trial, ...]
    places: FloatArray  # (trials, parameters) in 0..1 of the range, in the logarithm where the parameter is so
    objective: FloatArray  # (trials,) the study's first, larger is better


def trial_table(space: Space, trials: Sequence[Trial]) -> TrialTable:
    """The trials that have a value."""
    driven = tuple(trial for trial in trials if trial.state != FAILED and trial.told)
    places = [[place(each, trial.point[each.name]) for each in space.parameters] for trial in driven]
    shape = (len(driven), len(space.parameters))
    objective = np.array([trial.told[0] for trial in driven], dtype=np.float64)
    return TrialTable(space.parameters, driven, np.array(places, dtype=np.float64).reshape(shape), objective)


def place(parameter: Parameter, value: Value) -> float:
    """Where a value lies in its range, 0 at the low end and 1 at the high one; choices stand evenly in their order."""
    if parameter.choices:
        return parameter.choices.index(value) / max(len(parameter.choices) - 1, 1)
    low, high, number = parameter.low, parameter.high, float(value)
    if parameter.is_log:
        low, high, number = math.log(low), math.log(high), math.log(number)
    return (number - low) / (high - low) if high > low else 0.0


def is_ordered(parameter: Parameter) -> bool:
    """Whether the values have an order: numbers do, texts and switches do not."""
    return not any(isinstance(choice, str | bool) for choice in parameter.choices)

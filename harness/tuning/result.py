"""What a tuning study found."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.metrics.columns import Row
from harness.tuning.evaluation import Candidate, Value
from harness.tuning.space.space import Parameter, Space
from navstack.types import FloatArray

COMPLETE, PRUNED, FAILED = "complete", "pruned", "failed"  # states of a trial


@dataclass(frozen=True, slots=True)
class Trial:
    """One candidate on training missions.

    ``evaluator.rows(trial.candidate, trial.missions)`` gives its episodes again without driving
    anything.
    """

    number: int  # 0: the original
    candidate: Candidate
    # by name of the parameter, every one; of the original what its file says
    point: dict[str, Value]
    # COMPLETE: drove all training missions; PRUNED: dropped on the way; FAILED: could not be driven
    state: str
    missions: tuple[int, ...]  # for training that it drove, in its order; a dropped trial not all
    # each objective on these missions, larger is better; empty when it failed
    values: tuple[float, ...]
    told: tuple[float, ...]  # what the sampler was told of it
    # of the race's last look that it is no worse than the incumbent; None: there was no race
    p: float | None
    reason: str  # why it was pruned or failed


@dataclass(frozen=True, slots=True)
class Finalist:
    """One trial that took part in the final choice."""

    number: int  # of its trial; 0: the original
    candidate: Candidate
    missions: int  # final ones that it and those that it met finished
    value: float  # of the first objective on them; minus infinity where it could not be driven
    shortfall: float  # by how much it misses the objective's side condition on them

    def as_json(self) -> Row:
        """The finalist as one JSON object."""
        value = None
        if math.isfinite(self.value):
            value = self.value
        return {"trial": self.number, "missions": self.missions, "value": value}


@dataclass(frozen=True, slots=True, eq=False)
class TrialTable:
    """Trials that were driven.

    Of pruned ones the objective is the estimate for all missions that the sampler had.
    """

    parameters: tuple[Parameter, ...]
    trials: tuple[Trial, ...]
    # (trials, parameters) in 0..1 of the range, in the logarithm where the parameter is so
    places: FloatArray
    objective: FloatArray  # (trials,) the study's first, larger is better

    @property
    def varied(self) -> list[int]:
        """Numbers of the parameters of which there is more than one value."""
        if len(self.trials):
            return np.flatnonzero(np.ptp(self.places, axis=0)).tolist()
        return []


def trial_table(space: Space, trials: Sequence[Trial]) -> TrialTable:
    """The trials that have a value."""
    driven = tuple(trial for trial in trials if trial.state != FAILED and trial.told)
    places = [[each.place(trial.point[each.name]) for each in space.parameters] for trial in driven]
    shape = (len(driven), len(space.parameters))
    objective = np.array([trial.told[0] for trial in driven], dtype=np.float64)
    return TrialTable(
        space.parameters, driven, np.array(places, dtype=np.float64).reshape(shape), objective
    )


def least_squares(design: FloatArray, answer: FloatArray) -> tuple[FloatArray, float, int]:
    """Coefficients of a response surface, the residual sum of squares, and the rank."""
    solution, _, rank, _ = np.linalg.lstsq(design, answer, rcond=None)
    left = answer - design @ solution
    return np.asarray(solution, dtype=np.float64), float(left @ left), int(rank)


@dataclass(frozen=True, slots=True)
class StudyResult:
    """Everything that the search and the test brought. Rows stand in the order of the missions."""

    original: Candidate
    # the final choice's best, or else the training's; the original where nothing was better
    incumbent: Candidate
    # names; several: a Pareto study, in which the incumbent is best in the first
    objectives: tuple[str, ...]
    space: Space
    trials: tuple[Trial, ...]  # the original's first
    # numbers of the trials that no other beats in all objectives; one unless a Pareto study
    front: tuple[int, ...]
    seed: int
    train_missions: tuple[int, ...]  # stratified: each rung is a balanced first part
    test_missions: tuple[int, ...]
    train_rows: tuple[Sequence[Row], Sequence[Row]]  # of original and incumbent
    # of original and incumbent; empty where no test was asked for
    test_rows: tuple[Sequence[Row], ...]
    # who took part in the final choice, the best first; empty: there was none
    finals: tuple[Finalist, ...] = ()
    final_missions: tuple[int, ...] = ()  # on which the last of them met
    # whether the original leaves something to gain on its training missions; then no trial means
    # that there was no time for one
    has_room: bool = False

    def tuned(self, parameter: Parameter) -> Value:
        """The incumbent's value of a parameter that it changes."""
        values = self.incumbent.values
        return next(values[path] for path in parameter.paths if path in values)

    @property
    def is_tested(self) -> bool:
        """Whether both were driven on test missions."""
        return len(self.test_rows) == 2

    @property
    def judged_rows(self) -> tuple[Sequence[Row], Sequence[Row]]:
        """Rows of original and incumbent that the result is judged by.

        Of the test where there is one.
        """
        if self.is_tested:
            return (self.test_rows[0], self.test_rows[1])
        return self.train_rows

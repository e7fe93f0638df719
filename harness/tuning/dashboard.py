"""A study as Optuna keeps one in a file, for ``optuna-dashboard`` and Optuna's own plots."""

import warnings
from pathlib import Path

import optuna
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import FrozenTrial, TrialState, create_trial

from harness.storage.files import writing
from harness.tuning.result import COMPLETE, FAILED, StudyResult, Trial
from harness.tuning.sampler import distributions_of, possible_point

DASHBOARD, NAME = "optuna.journal", "navbench"


def write_dashboard(result: StudyResult, folder: Path) -> Path:
    """Write the trials of a study anew into ``optuna.journal``.

    A dropped trial has the corrected value that the sampler was told, a failed one has none.

    Raises:
        InputError: the folder cannot be written.
    """
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    path = folder / DASHBOARD
    with writing(folder):
        path.unlink(missing_ok=True)
        storage = JournalStorage(JournalFileBackend(str(path)))
        study = optuna.create_study(
            storage=storage,
            study_name=NAME,
            directions=["maximize"] * len(result.objectives),
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Optuna calls the names experimental
            study.set_metric_names(list(result.objectives))
        best = next(
            trial.number for trial in result.trials if trial.candidate.key == result.incumbent.key
        )
        study.set_user_attr("incumbent", best)
        study.add_trials([_as_optuna(trial, result) for trial in result.trials])
    return path


def _as_optuna(trial: Trial, result: StudyResult) -> FrozenTrial:
    values = None
    if trial.state == COMPLETE:
        state = TrialState.COMPLETE
        values = [float(value) for value in trial.values]
    elif trial.state == FAILED:
        state = TrialState.FAIL
    else:
        state = TrialState.PRUNED
    told = [float(value) for value in trial.told or ()]
    intermediate = None
    if told and len(result.objectives) == 1:
        intermediate = {len(trial.missions): told[0]}
    return create_trial(
        state=state,
        values=values,
        params=possible_point(result.space, trial.point),
        distributions=distributions_of(result.space),
        intermediate_values=intermediate,
        user_attrs={"missions": len(trial.missions), "reason": trial.reason, "told": told},
    )

"""A study's file for optuna-dashboard, read back by Optuna."""

from collections.abc import Callable
from pathlib import Path

import optuna
import pytest

from harness.tuning.dashboard import DASHBOARD, NAME, write_dashboard
from harness.tuning.result import COMPLETE, FAILED, StudyResult


def test_optuna_reads_the_trials_back(
    make_study: Callable[..., StudyResult], tmp_path: Path
) -> None:
    result = make_study(trials=30)
    for _ in range(2):  # a second time replaces the first
        path = write_dashboard(result, tmp_path)
    assert path == tmp_path / DASHBOARD
    storage = optuna.storages.JournalStorage(optuna.storages.journal.JournalFileBackend(str(path)))
    study = optuna.load_study(study_name=NAME, storage=storage)
    assert study.metric_names == list(result.objectives)
    assert len(study.trials) == len(result.trials)
    states = {True: optuna.trial.TrialState.COMPLETE, False: optuna.trial.TrialState.PRUNED}
    for read, trial in zip(study.trials, result.trials, strict=True):
        assert trial.state != FAILED and read.state == states[trial.state == COMPLETE]
        assert read.user_attrs["told"] == pytest.approx(list(trial.told))
        for name, value in trial.point.items():
            assert read.params[name] == pytest.approx(value)
        if trial.state == COMPLETE:
            assert read.values == pytest.approx(list(trial.values))
    incumbent = study.user_attrs["incumbent"]
    assert result.trials[incumbent].candidate.key == result.incumbent.key

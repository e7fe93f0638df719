"""Importance on objectives whose answer is known."""

import dataclasses

import numpy as np
import optuna
import pytest
from optuna.distributions import CategoricalDistribution, FloatDistribution
from optuna.importance import PedAnovaImportanceEvaluator, get_param_importances
from optuna.trial import create_trial

from harness.tuning.evaluation import Candidate
from harness.tuning.importance import importances
from harness.tuning.ped_anova import PedAnova
from harness.tuning.result import COMPLETE, FAILED, Trial, TrialTable, trial_table
from harness.tuning.space.space import Parameter, Space

PARAMETERS = tuple(
    Parameter(name, (f"node.{name}",), 0.5, 0.0, 1.0)
    for name in ("strong", "left", "right", "none")
)
SPACE = Space(
    "made-up", "", (*PARAMETERS, Parameter("kind", ("node.kind",), "a", choices=("a", "b")))
)


def table(trials: int, strong: float) -> TrialTable:
    rng = np.random.default_rng(11)
    found = []
    for number in range(trials):
        point = {each.name: float(rng.random()) for each in PARAMETERS} | {
            "kind": str(rng.choice(["a", "b"]))
        }
        value = strong * -((point["strong"] - 0.3) ** 2) + float(rng.normal(0.0, 0.1))
        found.append(
            Trial(number, Candidate("", {}), point, COMPLETE, (0,), (value,), (value,), None, "")
        )
    return trial_table(SPACE, found)


def test_the_parameter_that_matters_comes_first() -> None:
    found = importances(table(100, 4.0))
    assert found[0].name == "strong"
    assert sum(each.share.value or 0.0 for each in found) == pytest.approx(1.0)


def test_shares_are_those_of_a_study_of_optuna() -> None:
    trials = table(40, 4.0)
    study = optuna.create_study(direction="maximize")
    floats = {
        each.name: FloatDistribution(0.0, 1.0) for each in trials.parameters if each.is_ordered
    }
    kinds = {"kind": CategoricalDistribution((0.0, 1.0))}
    chosen = np.random.default_rng(2).integers(0, 40, 40)
    for number in chosen:
        point = dict(zip([*floats, *kinds], trials.places[number].tolist(), strict=True))
        value = float(trials.objective[number])
        study.add_trial(create_trial(params=point, distributions={**floats, **kinds}, value=value))
    expected = get_param_importances(
        study, evaluator=PedAnovaImportanceEvaluator(target_quantile=0.25)
    )
    found = PedAnova(trials.parameters, trials.places, 0.25).shares(
        chosen, trials.objective[chosen]
    )
    assert dict(zip([*floats, *kinds], found.tolist(), strict=True)) == expected


def test_two_parameters_are_enough() -> None:
    every = table(40, 4.0)
    for count in (1, 2):
        few = dataclasses.replace(
            every, parameters=every.parameters[:count], places=every.places[:, :count]
        )
        assert len(importances(few)) == (0 if count == 1 else 2)


def test_too_few_trials_say_nothing() -> None:
    few = table(15, 4.0)
    assert importances(few) == ()


def test_failed_trials_are_left_out() -> None:
    failed = Trial(
        1,
        Candidate("", {}),
        {each.name: 0.5 for each in PARAMETERS} | {"kind": "a"},
        FAILED,
        (),
        (),
        (),
        None,
        "",
    )
    assert len(trial_table(SPACE, [failed]).trials) == 0


def test_places_are_logarithmic_where_the_range_is() -> None:
    parameter = Parameter("scale", ("node.scale",), 1.0, 0.01, 100.0, is_log=True)
    assert parameter.place(1.0) == pytest.approx(0.5)
    assert SPACE.parameters[-1].place("b") == 1.0


def test_shares_stand_beside_resampled_trials(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With a correlation in place of PED-ANOVA, by the same draws of a slow loop."""

    trials = table(30, 4.0)

    def shares(self: object, chosen: np.ndarray, objective: np.ndarray) -> np.ndarray:
        return np.abs([np.corrcoef(column, objective)[0, 1] for column in trials.places[chosen].T])

    monkeypatch.setattr(PedAnova, "shares", shares)
    every = np.arange(30)
    rng = np.random.default_rng(0)
    chosen = [rng.integers(0, 30, 30) for _ in range(100)]
    spread = [shares(None, rows, trials.objective[rows]) for rows in chosen]
    found = {each.name: each for each in importances(trials)}
    for number, parameter in enumerate(trials.parameters):
        told, low_high = (
            found[parameter.name],
            np.quantile(spread, (0.025, 0.975), axis=0)[:, number],
        )
        assert told.share.value == shares(None, every, trials.objective)[number]
        assert (told.share.low, told.share.high, told.share.n) == (
            *map(pytest.approx, low_high),
            30,
        )
    told_shares = [each.share.value or 0.0 for each in found.values()]
    assert told_shares == sorted(told_shares, reverse=True)

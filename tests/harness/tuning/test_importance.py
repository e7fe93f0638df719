"""Importance and interactions on objectives whose answer is known."""

import numpy as np
import pytest

from harness.tuning.evaluation import Candidate
from harness.tuning.importance import importances, interactions
from harness.tuning.result import COMPLETE, FAILED, Trial, TrialTable, trial_table
from harness.tuning.space import Parameter, Space

PARAMETERS = tuple(Parameter(name, (f"node.{name}",), 0.5, 0.0, 1.0) for name in ("strong", "left", "right", "none"))
SPACE = Space("made-up", "", (*PARAMETERS, Parameter("kind", ("node.kind",), "a", choices=("a", "b"))))


def table(trials: int, strong: float, product: float) -> TrialTable:
    rng = np.random.default_rng(11)
    found = []
    for number in range(trials):
        point = {each.name: float(rng.random()) for each in PARAMETERS} | {"kind": str(rng.choice(["a", "b"]))}
        value = strong * -((point["strong"] - 0.3) ** 2) + product * (point["left"] - 0.5) * (point["right"] - 0.5)
        value += float(rng.normal(0.0, 0.1))
        found.append(Trial(number, Candidate("", {}), point, COMPLETE, (0,), (value,), (value,), None, ""))
    return trial_table(SPACE, found)


def test_the_parameter_that_matters_comes_first_and_is_more_than_chance() -> None:
    found = importances(table(100, 4.0, 0.0))
    assert found[0].name == "strong"
    assert found[0].is_told_apart
    assert sum(each.share.value or 0.0 for each in found) == pytest.approx(1.0)
    assert not next(each for each in found if each.name == "none").is_told_apart


def test_a_product_is_found_and_a_sum_is_none() -> None:
    pair = interactions(table(100, 0.0, 6.0))[0]
    assert set(pair.names) == {"left", "right"}
    assert pair.p_holm < 0.001
    assert min(each.p_holm for each in interactions(table(100, 4.0, 0.0))) > 0.01


def test_too_few_trials_say_nothing() -> None:
    few = table(15, 4.0, 4.0)
    assert importances(few) == ()
    assert interactions(few) == ()


def test_failed_trials_are_left_out() -> None:
    failed = Trial(
        1, Candidate("", {}), {each.name: 0.5 for each in PARAMETERS} | {"kind": "a"}, FAILED, (), (), (), None, ""
    )
    assert len(trial_table(SPACE, [failed]).trials) == 0


def test_places_are_logarithmic_where_the_range_is() -> None:
    parameter = Parameter("scale", ("node.scale",), 1.0, 0.01, 100.0, is_log=True)
    assert parameter.place(1.0) == pytest.approx(0.5)
    assert SPACE.parameters[-1].place("b") == 1.0

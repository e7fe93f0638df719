"""Importance on objectives whose answer is known."""

import dataclasses

import numpy as np
import pytest

from harness.tuning.evaluation import Candidate
from harness.tuning.importance import importances
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
    assert next(iter(found)) == "strong" and found.keys() == {
        *(each.name for each in SPACE.parameters)
    }
    assert list(found.values()) == sorted(found.values(), reverse=True)
    assert sum(found.values()) == pytest.approx(1.0)


def test_shares_do_not_depend_on_the_order_of_the_parameters() -> None:
    every = table(40, 4.0)
    turned = dataclasses.replace(
        every, parameters=every.parameters[::-1], places=every.places[:, ::-1]
    )
    assert importances(turned) == pytest.approx(importances(every))


def test_two_parameters_are_enough() -> None:
    every = table(40, 4.0)
    for count in (1, 2):
        few = dataclasses.replace(
            every, parameters=every.parameters[:count], places=every.places[:, :count]
        )
        assert len(importances(few)) == (0 if count == 1 else 2)


def test_too_few_trials_say_nothing() -> None:
    few = table(15, 4.0)
    assert importances(few) == {}


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

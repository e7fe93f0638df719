"""The auditor's checks on the search.

What a tuned file computes, and values at the edge of their range.
"""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import rankdata, t

from harness.audit.findings import AuditEvidence, Check
from harness.tuning import study_audit
from harness.tuning.evaluation import Candidate
from harness.tuning.result import COMPLETE, StudyResult, Trial, TrialTable, trial_table
from harness.tuning.space.space import Parameter, Space
from harness.tuning.study_audit import Edge, _p_near, _p_of_trend, computing, edges


def searched(parameter: Parameter, value: Any, slope: float, trials: int = 60) -> StudyResult:
    """A random search of two parameters.

    The objective is a multiple of one, and the other is without effect.
    """
    rng = np.random.default_rng(5)
    other = Parameter("other", ("node.other",), 0.5, 0.0, 1.0)
    found = []
    for number in range(trials):
        own = (
            parameter.choices[int(rng.integers(len(parameter.choices)))]
            if parameter.choices
            else float(rng.uniform(parameter.low, parameter.high))
        )
        own = round(own) if parameter.is_int else own
        told = (slope * float(own) if not isinstance(own, str) else 0.0) + float(
            rng.normal(0.0, 0.2)
        )
        point = {parameter.name: own, "other": float(rng.random())}
        candidate = Candidate(f"trial-{number}", {})
        found.append(Trial(number, candidate, point, COMPLETE, (0,), (told,), (told,), None, ""))
    return StudyResult(
        original=Candidate("original", {}),
        incumbent=Candidate("incumbent", dict.fromkeys(parameter.paths, value)),
        objectives=("margin",),
        space=Space("made-up", "", (parameter, other)),
        trials=tuple(found),
        front=(0,),
        seed=0,
        train_missions=(0,),
        test_missions=(),
        train_rows=((), ()),
        test_rows=(),
    )


NUMBER = Parameter("gain", ("node.gain",), 0.5, 0.0, 1.0)
WHOLE = Parameter("samples", ("node.samples",), 5, 1.0, 10.0, is_int=True)
TEXT = Parameter("kind", ("node.kind",), "a", choices=("a", "b", "c"))


@pytest.mark.parametrize(
    ("parameter", "value", "slope", "is_flagged"),
    [
        (NUMBER, 1.0, 0.0, True),  # at the very end: no chance for a number that may be anything
        (NUMBER, 0.95, 2.0, True),  # near, and the objective rises towards it
        (NUMBER, 0.95, 0.0, False),
        (NUMBER, 0.05, 2.0, False),  # near the end away from which it rises
        (NUMBER, 0.5, 2.0, False),
        (WHOLE, 10, 0.5, True),
        (WHOLE, 10, 0.0, False),  # one of ten levels is often the last one
        (TEXT, "c", 0.0, False),  # texts have no ends
    ],
)
def test_edges(parameter: Parameter, value: Any, slope: float, is_flagged: bool) -> None:
    assert edges(searched(parameter, value, slope)).is_flagged is is_flagged


@pytest.mark.parametrize(
    ("parameter", "distance", "p"),
    [
        (Parameter("step", ("node.step",), 0.0, 0.0, 4.0, step=0.5), 0.0, 2.0 / 9.0),
        (Parameter("step", ("node.step",), 0.0, 0.0, 4.0, step=0.5), 0.3, 0.6),
        (WHOLE, 0.0, 2.0 / 10.0),
        (Parameter("pair", ("node.pair",), 1, choices=(1, 2)), 0.0, 1.0),
        (NUMBER, 0.02, 0.04),
        (NUMBER, 0.8, 1.0),
    ],
)
def test_how_likely_an_arbitrary_value_is_so_near_to_an_end(
    parameter: Parameter,
    distance: float,
    p: float,
) -> None:
    study = searched(parameter, parameter.original, 0.0)
    assert _p_near(trial_table(study.space, study.trials), 0, distance) == pytest.approx(p)


def test_ends_of_levels_are_named() -> None:
    levels = Parameter("points", ("node.points",), 4, choices=(2, 4, 8))
    assert edges(searched(levels, 2, 0.0)).says == "points = 2 is the lower end 2"


def test_a_value_that_the_tuner_left_alone_is_no_edge() -> None:
    study = dataclasses.replace(searched(NUMBER, 1.0, 2.0), incumbent=Candidate("incumbent", {}))
    check = edges(study)
    assert not check.is_flagged
    assert check.says == "no value was tuned"


def tuned(study: StudyResult, values: dict[str, Any], *parameters: Parameter) -> StudyResult:
    space = dataclasses.replace(study.space, parameters=parameters or study.space.parameters)
    return dataclasses.replace(study, space=space, incumbent=Candidate("incumbent", values))


OTHER = Parameter("other", ("node.other",), 0.5, 0.0, 1.0)
BOTH = Parameter("gain", ("node.gain", "node.same"), 0.5, 0.0, 1.0)


def test_the_evidence_of_an_edge_is_both_of_its_p_by_fishers_method() -> None:
    assert Edge(NUMBER, 1.0, 0.0, True, 0.1, 0.2).p == pytest.approx(
        0.02 * (1.0 - math.log(0.02)), rel=1e-12
    )
    assert Edge(NUMBER, 1.0, 0.0, True, 0.0, 0.2).p == 0.0
    assert Edge(NUMBER, 1.0, 0.0, True, 1.0, 1.0).p == 1.0


@pytest.mark.parametrize(
    ("values", "times"),
    [
        ({"a.vx_samples": 50, "b.vx_samples": 40}, 5.0),
        ({"a.vx_samples": 50}, 2.5),
        ({"a.vx_samples": 30}, 1.5),
        ({"a.vx_samples": 40, "a.sim_time": 0.5, "b.gain": 9.0}, 2.0),
        ({"a.sim_time": 0.625}, 1.25),
    ],
)
def test_what_the_controller_computes_is_the_product_of_what_multiplies(
    values: dict[str, Any], times: float
) -> None:
    odd_ones: tuple[Any, ...] = (True, 0, "many")
    parameters = (
        Parameter("samples", ("a.vx_samples", "b.vx_samples"), 20, 5.0, 200.0, is_int=True),
        Parameter("time", ("a.sim_time",), 0.5, 0.25, 2.0),
        Parameter("gain", ("b.gain",), 1.0, 0.0, 10.0),
        *(Parameter(f"odd_{n}", (f"{n}.batch_size",), value) for n, value in enumerate(odd_ones)),
    )
    said = f"the controller computes {times:.2g} times as much per second by its parameters"
    told = (AuditEvidence.unsampled("computing per second", "times", 1.0, times, 1),)
    odd = {"0.batch_size": True, "1.batch_size": 5, "2.batch_size": "few"}
    study = tuned(searched(NUMBER, 0.5, 0.0, 1), {**values, **odd}, *parameters)
    assert computing(study) == Check("compute", times > 2.0, said, told)
    assert not computing(tuned(study, {**values, **odd}, *parameters[2:])).is_examined


@pytest.mark.parametrize(
    ("distance", "state", "said"),
    [
        (1e-9, "flagged", "gain = 1e-09 is the lower end 0"),
        (2e-9, "flagged", "gain = 2e-09 is 2e-07 % of its range from the lower end 0"),
        (0.03, "look", "gain = 0.03 is 3 % of its range from the lower end 0"),
        (0.04, "passed", "gain = 0.04 is 4 % of its range from the lower end 0"),
        (0.1 + 1e-9, "passed", "gain = 0.1 is 10 % of its range from the lower end 0"),
        (0.12, "passed", "none of the 1 tuned values is near an end of its range"),
    ],
)
def test_values_near_an_end_are_named(distance: float, state: str, said: str) -> None:
    check = edges(searched(NUMBER, distance, 1.0))  # it rises towards the other end
    assert (check.state, check.says, check.look) == (state, said, said if state == "look" else "")


def test_what_an_edge_rests_on() -> None:
    study = searched(NUMBER, 0.95, 2.0)
    table = trial_table(study.space, study.trials)
    p = Edge(NUMBER, 0.95, 0.05, True, 0.1, _p_of_trend(table, 0, True)).p
    (told,) = edges(study).evidence
    assert told == AuditEvidence.unsampled(
        "gain",
        "",
        0.5,
        0.95,
        1,
        told.p,
    ) and told.p == pytest.approx(p, rel=1e-9)


def test_tuned_values_share_the_level(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two near their ends only one rises towards it.

    A text has no end, and one path is enough to be tuned.
    """
    study = tuned(
        searched(NUMBER, 0.95, 2.0),
        {"node.same": 0.95, "node.other": 0.08, "node.kind": "c"},
        BOTH,
        OTHER,
    )
    p = edges(study).evidence[0].p
    assert p is not None
    for level, is_flagged in ((2.0 * p, True), (1.99 * p, False)):
        monkeypatch.setattr(study_audit, "LEVEL", level)
        check = edges(study)
        assert check.is_flagged is is_flagged
        assert [each.what for each in check.evidence] == (
            ["gain"] if is_flagged else ["gain", "other"]
        )
        assert check.says.count(" end ") == len(check.evidence)
    text = Parameter("kind", ("node.kind",), "a", choices=("a", "b", "c"))
    alone = tuned(searched(text, "c", 0.0), {"node.kind": "c"})
    assert (edges(alone).says, edges(alone).is_examined) == ("no value was tuned", False)


@pytest.mark.parametrize(("parameters", "least"), [((NUMBER, OTHER), 12), ((NUMBER,), 10)])
def test_a_trend_needs_ten_trials_beyond_two_for_each_other_parameter(
    parameters: tuple[Parameter, ...], least: int
) -> None:
    for trials in (least - 1, least):
        study = tuned(searched(NUMBER, 0.5, 0.0, trials), {"node.gain": 0.5}, *parameters)
        few = f"{trials} trials are too few to tell a trend of {len(parameters)} parameters"
        assert (edges(study) == Check("edge", False, few, is_examined=False)) is (trials < least)


def made(parameter: Parameter, places: Any, objective: Any = None) -> TrialTable:
    columns = np.asarray(places, dtype=np.float64).reshape(len(places), -1)
    names = (
        parameter,
        *(dataclasses.replace(OTHER, name=f"other_{n}") for n in range(columns.shape[1] - 1)),
    )
    trials = searched(parameter, parameter.original, 0.0, len(places)).trials
    return TrialTable(
        names,
        trials,
        columns,
        np.zeros(len(places)) if objective is None else np.asarray(objective),
    )


@pytest.mark.parametrize(
    ("parameter", "levels", "p"),
    [
        (NUMBER, 30, 2.0 / 30.0),  # each twice
        (NUMBER, 25, 2.0 / 25.0),
        (NUMBER, 31, 0.0),
        (NUMBER, 60, 0.0),
        (WHOLE, 5, 2.0 / 10.0),
        (Parameter("pair", ("node.pair",), 1, choices=(1, 2, 3, 4)), 3, 2.0 / 4.0),
    ],
)
def test_levels_of_a_grid_are_those_that_were_tried_twice(
    parameter: Parameter,
    levels: int,
    p: float,
) -> None:
    places = np.linspace(0.0, 1.0, levels)[np.arange(60) % levels]
    assert _p_near(made(parameter, places), 0, 0.0) == pytest.approx(p)


@pytest.mark.parametrize("is_high", [True, False])
def test_a_trend_is_that_of_a_response_surface(is_high: bool) -> None:
    """By the normal equations, with a column of its own for everything.

    The last parameter does not vary.
    """
    rng = np.random.default_rng(4)
    places = np.column_stack((rng.random((20, 3)), np.full(20, 0.5)))
    objective = (
        places[:, 0] - places[:, 0] ** 2 + 2.0 * places[:, 1] ** 2 + rng.normal(0.0, 0.3, 20)
    )
    objective = (objective - objective.min()) / np.ptp(objective)
    own = 1.0 - places[:, 0] if is_high else places[:, 0]
    columns = [
        own**0,
        own,
        own**2,
        *(places[:, number] ** power for number in (1, 2) for power in (1, 2)),
    ]
    design, ranks = np.stack(columns, axis=1), rankdata(objective)
    inverse = np.linalg.inv(design.T @ design)
    solution = inverse @ design.T @ ranks
    variance = ((ranks - design @ solution) ** 2).sum() / 13.0 * inverse[1, 1]
    p = _p_of_trend(made(NUMBER, places, objective), 0, is_high)
    assert (
        p == pytest.approx(t.cdf(solution[1] / math.sqrt(variance), 13), rel=1e-6)
        and 0.01 < p < 0.99
    )


def test_a_trend_without_any_noise_is_sure() -> None:
    places = np.random.default_rng(0).permutation(20) / 19.0
    table = made(NUMBER, places, places)
    assert _p_of_trend(table, 0, True) == pytest.approx(0.0, abs=1e-9)
    assert _p_of_trend(table, 0, False) == pytest.approx(1.0, abs=1e-9)


def test_there_is_no_trend_where_nothing_varies(monkeypatch: pytest.MonkeyPatch) -> None:
    places = np.random.default_rng(0).random(20)
    assert _p_of_trend(made(NUMBER, places, np.ones(20)), 0, True) == 1.0
    assert _p_of_trend(made(NUMBER, np.full(20, 0.5), places), 0, True) == 1.0
    monkeypatch.setattr(study_audit, "least_squares", lambda design, answer: (-np.ones(3), 0.0, 3))
    assert _p_of_trend(made(NUMBER, places, places), 0, True) == 1.0

"""What the samplers may choose, by hand."""

import itertools
from typing import Any

import pytest
from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution

from harness.tuning.sampler import distributions_of, make_sampler, possible_point
from harness.tuning.space.constraint import parse_constraint
from harness.tuning.space.space import Parameter, Space
from navstack.errors import InputError

GAIN = Parameter("gain", ("node.gain",), 0.5, 0.0, 1.0)
SCALE = Parameter("scale", ("node.scale",), 1.0, 0.01, 100.0, is_log=True)
STEPS = Parameter("steps", ("node.steps",), 0.5, 0.25, 2.0, step=0.5)
COUNT = Parameter("count", ("node.count",), 3, 1.0, 9.0, is_int=True)
EVEN = Parameter("even", ("node.even",), 3, 2.0, 9.0, is_int=True, step=2.0)
KIND = Parameter("kind", ("node.kind",), "a", choices=("a", "b"))


def space(*parameters: Parameter, constraint: str = "") -> Space:
    names = [each.name for each in parameters]
    return Space(
        "own", "", parameters, (parse_constraint(constraint, names, "own"),) if constraint else ()
    )


def points(
    trials: int,
    *parameters: Parameter,
    constraint: str = "",
    seed: int = 0,
) -> list[tuple[Any, ...]]:
    sampler = make_sampler("grid", space(*parameters, constraint=constraint), seed, trials, 1)
    return [tuple(point.values()) for point in iter(sampler.ask, None) if point is not None]


def test_optuna_may_look_at_what_a_parameter_can_be() -> None:
    assert distributions_of(space(GAIN, SCALE, STEPS, COUNT, EVEN, KIND)) == {
        "gain": FloatDistribution(0.0, 1.0),
        "scale": FloatDistribution(0.01, 100.0, log=True),
        "steps": FloatDistribution(0.25, 1.75, step=0.5),
        "count": IntDistribution(1, 9),
        "even": IntDistribution(2, 8, step=2),
        "kind": CategoricalDistribution(("a", "b")),
    }


def test_what_lies_between_the_steps_goes_to_the_nearest() -> None:
    own = space(GAIN, STEPS, EVEN, KIND)
    given: dict[str, Any] = {"gain": 0.3, "steps": 0.5001, "even": 9, "kind": "b"}
    assert possible_point(own, given) == {"gain": 0.3, "steps": 0.75, "even": 8, "kind": "b"}
    assert possible_point(own, {**given, "steps": 9.0, "even": 4}) == {
        "gain": 0.3,
        "steps": 1.75,
        "even": 4,
        "kind": "b",
    }
    assert possible_point(space(STEPS, EVEN), {"steps": -9.0, "even": 1}) == {
        "steps": 0.25,
        "even": 2,
    }


@pytest.mark.parametrize(
    ("trials", "levels"),
    [
        (8, ((0.0, 1.0), (0.01, 100.0), ("a", "b"))),
        (17, ((0.0, 1.0), (0.01, 100.0), ("a", "b"))),  # three levels would be 18 points
        (18, ((0.0, 0.5, 1.0), (0.01, 1.0, 100.0), ("a", "b"))),
        (32, ((0.0, 0.3333, 0.6667, 1.0), (0.01, 0.2154, 4.642, 100.0), ("a", "b"))),
    ],
)
def test_a_grid_is_as_fine_as_the_trials_let_it_be(
    trials: int, levels: tuple[tuple[Any, ...], ...]
) -> None:
    found = points(trials, GAIN, SCALE, KIND)
    assert set(found) == set(itertools.product(*levels)) - {(0.5, 1.0, "a")}, (
        "the original is driven anyway"
    )
    assert len(found) == len(set(found)) and found == points(trials, GAIN, SCALE, KIND)
    assert found != points(trials, GAIN, SCALE, KIND, seed=1)


def test_a_grid_of_whole_numbers_and_steps_has_each_once_and_keeps_the_constraints() -> None:
    assert sorted(points(99, EVEN)) == [(2,), (4,), (6,), (8,)]
    assert sorted(points(99, STEPS)) == [(0.25,), (0.75,), (1.25,), (1.75,)]
    assert sorted(points(3, COUNT, constraint="count <= 5")) == [(1,), (5,)]


def test_a_grid_of_far_more_points_than_trials_is_refused() -> None:
    many = [Parameter(f"p{number}", (f"node.p{number}",), 0.5, 0.0, 1.0) for number in range(9)]
    assert len(points(6, *many)) == 512, "up to a hundred times as many may be left"
    with pytest.raises(
        InputError, match="9 parameters make 512 points even with two levels each, for 5 trials"
    ):
        make_sampler("grid", space(*many), 0, 5, 1)
    letters = Parameter("letters", ("node.letters",), "0", choices=tuple(map(str, range(150))))
    assert len(points(1, letters)) == 149

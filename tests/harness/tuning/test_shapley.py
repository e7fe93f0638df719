"""Exact Shapley values against their axioms, and against the mean over all orders."""

import itertools
from collections.abc import Sequence

import numpy as np
import pytest

from harness.metrics.columns import Row
from harness.tuning.evaluation import MARGIN, Candidate
from harness.tuning.result import StudyResult
from harness.tuning.space.space import Parameter, Space
from harness.tuning.waterfall import players, shapley_values, waterfall

RNG = np.random.default_rng(2)


@pytest.mark.parametrize("players", [1, 2, 3, 4, 5])
def test_it_is_the_mean_over_all_orders(players: int) -> None:
    game = RNG.normal(size=(2**players, 3))
    orders = list(itertools.permutations(range(players)))
    expected = np.zeros((3, players))
    for order in orders:
        inside = 0
        for player in order:
            expected[:, player] += (game[inside | 2**player] - game[inside]) / len(orders)
            inside |= 2**player
    assert shapley_values(game) == pytest.approx(expected)
    assert shapley_values(game).sum(axis=1) == pytest.approx(game[-1] - game[0], abs=1e-12)


def test_who_brings_nothing_gets_nothing_and_equals_get_the_same() -> None:
    game = np.array([[3.0 * (mask & 3 == 3)] for mask in range(8)])
    assert shapley_values(game)[0] == pytest.approx([1.5, 1.5, 0.0])


SPACE = Space("", "", tuple(Parameter(name, (f"node.{name}",), 1.0, 0.0, 9.0) for name in "abc"))


class Adding:
    """Every value is worth itself times the mission's number.

    The last mission has no result with a alone.
    """

    def rows(self, candidate: Candidate, missions: Sequence[int]) -> list[Row]:
        point = {
            each.name: candidate.values.get(each.paths[0], each.original)
            for each in SPACE.parameters
        }
        worth = sum(float(value) for value in point.values())
        lost = set(candidate.values) == {"node.a"}
        return [
            {MARGIN: worth * mission, "error": "lost" if lost and mission == missions[-1] else None}
            for mission in missions
        ]


def changed(**values: float) -> StudyResult:
    incumbent = Candidate("incumbent", {f"node.{name}": value for name, value in values.items()})
    original, nobody = Candidate("original", {}), ((), ())
    return StudyResult(original, incumbent, ("margin",), SPACE, (), (), 0, (), (5,), nobody, ())


def test_a_waterfall_adds_up_on_missions_that_every_mixture_finished() -> None:
    study = changed(a=3.0, b=8.0)
    found = waterfall(study, Adding(), (1, 2, 3), players(study, ("b",)))
    assert found is not None
    assert [(step.player, step.gain_usd_per_run.value) for step in found.steps] == [
        ("b", 10.5),
        ("a", 3.0),
    ]
    assert (found.original, found.incumbent, found.total.value) == (4.5, 18.0, 13.5)
    assert (found.missions, found.episodes, found.unseen) == (2, 12, False)
    assert (
        waterfall(study, Adding(), (), players(study, ()))
        is waterfall(study, Adding(), (1,), ())
        is None
    )

"""Exact Shapley values against their axioms, and against the mean over all orders."""

import itertools

import numpy as np
import pytest

from harness.tuning.waterfall import shapley_values

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

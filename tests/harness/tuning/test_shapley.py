"""Exact Shapley values against their axioms, and against the mean over all orders."""

import itertools

import numpy as np
import pytest

from harness.tuning.waterfall import coalitions, shapley_values

RNG = np.random.default_rng(2)


def random_game(players: int, missions: int = 3) -> dict[frozenset[int], np.ndarray]:
    return {each: RNG.normal(size=missions) for each in coalitions(players)}


@pytest.mark.parametrize("players", [1, 2, 3, 4, 5])
def test_it_is_the_mean_over_all_orders(players: int) -> None:
    game = random_game(players)
    orders = list(itertools.permutations(range(players)))
    expected = np.zeros((3, players))
    for order in orders:
        inside: frozenset[int] = frozenset()
        for player in order:
            expected[:, player] += (game[inside | {player}] - game[inside]) / len(orders)
            inside |= {player}
    assert shapley_values(game, players) == pytest.approx(expected)


def test_values_add_up_to_the_whole() -> None:
    game = random_game(5)
    total = game[frozenset(range(5))] - game[frozenset()]
    assert shapley_values(game, 5).sum(axis=1) == pytest.approx(total, abs=1e-12)


def test_who_brings_nothing_gets_nothing_and_equals_get_the_same() -> None:
    game = {each: np.array([3.0 * (0 in each and 1 in each)]) for each in coalitions(3)}
    assert shapley_values(game, 3)[0] == pytest.approx([1.5, 1.5, 0.0])


@pytest.mark.parametrize("players", [0, 6])
def test_so_many_players_are_refused(players: int) -> None:
    with pytest.raises(ValueError, match="allowed are 1 to 5"):
        list(coalitions(players))

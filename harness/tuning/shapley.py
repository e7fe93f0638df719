"""Exact Shapley values: what each player brings, averaged over all orders in which they can come in (Shapley 1953)."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from navstack.types import FloatArray

Coalition = frozenset[int]  # numbers of the players that are in
MOST_PLAYERS = 5  # 32 coalitions, each of which drives every mission


def coalitions(players: int) -> Iterator[Coalition]:
    """Every coalition, the empty one first and the whole one last.

    Raises:
        ValueError: more than :data:`MOST_PLAYERS` players, or none.
    """
    if not 1 <= players <= MOST_PLAYERS:
        raise ValueError(f"{players} players; allowed are 1 to {MOST_PLAYERS}")
    for mask in range(2**players):
        yield frozenset(i for i in range(players) if mask >> i & 1)


def shapley_values(values: Mapping[Coalition, FloatArray], players: int) -> FloatArray:
    """What each player brings, mission by mission.

    Args:
        values: shape (n,) of every coalition: what it is worth on each mission.
        players: how many there are.

    Returns:
        Shape (n, players); rows add up to the whole coalition's worth less the empty one's.
    """
    shares = []
    for player in range(players):
        share = np.zeros_like(values[frozenset()])
        for without in coalitions(players):
            if player not in without:
                weight = math.factorial(len(without)) * math.factorial(players - len(without) - 1)
                share += weight / math.factorial(players) * (values[without | {player}] - values[without])
        shares.append(share)
    return np.column_stack(shares)

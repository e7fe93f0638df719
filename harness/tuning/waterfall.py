"""The margin waterfall: from the old file to the new one, on the same missions."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.economics.valuation import CENT
from harness.statistics.bootstrap import bootstrap_mean
from harness.statistics.interval import Interval
from harness.tuning.evaluation import MARGIN, Candidate, Evaluator, Value
from harness.tuning.result import StudyResult
from navstack.types import FloatArray

REST = "the rest"
MOST_PLAYERS = 5  # 32 mixtures, each of which drives every mission


@dataclass(frozen=True, slots=True)
class Player:
    """Parameters that change together: one, those that a constraint binds, or all that are left."""

    title: str
    names: tuple[str, ...]  # of parameters of the search space


@dataclass(frozen=True, slots=True)
class Step:
    """What one player brings."""

    player: str  # its title
    changes: dict[str, tuple[Value, Value]]  # of each of its parameters the value before and after
    gain_usd_per_run: Interval


@dataclass(frozen=True, slots=True)
class Waterfall:
    """From the original's margin to the incumbent's."""

    steps: tuple[Step, ...]  # the largest gain first
    original: float  # [USD/run] mean margin
    incumbent: float
    total: Interval  # [USD/run] incumbent less original; the steps add up to its value
    missions: int  # on which every mixture has a margin
    unseen: bool  # these are test missions
    episodes: int  # that all mixtures together stand for

    @property
    def kind(self) -> str:
        """What its missions are."""
        if self.unseen:
            return "unseen test"
        return "training"


def players(
    study: StudyResult,
    ranking: Sequence[str],
    most: int = MOST_PLAYERS,
) -> tuple[Player, ...]:
    """The players: the most important changed parameters one by one, then all others together.

    Parameters that a constraint of the search space binds change together, as half of such a change
    may be forbidden.

    Args:
        study: whose incumbent is explained.
        ranking: names of parameters, the most important first; those missing come last.
        most: players at most.
    """
    changed = [
        each.name
        for each in study.space.parameters
        if study.incumbent.values.keys() & set(each.paths)
    ]
    ranked_first = dict.fromkeys([*(name for name in ranking if name in changed), *changed])
    order = {name: place for place, name in enumerate(ranked_first)}
    groups: list[set[str]] = [{name} for name in changed]
    for constraint in study.space.constraints:
        bound = [group for group in groups if group & constraint.names]
        if len(bound) > 1:
            groups = [group for group in groups if group not in bound]
            groups.append(set().union(*bound))
    ranked = sorted(
        (sorted(group, key=order.__getitem__) for group in groups),
        key=lambda names: order[names[0]],
    )
    if len(ranked) > most:
        rest = [name for names in ranked[most - 1 :] for name in names]
        return (*map(_player, ranked[: most - 1]), Player(REST, tuple(rest)))
    return tuple(map(_player, ranked))


def waterfall(
    study: StudyResult,
    evaluator: Evaluator,
    missions: Sequence[int],
    who: Sequence[Player],
) -> Waterfall | None:
    """Drive every mixture of old and new values and share out the gain (Shapley 1953).

    A mission on which any mixture has no result is left out, and where the cargo is not modelled
    there is no margin. Intervals are the bootstrap's over missions.

    Args:
        study: whose incumbent is explained.
        evaluator: that drives what it has not driven yet.
        missions: numbers of the missions.
        who: the players, at least one.

    Returns:
        None where no mission has a margin for every mixture, or nothing was changed.
    """
    if not who or not missions:
        return None
    driven = []
    for mask in range(2 ** len(who)):
        driven.append(_margins(evaluator, mixture(study, who, mask), missions))
        if np.isnan(driven[-1]).all():
            return None  # then no mission has one for every mixture: the others need not be driven
    whole = ~np.isnan(driven).any(axis=0)
    if not whole.any():
        return None
    margins = np.array(driven)[:, whole]
    shares = shapley_values(margins)
    first, last = margins[0], margins[-1]
    steps = [_step(study, player, shares[:, i]) for i, player in enumerate(who)]
    return Waterfall(
        steps=tuple(sorted(steps, key=lambda step: -(step.gain_usd_per_run.value or 0.0))),
        original=float(first.mean()),
        incumbent=float(last.mean()),
        total=_mean(last - first),
        missions=int(whole.sum()),
        unseen=set(missions) <= set(study.test_missions),
        episodes=len(driven) * len(missions),
    )


def mixture(study: StudyResult, who: Sequence[Player], mask: int) -> Candidate:
    """The candidate with new values for players whose bits are set, and old ones for others."""
    inside = [bool(mask >> number & 1) for number in range(len(who))]
    if not any(inside):
        return study.original
    if all(inside):
        return study.incumbent
    names: set[str] = set()
    for player, is_in in zip(who, inside, strict=True):
        if is_in:
            names.update(player.names)
    paths: set[str] = set()
    for parameter in study.space.parameters:
        if parameter.name in names:
            paths.update(parameter.paths)
    values = {path: value for path, value in study.incumbent.values.items() if path in paths}
    return Candidate("mixture-" + "".join("01"[is_in] for is_in in inside), values)


def shapley_values(values: FloatArray) -> FloatArray:
    """What each player brings, averaged over all orders of joining, mission by mission.

    Args:
        values: (2^players, n): what each mixture is worth on each mission; the bits of its number
            say who is in.

    Returns:
        Shape (n, players); rows add up to the whole mixture's worth less the empty one's.
    """
    players = len(values).bit_length() - 1
    shares = np.zeros((values.shape[1], players))
    for mask in range(len(values)):
        size = mask.bit_count()
        for player in range(players):
            if not mask >> player & 1:
                weight = (
                    math.factorial(size)
                    * math.factorial(players - size - 1)
                    / math.factorial(players)
                )
                shares[:, player] += weight * (values[mask | 1 << player] - values[mask])
    return shares


def _player(names: Sequence[str]) -> Player:
    return Player(" + ".join(names), tuple(names))


def _margins(evaluator: Evaluator, candidate: Candidate, missions: Sequence[int]) -> FloatArray:
    """Margin [USD] on each mission; NaN where there is none."""
    rows = evaluator.rows(candidate, missions)
    margins = (row.get(MARGIN) if row.get("error") is None else None for row in rows)
    return np.array([np.nan if margin is None else margin for margin in margins], dtype=np.float64)


def _step(study: StudyResult, player: Player, gains: FloatArray) -> Step:
    parameters = {each.name: each for each in study.space.parameters}
    changes = {}
    for name in player.names:
        changes[name] = (parameters[name].original, study.tuned(parameters[name]))
    return Step(player.title, changes, _mean(gains))


def _mean(values: FloatArray) -> Interval:
    """Mean over missions; without bounds where all are alike to a cent."""
    if np.ptp(values) <= CENT:
        return Interval(float(values.mean()), None, None, values.size)
    return bootstrap_mean(values, np.random.default_rng(0))

"""Which parameters matter to the objective, and which pairs of them act together, told from a study's trials."""

import itertools
from dataclasses import dataclass

import numpy as np
from scipy import stats

from harness.metrics.columns import Row
from harness.statistics.bootstrap import percentile_interval
from harness.statistics.interval import Interval
from harness.statistics.paired import holm
from harness.tuning.result import TrialTable, least_squares
from navstack.types import FloatArray

TOP = 0.25  # share of the trials, the best ones, that importance is about
# so that the best are five, fewer than which PED-ANOVA's densities are not to be trusted
LEAST_TRIALS = 20
RESAMPLES = 100  # of the trials, for intervals; and as many shuffles for the level of chance
PAIRS = 3  # interactions that are told of
SEED = 0  # of resamples and shuffles


@dataclass(frozen=True, slots=True)
class Importance:
    """How much a parameter decides whether a trial is among the best."""

    name: str
    share: Interval  # of all importance, 0..1; over resampled trials
    # share that a parameter without any effect exceeds in 1 of 20 studies with these trials
    chance: float

    @property
    def is_told_apart(self) -> bool:
        """Whether it is more than chance gives."""
        return (self.share.value or 0.0) > self.chance

    def as_json(self) -> Row:
        """The importance as one JSON object."""
        return {"name": self.name, **self.share.as_json(), "chance": self.chance}


@dataclass(frozen=True, slots=True)
class Interaction:
    """Two parameters of which the effect of one depends on the value of the other."""

    names: tuple[str, str]
    # of the objective's ranks that their product explains beyond each by itself
    variance_share: float
    p_holm: float  # of none, adjusted for all pairs


def importances(table: TrialTable) -> tuple[Importance, ...]:
    """Importance of each parameter by PED-ANOVA (Watanabe et al. 2023, IJCAI), the largest first.

    It asks how far the density of the best quarter of the trials departs from that of all,
    parameter by parameter. The shares add up to one whatever the data, so each stands beside what
    shuffled objectives give. Intervals are the percentile bootstrap's over trials; these come from
    an adaptive sampler and are not independent, so they are too narrow. Empty where the trials are
    fewer than :data:`LEAST_TRIALS`, or all alike.
    """
    varied = table.varied
    if len(table.trials) < LEAST_TRIALS or len(varied) < 2 or np.ptp(table.objective) == 0.0:
        return ()
    from harness.tuning.ped_anova import PedAnova  # Optuna takes half a second

    parameters = [table.parameters[number] for number in varied]
    places, objective, n = table.places[:, varied], table.objective, len(table.trials)
    rng, ped_anova = np.random.default_rng(SEED), PedAnova(parameters, places, TOP)
    shares = ped_anova.shares(np.arange(n), objective)
    resamples = (rng.integers(0, n, n) for _ in range(RESAMPLES))
    spread = np.array([ped_anova.shares(chosen, objective[chosen]) for chosen in resamples])
    shuffled = np.array(
        [ped_anova.shares(np.arange(n), rng.permutation(objective)) for _ in range(RESAMPLES)]
    )
    chance = np.quantile(shuffled, 0.95, axis=0)
    found = [
        Importance(
            each.name, percentile_interval(float(shares[i]), spread[:, i], n), float(chance[i])
        )
        for i, each in enumerate(parameters)
    ]
    return tuple(sorted(found, key=lambda each: -(each.share.value or 0.0)))


def interactions(table: TrialTable) -> tuple[Interaction, ...]:
    """The strongest pairs of numbers by a quadratic response surface on ranks (Box and Wilson 1951), strongest first.

    Beside every parameter's linear term and the two squares the product of a pair is tested (partial F test). Empty
    where the trials are too few for such a surface.
    """
    numbers = [number for number in table.varied if table.parameters[number].is_ordered]
    if len(table.trials) < max(LEAST_TRIALS, len(numbers) + 10) or np.ptp(table.objective) == 0.0:
        return ()
    places = table.places - table.places.mean(axis=0)
    answer = stats.rankdata(table.objective)
    found = []
    for i, j in itertools.combinations(numbers, 2):
        without = np.column_stack(
            [np.ones(len(answer)), places, places[:, i] ** 2, places[:, j] ** 2]
        )
        found.append((i, j, *_gain_of_term(without, places[:, i] * places[:, j], answer)))
    adjusted = holm([p for *_, p in found])
    names = [parameter.name for parameter in table.parameters]
    pairs = [
        Interaction((names[i], names[j]), s, p)
        for (i, j, s, _), p in zip(found, adjusted, strict=True)
    ]
    return tuple(sorted(pairs, key=lambda pair: (pair.p_holm, -pair.variance_share))[:PAIRS])


def _gain_of_term(without: FloatArray, term: FloatArray, answer: FloatArray) -> tuple[float, float]:
    """Share of the variance that one more term explains, and the p value of its partial F test."""
    _, before, _ = least_squares(without, answer)
    _, after, rank = least_squares(np.column_stack([without, term]), answer)
    freedom = len(answer) - rank
    whole = float(((answer - answer.mean()) ** 2).sum())
    gain = max(before - after, 0.0)
    if freedom < 1 or whole == 0.0:
        return 0.0, 1.0
    p = float(stats.f.sf(gain / (after / freedom), 1, freedom)) if after > 0.0 else 0.0
    return gain / whole, p

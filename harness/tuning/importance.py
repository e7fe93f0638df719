"""Which parameters matter to the objective, estimated from a study's trials."""

from dataclasses import dataclass

import numpy as np

from harness.metrics.columns import Row
from harness.statistics.bootstrap import percentile_interval
from harness.statistics.interval import Interval
from harness.tuning.result import TrialTable

TOP = 0.25  # share of the trials, the best ones, that importance is about
# so that the best are five, fewer than which PED-ANOVA's densities are not to be trusted
LEAST_TRIALS = 20
RESAMPLES = 100  # of the trials, for intervals
SEED = 0  # of resamples


@dataclass(frozen=True, slots=True)
class Importance:
    """How much a parameter decides whether a trial is among the best."""

    name: str
    share: Interval  # of all importance, 0..1; over resampled trials

    def as_json(self) -> Row:
        """The importance as one JSON object."""
        return {"name": self.name, **self.share.as_json()}


def importances(table: TrialTable) -> tuple[Importance, ...]:
    """Importance of each parameter by PED-ANOVA (Watanabe et al. 2023, IJCAI), the largest first.

    It asks how far the density of the best quarter of the trials departs from that of all,
    parameter by parameter. The shares add up to one whatever the data. Intervals are the percentile
    bootstrap's over trials; these come from an adaptive sampler and are not independent, so they
    are too narrow. Empty where the trials are fewer than :data:`LEAST_TRIALS`, or all alike.
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
    found = [
        Importance(each.name, percentile_interval(float(shares[i]), spread[:, i], n))
        for i, each in enumerate(parameters)
    ]
    return tuple(sorted(found, key=lambda each: -(each.share.value or 0.0)))

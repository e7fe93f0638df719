"""What a contact with a person costs: risk of injury by its severity, times the cost of that severity.

Severity is the maximum abbreviated injury scale (MAIS). The risk curves are Wang 2022's logistic fits over the change
of velocity delta_v, for all crash modes; the paper scales their cost by the robot's mass over a vehicle's. They were
fitted to people inside cars: a proxy, as the paper says itself (appendix "Pedestrian injury-cost proxy").
"""

from typing import Protocol

import numpy as np
import numpy.typing as npt

from navstack.types import FloatArray

MPH_PER_MPS = 2.23694  # [mph / (m/s)]
SEVERITIES = ("mais_0", "mais_1", "mais_2", "mais_3", "mais_4", "mais_5", "fatal")


class InjuryRisk(Protocol):
    """Coefficients of the risk curves MAIS >= 1, 2, 3, 4, 5 and fatal."""

    @property
    def mais_intercepts(self) -> tuple[float, ...]:
        """Six intercepts."""

    @property
    def mais_slopes(self) -> tuple[float, ...]:
        """Six slopes [1/mph]."""


class InjuryModel(InjuryRisk, Protocol):
    """Risk curves and costs; a price file has them all."""

    @property
    def mais_costs(self) -> tuple[float, ...]:
        """Costs of MAIS 0..3 [USD]; severer ones carry none."""

    @property
    def injury_mass_factor(self) -> float:
        """Robot's mass over the reference vehicle's."""


def mais_probabilities(delta_v: npt.ArrayLike, model: InjuryRisk) -> FloatArray:
    """Probability of each severity of :data:`SEVERITIES`, shape ``delta_v.shape + (7,)``; sums to one.

    Args:
        delta_v: change of velocity [m/s], any shape; 0 or less is MAIS 0 with certainty.
        model: the risk curves. Where a fitted curve lies above that of a lesser severity it is cut down to it.
    """
    speed = np.asarray(delta_v, dtype=np.float64)[..., np.newaxis]
    with np.errstate(over="ignore"):  # far below the curve: 1 / infinity
        log_odds = np.asarray(model.mais_intercepts) + np.asarray(model.mais_slopes) * (MPH_PER_MPS * speed)
        at_least = 1.0 / (1.0 + np.exp(-log_odds))
    at_least = np.where(speed <= 0.0, 0.0, np.minimum.accumulate(at_least, axis=-1))
    bounds = np.concatenate((np.ones_like(speed), at_least, np.zeros_like(speed)), axis=-1)
    probabilities: FloatArray = bounds[..., :-1] - bounds[..., 1:]
    return probabilities


def injury_cost(delta_v: npt.ArrayLike, model: InjuryModel) -> FloatArray:
    """Expected cost [USD] of one counted contact per entry of ``delta_v`` [m/s]; same shape (paper, eq. pedestrian)."""
    costs = np.asarray(model.mais_costs)
    expected: FloatArray = model.injury_mass_factor * (mais_probabilities(delta_v, model)[..., : costs.size] @ costs)
    return expected

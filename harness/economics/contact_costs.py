"""What contacts cost: the one place where impulses become dollars.

A contact with a person costs the risk of injury by its severity, times the cost of that severity.
Severity is the maximum abbreviated injury scale (MAIS). The risk curves are Wang 2022's logistic
fits over the change of velocity delta_v, for all crash modes; the paper scales their cost by the
robot's mass over a vehicle's. They were fitted to people inside cars: a proxy, as the paper says
itself (appendix "Pedestrian injury-cost proxy").
"""

from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from harness.economics.prices import Logistic, Prices, load_severe
from harness.metrics.columns import Row
from harness.metrics.contacts import PRICED_PROPERTY, PROPERTY_IMPULSE
from navstack.types import FloatArray

MPH_PER_MPS = 2.23694  # [mph / (m/s)]
_SPEEDS = np.linspace(0.0, 100.0, 20_001)  # [m/s] at which the highest cost so far is known
SEVERITIES = ("mais_0", "mais_1", "mais_2", "mais_3", "mais_4", "mais_5", "fatal")


def mais_probabilities(delta_v: npt.ArrayLike, curves: Sequence[Logistic]) -> FloatArray:
    """Probability of each severity of :data:`SEVERITIES`, shape ``delta_v.shape + (7,)``.

    Sums to one.

    Args:
        delta_v: change of velocity [m/s], any shape; 0 or less is MAIS 0 with certainty.
        curves: of the risk, MAIS >= 1..5 and fatal; one above that of a lesser severity is cut down
            to it.
    """
    speed = np.asarray(delta_v, dtype=np.float64)[..., np.newaxis]
    with np.errstate(over="ignore"):  # far below the curve: 1 / infinity
        intercepts, slopes = np.array(
            [(curve.intercept, curve.slope_per_mph) for curve in curves]
        ).T
        log_odds = intercepts + slopes * (MPH_PER_MPS * speed)
        at_least = 1.0 / (1.0 + np.exp(-log_odds))
    at_least = np.where(speed <= 0.0, 0.0, np.minimum.accumulate(at_least, axis=-1))
    bounds = np.concatenate((np.ones_like(speed), at_least, np.zeros_like(speed)), axis=-1)
    probabilities: FloatArray = bounds[..., :-1] - bounds[..., 1:]
    return probabilities


def injury_cost(delta_v: npt.ArrayLike, prices: Prices) -> FloatArray:
    """Expected cost [USD] of one counted contact per entry of ``delta_v`` [m/s].

    Same shape (paper, eq. pedestrian).
    """
    costs = np.asarray(prices.mais_costs)
    probabilities = mais_probabilities(delta_v, prices.injury.logistic.curves)[..., : costs.size]
    expected: FloatArray = prices.injury_mass_factor * (probabilities @ costs)
    return expected


def injury_measures(impulses: npt.ArrayLike, prices: Prices) -> Row:
    """What a delivery's contacts with people come to.

    Delta_v is impulse over the robot's mass, as published.

    Args:
        impulses: shape (n,) [N s], one per contact that is paid for.
        prices: the price file.
    """
    delta_v = np.asarray(impulses, dtype=np.float64) / prices.robot_mass.value  # [m/s]
    return {
        "collision_delta_v_mps": float(delta_v.mean()) if len(delta_v) else 0.0,
        "pedestrian_injury_usd": float(injury_cost(delta_v, prices).sum()),
    }


def injury_costs(impulses: npt.ArrayLike, prices: Prices) -> FloatArray:
    """Expected cost [USD] of a contact with a person for each impulse [N s]; same shape."""
    return injury_cost(np.asarray(impulses, dtype=np.float64) / prices.robot_mass.value, prices)


def monotone_injury_costs(impulses: npt.ArrayLike, prices: Prices) -> FloatArray:
    """As :func:`injury_costs` up to the impulse at which that is highest; beyond it never falls.

    From there on the cost grows by that of MAIS 4, 5 and fatal injuries (:class:`SeverePrices`),
    which the published rule gives no price: it falls to nothing where these are all that is left.
    """
    severe, published = _beyond_peak(prices)
    speed = np.asarray(impulses, dtype=np.float64) / prices.robot_mass.value
    reached = published[np.clip(np.searchsorted(_SPEEDS, speed, side="right") - 1, 0, None)]
    cost: FloatArray = np.maximum(injury_cost(speed, prices) + severe(speed), reached)
    return cost


def turning_impulse(prices: Prices) -> float:
    """Impulse [N s] of a contact with a person at which the published cost is highest.

    Beyond, it falls.
    """
    return float(_SPEEDS[injury_cost(_SPEEDS, prices).argmax()]) * prices.robot_mass.value


def forgives(prices: Prices) -> bool:
    """Whether the hardest contacts with people cost less than softer ones."""
    costs = injury_cost(_SPEEDS, prices)
    return bool(costs[-1] < 0.5 * costs.max())


@lru_cache(maxsize=8)
def _beyond_peak(prices: Prices) -> tuple[Callable[[FloatArray], FloatArray], FloatArray]:
    """Cost of severe injuries beyond the peak, and the highest total cost so far, both [USD].

    The first is a function of delta_v [m/s], the second an array over ``_SPEEDS``.
    """
    severe = load_severe()
    costs = prices.injury_mass_factor * np.array(
        [severe.mais_4.value, severe.mais_5.value, severe.fatal.value]
    )
    priced = injury_cost(_SPEEDS, prices)

    def of_severe(speed: FloatArray) -> FloatArray:
        all_of_them: FloatArray = (
            mais_probabilities(speed, prices.injury.logistic.curves)[..., -3:] @ costs
        )
        return all_of_them

    at_peak = float(of_severe(_SPEEDS[priced.argmax()]))

    def growth(speed: FloatArray) -> FloatArray:
        return np.maximum(of_severe(speed) - at_peak, 0.0)

    return growth, np.maximum.accumulate(priced + growth(_SPEEDS))


def property_cost(kind: str, impulse: float, prices: Prices) -> float:
    """Cost [USD] of a contact with property; 0 for what is not priced or hit too softly."""
    if kind not in PRICED_PROPERTY or impulse < PROPERTY_IMPULSE:
        return 0.0
    cost: float = getattr(prices.property_damage, kind).value
    return cost

"""What a delivery could lose that has not been seen to.

The limits of the interval that admits it.
"""

import math

import numpy as np

from harness.economics.accountings import PUBLISHED, injury_price
from harness.economics.prices import Prices
from harness.statistics.bootstrap import IntArray
from harness.statistics.interval import Interval
from harness.statistics.unseen import Reach, admit_unseen
from navstack.types import FloatArray

# [N s] of a robot of so many kg: 0..100 m/s, among which the dearest contact is looked for
_IMPULSES, _MASS = np.linspace(0.0, 5000.0, 10_001), 50.0


def reach_of_loss(
    prices: Prices, most_impulse: float = math.inf, accounting: str = PUBLISHED
) -> Reach:
    """From the lost fee to the dearest contact with a person, with repair and food [USD].

    Args:
        prices: the price file.
        most_impulse: [N s] that the world lets a contact have.
        accounting: by which contacts are paid.
    """
    fee = prices.delivery_fee.value
    impulses = _IMPULSES * (prices.robot_mass.value / _MASS)
    costs = injury_price(accounting)(np.minimum(impulses, most_impulse), prices)
    injury = float(costs.max())
    return Reach(fee, fee + injury + prices.repair_per_physical_assistance + prices.food_price)


def margin_admitting_unseen(
    margin: FloatArray,
    reach: Reach,
    clusters: IntArray,
    seed: int,
) -> Interval:
    """Mean of margins (n,) [USD] with the interval that admits a loss that has not been seen.

    Nothing earns more than the best has, or than the fee.
    """
    most = max(float(margin.max()), reach.least)
    return admit_unseen(margin, most, reach, None, np.random.default_rng(seed), clusters=clusters)


def difference_admitting_unseen(
    differences: FloatArray,
    reach: Reach,
    clusters: IntArray,
    seed: int,
) -> Interval:
    """The same of differences (n,) between two stacks, either of which may lose it."""
    return admit_unseen(
        differences,
        0.0,
        reach,
        reach,
        np.random.default_rng(seed),
        clusters=clusters,
    )

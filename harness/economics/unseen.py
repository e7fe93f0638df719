"""What a delivery could lose that has not been seen to.

The limits of the interval that admits it.
"""

import math

import numpy as np

from harness.economics.contact_costs import injury_costs
from harness.economics.prices import Prices
from harness.statistics.bootstrap import IntArray
from harness.statistics.interval import Interval
from harness.statistics.unseen import Reach, admit_unseen
from navstack.types import FloatArray

# [N s] Of these the dearest is looked for; the published curve turns at 1042.
_IMPULSES = np.linspace(0.0, 5000.0, 10_001)


def reach_of_loss(prices: Prices, most_impulse: float = math.inf) -> Reach:
    """From the lost fee to the dearest contact with a person, with repair and food [USD].

    Args:
        prices: the price file.
        most_impulse: [N s] that the world lets a contact have.
    """
    fee = prices.delivery_fee.value
    injury = float(injury_costs(np.minimum(_IMPULSES, most_impulse), prices).max())
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

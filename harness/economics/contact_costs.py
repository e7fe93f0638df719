"""What contacts cost: the one place where impulses become dollars."""

import numpy as np
import numpy.typing as npt

from harness.economics.injury import injury_cost
from harness.economics.prices import Prices
from harness.metrics import PRICED_PROPERTY, PROPERTY_IMPULSE, Row
from navstack.types import FloatArray


def injury_measures(impulses: npt.ArrayLike, prices: Prices) -> Row:
    """What a delivery's contacts with people come to; delta_v is impulse over the robot's mass, as published.

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


def property_cost(kind: str, impulse: float, prices: Prices) -> float:
    """Cost [USD] of a contact with property; 0 for what is not priced or hit too softly."""
    if kind not in PRICED_PROPERTY or impulse < PROPERTY_IMPULSE:
        return 0.0
    cost: float = getattr(prices.property_damage, kind).value
    return cost

"""The dollars of a delivery while it is driven: its contribution margin, bit by bit."""

import math

import numpy as np

from harness.economics.cost_model import running
from harness.economics.cost_terms import COUNTED_TERMS
from harness.economics.measured import Quantity
from harness.economics.prices import Prices
from harness.economics.valuation import deliveries
from harness.episode.episode import Delivery, cost_of
from harness.metrics.delivery_log import JOULES_PER_KWH
from harness.world.truth import Partner, Truth

REWARDED = ("revenue", *COUNTED_TERMS)


class Dollars:
    """What came in (positive) and went out (negative) since the last question, by term.

    Contacts and electricity are paid when they happen, the rest at the end, where rounding is
    settled, too. The sum over a delivery is its contribution margin.
    """

    def __init__(self, prices: Prices, truth: Truth) -> None:
        """Begin a delivery.

        Args:
            prices: the price file.
            truth: the state at its start.
        """
        self._prices = prices
        self._per_metre = (
            prices.electricity.value * prices.rolling_resistance_force / JOULES_PER_KWH
        ) / prices.electro_mechanical_efficiency
        self._x, self._y, self._contacts = truth.pose.x, truth.pose.y, 0
        self._paid = dict.fromkeys(REWARDED, 0.0)

    def since(self, truth: Truth) -> dict[str, float]:
        """What the time since the last question came to."""
        found = dict.fromkeys(REWARDED, 0.0)
        found["electricity"] = -self._per_metre * math.hypot(
            truth.pose.x - self._x, truth.pose.y - self._y
        )
        for contact in truth.counted_contacts[self._contacts :]:
            term = "property_damage"
            if contact.partner is Partner.PEDESTRIAN:
                term = "pedestrian_safety"
            found[term] -= cost_of(contact, self._prices)
        self._x, self._y, self._contacts = truth.pose.x, truth.pose.y, len(truth.counted_contacts)
        self._paid = {term: paid + found[term] for term, paid in self._paid.items()}
        return found

    def settle(self, delivery: Delivery) -> dict[str, float]:
        """What is left to come when it is over; a cargo that is not modelled arrives intact."""
        each = deliveries([delivery.row], self._prices.rolling_resistance_force)
        costs = running(each, self._prices)
        is_unknown = costs.revenue is None
        whole = {key: -_amount(amount) for key, amount in costs.terms.items()}
        whole["revenue"] = _amount(costs.revenue)
        if is_unknown and delivery.row["outcome"] == "arrived":
            whole["revenue"] = self._prices.delivery_fee.value
        return {term: amount - self._paid[term] for term, amount in whole.items()}


def _amount(of_one: Quantity | None) -> float:
    """What a delivery costs or earns; None: it is not modelled."""
    if of_one is None:
        return 0.0
    return float(np.ravel(of_one)[0])

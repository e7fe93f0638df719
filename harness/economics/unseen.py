"""What a delivery could lose that has not been seen to.

The limits of the interval that admits it.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.economics.accountings import ACCOUNTINGS, COUNTED, MONOTONE, PUBLISHED, injury_price
from harness.economics.prices import Prices, load_severe
from harness.metrics.columns import Row
from harness.metrics.contacts import PRICED_PROPERTY
from harness.statistics.bootstrap import IntArray
from harness.statistics.interval import Interval
from harness.statistics.unseen import Reach, admit_unseen
from harness.storage.rows import values
from navstack.types import FloatArray

# [N s] of a robot of so many kg: up to 100 m/s, among which the dearest contact is looked for
_IMPULSES, _MASS = np.linspace(0.5, 5000.0, 10_000), 50.0


HIT = 60.0  # [USD] about what it costs to hit somebody at the published prices ...
_HIT_INJURY, _HIT_IMPULSE = 37.0, 100.0  # ... [USD] of it the injury, and [N s] of such a hit
_LEAST = 1e-3  # [N s] a contact, if rules let the softest count


@dataclass(frozen=True, slots=True)
class ContactLimits:
    """What a world and its rules let the counted contacts of a delivery come to."""

    least: float = 50.0  # [N s] from which a contact counts; published
    most: float = math.inf  # [N s] of one contact with a person
    health: float = 177.78  # [N s] the contact that brings their sum to it is the last; published
    property: tuple[str, ...] = PRICED_PROPERTY  # the kinds that there are


def contact_limits(
    world: Mapping[str, Any], rules: Mapping[str, Any], rows: Iterable[Sequence[Row]]
) -> ContactLimits:
    """The limits under which deliveries were driven.

    Args:
        world: the world's file; what it does not name is as published.
        rules: the rules' file.
        rows: of each stack's deliveries, which tell what property there was.
    """
    usual, contacts = ContactLimits(), world.get("contacts", {})
    most = world.get("pedestrian_bodies", {}).get("max_contact_impulse", 0.0)
    if not most or contacts.get("per") != "point":  # all points of a contact may be more
        most = math.inf
    stacks = list(rows)
    kinds = []
    for kind in PRICED_PROPERTY:
        counts = [count for own in stacks for count in values(own, f"{kind}_contacts")]
        if any(count is not None for count in counts):
            kinds.append(kind)
    return ContactLimits(
        least=contacts.get("counted_impulse", usual.least),
        most=most,
        health=rules.get("impulse_health", usual.health),
        property=tuple(kinds),
    )


def hit_cost(prices: Prices) -> float:
    """About what it costs to hit somebody [USD]; no less than at the published prices."""
    injury = float(injury_price(PUBLISHED)(np.array([_HIT_IMPULSE]), prices)[0])
    return max(HIT, HIT - _HIT_INJURY + injury)


def reach_of_loss(
    prices: Prices, limits: ContactLimits | None = None, accounting: str = PUBLISHED
) -> Reach:
    """From the lost fee to the dearest contacts, with repair and food [USD].

    The dearest are people hit until the robot's health is used up, and the dearest property.

    Args:
        prices: the price file.
        limits: of the counted contacts.
        accounting: by which contacts are paid.
    """
    limits = limits or ContactLimits()
    fee = prices.delivery_fee.value
    damages = [getattr(prices.property_damage, kind).value for kind in limits.property]
    if accounting == MONOTONE:
        damages.append(load_severe().other_property.value)
    contacts = _dearest_injuries(prices, limits, accounting) + max(damages, default=0.0)
    assistance = prices.repair_per_physical_assistance + prices.food_price
    return Reach(fee, fee + contacts + assistance)


def _dearest_injuries(prices: Prices, limits: ContactLimits, accounting: str) -> float:
    """What the contacts of one delivery with people may cost [USD].

    Where all contacts are paid, whole ones have no limit: then it is the dearest.
    """
    impulses = _IMPULSES * (prices.robot_mass.value / _MASS)
    cost_of = injury_price(accounting)
    if ACCOUNTINGS[accounting][0] != COUNTED:
        return float(cost_of(impulses, prices).max())
    softest = max(limits.least, min(impulses[0], limits.health))
    hits = np.append(np.clip(impulses, softest, max(softest, limits.most)), softest)
    costs = cost_of(hits, prices)
    is_borne = hits <= max(softest, limits.health)
    usd_per_ns = (costs[is_borne] / np.maximum(hits[is_borne], _LEAST)).max()
    return float(costs.max() + usd_per_ns * limits.health)


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

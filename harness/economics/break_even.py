"""The break-even point, and how much of each trouble a delivery fee can bear."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import erfcx, ndtr

from harness.economics.prices import Prices
from harness.statistics.bootstrap import IntArray, resampled_means
from navstack.types import FloatArray


def break_even_runs(capex_usd: float, contribution_margin: float | None) -> float | None:
    """Deliveries that pay back the capital expenditure (paper, eq. BEP).

    Args:
        capex_usd: capital expenditure [USD].
        contribution_margin: earned per delivery [USD/run]; None where it is undefined.

    Returns:
        A real number of deliveries; None where the margin is not positive: then every delivery adds
        to the loss.
    """
    if contribution_margin is None or contribution_margin <= 0.0:
        return None
    return capex_usd / contribution_margin


def break_even_robots_per_operator(earned: float, shift_usd: float) -> float | None:
    """Robots that one operator must serve so that they pay the shift.

    Args:
        earned: by a robot in a shift, before the operator is paid [USD].
        shift_usd: what an operator costs for a shift [USD].

    Returns:
        A real number; None where a robot earns nothing: then no number of them pays.
    """
    if earned <= 0.0:
        return None
    return shift_usd / earned


def break_even_days(runs: float | None, prices: Prices) -> float | None:
    """Days of one robot's work that ``runs`` deliveries take."""
    if runs is None:
        return None
    return runs / prices.deliveries_per_day.value


def break_even_probability(
    runs: float,
    capex_usd: float,
    means: FloatArray,
    deviations: FloatArray,
) -> float:
    """Probability that profits pay back the capital expenditure within ``runs`` deliveries.

    The sum of many deliveries' profits is taken as Brownian motion with drift; when it first
    reaches ``capex_usd`` has the inverse Gaussian distribution (Chhikara and Folks 1989). Averaged
    over what the data leave open.

    Args:
        runs: deliveries [run], more than 0.
        capex_usd: capital expenditure [USD], more than 0.
        means: mean profit of a delivery [USD/run] in each bootstrap resample of the deliveries,
            shape (draws,).
        deviations: standard deviation of a delivery's profit [USD/run] in each, shape (draws,).
    """
    spread = np.where(deviations > 0.0, deviations, 1.0) * np.sqrt(runs)
    above, below = (means * runs - capex_usd) / spread, (means * runs + capex_usd) / spread
    by_then = ndtr(above)
    # exp(2 mean capex / variance) times the tail beyond ``below``; what overflows in it cancels
    # where that is positive
    earlier = np.exp(0.5 * np.minimum(below, 0.0) ** 2 - 0.5 * above**2) * _scaled_tail(below)
    certain = means * runs >= capex_usd  # without any spread
    return float(np.where(deviations > 0.0, np.minimum(by_then + earlier, 1.0), certain).mean())


def profit_draws(
    margin: FloatArray,
    clusters: IntArray,
    seed: int,
) -> tuple[FloatArray, FloatArray]:
    """Mean and standard deviation of a delivery's profit [USD/run] per resample, (draws,)."""
    centre = float(margin.mean())  # taken off, so that squares keep their digits
    profits = margin - centre
    rng = np.random.default_rng(seed)
    moments = resampled_means(np.column_stack((profits, profits**2)), rng, clusters=clusters)
    means, squares = moments.T
    return means + centre, np.sqrt(np.maximum(squares - means**2, 0.0))


def _scaled_tail(z: FloatArray) -> FloatArray:
    """Upper tail of the standard normal at each ``z``, times exp(z^2 / 2) where z is positive."""
    positive = np.maximum(z, 0.0)
    tail: FloatArray = np.where(z > 0.0, 0.5 * erfcx(positive / math.sqrt(2.0)), ndtr(-z))
    return tail


@dataclass(frozen=True, slots=True)
class Thresholds:
    """The rates above which one trouble alone uses up the fee (paper, "Break-Even Thresholds").

    Rates are events per delivery. Everything else is taken to cost nothing.
    """

    pedestrian_safety_usd_per_run: float  # [USD/run]
    ais1_contact_rate: float  # [1/run] contacts that end in AIS 1
    ais2_contact_rate: float  # [1/run]
    ais3_contact_rate: float  # [1/run]
    spoilage_rate: float  # [1/run] food refunded and fee lost
    timeout_and_physical_assistance_rate: float  # [1/run] both together: fee refunded and fee lost
    property_contact_rate: float  # [1/run] at the mean damage of the four published types
    physical_assistance_rate: float  # [1/run] through repair alone


def thresholds(prices: Prices) -> Thresholds:
    """The five thresholds of the appendix, the first one also per severity."""
    fee = prices.delivery_fee.value
    _, *severities = (prices.injury_mass_factor * cost for cost in prices.mais_costs)
    damage = prices.property_damage
    types = (
        damage.mailbox.value,
        damage.trash_bin.value,
        damage.bollard.value,
        damage.building_glass.value,
    )
    ais1, ais2, ais3 = (fee / cost for cost in severities)
    return Thresholds(
        pedestrian_safety_usd_per_run=fee,
        ais1_contact_rate=ais1,
        ais2_contact_rate=ais2,
        ais3_contact_rate=ais3,
        spoilage_rate=fee / (prices.food_price + fee),
        timeout_and_physical_assistance_rate=fee / (fee + fee),
        property_contact_rate=fee / (sum(types) / len(types)),
        physical_assistance_rate=fee / prices.repair_per_physical_assistance,
    )

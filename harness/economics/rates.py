"""How often deliveries meet trouble, per distance and per time; what they earn per distance."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from harness.economics.contact_costs import mais_probabilities
from harness.economics.prices import Prices
from harness.metrics.columns import Row
from harness.metrics.contacts import PRICED_PROPERTY
from harness.statistics.bootstrap import IntArray, percentile_interval, resampled_means
from harness.statistics.interval import Interval
from harness.statistics.rates import poisson_rate
from harness.storage.rows import values
from harness.world.outcome import Outcome
from navstack.types import FloatArray

THOUSAND = 1000.0
SECONDS_PER_HOUR = 3600.0
# outcomes after which a person must help
NEEDS_PEOPLE = (Outcome.TIMEOUT.value, Outcome.PHYSICAL_ASSISTANCE.value)
MARGIN_PER_KM = "contribution_margin_usd_per_km"


@dataclass(frozen=True, slots=True)
class Exposure:
    """A unit over which events are counted."""

    title: str
    key: str
    column: str  # of ``episodes.parquet``
    per_unit: float  # of the column's unit
    least: float = 0.0  # of the column's unit a delivery, up to which nothing was driven


STOOD = 0.5  # [m] a delivery, by which a robot that stands is pushed or settles
PER_1000_KM = Exposure("1000 km", "1000_km", "distance_m", 1000.0 * THOUSAND, STOOD)
PER_1000_H = Exposure("1000 h", "1000_h", "duration_s", SECONDS_PER_HOUR * THOUSAND)
EXPOSURES = (PER_1000_KM, PER_1000_H)


def contacts(rows: Sequence[Row], prices: Prices) -> FloatArray:
    """A 1 for each counted contact with a person and each paid one with property."""
    columns = ("pedestrian_contacts", *(f"{kind}_contacts" for kind in PRICED_PROPERTY))
    return np.ones(sum(number or 0 for name in columns for number in values(rows, name)))


def injuries(rows: Sequence[Row], prices: Prices) -> FloatArray:
    """Probability of an injury (MAIS 1 or more) in each counted contact with a person.

    By the price file's risk curves, at the mean change of velocity of the delivery's contacts:
    exact where a delivery has one.
    """
    counts = np.array([number or 0 for number in values(rows, "pedestrian_contacts")], dtype=int)
    speeds = np.array([speed or 0.0 for speed in values(rows, "collision_delta_v_mps")])
    risks = 1.0 - mais_probabilities(speeds, prices.injury.logistic.curves)[:, 0]
    return np.repeat(risks, counts)


def interventions(rows: Sequence[Row], prices: Prices) -> FloatArray:
    """A 1 for each way, there or back, that a person must help: timeouts, physical assistance."""
    ends = [*values(rows, "outcome"), *values(rows, "way_back")]
    return np.ones(sum(end in NEEDS_PEOPLE for end in ends))


@dataclass(frozen=True, slots=True)
class EventRate:
    """Something that happens while driving."""

    title: str
    weights: Callable[[Sequence[Row], Prices], FloatArray]  # of each event; 1: it is counted


EVENT_RATES = {
    "contacts": EventRate("Contacts", contacts),
    "injuries": EventRate("Injuries, expected (MAIS 1+)", injuries),
    "interventions": EventRate("Interventions", interventions),
}
# key -> title, in the order of tables
RATE_TITLES = {
    f"{name}_per_{exposure.key}": f"{rate.title} per {exposure.title}"
    for exposure in EXPOSURES
    for name, rate in EVENT_RATES.items()
}


def event_rates(rows: Sequence[Row], prices: Prices) -> dict[str, Interval]:
    """Rates by the keys of :data:`RATE_TITLES`, with exact Poisson bounds.

    ``n`` is the number of events; of injuries, that of contacts with people.

    Args:
        rows: of ``episodes.parquet``.
        prices: whose risk curves say how likely an injury is.
    """
    found = {}
    for exposure in EXPOSURES:
        driven = sum(amount or 0.0 for amount in values(rows, exposure.column))
        units = driven / exposure.per_unit if driven > exposure.least * len(rows) else 0.0
        for name, rate in EVENT_RATES.items():
            key = f"{name}_per_{exposure.key}"
            found[key] = poisson_rate(rate.weights(rows, prices), units)
    return found


def margin_per_km(
    margins: FloatArray,
    rows: Sequence[Row],
    clusters: IntArray,
    seed: int,
) -> Interval:
    """What a kilometre earns [USD/km]: all margins over all distances, with a bootstrap interval.

    Without bounds where a resample may have no kilometre, as of robots most of which stood.

    Args:
        margins: of each delivery [USD], shape (n,).
        rows: of these deliveries.
        clusters: number of each delivery's mission, shape (n,).
        seed: of the resamples.
    """
    distances = np.array([metres or 0.0 for metres in values(rows, "distance_m")]) / THOUSAND
    total = float(distances.sum())
    if total <= len(rows) * STOOD / THOUSAND:
        return Interval(None, None, None, len(rows))
    value = float(margins.sum()) / total
    if clusters.max() == 0:
        return Interval(value, None, None, len(rows))
    means = resampled_means(
        np.column_stack((margins, distances)), np.random.default_rng(seed), clusters=clusters
    )
    if (means[:, 1] <= 0.0).any():
        return Interval(value, None, None, len(rows))
    return percentile_interval(value, means[:, 0] / means[:, 1], len(rows))

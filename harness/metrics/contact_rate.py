"""Contacts that are paid for, per distance driven."""

from collections.abc import Sequence

from harness.metrics.columns import Row
from harness.metrics.contacts import PRICED_PROPERTY
from harness.statistics.interval import Interval
from harness.statistics.rates import poisson_rate
from harness.storage.rows import values

THOUSAND_KM = 1e6  # [m]


def contacts_per_1000_km(rows: Sequence[Row]) -> Interval:
    """Counted contacts with people and paid ones with property, per 1000 km driven.

    The interval is exact for contacts that happen independently (Poisson).

    Args:
        rows: of ``episodes.parquet``.
    """
    columns = ("pedestrian_contacts", *(f"{kind}_contacts" for kind in PRICED_PROPERTY))
    count = sum(number or 0 for name in columns for number in values(rows, name))
    distance = sum(metres or 0.0 for metres in values(rows, "distance_m"))  # [m]
    return poisson_rate(count, distance / THOUSAND_KM)

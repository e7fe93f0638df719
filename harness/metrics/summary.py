"""How a run sums up its deliveries: the paper's means under the paper's names, and further ones."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from harness.metrics.catalog import EPISODE_METRICS
from harness.metrics.columns import Row


def summarize(rows: Sequence[Mapping[str, Any]], rolling_resistance_force: float) -> Row:
    """The measurements of a run under the keys of the paper's simulation table: means over its episodes.

    ``rolling_resistance_force`` [N] is the paper's C_RollingResistanceForce; mechanical power is this force times the
    mean speed. A share is undefined (None) where an arrival's cargo was not modelled, a mean where a value is.
    """

    def share(outcome: str) -> float:
        return sum(row["outcome"] == outcome for row in rows) / len(rows)

    modelled = not any(row["outcome"] == "arrived" for row in rows)
    means = {
        metric.mean_key: mean_of_all(rows, metric.key, metric.mean_divisor)
        for metric in EPISODE_METRICS
        if metric.is_published
    }
    return {
        "sla": share("sla") if modelled else None,
        "spoiled": share("spoiled") if modelled else None,
        "timeout": share("timeout"),
        "physical_assistance": share("physical_assistance"),
        "avg_mechanical_power_kw": rolling_resistance_force * means["avg_velocity_mps"] / 1000.0,
        **means,
    }


def summarize_more(rows: Sequence[Mapping[str, Any]]) -> Row:
    """Means that the paper's table does not have, over the deliveries where they are defined; None: in none."""
    more = [metric for metric in EPISODE_METRICS if metric.mean_key and not metric.is_published]
    return {metric.mean_key: mean_of_defined(rows, metric.key, metric.mean_divisor) for metric in more}


def mean_of_all(rows: Sequence[Mapping[str, Any]], key: str, divisor: float) -> float | None:
    """Mean over the divisor of a column; None where a value is undefined."""
    values = [row.get(key) for row in rows]
    return None if any(value is None for value in values) else float(np.mean(values)) / divisor


def mean_of_defined(rows: Sequence[Mapping[str, Any]], key: str, divisor: float) -> float | None:
    """Mean over the divisor of a column's defined values; None where there is none."""
    values = [row[key] for row in rows if row.get(key) is not None]
    return float(np.mean(values)) / divisor if values else None

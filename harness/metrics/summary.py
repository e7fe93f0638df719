"""How a run sums up its deliveries: the paper's means under the paper's names, and further ones."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from harness.metrics.catalog import EPISODE_METRICS
from harness.metrics.columns import Row
from harness.metrics.metric import Metric
from harness.storage.rows import values
from harness.world.outcome import OUTCOMES, Outcome


def summarize(rows: Sequence[Mapping[str, Any]], rolling_resistance_force: float) -> Row:
    """The measurements of a run under the keys of the paper's simulation table.

    Means over its episodes.

    ``rolling_resistance_force`` [N] is the paper's C_RollingResistanceForce; mechanical power is
    this force times the mean speed. A share is undefined (None) where an arrival's cargo was not
    modelled, a mean where a value is.
    """
    outcomes = values(rows, "outcome")

    means: Row = {}
    for metric in EPISODE_METRICS:
        if metric.mean_key and metric.is_published:
            means[metric.mean_key] = None
            if None not in values(rows, metric.key):
                means[metric.mean_key] = _mean_of_defined(rows, metric)
    summary: Row = {outcome: outcomes.count(outcome) / len(rows) for outcome in OUTCOMES}
    if Outcome.ARRIVED.value in outcomes:
        summary["sla"] = summary["spoiled"] = None
    speed, power = means["avg_velocity_mps"], None
    if speed is not None:
        power = rolling_resistance_force * speed / 1000.0
    return {**summary, "avg_mechanical_power_kw": power, **means}


def summarize_more(rows: Sequence[Mapping[str, Any]]) -> Row:
    """Means that the paper's table does not have, over the deliveries where they are defined.

    None: in none.
    """
    more = [metric for metric in EPISODE_METRICS if not metric.is_published]
    return {metric.mean_key: _mean_of_defined(rows, metric) for metric in more if metric.mean_key}


def _mean_of_defined(rows: Sequence[Mapping[str, Any]], metric: Metric) -> float | None:
    defined = [each for each in values(rows, metric.key) if each is not None]
    if not defined:
        return None
    return float(np.mean(defined)) / metric.mean_divisor

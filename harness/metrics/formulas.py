"""Metrics with a formula of their own over the recorded series, each declared beside it.

A new one takes a function and an entry here. The series are those of ``DeliveryLog.series``.
"""

from collections.abc import Mapping

import numpy as np

from harness.metrics.metric import Better, Metric
from harness.metrics.motion import distance_driven, wrapped
from navstack.types import FloatArray

LEAST_DISTANCE = 1.0  # [m] below which turning per metre says nothing


def path_irregularity(series: Mapping[str, FloatArray]) -> float | None:
    """Accumulated turning per metre in [rad/m]; None below :data:`LEAST_DISTANCE`.

    Guzzi et al. 2013 subtract the turning that the most direct path needs, which depends on a
    planner; nothing is subtracted here, so that this is an upper bound of theirs.
    """
    distance = distance_driven(series["x"], series["y"])
    if distance < LEAST_DISTANCE:
        return None
    return float(np.abs(wrapped(np.diff(series["yaw"]))).sum() / distance)


# By group of the catalog, in which they come first.
FORMULAS: Mapping[str, tuple[Metric, ...]] = {
    "Motion": (
        Metric(
            key="path_irregularity_radpm",
            title="Path irregularity",
            better=Better.LOWER,
            meaning="Accumulated turning (sum of absolute changes of the true yaw from tick to "
            "tick) per metre driven. The definition there subtracts the turning of the most "
            "direct path; here nothing is subtracted.",
            source="Guzzi et al. 2013, ICRA, Human-friendly robot navigation in dynamic "
            "environments",
            undefined="less than 1 m was driven",
            mean_key="avg_path_irregularity_radpm",
            decimals=3,
            formula=path_irregularity,
        ),
    ),
}

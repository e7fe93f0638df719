"""Means of many columns with their bootstrap intervals, from the same resamples."""

from collections.abc import Mapping

import numpy as np

from harness.statistics.bootstrap import IntArray, percentile_interval, resampled_means
from harness.statistics.interval import Interval
from navstack.types import FloatArray


def mean_intervals(
    columns: Mapping[str, FloatArray | None],
    clusters: IntArray,
    seed: int,
    resolution: float = 0.0,
) -> dict[str, Interval]:
    """Mean and bootstrap interval of each column (n,) over its defined entries.

    None and all undefined are left out.

    No bounds where all entries are within ``resolution`` or of one cluster: too few to tell.
    """
    known = {
        key: np.broadcast_to(column, clusters.shape)
        for key, column in columns.items()
        if column is not None
    }
    known = {key: column for key, column in known.items() if not np.isnan(column).all()}
    differ = [
        key
        for key, column in known.items()
        if np.nanmax(column) - np.nanmin(column) > resolution
        and np.ptp(clusters[~np.isnan(column)]) > 0
    ]
    intervals = {
        key: Interval(float(np.nanmean(column)), None, None, int((~np.isnan(column)).sum()))
        for key, column in known.items()
    }
    if differ:
        draws = resampled_means(
            np.column_stack([known[key] for key in differ]),
            np.random.default_rng(seed),
            clusters=clusters,
        )
        for key, means in zip(differ, draws.T, strict=True):
            mean = intervals[key]
            intervals[key] = percentile_interval(float(np.nanmean(known[key])), means, mean.n)
    return intervals

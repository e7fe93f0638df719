"""Values with their uncertainty: intervals, resamples, and comparisons of paired deliveries."""

from harness.statistics.bootstrap import (
    bootstrap_cvar,
    bootstrap_mean,
    bootstrap_quantile,
    cvar,
    number_clusters,
    percentile_interval,
    resampled_means,
)
from harness.statistics.interval import Interval, wilson_interval
from harness.statistics.paired import (
    PairedDifference,
    compare_pairs,
    holm,
    mcnemar_p,
    paired_slope,
    pairs_needed,
    sign_flip_p,
    smallest_detectable,
)

__all__ = [
    "Interval",
    "PairedDifference",
    "bootstrap_cvar",
    "bootstrap_mean",
    "bootstrap_quantile",
    "compare_pairs",
    "cvar",
    "holm",
    "mcnemar_p",
    "number_clusters",
    "paired_slope",
    "pairs_needed",
    "percentile_interval",
    "resampled_means",
    "sign_flip_p",
    "smallest_detectable",
    "wilson_interval",
]

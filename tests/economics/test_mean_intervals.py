"""Means of many columns from the same resamples."""

import math

import numpy as np

from harness.statistics.mean_intervals import mean_intervals


def test_a_mean_that_is_known_of_one_mission_has_no_bounds() -> None:
    """Its resamples would all be alike, which looks like certainty."""
    clusters = np.array([0, 0, 1, 1, 2, 3])
    sparse = np.array([1.0, 2.0, *[math.nan] * 4])
    full = np.array([1.0, 2.0, 4.0, 3.0, 9.0, 5.0])
    found = mean_intervals({"sparse": sparse, "full": full}, clusters, 0)
    assert (found["sparse"].value, found["sparse"].low, found["sparse"].high) == (1.5, None, None)
    assert found["full"].low is not None and found["full"].low < 4.0 < (found["full"].high or 0.0)

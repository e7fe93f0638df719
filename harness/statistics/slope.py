"""How a quantity changes with what was set, over missions that met every setting."""

import numpy as np

from harness.statistics.bootstrap import IntArray, bootstrap_mean
from harness.statistics.interval import Interval
from navstack.types import FloatArray


def paired_slope(levels: FloatArray, values: FloatArray, clusters: IntArray, rng: np.random.Generator) -> Interval:
    """Slope of the least-squares line through values over levels, every mission with an intercept of its own.

    This is the fixed-effects ("within") estimator (e.g. Wooldridge 2010, Econometric Analysis of Cross Section and
    Panel Data, section 10.5). Where each mission meets every level it is the mean of the missions' own slopes, and
    these are resampled, whole missions at a time: the pairs cluster bootstrap (Cameron, Gelbach and Miller 2008).

    Args:
        levels: shape (k,), at least two different ones.
        values: shape (n, k), finite: of each delivery at each level.
        clusters: number of each delivery's mission, shape (n,).
        rng: source of the resamples.

    Raises:
        ValueError: levels that are all alike.
    """
    centred = levels - levels.mean()
    spread = float(centred @ centred)
    if spread == 0.0:
        raise ValueError("a slope needs two different levels at least")
    slopes = values @ centred / spread
    if slopes.size == 0 or np.ptp(slopes) == 0.0:
        return Interval(float(slopes.mean()) if slopes.size else None, None, None, slopes.size)
    return bootstrap_mean(slopes, rng, clusters=clusters)

"""How often something happens, with an exact interval."""

from scipy.special import gammaincinv

from harness.statistics.interval import Interval

TAIL = 0.025  # on either side of a 95 % interval


def poisson_rate(count: int, exposure: float) -> Interval:
    """Events per unit of exposure, with the exact 95 % interval of a Poisson count.

    Garwood 1936, "Fiducial limits for the Poisson distribution": quantiles of gamma distributions.

    Args:
        count: events that happened; 0 or more.
        exposure: over which they did, e.g. a distance; none: the rate is undefined.
    """
    if exposure <= 0.0:
        return Interval(None, None, None, count)
    low = 0.0
    if count:
        low = float(gammaincinv(count, TAIL))
    high = float(gammaincinv(count + 1, 1.0 - TAIL))
    return Interval(count / exposure, low / exposure, high / exposure, count)

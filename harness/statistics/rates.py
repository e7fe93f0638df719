"""How often something happens, with an exact interval."""

from scipy.special import gammaincinv

from harness.statistics.interval import Interval
from navstack.types import FloatArray

TAIL = 0.025  # on either side of a 95 % interval


def poisson_rate(weights: FloatArray, exposure: float, heaviest: float = 1.0) -> Interval:
    """Events per unit of exposure, with the 95 % interval of a Poisson count.

    Where each event has a weight of 1, that is exact (Garwood 1936, "Fiducial limits for the
    Poisson distribution"). Else it is the one of Fay and Feuer 1997, "Confidence intervals for
    directly standardized rates", Statistics in Medicine 16.

    Args:
        weights: of the events that happened, shape (n,), each from 0 to ``heaviest``, e.g. a
            contact's risk of an injury.
        exposure: over which they did, e.g. a distance; none: the rate is undefined.
        heaviest: what an event not seen yet may weigh.
    """
    count = weights.size
    if exposure <= 0.0:
        return Interval(None, None, None, count)
    total, variance = float(weights.sum()), float((weights**2).sum())
    low = 0.0
    if total > 0.0:
        low = variance / total / 2.0 * _chi_squared(TAIL, 2.0 * total**2 / variance)
    above, spread = total + heaviest, variance + heaviest**2
    high = spread / above / 2.0 * _chi_squared(1.0 - TAIL, 2.0 * above**2 / spread)
    return Interval(total / exposure, low / exposure, high / exposure, count)


def _chi_squared(probability: float, freedom: float) -> float:
    """Quantile of the chi-squared distribution, without importing all of ``scipy.stats``."""
    return 2.0 * float(gammaincinv(freedom / 2.0, probability))

"""When AMCL takes itself to be lost: a fast average of the scans' likelihood falls below a slow one."""

from navstack.params.amcl import AmclParams

LEAST_FALL = 0.1  # [-] of the fast average of fits: smaller ones are chance, as people pass by


class LikelihoodAverages:
    """The averages of Nav2 (``pf.c``), after Augmented MCL (Probabilistic Robotics, table 8.3).

    They start at their first value and start over whenever random particles were drawn, so that chance does not take
    over; and a weight is a likelihood divided by the number of particles. So they notice little: the first value is
    that of particles which are still spread widely, and fewer particles pass for a better fit.
    """

    def __init__(self, slow_rate: float, fast_rate: float) -> None:
        self._rates = slow_rate, fast_rate
        self.clear()

    def clear(self) -> None:
        """Start over."""
        self._averages = [0.0, 0.0]  # slow, fast
        self._count = 0

    def follow(self, weight: float, fit: float) -> None:
        """Take in a scan.

        Args:
            weight: mean of the particles' weights times the scan's likelihood.
            fit: greatest likelihood of the scan for any particle, as a share of the best possible.
        """
        self._count += 1
        value = self._choose(weight, fit)
        for i, rate in enumerate(self._rates):
            self._averages[i] += self._share_of_new(rate) * (value - self._averages[i])

    def _choose(self, weight: float, fit: float) -> float:
        """What is averaged."""
        return weight

    def _share_of_new(self, rate: float) -> float:
        """How much the newest value counts."""
        return 1.0 if self._count == 1 else rate

    @property
    def share_of_strays(self) -> float:
        """The share of random particles that the next resampling brings: how far the fast average has fallen."""
        slow, fast = self._averages
        return max(1.0 - fast / slow, 0.0) if slow > 0.0 else 0.0

    def after_strays(self) -> None:
        """Random particles were drawn."""
        self.clear()


class LastingAverages(LikelihoodAverages):
    """Averages for random particles that the scan has picked: these do no harm, and may come until one is right.

    Each average is the plain mean until its rate takes over, and lasts. It is of the fit, which does not change with
    the number of particles or returns, nor with the random particles as long as one of all is right. Looking for poses
    that fit is dear, so that a fall of less than ``LEAST_FALL`` brings none.
    """

    def _choose(self, weight: float, fit: float) -> float:
        return fit

    def _share_of_new(self, rate: float) -> float:
        return max(rate, 1.0 / self._count) if rate > 0.0 else 0.0

    @property
    def share_of_strays(self) -> float:
        """See the base class."""
        share = super().share_of_strays
        return share if share >= LEAST_FALL else 0.0

    def after_strays(self) -> None:
        """They last."""


def averages_of(params: AmclParams) -> LikelihoodAverages:
    """The averages that go with the parameters' kind of random particles."""
    kind = LastingAverages if params.recovery_candidates > 0 else LikelihoodAverages
    return kind(params.recovery_alpha_slow, params.recovery_alpha_fast)

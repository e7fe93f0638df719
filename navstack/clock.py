"""When something that runs at a fixed rate is due, on simulated time."""

import math


class Clock:
    """Says when something that runs at a fixed rate is due.

    First at the start, then once per period.

    The periods are counted, not summed up, so that rounding never shifts them against the physics
    steps.
    """

    _TOLERANCE = 1e-6  # [periods] within which a time stamp counts as on time

    def __init__(self, rate: float) -> None:
        """Make a clock of ``rate`` [Hz]."""
        self.rate = rate  # [Hz]
        self.reset()

    def reset(self) -> None:
        """Be due at the next question."""
        self._last = -1
        # [s] before which nothing is due: a bound that spares most of the arithmetic
        self._early = -math.inf

    def is_due(self, stamp: float) -> bool:
        """Whether a new period has begun at ``stamp`` [s] since this was true last."""
        if stamp < self._early:
            return False
        period = math.floor(stamp * self.rate + self._TOLERANCE)
        if period <= self._last:
            return False
        self._last = period
        self._early = math.inf
        if self.rate > 0.0:
            self._early = (period + 1.0 - 2.0 * self._TOLERANCE) / self.rate
        return True

"""The wall time of a study: what of it is left, and for how many deliveries it lasts."""

import math
import time

from harness.tuning.journal import Journal

ENDING = 8  # deliveries that are as long as recording three missions and writing the pages
MOST_RESERVED = 0.5  # of the time between the original and the ending, for choice and test
# times its training missions that a study takes at least: your file, a few trials, a test
LEAST_STUDY = 10


class Budget:
    """Wall time for all that a study does, by one estimate: the time per delivery so far."""

    def __init__(self, seconds: float | None, journal: Journal) -> None:
        """Nothing is spent yet.

        Args:
            seconds: [s] of wall time; None: as long as it takes.
            journal: which keeps the time.
        """
        self.seconds, self._journal = seconds, journal
        self.ending = ENDING  # deliveries; 0: there will be nothing to record

    @property
    def end(self) -> float:
        """[s] of the monotonic clock at which it is over; infinite: there is none."""
        if self.seconds is None:
            return math.inf
        return time.monotonic() + self.seconds - self._journal.elapsed

    @property
    def left(self) -> float:
        """Wall time [s] for deliveries before the recorded ones; infinite: there is no budget."""
        if self.seconds is None:
            return math.inf
        journal = self._journal
        return max(self.seconds - journal.elapsed - self.ending * journal.pace, 0.0)

    @property
    def until(self) -> float:
        """[s] of the monotonic clock at which the recorded deliveries begin."""
        return time.monotonic() + self.left

    def share_of(self, deliveries: int) -> float:
        """The share of so many deliveries for which it lasts, 0 to 1."""
        needed = deliveries * self._journal.pace
        if needed <= self.left:
            return 1.0
        return self.left / needed

    def allows(self, trial: int, later: int, began: float) -> bool:
        """Whether there is time for a trial before what follows the search.

        Args:
            trial: deliveries after which it may be dropped.
            later: deliveries of final choice and test.
            began: [s] of the study at which its first trial could begin.
        """
        if self.seconds is None:
            return True
        pace = self._journal.pace
        between = self.seconds - began - self.ending * pace
        reserve = min(later * pace, MOST_RESERVED * between)
        return trial * pace + reserve < self.left


def further(missions: int, pace: float, seconds: float) -> str:
    """A budget that leaves as much again as a study takes, beyond the ``seconds`` of before."""
    return enough_for(missions, pace, seconds + LEAST_STUDY * missions * pace)


def enough_for(missions: int, pace: float, least: float = 0.0) -> str:
    """A budget for a study with so many training missions, as ``--budget`` takes it.

    Args:
        missions: for training.
        pace: wall time [s] of a delivery.
        least: [s] that it has in any case.
    """
    seconds = max(LEAST_STUDY * missions * pace, least)
    return f"{max(math.ceil(seconds / 60.0), 1)}m"

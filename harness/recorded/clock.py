"""The robot's time while a bag is replayed: that of the stamps, not that of the recording."""

from collections import Counter
from collections.abc import Mapping

APART = 10.0  # [s] by which a stamp may differ from the time that has come
_BEGINNING = 0.1  # [s] of simulated time, in which a stamp of 0 may be meant


class Clock:
    """Goes with the stamps of measurement, never back; a stamp of another clock is replaced by the time of arrival.

    Late messages keep their older stamps, and a bag whose stamps run faster or slower than its recording is followed. A
    stamp more than ``APART`` off both the last and the expected time (of a receiver's own clock, corrupt) is not used,
    nor one that is unset: 0, or the one at which a topic stands still.
    """

    def __init__(self, offset: float, still: Mapping[str, float] | None = None) -> None:
        """Start.

        Args:
            offset: [s] by which stamps usually differ from the times of arrival.
            still: the stamps that do not change, by topic.
        """
        self._offset, self._still = offset, still or {}
        self._arrival: float | None = None
        self.now = 0.0  # [s]
        self.replaced: Counter[str] = Counter()  # stamps, by topic

    def take(self, topic: str, arrival: float, stamp: float) -> float:
        """Go on to a message's arrival; returns the stamp to use for it, in [s]."""
        expected = arrival + self._offset if self._arrival is None else self.now + arrival - self._arrival
        is_near_now = self._arrival is not None and abs(stamp - self.now) <= APART
        is_unset = stamp == self._still.get(topic) or (stamp == 0.0 and abs(expected) > _BEGINNING)
        if is_unset or (not abs(stamp - expected) <= APART and not is_near_now):
            self.replaced[topic] += 1
            stamp = expected
        self.now = stamp if self._arrival is None else max(self.now, stamp)
        self._arrival = arrival
        return stamp

"""The time of a replayed log."""

import math
from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

from harness.recorded.ros_messages import FIX

STILL = 3  # messages with one stamp, after which it is taken to be unset
STILL_AFTER = {FIX: 2.0}  # [s] for which receivers may repeat a fix
LATE = 0.3  # [s] by which a message may be older than the one before of its topic
# [s] by which a stamp may be ahead of its time: where a log that is played fast was recorded
AHEAD = 1.0
APART = 10.0  # [s] by which a stamp may differ from the time that has come
_BEGINNING = 0.1  # [s] of simulated time, in which a stamp of 0 may be meant


@dataclass(slots=True)
class _TopicTime:
    """What is known of the stamps of one topic."""

    newest: float = -math.inf  # [s] as written, since they last went back
    last: float = math.nan  # [s] as written
    shift: float = 0.0  # [s] added to them since
    lag: float = 0.0  # [s] by which the last one was older than expected
    repeats: int = 0  # of the last
    since: float = 0.0  # [s] arrival of the first of these


class Clock:
    """Goes with the stamps of measurement, never back.

    A stamp of another clock is replaced by the time of arrival.

    Late messages keep their older stamps, and a bag whose stamps run faster or slower than its
    recording is followed. Where the stamps of a topic go back by more than ``LATE``, or get more
    than ``AHEAD`` of the expected time, its clock was set: they run on from there, until they fit
    as they are. A stamp more than ``APART`` off both the last and the expected time (of a
    receiver's own clock, corrupt) is not used, nor one that is unset: 0, or the one at which a
    topic stands still.
    """

    def __init__(self, offset: float, still: Mapping[str, float] | None = None) -> None:
        """Start.

        Args:
            offset: [s] by which stamps usually differ from the times of arrival.
            still: the stamps that do not change, by topic.
        """
        self._offset, self._still = offset, dict(still or {})
        self._arrival: float | None = None  # [s] of the message that brought ``now``
        self._topics: defaultdict[str, _TopicTime] = defaultdict(_TopicTime)
        self.now = 0.0  # [s]
        self.replaced: Counter[str] = Counter()  # stamps, by topic
        self.jumps: dict[str, float] = {}  # [s] of the stamps of a topic, the first one

    def take(self, topic: str, arrival: float, stamp: float, still_after: float = 0.0) -> float:
        """Go on to a message's arrival; returns the stamp to use for it.

        Args:
            topic: of the message.
            arrival: [s] when it was recorded.
            stamp: [s] in its header.
            still_after: [s] for which a topic may repeat a stamp before its clock stands.
        """
        expected, is_near_now = arrival + self._offset, False
        if self._arrival is not None:
            expected = self.now + arrival - self._arrival
        known, given = self._topics[topic], stamp
        self._note_repeats(topic, known, arrival, stamp, still_after)
        is_unset = stamp == self._still.get(topic) or (stamp == 0.0 and abs(expected) > _BEGINNING)
        if not is_unset:
            stamp = self._run_on(topic, known, stamp, expected)
        if self._arrival is not None:
            is_near_now = abs(stamp - self.now) <= APART
        if is_unset or (not abs(stamp - expected) <= APART and not is_near_now):
            self.replaced[topic] += 1
            stamp = expected
        else:
            known.newest, known.lag = max(given, known.newest), expected - stamp
        if self._arrival is None or stamp > self.now:
            self.now, self._arrival = stamp, arrival
        return stamp

    def _note_repeats(
        self,
        topic: str,
        known: _TopicTime,
        arrival: float,
        stamp: float,
        still_after: float,
    ) -> None:
        """Tell a topic that stands still."""
        if stamp != known.last:
            known.last, known.repeats, known.since = stamp, 0, arrival
            return
        known.repeats += 1
        if known.repeats >= STILL and arrival - known.since >= still_after:
            self._still[topic] = stamp

    def _run_on(self, topic: str, known: _TopicTime, stamp: float, expected: float) -> float:
        """The stamp, shifted if the topic's have gone back."""
        back, ahead = known.newest - stamp, stamp + known.shift - expected
        if abs(stamp - expected) < abs(ahead):
            known.shift = 0.0  # the clock is right again
        elif LATE < back <= APART or AHEAD < ahead <= APART:
            run_on = expected - known.lag
            self.jumps.setdefault(topic, stamp + known.shift - run_on)
            known.shift, known.newest = run_on - stamp, stamp
        return stamp + known.shift

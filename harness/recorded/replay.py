"""A localizer over a recorded log, message by message in the order of arrival."""

import math
from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from statistics import median
from typing import Any

import numpy as np

from harness.recorded import messages
from harness.recorded.bag import Bag, Message
from harness.recorded.receiver import Measured, Receiver
from harness.recorded.ros_messages import FIX, decode, first_messages
from harness.recorded.sources import Choice
from harness.recorded.trajectory import Trajectory
from navstack.errors import InputError
from navstack.localization.amcl import AmclLocalizer
from navstack.localization.localizer import Localizer
from navstack.types import Belief, GpsFix, Imu, LaserScan, Observation, Odometry

# messages from which the usual offset between stamps and arrivals is taken, and of each topic
_FIRST = 50
_STILL = 3  # messages with one stamp, after which it is taken to be unset
_COLUMNS = 4  # stamp, x, y, yaw
APART = 10.0  # [s] by which a stamp may differ from the time that has come
_BEGINNING = 0.1  # [s] of simulated time, in which a stamp of 0 may be meant


class Clock:
    """Goes with the stamps of measurement, never back.

    A stamp of another clock is replaced by the time of arrival.

    Late messages keep their older stamps, and a bag whose stamps run faster or slower than its
    recording is followed. A stamp more than ``APART`` off both the last and the expected time (of a
    receiver's own clock, corrupt) is not used, nor one that is unset: 0, or the one at which a
    topic stands still.
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
        expected, is_near_now = arrival + self._offset, False
        if self._arrival is not None:
            expected = self.now + arrival - self._arrival
            is_near_now = abs(stamp - self.now) <= APART
        is_unset = stamp == self._still.get(topic) or (stamp == 0.0 and abs(expected) > _BEGINNING)
        if is_unset or (not abs(stamp - expected) <= APART and not is_near_now):
            self.replaced[topic] += 1
            stamp = expected
        if self._arrival is None or stamp > self.now:
            self.now = stamp
        self._arrival = arrival
        return stamp


class Replay:
    """Feeds a localizer with a log and keeps its beliefs.

    Every message is an observation of its own, so that none is lost: an observation holds one of
    each kind. AMCL moves with the odometry alone, so that its beliefs are of the last odometry
    message's time; others are of the present.
    """

    def __init__(self, bag: Bag, choice: Choice, receiver: Receiver, localizer: Localizer) -> None:
        self._bag, self._choice, self._receiver, self._localizer = bag, choice, receiver, localizer
        self._beliefs, self._references = array("d"), array("d")  # rows of _COLUMNS
        self._is_amcl = isinstance(localizer, AmclLocalizer)
        self._moved_at: float | None = None  # [s], stamp of AMCL's last odometry message

    @property
    def topics(self) -> set[str]:
        """What is read."""
        return self._choice.names

    @property
    def trajectory(self) -> Trajectory:
        """The beliefs so far, the last one of each time."""
        beliefs = _trajectory(self._beliefs)
        is_last = np.diff(beliefs.stamps, append=np.inf) > 0.0
        return Trajectory(beliefs.stamps[is_last], beliefs.poses[is_last])

    @property
    def reference(self) -> Trajectory:
        """The poses of the reference topic so far."""
        return _trajectory(self._references)

    def run(
        self, start: Belief, begin: Callable[[Belief], None], say: Callable[[str], None]
    ) -> Iterator[float]:
        """Replay; yields the share of the messages that are done.

        Args:
            start: where the robot is believed to be; its stamp becomes that of the first message.
            begin: resets the localizer.
            say: takes warnings.

        Raises:
            DamageError: a message cannot be read.
            InputError: the localizer's belief is no longer a number.
        """
        places = self._bag.places(self._choice.names)
        clock = self._clock()
        belief: Belief | None = None
        for number, place in enumerate(places):
            message = self._bag.read(place)
            decoded = decode(message)
            measured_at = self._receiver.stamp_of(message.topic.type, decoded)
            if measured_at is not None:
                stamp = clock.take(message.topic.name, message.arrival, measured_at)
                if belief is None:
                    belief = replace(start, stamp=clock.now)
                    begin(belief)
                belief = self._take(message, decoded, stamp, clock.now, belief)
            yield (number + 1) / len(places)
        for topic, count in clock.replaced.items():
            wrong = "stamps that are unset or of another time"
            say(f"{count} messages of {topic} have {wrong}; taken as measured when they arrived")
        for kind, count in self._receiver.left_out.items():
            say(f"{count} messages of {kind.rsplit('/', 1)[-1]} hold nothing usable; left out")

    def _clock(self) -> Clock:
        """A clock that knows unset stamps, and the usual offset of the others."""
        still: dict[str, float] = {}
        known: list[tuple[float, float]] = []  # arrival, offset
        for topic in sorted(self._choice.names):
            times = self._first_times(topic)
            stamps = {stamp for _, stamp in times}
            if len(times) >= _STILL and len(stamps) == 1:
                still[topic] = stamps.pop()
                continue
            known += [(arrival, stamp - arrival) for arrival, stamp in times if stamp != 0.0]
        offsets = [offset for _, offset in sorted(known)[:_FIRST]] or [0.0]
        return Clock(median(offsets), still)

    def _first_times(self, topic: str) -> list[tuple[float, float]]:
        """Arrival and stamp in [s] of a topic's first messages."""
        times = []
        for message, decoded in first_messages(self._bag, topic, _FIRST):
            stamp = self._receiver.stamp_of(message.topic.type, decoded)
            if stamp is not None:
                times.append((message.arrival, stamp))
        return times

    def _take(
        self, message: Message, decoded: Any, stamp: float, now: float, belief: Belief
    ) -> Belief:
        """One message, to the localizer or to the reference; returns what is believed then."""
        name, kind = message.topic.name, message.topic.type
        is_input = name in self._choice.topics.values()
        measured = None
        if is_input or kind == FIX:
            measured = self._receiver.convert(kind, decoded, stamp, belief.pose)
        if name == self._choice.reference:
            row = None
            if isinstance(measured, GpsFix):
                row = measured.x, measured.y, math.nan
            elif kind != FIX:
                row = messages.pose_of(decoded)
            if row is not None:
                self._references.extend((stamp, *row))
        if not is_input or measured is None:
            return belief
        belief = self._localizer.update(_observation(now, measured))
        if self._is_amcl and isinstance(measured, Odometry):
            self._moved_at = measured.stamp
        if self._moved_at is not None:
            now = self._moved_at
        self._keep(now, belief)
        return belief

    def _keep(self, stamp: float, belief: Belief) -> None:
        pose = belief.pose
        if not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
            raise InputError(f"the localizer's belief is no longer a number at {stamp:.3f} s")
        if self._beliefs and self._beliefs[-_COLUMNS] == stamp:
            del self._beliefs[-_COLUMNS:]
        self._beliefs.extend((stamp, pose.x, pose.y, pose.yaw))


def _trajectory(rows: "array[float]") -> Trajectory:
    return Trajectory.of_rows(np.array(rows).reshape(-1, _COLUMNS))


def _observation(now: float, measured: Measured) -> Observation:
    """What holds one measurement only."""
    match measured:
        case GpsFix():
            return Observation(now, gps=measured)
        case Imu():
            return Observation(now, imu=measured)
        case LaserScan():
            return Observation(now, scan=measured)
        case Odometry():
            return Observation(now, odometry=measured)

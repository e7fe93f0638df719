"""A localizer over a recorded log, message by message in the order of arrival."""

import math
from array import array
from collections.abc import Callable, Iterator
from dataclasses import replace
from statistics import median
from typing import Any

import numpy as np

from harness.recorded import messages
from harness.recorded.bag import Bag, Message
from harness.recorded.bag_file import BagError
from harness.recorded.clock import STILL, STILL_AFTER, Clock
from harness.recorded.receiver import Measured, Receiver
from harness.recorded.ros_messages import FIX, decode, first_messages
from harness.recorded.sources import Choice
from harness.recorded.trajectory import Trajectory
from navstack.localization.amcl import AmclLocalizer
from navstack.localization.localizer import Localizer
from navstack.plugin_answers import checked_belief
from navstack.types import Belief, GpsFix, Health, Imu, IntArray, LaserScan, Observation, Odometry

# messages from which the usual offset between stamps and arrivals is taken, and of each topic
_FIRST = 50
_COLUMNS = 4  # stamp, x, y, yaw


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
        self._last = 0.0  # [s] of the last belief
        self._is_next_held_out = False  # of the reference's messages, where such are held out
        self.seconds = dict.fromkeys(Health, 0.0)  # for which it was so

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
        self,
        start: Belief,
        begin: Callable[[Belief], None],
        say: Callable[[str], None],
    ) -> Iterator[float]:
        """Replay; yields the share of the messages that are done.

        Args:
            start: where the robot is believed to be; its stamp becomes that of the first message.
            begin: resets the localizer.
            say: takes notes.

        Raises:
            DamageError: a message cannot be read.
            InputError: the localizer answers no belief of numbers, or no time passes in the log.
        """
        places = self._bag.places(self._choice.names)
        clock = self._clock(places)
        belief: Belief | None = None
        for number, place in enumerate(places):
            message = self._bag.read(place)
            decoded = decode(message)
            measured_at = self._receiver.stamp_of(message.topic.type, decoded)
            if measured_at is not None:
                still_after = STILL_AFTER.get(message.topic.type, 0.0)
                stamp = clock.take(message.topic.name, message.arrival, measured_at, still_after)
                if belief is None:
                    belief = replace(start, stamp=clock.now)
                    begin(belief)
                belief = self._take(message, decoded, stamp, clock.now, belief)
            yield (number + 1) / len(places)
        for line in self._receiver.notes(clock):
            say(line)

    def _clock(self, places: IntArray) -> Clock:
        """A clock that knows unset stamps, and the usual offset of the others.

        Raises:
            BagError: neither stamps nor arrivals go on.
        """
        still: dict[str, float] = {}
        known: list[tuple[float, float]] = []  # arrival, offset
        for topic in sorted(self._choice.names):
            times = self._first_times(topic)
            stamps = {stamp for _, stamp in times}
            if len(times) >= STILL and len(stamps) == 1:
                still[topic] = stamps.pop()
                continue
            known += [(arrival, stamp - arrival) for arrival, stamp in times if stamp != 0.0]
        if still and not known and places[0, 1] == places[-1, 1]:
            raise BagError(
                f"no time passes in the log: its {len(places)} messages arrived at once, and their "
                "stamps do not change"
            )
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
        self,
        message: Message,
        decoded: Any,
        stamp: float,
        now: float,
        belief: Belief,
    ) -> Belief:
        """One message, to the localizer or to the reference; returns what is believed then."""
        name, kind = message.topic.name, message.topic.type
        is_input, is_reference = self._uses_of(name)
        measured = None
        if is_input or kind == FIX:
            measured = self._receiver.convert(kind, decoded, stamp, belief.pose)
        if is_reference:
            row = None
            if isinstance(measured, GpsFix):
                row = measured.x, measured.y, math.nan
            elif kind != FIX:
                row = messages.pose_of(decoded)
            if row is not None:
                self._references.extend((stamp, *row))
        if not is_input or measured is None:
            return belief
        if self._beliefs:
            self.seconds[belief.health] += now - self._last
        self._last = now
        belief = self._localizer.update(_observation(now, measured))
        belief = checked_belief(belief, self._localizer)
        if self._is_amcl and isinstance(measured, Odometry):
            self._moved_at = measured.stamp
        if self._moved_at is not None:
            now = self._moved_at
        self._keep(now, belief)
        return belief

    def _uses_of(self, topic: str) -> tuple[bool, bool]:
        """Whether a topic's next message goes to the localizer, and to the reference."""
        is_input = topic in self._choice.topics.values()
        is_reference = topic == self._choice.reference
        if not (is_reference and self._choice.is_held_out):
            return is_input, is_reference
        is_held_out = self._is_next_held_out
        self._is_next_held_out = not is_held_out
        return not is_held_out, is_held_out

    def _keep(self, stamp: float, belief: Belief) -> None:
        pose = belief.pose
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

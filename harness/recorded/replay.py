"""A localizer over a recorded log, message by message in the order of arrival."""

import contextlib
import math
from array import array
from collections.abc import Callable, Iterator
from dataclasses import replace
from statistics import median
from typing import Any

import numpy as np

from harness.recorded import messages
from harness.recorded.bag import Bag, Message
from harness.recorded.bag_file import DamageError
from harness.recorded.clock import Clock
from harness.recorded.receiver import Receiver
from harness.recorded.ros_messages import FIX, IMU, ODOMETRY, SCAN, TRANSFORM_TYPES, decode
from harness.recorded.sources import Choice
from harness.recorded.trajectory import Trajectory
from navstack.errors import InputError
from navstack.localization.amcl import AmclLocalizer
from navstack.localization.localizer import Localizer
from navstack.types import Belief, Observation, Odometry

# Of an observation, by type of message.
_FIELDS = {FIX: "gps", IMU: "imu", ODOMETRY: "odometry", SCAN: "scan", **dict.fromkeys(TRANSFORM_TYPES, "odometry")}
_FIRST = 50  # messages from which the usual offset between stamps and arrivals is taken, and of each topic
_STILL = 3  # messages with one stamp, after which it is taken to be unset
_COLUMNS = 4  # stamp, x, y, yaw


class Replay:
    """Feeds a localizer with a log and keeps its beliefs.

    Every message is an observation of its own, so that none is lost: an observation holds one of each kind. AMCL moves
    with the odometry alone, so that its beliefs are of the last odometry message's time; others are of the present.
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

    def run(self, start: Belief, begin: Callable[[Belief], None], say: Callable[[str], None]) -> Iterator[float]:
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
        """A clock that knows unset stamps, and how far the others usually are from their arrival."""
        still: dict[str, float] = {}
        known: list[tuple[float, float]] = []  # arrival, offset
        for topic in sorted(self._choice.names):
            times = self._first_times(topic)
            stamps = {stamp for _, stamp in times}
            if len(times) >= _STILL and len(stamps) == 1:
                still[topic] = stamps.pop()
                continue
            known += [(arrival, stamp - arrival) for arrival, stamp in times if stamp != 0.0]
        offsets = [offset for _, offset in sorted(known)[:_FIRST]]
        return Clock(median(offsets) if offsets else 0.0, still)

    def _first_times(self, topic: str) -> list[tuple[float, float]]:
        """Arrival and stamp in [s] of a topic's first messages."""
        times = []
        with contextlib.suppress(DamageError):  # it is met again
            for place in self._bag.places({topic})[:_FIRST]:
                message = self._bag.read(place)
                stamp = self._receiver.stamp_of(message.topic.type, decode(message))
                if stamp is not None:
                    times.append((message.arrival, stamp))
        return times

    def _take(self, message: Message, decoded: Any, stamp: float, now: float, belief: Belief) -> Belief:
        """One message, to the localizer or to the reference; returns what is believed then."""
        name, kind = message.topic.name, message.topic.type
        is_reference, is_input = name == self._choice.reference, name in self._choice.topics.values()
        measured = None
        if is_input or kind == FIX:
            measured = self._receiver.convert(kind, decoded, stamp, belief.pose)
        if is_reference:
            if kind == FIX:
                row = None if measured is None else (measured.x, measured.y, math.nan)
            else:
                row = messages.pose_of(decoded)
            if row is not None:
                self._references.extend((stamp, *row))
        if not is_input or measured is None:
            return belief
        belief = self._localizer.update(Observation(now, **{_FIELDS[kind]: measured}))
        if self._is_amcl and isinstance(measured, Odometry):
            self._moved_at = measured.stamp
        self._keep(now if self._moved_at is None else self._moved_at, belief)
        return belief

    def _keep(self, stamp: float, belief: Belief) -> None:
        pose = belief.pose
        if not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
            raise InputError(f"the localizer's belief is no longer a number at {stamp:.3f} s")
        if self._beliefs and self._beliefs[-_COLUMNS] == stamp:
            del self._beliefs[-_COLUMNS:]
        self._beliefs.extend((stamp, pose.x, pose.y, pose.yaw))


def _trajectory(rows: array) -> Trajectory:
    return Trajectory.of_rows(np.array(rows).reshape(-1, _COLUMNS))

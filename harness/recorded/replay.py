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
from navstack.localization.localizer import Localizer
from navstack.types import Belief, Observation

# Of an observation, by type of message.
_FIELDS = {FIX: "gps", IMU: "imu", ODOMETRY: "odometry", SCAN: "scan", **dict.fromkeys(TRANSFORM_TYPES, "odometry")}
_FIRST = 50  # messages from which the usual offset between stamps and arrivals is taken
_COLUMNS = 4  # stamp, x, y, yaw


class Replay:
    """Feeds a localizer with a log and keeps its beliefs.

    Every message is an observation of its own, so that none is lost: an observation holds one of each kind.
    """

    def __init__(self, bag: Bag, choice: Choice, receiver: Receiver, localizer: Localizer) -> None:
        self._bag, self._choice, self._receiver, self._localizer = bag, choice, receiver, localizer
        self._beliefs, self._references = array("d"), array("d")  # rows of _COLUMNS

    @property
    def topics(self) -> set[str]:
        """What is read."""
        return self._choice.names

    @property
    def trajectory(self) -> Trajectory:
        """The beliefs so far, the last one of each time."""
        return _trajectory(self._beliefs)

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
        clock = Clock(self._usual_offset(places))
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
            say(f"{count} messages of {topic} have stamps of another time; taken as measured when they arrived")
        for kind, count in self._receiver.left_out.items():
            say(f"{count} messages of {kind.rsplit('/', 1)[-1]} hold nothing usable; left out")

    def _usual_offset(self, places: np.ndarray) -> float:
        """How far in [s] the stamps of the first messages are from their arrival."""
        offsets = []
        with contextlib.suppress(DamageError):  # it is met again
            for place in places[:_FIRST]:
                message = self._bag.read(place)
                stamp = self._receiver.stamp_of(message.topic.type, decode(message))
                if stamp is not None:
                    offsets.append(stamp - message.arrival)
        return median(offsets) if offsets else 0.0

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
        self._keep(now, belief)
        return belief

    def _keep(self, now: float, belief: Belief) -> None:
        pose = belief.pose
        if not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
            raise InputError(f"the localizer's belief is no longer a number at {now:.3f} s")
        if self._beliefs and self._beliefs[-_COLUMNS] == now:
            del self._beliefs[-_COLUMNS:]
        self._beliefs.extend((now, pose.x, pose.y, pose.yaw))


def _trajectory(rows: array) -> Trajectory:
    return Trajectory.of_rows(np.array(rows).reshape(-1, _COLUMNS))

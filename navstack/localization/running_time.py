"""Time that runs on for a localizer, whatever clocks do: set back or ahead, or standing."""

import math
import warnings
from abc import abstractmethod
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from navstack.localization.localizer import Localizer
from navstack.types import Belief, Health, Observation

JITTER = 0.1  # [s] by which stamps may go back, or be ahead, although no clock was set
SURE_AFTER = 1.0  # [s] of messages older than the last one, after which their clock was set back
STILL = 20  # messages of one sensor that come while the time stands, after which the clock does
_KINDS = ("odometry", "imu", "gps", "scan")


@dataclass(slots=True)
class _SensorTime:
    """What is known of the stamps of one sensor."""

    shift: float = 0.0  # [s] added to them
    newest: float = -math.inf  # [s] of all, shifted
    lag: float = 0.0  # [s] by which that message was late
    older_since: float = math.nan  # [s] since when all are older than that


class RunningTime:
    """Replaces stamps of clocks that were set by those of time that runs on.

    No time is taken to pass where the robot's clock is set back: what is known of the robot stays
    true. robot_localization starts over instead (``reset_on_time_jump``), and tf2 clears its
    buffer. Messages that were stamped before that and arrive after it keep their time. A clock that
    is set ahead cannot be told from one that ran on while nothing came.

    A message from the future was measured now, and a sensor of which all messages of
    ``SURE_AFTER`` are older than one before has a clock that was set back: they are as late as
    that one was. robot_localization lets both wait until their time comes.

    Whether a clock stands or nothing happens cannot be told from stamps. It is taken to stand where
    ``STILL`` messages of one sensor came at one and the same time, none newer than the last.
    """

    def __init__(self) -> None:
        self._now = -math.inf  # [s] that runs on
        self._shift = self._older_shift = 0.0  # [s] of it from the clock's, now and before
        self._sensors = {kind: _SensorTime() for kind in _KINDS}
        self._repeats: Counter[str] = Counter()  # messages since time stands, by kind
        self._warned: set[str] = set()

    def run_on(self, observation: Observation) -> Observation:
        """The same with stamps of the time that runs on."""
        now = observation.stamp + self._shift
        if now < self._now - JITTER:
            self._warn(f"the clock was set back by {self._now - now:.3f} s")
            self._older_shift = self._shift
            self._shift += self._now - now
            now = self._now
        if now > self._now:
            self._now = now
            self._repeats.clear()
        changed = {}
        for kind, sensor in self._sensors.items():
            message = getattr(observation, kind)
            if message is None:
                continue
            newest = sensor.newest
            stamp = self._stamp(kind, sensor, message.stamp)
            if stamp <= newest:
                self._repeats[kind] += 1
            if stamp != message.stamp:
                changed[kind] = replace(message, stamp=stamp)
        if changed or self._shift != 0.0:
            return replace(observation, stamp=now, **changed)
        return observation

    def own(self, belief: Belief) -> Belief:
        """A belief at the clock's own time, LOST where the clock stands."""
        if self._shift != 0.0:
            belief = replace(belief, stamp=belief.stamp - self._shift)
        if self._repeats and max(self._repeats.values()) >= STILL:
            belief = replace(belief, health=Health.LOST)
        return belief

    def _warn(self, text: str) -> None:
        if text not in self._warned:
            self._warned.add(text)
            warnings.warn(text, RuntimeWarning, stacklevel=4)  # who calls update

    def _stamp(self, kind: str, sensor: _SensorTime, given: float) -> float:
        """The stamp of a sensor's message at the time that runs on."""
        latest = self._now + JITTER
        stamp = given + self._shift + sensor.shift
        if stamp > latest and given + self._older_shift + sensor.shift <= latest:
            stamp = given + self._older_shift + sensor.shift  # from before the clock was set back
        elif stamp > latest and given + self._shift <= latest:
            stamp, sensor.shift = given + self._shift, 0.0  # the sensor's clock is right again
        if stamp > latest:
            self._warn(f"stamps of {kind} are ahead of the time; taken as measured now")
            stamp = self._now
        if stamp >= sensor.newest - JITTER:
            sensor.newest = max(stamp, sensor.newest)
            sensor.lag, sensor.older_since = self._now - stamp, math.nan
            return stamp
        if math.isnan(sensor.older_since):
            sensor.older_since = self._now
        if self._now - sensor.older_since >= SURE_AFTER:
            self._warn(f"the clock of {kind} was set back by {sensor.newest - stamp:.3f} s")
            sensor.shift += self._now - sensor.lag - stamp
            stamp = self._now - sensor.lag
        return stamp


class TimedLocalizer(Localizer):
    """A localizer that can rely on its time: see :class:`RunningTime`."""

    def reset(self, belief: Belief, rng: np.random.Generator) -> None:
        """Start over from an initial belief; all chance in localization is drawn from ``rng``."""
        self._time = RunningTime()
        self._begin(belief, rng)

    def update(self, observation: Observation) -> Belief:
        """Take in what has arrived, and return the belief at ``observation.stamp``."""
        return self._time.own(self._take(self._time.run_on(observation)))

    @abstractmethod
    def _begin(self, belief: Belief, rng: np.random.Generator) -> None:
        """As :meth:`reset`."""

    @abstractmethod
    def _take(self, observation: Observation) -> Belief:
        """As :meth:`update`, of stamps of time that runs on."""

"""Brains around brains: one that is listened to, and two of which one drives."""

import copy
from dataclasses import dataclass
from typing import Any

from harness.task.brain import Brain
from navstack.control.decision import Alternative
from navstack.navigation_status import Status
from navstack.navigator import Navigator
from navstack.types import Belief, Generators, Observation, Pose2D, Twist2D

# by the cycle's time [s]: what its command was preferred to
Weighed = dict[float, tuple[Alternative, ...]]


@dataclass(frozen=True, slots=True)
class TakeOver:
    """How it stood when the second of two brains took over."""

    stamp: float  # [s]
    before: Twist2D  # what the first would have commanded
    after: Twist2D  # what the second did
    status: Status  # of the second
    recoveries: int  # begun by the second until then: it meant them, the wheels did not


class _Led:
    """Tells what the brain tells that drives.

    All of :class:`harness.task.brain.Brain` but the tick.
    """

    def __init__(self, driving: Brain) -> None:
        self._driving = driving

    def __getattr__(self, name: str) -> Any:
        return getattr(self._driving, name)


class Watched(_Led):
    """A navigator that is asked in every cycle what else it weighed.

    It drives as it would otherwise.
    """

    def __init__(self, navigator: Navigator) -> None:
        super().__init__(navigator)
        self._navigator = navigator
        self.weighed: Weighed = {}
        self.options = ()  # of replays only, and slow to work out

    def tick(self, observation: Observation) -> Twist2D:
        """The navigator's command."""
        command = self._navigator.tick(observation)
        alternatives = self._navigator.alternatives
        if alternatives:
            self.weighed[observation.stamp] = alternatives
        return command


class HandOver(_Led):
    """Two brains that see the same; the second drives from some moment on."""

    def __init__(self, first: Brain, second: Brain, moment: float) -> None:
        """Take two brains to be reset.

        Args:
            first: drives before the moment.
            second: drives from it on.
            moment: [s].
        """
        super().__init__(first)
        self._second, self._moment = second, moment
        self.take_over: TakeOver | None = None  # None: not yet

    def reset(self, goal: Pose2D, initial_belief: Belief, generators: Generators) -> None:
        """Start both; the second draws its chance from copies of the generators."""
        self._second.reset(goal, initial_belief, copy.deepcopy(generators))
        self._driving.reset(goal, initial_belief, generators)

    def tick(self, observation: Observation) -> Twist2D:
        """The command of whoever drives."""
        command = self._driving.tick(observation)
        if self.take_over is not None:
            return command
        second = self._second
        other = second.tick(observation)
        if observation.stamp < self._moment:
            return command
        self.take_over = TakeOver(
            observation.stamp, command, other, second.status, second.counts.recoveries
        )
        self._driving = second
        return other

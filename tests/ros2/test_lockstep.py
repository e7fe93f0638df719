"""In lockstep a command is waited for when the peer's timer has it due, whatever its phase is."""

import math
import time
from typing import Any

import numpy as np
import pytest

from harness.task.ros2_params import Ros2Params
from navstack.types import Belief, Generators, Observation, Pose2D, Twist2D

brain = pytest.importorskip("harness.ros2.brain", exc_type=ImportError)

TICK, RATE = 1.0 / 60.0, 20.0  # [s], [Hz]
TICKS = 240


class TimedPeer:
    """A robot node whose peer commands by a timer on the clock."""

    listeners, is_aborted, refused = 1, False, 0

    def __init__(self, phase: float, is_fast: bool) -> None:
        self.phase, self.is_fast = phase, is_fast
        self.heard, self.clock, self.commanded_at = 0, 0.0, 0.0
        self.fired = math.inf  # number of the timer's last period
        self.waiting: list[float] = []  # [s] when commands that were not heard yet were made
        self.command = Twist2D(0.5)
        self.has_goal = False

    def begin(self, start: Pose2D, stamp: float) -> None:
        self.has_goal = False

    def send_goal(self, goal: Pose2D, stamp: float) -> None:
        self.has_goal = True

    def publish(self, seen: Any, truth: Any, people: Any, offset: float) -> None:
        self.clock = offset + seen.stamp
        period = math.floor((self.clock - self.phase) * RATE + 1e-9)
        if self.has_goal and period != self.fired:
            self.fired = period
            self.waiting.append(self.clock)

    def take_in(self) -> None:
        """Where commands take a while to come, only who waits hears them at once."""
        if self.is_fast and self.waiting:
            self.wait_for_command(0.0)

    def wait_for_command(self, timeout: float) -> bool:
        if not self.waiting:
            return False
        made = self.waiting.pop()
        self.commanded_at = made
        self.waiting.clear()
        self.heard += 1
        return True


@pytest.mark.parametrize("phase", [0.0, 0.011, 0.02, 0.033, 0.049])
@pytest.mark.parametrize("is_fast", [True, False])
def test_no_command_of_a_timer_is_missed(phase: float, is_fast: bool) -> None:
    peer = TimedPeer(phase, is_fast)
    params = Ros2Params(controller_frequency=RATE, wait=5.0, settle=0.1)
    subject = brain.Ros2Brain(lambda: peer, params, lambda: (Pose2D(), np.empty((0, 4))))
    streams = np.random.default_rng(0).spawn(3)
    subject.reset(Pose2D(5.0), Belief(Pose2D()), Generators(*streams))
    commands = [subject.tick(Observation(k * TICK)) for k in range(TICKS)]
    assert subject.trouble.history == ""
    assert peer.heard == pytest.approx(TICKS * TICK * RATE, abs=2)
    assert commands[-1] == Twist2D(0.5)


def test_nobody_who_drives_is_told_of() -> None:
    peer = TimedPeer(0.0, True)
    peer.listeners = 0
    params = Ros2Params(start_limit=0.01)
    subject = brain.Ros2Brain(lambda: peer, params, lambda: (Pose2D(), np.empty((0, 4))))
    streams = np.random.default_rng(0).spawn(3)
    subject.reset(Pose2D(5.0), Belief(Pose2D()), Generators(*streams))
    with pytest.raises(brain.PeerError, match="nobody listens to /goal_pose within 0.01 s"):
        subject.tick(Observation(0.0))


@pytest.mark.parametrize("frequency", [20.0, 30.0, 0.0])
def test_the_clock_runs_as_fast_as_it_was_asked_to(frequency: float) -> None:
    """Whatever the peer's period, which is no whole number of ticks."""
    rate = 20.0
    params = Ros2Params(
        controller_frequency=frequency, rate=rate, wait=5.0, settle=0.1, most_missed=1.0
    )
    peer = TimedPeer(0.0, True)
    subject = brain.Ros2Brain(lambda: peer, params, lambda: (Pose2D(), np.empty((0, 4))))
    streams = np.random.default_rng(0).spawn(3)
    subject.reset(Pose2D(5.0), Belief(Pose2D()), Generators(*streams))
    subject.tick(Observation(0.0))
    began = time.monotonic()
    for tick in range(1, 101):
        subject.tick(Observation(tick * TICK))
    assert rate * (time.monotonic() - began) >= 0.9 * 100 * TICK


class SlowPeer(TimedPeer):
    """Needs longer for a command than its period lasts."""

    def wait_for_command(self, timeout: float) -> bool:
        if self.has_goal and self.heard:  # the first one is waited for as the world stands still
            time.sleep(min(timeout, 0.02))
            return False
        return super().wait_for_command(timeout)


def test_at_a_rate_the_clock_waits_for_nobody() -> None:
    rate = 20.0  # at which a period lasts 2.5 ms of wall time
    params = Ros2Params(controller_frequency=RATE, rate=rate, wait=5.0, settle=0.1, most_missed=1.0)
    subject = brain.Ros2Brain(
        lambda: SlowPeer(0.0, True), params, lambda: (Pose2D(), np.empty((0, 4)))
    )
    streams = np.random.default_rng(0).spawn(3)
    subject.reset(Pose2D(5.0), Belief(Pose2D()), Generators(*streams))
    subject.tick(Observation(0.0))
    began = time.monotonic()
    for tick in range(1, 121):
        subject.tick(Observation(tick * TICK))
    assert time.monotonic() - began < 3.0 * 120 * TICK / rate, "it would be 8 times as long"
    assert "40 of 40 commands did not come in time" in subject.trouble.history

"""The brain's tick: from an observation to a command."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from navstack.behavior_tree import NavigateToPose
from navstack.clock import Clock
from navstack.control.decision import Alternative, DecisionRecord, Option
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.geometry import largest_variance
from navstack.localization.localizer import Localizer
from navstack.navigation_status import Counts, Status, Trouble
from navstack.plugin_answers import checked_belief
from navstack.safety.collision_monitor import CollisionMonitor, MonitorAction
from navstack.safety.velocity_smoother import VelocitySmoother
from navstack.stopwatch import Latencies
from navstack.types import (
    Belief,
    FloatArray,
    Generators,
    Health,
    LaserScan,
    Observation,
    Odometry,
    Path,
    Pose2D,
    RobotState,
    Track,
    Twist2D,
)

_KEPT = 64  # recent states: one second at 60 Hz
# [s] that a lost robot stands before it gives up; assumed: outages of satellites are shorter
LOST_PATIENCE = 60.0


class PeopleTracker(Protocol):
    """Who tells a controller of people, as :class:`~navstack.perception.tracker.Tracker` does."""

    def reset(self) -> None:
        """Forget everything, for a new episode."""

    def observe(
        self, scan: LaserScan, in_map: Pose2D, in_odom: Pose2D, covariance: FloatArray
    ) -> None:
        """Take in a scan, taken from a pose believed in the map and the odom frame.

        ``covariance`` (3, 3) is that of the pose in the map.
        """

    def tracks(self, stamp: float) -> Sequence[Track]:
        """The people at a time [s] no earlier than the last scan's."""


class Frequencies(NamedTuple):
    """How often each part runs, in [Hz]."""

    local_costmap: float
    global_costmap: float
    controller: float
    behaviors: float
    smoother: float


@dataclass(frozen=True, slots=True)
class TickRecord:
    """How a tick came to its command, from the belief to the wheels."""

    belief: Belief
    decision: DecisionRecord
    wanted: Twist2D  # handed to the smoother
    command: Twist2D  # left after smoother and monitor: driven until the next one
    monitor: MonitorAction  # the last


class Navigator:
    """Localizes, maps, plans, follows or recovers, smooths and monitors, each when it is due.

    A navigator that ``stops_when_lost`` stands while the belief's health is LOST: the smoother
    brings it to rest, and the tree is not asked. Progress and patience do not count that time,
    recoveries do; after ``LOST_PATIENCE`` the navigation is given up.
    """

    def __init__(
        self,
        localizer: Localizer,
        local_costmap: LayeredCostmap,
        global_costmap: LayeredCostmap,
        tree: NavigateToPose,
        smoother: VelocitySmoother,
        monitor: CollisionMonitor,
        frequencies: Frequencies,
        stops_when_lost: bool = False,
        tracker: PeopleTracker | None = None,
    ) -> None:
        self._localizer = localizer
        self._tree = tree
        self._smoother = smoother
        self._monitor = monitor
        self._stops_when_lost = stops_when_lost
        self._tracker = tracker
        self._clocks = tuple(map(Clock, frequencies))
        (
            local_clock,
            global_clock,
            self._control_clock,
            self._behavior_clock,
            self._smoother_clock,
        ) = self._clocks
        self._costmaps = ((local_costmap, local_clock), (global_costmap, global_clock))
        self.belief = Belief(Pose2D())

    def reset(self, goal: Pose2D, initial_belief: Belief, generators: Generators) -> None:
        """Take a new goal (map frame) and start from an initial belief.

        Nothing of earlier goals is left.
        """
        self.belief = initial_belief
        self._localizer.reset(initial_belief, generators.localizer)
        for costmap, _ in self._costmaps:
            costmap.reset()
        self._tree.reset(goal, generators.planner, generators.controller)
        self._smoother.reset()
        self._monitor.reset()
        if self._tracker is not None:
            self._tracker.reset()
        for clock in self._clocks:
            clock.reset()
        self._odometry = Odometry(0.0, Pose2D(), Twist2D())
        self._output = Twist2D()
        # the newest command of controller or behavior not yet smoothed
        self._to_smooth: Twist2D | None = None
        self._chosen: Twist2D | None = None  # the same, of the last tick only
        self._stamp = 0.0  # [s] of the last tick
        self._recent: deque[RobotState] = deque(maxlen=_KEPT)
        self._lost_since: float | None = None  # [s] when it stopped; None: it drives

    @property
    def status(self) -> Status:
        """How the navigation stands."""
        return self._tree.status

    @property
    def counts(self) -> Counts:
        """Plans, failures and recoveries since the goal was given."""
        return self._tree.counts

    @property
    def trouble(self) -> Trouble:
        """What went wrong last, and why the navigation was given up if it was."""
        return self._tree.trouble

    @property
    def latencies(self) -> Latencies:
        """How long planner and controller took since the goal was given."""
        return self._tree.latencies

    @property
    def decision(self) -> TickRecord | None:
        """How the last tick was decided; None: neither control nor behavior cycle was due in it.

        Made when it is asked for, which must be before the next tick.
        """
        if self._chosen is None:
            return None
        decision = self._tree.decision(self._chosen, self._stamp)
        return TickRecord(self.belief, decision, self._chosen, self._output, self._monitor.action)

    @property
    def alternatives(self) -> tuple[Alternative, ...]:
        """What the controller preferred its command of the last tick to.

        To be asked for as :attr:`decision` is.
        """
        if self._chosen is None:
            return ()
        return self._tree.alternatives(self._stamp)

    @property
    def options(self) -> tuple[Option, ...]:
        """What the controller weighed in its last cycle, the chosen motion first.

        None where something else drives.
        """
        return self._tree.options(self._stamp)

    @property
    def plan(self) -> Path | None:
        """The path that is followed, in the map frame; None: none is."""
        return self._tree.plan

    @property
    def tracks(self) -> tuple[Track, ...]:
        """What moves about, at the last tick; none where nobody tracks."""
        if self._tracker is None:
            return ()
        return tuple(self._tracker.tracks(self._stamp))

    def send_again(self) -> None:
        """Take the goal once more, where it was given up, with all patience."""
        self._lost_since = None
        self._tree.try_again(self._stamp)

    def tick(self, observation: Observation) -> Twist2D:
        """The velocity to drive until the next tick, in the base frame."""
        state = self._sense(observation)
        self._chosen, self._stamp = None, state.stamp
        self._map(state, observation)
        if self._stops_when_lost and self.belief.health is Health.LOST:
            self._stand(state.stamp)
        else:
            self._run_tree(state)
        if observation.scan is not None:
            seen_from = self._state_at(observation.scan.stamp).odom_pose
            self._monitor.receive(observation.scan, seen_from)
        if self._smoother_clock.is_due(state.stamp):
            smoothed = self._smoother.smooth(self._to_smooth, state.twist, state.stamp)
            self._output = self._monitor.process(smoothed, state.stamp, state.odom_pose)
            self._to_smooth = None
        return self._output

    def _run_tree(self, state: RobotState) -> None:
        """Recover, plan and follow, each when it is due."""
        if self._lost_since is not None:
            self._lost_since = None
            self._tree.resume(state.stamp)
        if self._behavior_clock.is_due(state.stamp):
            self._take(self._tree.recover(state))
        self._take(self._tree.replan(state))
        if self._control_clock.is_due(state.stamp):
            self._take(self._tree.follow(state, self.tracks))

    def _stand(self, now: float) -> None:
        """Do nothing, as long as patience lasts."""
        if self._lost_since is None:
            self._lost_since = now
        if now - self._lost_since > LOST_PATIENCE:
            self._tree.give_up(f"lost for more than {LOST_PATIENCE:g} s", now)
        if self._control_clock.is_due(now):
            self._take(Twist2D())

    def _take(self, command: Twist2D | None) -> None:
        """Hand a command to the smoother; None: who was asked does not drive."""
        if command is not None:
            self._to_smooth = self._chosen = command

    def _sense(self, observation: Observation) -> RobotState:
        self.belief = checked_belief(self._localizer.update(observation), self._localizer)
        if observation.odometry is not None:
            self._odometry = observation.odometry
        unsure = math.sqrt(largest_variance(self.belief.covariance))
        state = RobotState(
            self.belief.pose, self._odometry.twist, observation.stamp, self._odometry.pose, unsure
        )
        self._recent.append(state)
        return state

    def _state_at(self, stamp: float) -> RobotState:
        """The newest state that is no newer than ``stamp`` [s], as tf would tell it.

        The oldest kept before that.
        """
        for state in reversed(self._recent):
            if state.stamp <= stamp:
                return state
        return self._recent[0]

    def _map(self, state: RobotState, observation: Observation) -> None:
        """Show a new scan to tracker and costmaps, and update the costmaps that are due."""
        scan = observation.scan
        if scan is not None:
            taken = self._state_at(scan.stamp)
            if self._tracker is not None:
                covariance = self.belief.covariance
                self._tracker.observe(scan, taken.pose, taken.odom_pose, covariance)
            for costmap, _ in self._costmaps:
                costmap.observe_scan(taken.pose, scan)
        for costmap, clock in self._costmaps:
            if clock.rate > 0.0 and clock.is_due(state.stamp):
                costmap.update(state.pose, None, state.stamp)

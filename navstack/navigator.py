"""The brain's tick: from an observation to a command."""

from typing import NamedTuple

import numpy as np

from navstack.behavior_tree import Counts, NavigateToPose, Status
from navstack.clock import Clock
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.localization.localizer import Localizer
from navstack.safety.velocity_smoother import VelocitySmoother
from navstack.types import Belief, Observation, Pose2D, RobotState, Twist2D


class Frequencies(NamedTuple):
    """How often each part runs, in [Hz]."""

    local_costmap: float
    global_costmap: float
    controller: float
    smoother: float


class Navigator:
    """Localizes, maps, plans, follows and smooths, each part when it is due."""

    def __init__(
        self,
        localizer: Localizer,
        local_costmap: LayeredCostmap,
        global_costmap: LayeredCostmap,
        tree: NavigateToPose,
        smoother: VelocitySmoother,
        frequencies: Frequencies,
    ) -> None:
        self._localizer = localizer
        self._local_costmap = local_costmap
        self._global_costmap = global_costmap
        self._tree = tree
        self._smoother = smoother
        self._local_clock = Clock(frequencies.local_costmap)
        self._global_clock = Clock(frequencies.global_costmap)
        self._control_clock = Clock(frequencies.controller)
        self._smoother_clock = Clock(frequencies.smoother)
        self.belief = Belief(Pose2D())

    def reset(self, goal: Pose2D, initial_belief: Belief, rng: np.random.Generator) -> None:
        """Take a new goal (map frame) and start from an initial belief; nothing of earlier goals is left.

        All chance in planning is drawn from ``rng``.
        """
        self.belief = initial_belief
        self._localizer.reset(initial_belief)
        self._local_costmap.reset()
        self._global_costmap.reset()
        self._tree.reset(goal, rng)
        self._smoother.reset()
        for clock in (self._local_clock, self._global_clock, self._control_clock, self._smoother_clock):
            clock.reset()
        self._twist = self._command = Twist2D()
        self._wanted: Twist2D | None = None  # the controller's newest command, until the smoother has taken it

    @property
    def status(self) -> Status:
        """How the navigation stands."""
        return self._tree.status

    @property
    def counts(self) -> Counts:
        """Plans, failures and recoveries since the goal was given."""
        return self._tree.counts

    @property
    def last_error(self) -> str:
        """Nav2's name of the last failure that called for a recovery; empty: none."""
        return self._tree.last_error

    def tick(self, observation: Observation) -> Twist2D:
        """The velocity to drive until the next tick, in the base frame."""
        state = self._sense(observation)
        self._map(state, observation)
        self._tree.replan(state)
        if self._control_clock.is_due(state.stamp):
            self._wanted = self._tree.follow(state)
        if self._smoother_clock.is_due(state.stamp):
            self._command = self._smoother.smooth(self._wanted, self._twist, state.stamp)
            self._wanted = None
        return self._command

    def _sense(self, observation: Observation) -> RobotState:
        self.belief = self._localizer.update(observation)
        if observation.odometry is not None:
            self._twist = observation.odometry.twist
        return RobotState(self.belief.pose, self._twist, observation.stamp)

    def _map(self, state: RobotState, observation: Observation) -> None:
        """Show a new scan to both costmaps, from the pose at which it was taken, and update those that are due."""
        for costmap, clock in ((self._local_costmap, self._local_clock), (self._global_costmap, self._global_clock)):
            if observation.scan is not None:
                costmap.observe_scan(state.pose, observation.scan)
            if clock.is_due(state.stamp):
                costmap.update(state.pose, None, state.stamp)

"""Navigate to a pose with replanning and recovery, after Nav2's default behavior tree.

The tree is ``navigate_to_pose_w_replanning_and_recovery.xml``: replan at 1 Hz and follow; a failed planner clears the
global costmap and tries once more, a failed controller clears the local one and tries once more; when that fails too,
the next recovery of the round robin runs and the whole starts over, at most six times. Of Nav2's round robin, clearing
and waiting exist here; spinning and backing up do not yet.
"""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from navstack.control.controller import Surroundings
from navstack.control.controller_server import ControllerServer
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.errors import ControlError, NavstackError, PlanningError
from navstack.planning.planner import Planner
from navstack.types import Pose2D, RobotState, Twist2D

REPLANNING_PERIOD = 1.0  # [s] RateController hz="1.0"
NUMBER_OF_RETRIES = 6  # RecoveryNode NavigateRecovery
WAIT_DURATION = 5.0  # [s] Wait wait_duration="5.0"


class Status(Enum):
    """How a navigation stands."""

    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"


@dataclass(slots=True)
class Counts:
    """What happened on the way; goes into the episode's row."""

    plans: int = 0
    failed_plans: int = 0
    failed_controls: int = 0
    recoveries: int = 0


class NavigateToPose:
    """The default tree. :meth:`replan` runs when planning is due, :meth:`follow` once per control cycle."""

    def __init__(
        self,
        planner: Planner,
        controller_server: ControllerServer,
        global_costmap: LayeredCostmap,
        local_costmap: LayeredCostmap,
    ) -> None:
        self._planner = planner
        self._controller_server = controller_server
        self._global_costmap = global_costmap
        self._local_costmap = local_costmap
        self._begin(Pose2D())

    def reset(self, goal: Pose2D, rng: np.random.Generator) -> None:
        """Start over with a new goal; all chance in planning is drawn from ``rng``."""
        self._planner.reset(rng)
        self._controller_server.reset()
        self._begin(goal)

    def _begin(self, goal: Pose2D) -> None:
        self._goal = goal
        self._following = False
        self._plan_retried = self._control_retried = False
        self._next_plan = 0.0  # [s]
        self._wait_until = 0.0  # [s]
        self.status = Status.RUNNING
        self.last_error = ""  # Nav2's name of the last failure
        self.counts = Counts()

    def replan(self, state: RobotState) -> None:
        """Compute a new path when one is due; every failure is counted and answered as the tree says."""
        is_due = state.stamp >= max(self._next_plan, self._wait_until) - 1e-9
        if self.status is not Status.RUNNING or not (is_due and self._global_costmap.is_current):
            return
        try:
            plan = self._planner.plan(state.pose, self._goal, self._global_costmap.master, state.stamp)
        except PlanningError as error:
            self._planning_failed(error, state.stamp)
            return
        self.counts.plans += 1
        self._plan_retried = False
        self._next_plan = state.stamp + REPLANNING_PERIOD
        if self._following:
            self._controller_server.set_plan(plan)
        else:
            self._controller_server.begin(plan, state.stamp)
            self._following = True

    def follow(self, state: RobotState) -> Twist2D:
        """The command of this control cycle; standstill while there is nothing to follow or nothing known."""
        if self.status is not Status.RUNNING or not (self._following and self._local_costmap.is_current):
            return Twist2D()
        if self._controller_server.goal_reached(state):
            self.status = Status.SUCCEEDED
            return Twist2D()
        try:
            return self._controller_server.compute_command(state, Surroundings(self._local_costmap.master))
        except ControlError as error:
            self._control_failed(error, state.stamp)
            return Twist2D()

    def _planning_failed(self, error: PlanningError, now: float) -> None:
        self.counts.failed_plans += 1
        if not self._plan_retried:
            self._plan_retried = True
            self._global_costmap.clear_entirely()
            return  # and try again after the costmap's next update
        self._recover(error, now)

    def _control_failed(self, error: ControlError, now: float) -> None:
        self.counts.failed_controls += 1
        if not self._control_retried:
            self._control_retried = True
            self._local_costmap.clear_entirely()
            self._controller_server.begin_again(now)
            return
        self._recover(error, now)

    def _recover(self, error: NavstackError, now: float) -> None:
        """The next recovery of the round robin, or the end when the retries are used up."""
        self.last_error = getattr(error, "code", "UNKNOWN")
        self._following = self._plan_retried = self._control_retried = False
        if self.counts.recoveries >= NUMBER_OF_RETRIES:
            self.status = Status.FAILED
            return
        if self.counts.recoveries % 2 == 0:
            self._local_costmap.clear_entirely()
            self._global_costmap.clear_entirely()
        else:
            self._wait_until = now + WAIT_DURATION
        self.counts.recoveries += 1
        self._next_plan = now

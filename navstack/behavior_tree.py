"""Navigate to a pose with replanning and recovery, after Nav2's default behavior tree.

The tree is Jazzy's ``navigate_to_pose_w_replanning_and_recovery.xml``: replan at 1 Hz and follow. A
failure to plan clears the global costmap and is tried once more, a failure to follow clears the
local one and is tried once more. When that fails too, the next recovery of the round robin runs and
the whole starts over, at most six times. All of this only where the error is one that a recovery
may cure (WouldAPlannerRecoveryHelp, WouldAControllerRecoveryHelp): a goal in an obstacle or outside
the map ends the navigation at once.

Not modelled: GoalUpdated, which cuts a recovery short when a new goal arrives (a new goal begins
with ``reset``), and the selectors of planner and controller (their defaults run, ``GridBased`` and
``FollowPath``; where the file does not list one of them, Nav2 refuses the goal, and here the first
of the list runs).
"""

from dataclasses import replace

import numpy as np

from navstack.action_codes import COMPUTE_PATH_TO_POSE, FOLLOW_PATH, Codes
from navstack.behaviors.behavior_server import BehaviorServer
from navstack.control.controller import Surroundings
from navstack.control.controller_server import ControllerServer
from navstack.control.decision import Alternative, DecisionRecord, Option
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.errors import BehaviorError, ControlError, PlanningError
from navstack.navigation_status import Counts, Status, Trouble, history_text
from navstack.planning.planner import Planner
from navstack.plugin_answers import checked_plan
from navstack.recovery import default_recoveries
from navstack.stopwatch import Latencies, Stopwatch
from navstack.types import Path, Pose2D, RobotState, Track, Twist2D

REPLANNING_PERIOD = 1.0  # [s] RateController hz="1.0"
NUMBER_OF_RETRIES = 6  # RecoveryNode NavigateRecovery

# The errors after which clearing and recovering are tried
# (would_a_planner_recovery_help_condition.cpp and would_a_controller_recovery_help_condition.cpp);
# after any other, the navigation fails.
PLANNER_RECOVERY_HELPS = frozenset({"UNKNOWN", "TIMEOUT", "NO_VALID_PATH"})
CONTROLLER_RECOVERY_HELPS = frozenset(
    {"UNKNOWN", "PATIENCE_EXCEEDED", "FAILED_TO_MAKE_PROGRESS", "NO_VALID_CONTROL"}
)

_LATELY = 0.2  # [s] within which a control cycle is still the last
TREE = "behavior_tree"  # who decided where neither a controller nor a recovery was asked


class NavigateToPose:
    """The default tree.

    :meth:`replan` runs when planning is due, :meth:`follow` once per control cycle, :meth:`recover`
    once per cycle of the behavior server.
    """

    def __init__(
        self,
        planner: Planner,
        controller_server: ControllerServer,
        behavior_server: BehaviorServer,
        global_costmap: LayeredCostmap,
        local_costmap: LayeredCostmap,
    ) -> None:
        self._planner = planner
        self._controller_server = controller_server
        self._behavior_server = behavior_server
        self._global_costmap = global_costmap
        self._local_costmap = local_costmap
        self._recoveries = default_recoveries(behavior_server, global_costmap, local_costmap)
        self._stopwatch = Stopwatch()  # of the planner's calls
        self._begin(Pose2D())

    def reset(
        self, goal: Pose2D, rng: np.random.Generator, controller_rng: np.random.Generator
    ) -> None:
        """Start over with a new goal.

        Chance in planning is drawn from ``rng``, in control from ``controller_rng``.
        """
        self._planner.reset(rng)
        self._controller_server.reset(controller_rng)
        self._behavior_server.reset()
        self._recoveries.reset()
        self._stopwatch.clear()
        self._begin(goal)

    def _begin(self, goal: Pose2D) -> None:
        self._goal = goal
        self._following = self._recovering = False
        self._plan_retried = self._control_retried = False
        # of the last attempts; empty: none, or it was broken off
        self._plan_error = self._control_error = ""
        self._next_plan = 0.0  # [s]
        self._driver = TREE
        self._counts = Counts()
        self._recoveries_before = 0  # the goal was sent again
        self._trouble = Trouble()
        self._history: list[tuple[float, str]] = []  # [s] and what happened
        self.status = Status.RUNNING

    @property
    def counts(self) -> Counts:
        """Plans, failures and recoveries since the goal was given."""
        clearings, spins, waits, backups = self._recoveries.begun
        return replace(
            self._counts,
            clearings=clearings,
            spins=spins,
            waits=waits,
            backups=backups,
            failed_recoveries=self._recoveries.failed,
        )

    @property
    def trouble(self) -> Trouble:
        """What went wrong last, and why the tree gave up if it did."""
        failure = self._recoveries.last_failure
        trouble = replace(self._trouble, history=history_text(self._history))
        if failure is None:
            return trouble
        return replace(trouble, recovery_error=failure.code, recovery_error_code=failure.number)

    @property
    def latencies(self) -> Latencies:
        """How long planner and controller took."""
        return Latencies(self._stopwatch.durations, self._controller_server.stopwatch.durations)

    @property
    def plan(self) -> Path | None:
        """The path that is followed; None: none is."""
        return self._controller_server.plan

    def decision(self, command: Twist2D, now: float) -> DecisionRecord:
        """How the ``command`` of the cycle at ``now`` [s] was decided."""
        decided = self._controller_server.decision
        if decided is not None and decided.stamp == now:
            return decided
        return DecisionRecord(now, self._driver, command)

    def alternatives(self, now: float) -> tuple[Alternative, ...]:
        """What the controller preferred the command of the cycle at ``now`` [s] to.

        None where it was not asked.
        """
        decided = self._controller_server.decision
        if decided is None or decided.stamp != now:
            return ()
        return self._controller_server.controller.alternatives

    def options(self, now: float) -> tuple[Option, ...]:
        """What the controller weighed in its last cycle before ``now`` [s].

        None where something else drives.
        """
        options = self._controller_server.controller.options
        if not options:  # most controllers have none, and a decision takes longer than a cycle
            return ()
        decided = self._controller_server.decision
        if decided is None or now - decided.stamp >= _LATELY:
            return ()
        return options

    def replan(self, state: RobotState) -> Twist2D | None:
        """Compute a new path when one is due.

        Every failure is counted and answered as the tree says.

        Returns:
            Standstill where a failure ends the following of the old path, as the controller server
            commands when its action is cancelled; else None.
        """
        is_due = state.stamp >= self._next_plan - 1e-9 and not self._recovering
        if self.status is not Status.RUNNING or not (is_due and self._global_costmap.is_current):
            return None
        try:
            with self._stopwatch:
                plan = self._planner.plan(
                    state.pose, self._goal, self._global_costmap.master, state.stamp
                )
            plan = checked_plan(plan, self._planner)
        except PlanningError as error:
            was_following = self._following
            self._planning_failed(error, state)
            if was_following and not self._following:
                return Twist2D()
            return None
        self._count(plans=self._counts.plans + 1)
        self._plan_retried, self._plan_error = False, ""
        self._next_plan = state.stamp + REPLANNING_PERIOD
        self._follow(plan, state.stamp)
        return None

    def _follow(self, plan: Path, stamp: float) -> None:
        if self._following:
            self._controller_server.set_plan(plan)
        else:
            self._controller_server.begin(plan, stamp)
            self._following = True

    def follow(self, state: RobotState, tracks: tuple[Track, ...]) -> Twist2D | None:
        """The command of this control cycle among ``tracks``, standstill without a path or costmap.

        None: a recovery is driving.
        """
        if self._recovering:
            return None
        self._driver = TREE
        rests = self.status is Status.SUCCEEDED and self._controller_server.controller.acts_at_rest
        if not (self.status is Status.RUNNING or rests) or not (
            self._following and self._local_costmap.is_current
        ):
            return Twist2D()
        if not rests and self._controller_server.goal_reached(state):
            self.status = Status.SUCCEEDED
            self._history.append((state.stamp, "arrived where it believes the goal"))
            return Twist2D()
        surroundings = Surroundings(self._local_costmap.master, tracks)
        try:
            return self._controller_server.compute_command(
                state, surroundings, expects_progress=not rests
            )
        except ControlError as error:
            self._control_failed(error, state)
            return Twist2D()

    def recover(self, state: RobotState) -> Twist2D | None:
        """The command of this cycle of the behavior server; None: no recovery is running."""
        if not self._recovering:
            return None
        self._driver = self._recoveries.current
        try:
            command = self._recoveries.step(state)
        except BehaviorError:
            self._give_up("every recovery failed", state.stamp)
            return Twist2D()
        if self._recoveries.current != self._driver:
            self._history.append(
                (state.stamp, f"{self._driver} failed, {self._recoveries.current} begins")
            )
        if command is None:
            self._start_over(state.stamp)
        return command or Twist2D()

    def _planning_failed(self, error: PlanningError, state: RobotState) -> None:
        self._count(failed_plans=self._counts.failed_plans + 1)
        self._plan_error = error.code
        self._history.append((state.stamp, f"no plan ({error.code})"))
        if error.code in PLANNER_RECOVERY_HELPS and not self._plan_retried:
            self._plan_retried = True
            self._global_costmap.clear_entirely()
            # and try again after the costmap's next update; until then the old path is followed
            return
        if self._controller_server.controller.acts_at_rest and (
            self._following or error.code in PLANNER_RECOVERY_HELPS
        ):
            self._next_plan = state.stamp + REPLANNING_PERIOD
            if not self._following:
                self._follow(Path(self._goal.as_array()[None]), state.stamp)
            return  # a controller that gives way without a plan need not stand
        if self._following:
            self._control_error = ""  # broken off, which is no failure
        self._turn_to_recoveries(error.code, COMPUTE_PATH_TO_POSE, state)

    def _control_failed(self, error: ControlError, state: RobotState) -> None:
        self._count(failed_controls=self._counts.failed_controls + 1)
        self._control_error = error.code
        self._history.append((state.stamp, f"plan not followed ({error.code})"))
        if error.code in CONTROLLER_RECOVERY_HELPS and not self._control_retried:
            self._control_retried = True
            self._local_costmap.clear_entirely()
            self._controller_server.begin_again(state.stamp)
            return
        self._plan_error = ""  # the last plan was found, or planning is broken off
        self._turn_to_recoveries(error.code, FOLLOW_PATH, state)

    def _turn_to_recoveries(self, code: str, numbers: Codes, state: RobotState) -> None:
        """The next recovery of the round robin, or the end."""
        self._trouble = Trouble(error=code, error_code=numbers.get(code, numbers["UNKNOWN"]))
        self._following = self._plan_retried = self._control_retried = False
        if self._counts.recoveries - self._recoveries_before >= NUMBER_OF_RETRIES:
            self._give_up("all retries are used up", state.stamp)
            return
        # As in Nav2, an earlier error of the controller still speaks for a recovery until it
        # follows a path again.
        if not (
            self._control_error in CONTROLLER_RECOVERY_HELPS
            or self._plan_error in PLANNER_RECOVERY_HELPS
        ):
            self._give_up("no recovery helps against this error", state.stamp)
            return
        self._count(recoveries=self._counts.recoveries + 1)
        try:
            is_done = self._recoveries.begin(state)
        except BehaviorError:
            self._give_up("every recovery failed", state.stamp)
            return
        self._history.append((state.stamp, f"{self._recoveries.current} begins"))
        self._recovering = True
        if is_done:
            self._start_over(state.stamp)

    def _start_over(self, now: float) -> None:
        self._recovering = False
        self._next_plan = now

    def resume(self, now: float) -> None:
        """Go on with a new path after a time in which nothing was asked.

        Only a recovery counts that time.
        """
        self._next_plan = now
        self._controller_server.resume(now)

    def try_again(self, now: float) -> None:
        """Take a goal that was given up once more, with all retries, at ``now`` [s]."""
        if self.status is not Status.FAILED:
            return
        self._history.append((now, "the goal is sent again"))
        self._trouble = replace(self._trouble, gave_up="")
        self._recoveries_before = self._counts.recoveries
        self._following = self._plan_retried = self._control_retried = False
        self._plan_error = self._control_error = ""
        self._recoveries.restart()  # a tree is halted after every goal
        self._next_plan = now
        self.status = Status.RUNNING

    def give_up(self, reason: str, now: float) -> None:
        """End a running navigation without success, at ``now`` [s]."""
        if self.status is Status.RUNNING:
            self._give_up(reason, now)

    def _give_up(self, reason: str, now: float) -> None:
        self._recovering = False
        self._history.append((now, f"gave up: {reason}"))
        self._trouble = replace(self._trouble, gave_up=reason)
        self.status = Status.FAILED

    def _count(self, **changes: int) -> None:
        self._counts = replace(self._counts, **changes)

"""The rules of Nav2's default tree, one by one, with planners and controllers that fail as told."""

from types import SimpleNamespace

import numpy as np
import pytest

from navstack.action_codes import COMPUTE_PATH_TO_POSE, FOLLOW_PATH
from navstack.behavior_tree import (
    CONTROLLER_RECOVERY_HELPS,
    NUMBER_OF_RETRIES,
    PLANNER_RECOVERY_HELPS,
    NavigateToPose,
)
from navstack.behaviors.behavior_server import BehaviorServer
from navstack.behaviors.wait import Wait
from navstack.costmap.costmap import Costmap
from navstack.errors import ControlError, PlanningError
from navstack.navigation_status import Counts, Status
from navstack.params.servers import BehaviorServerParams
from navstack.types import Path, Pose2D, RobotState, Twist2D

FOOTPRINT = np.array([[0.2, 0.2], [0.2, -0.2], [-0.2, -0.2], [-0.2, 0.2]])
DRIVE = Twist2D(linear_x=0.5)
TICK = 0.1  # [s]
EVER = 10**9  # failures


def failing(kind, code):
    error = kind("as told")
    error.code = code
    return error


class FakeCostmap:
    """Current again at the next tick after it was cleared."""

    def __init__(self):
        self.master = Costmap(np.zeros((200, 200), dtype=np.uint8), 0.05, 0.0, 0.0)
        self.is_current = True
        self.cleared = 0

    def clear_entirely(self):
        self.is_current = False
        self.cleared = self.cleared + 1


class FakePlanner:
    def __init__(self):
        self.code = ""
        self.failures = 0
        self.stamps = []

    def reset(self, rng):
        pass

    def plan(self, start, goal, costmap, stamp):
        self.stamps.append(stamp)
        if self.failures > 0:
            self.failures -= 1
            raise failing(PlanningError, self.code)
        return Path(np.array([goal.as_array()]), stamp)


class FakeControllerServer:
    def __init__(self):
        self.code = ""
        self.failures = 0
        self.begun = 0
        self.arrived = False

    def reset(self, rng):
        pass

    def begin(self, plan, now):
        self.begun += 1

    begin_again = set_plan = lambda self, *_: None

    def goal_reached(self, state):
        return self.arrived

    controller = SimpleNamespace(acts_at_rest=False)

    def compute_command(self, state, surroundings, expects_progress):
        if self.failures > 0:
            self.failures -= 1
            raise failing(ControlError, self.code)
        return DRIVE


class Rig:
    """A tree with fakes all around, ticked at 10 Hz."""

    def __init__(self, behaviors=None):
        self.planner = FakePlanner()
        self.controller = FakeControllerServer()
        self.world = FakeCostmap()
        self.local = FakeCostmap()
        known = (
            {"wait": Wait(BehaviorServerParams(), FOOTPRINT, None)}
            if behaviors is None
            else behaviors
        )
        server = BehaviorServer(known, self.local.master)
        self.tree = NavigateToPose(self.planner, self.controller, server, self.world, self.local)
        self.tree.reset(Pose2D(9.0, 5.0), np.random.default_rng(0), np.random.default_rng(1))
        self.ticks = 0

    def tick(self, times=1):
        """The last command of so many ticks."""
        for _ in range(times):
            state = RobotState(Pose2D(5.0, 5.0), Twist2D(), self.ticks * TICK)
            recovery = self.tree.recover(state)
            self.stopped = self.tree.replan(state)
            command = self.tree.follow(state, ())
            self.world.is_current = self.local.is_current = True
            self.ticks += 1
        return recovery if command is None else command

    def plan_fails(self, code, times=EVER):
        self.planner.code = code
        self.planner.failures = times

    def control_fails(self, code, times=EVER):
        self.controller.code = code
        self.controller.failures = times


def test_the_path_is_computed_anew_every_second_while_it_is_followed() -> None:
    rig = Rig()
    assert rig.tick(35) == DRIVE
    assert rig.planner.stamps == pytest.approx([0.0, 1.0, 2.0, 3.0])
    assert rig.controller.begun == 1


def test_a_failed_plan_clears_the_global_costmap_and_is_tried_again_along_the_old_path() -> None:
    rig = Rig()
    rig.tick(10)
    rig.plan_fails("NO_VALID_PATH", times=1)
    assert rig.tick() == DRIVE
    assert rig.planner.stamps[-1] == pytest.approx(1.0)
    assert rig.tick() == DRIVE
    assert rig.planner.stamps[-1] == pytest.approx(1.1)
    assert rig.world.cleared == 1
    assert rig.local.cleared == 0
    assert rig.tree.counts.recoveries == 0
    assert rig.controller.begun == 1


def test_the_old_command_ends_in_the_tick_in_which_planning_gives_up_following() -> None:
    rig = Rig()
    rig.tick(10)
    assert rig.stopped is None
    rig.plan_fails("NO_VALID_PATH")
    rig.tick()
    assert rig.stopped is None  # the old path is followed until the second attempt
    rig.tick()
    assert rig.stopped == Twist2D()
    rig.tick()
    assert rig.stopped is None  # who recovers commands


def test_a_successful_plan_gives_the_next_failure_a_second_attempt_again() -> None:
    rig = Rig()
    for failures in (1, 2, 3):
        rig.plan_fails("TIMEOUT", times=1)
        rig.tick(11)
        assert rig.world.cleared == failures
    assert rig.tree.counts.recoveries == 0
    assert rig.tree.counts.failed_plans == 3


def test_following_is_tried_again_once_per_attempt_however_often_the_path_is_renewed() -> None:
    rig = Rig()
    rig.control_fails("NO_VALID_CONTROL", times=1)
    assert rig.tick() == Twist2D()
    assert rig.local.cleared == 1
    assert rig.world.cleared == 0
    assert rig.tree.counts.recoveries == 0
    rig.tick(25)
    rig.control_fails("NO_VALID_CONTROL", times=1)
    rig.tick()
    assert rig.tree.counts.recoveries == 1
    assert rig.tree.counts.clearings == 1
    rig.tick(5)  # a recovery begins a new attempt with a second chance of its own
    rig.control_fails("NO_VALID_CONTROL", times=1)
    rig.tick(2)
    assert rig.tree.counts.recoveries == 1


@pytest.mark.parametrize("code", COMPUTE_PATH_TO_POSE)
def test_only_some_planning_errors_lead_to_clearing_and_recovery(code: str) -> None:
    rig = Rig()
    rig.plan_fails(code)
    rig.tick(3)
    assert rig.tree.trouble.error == code
    assert rig.tree.trouble.error_code == COMPUTE_PATH_TO_POSE[code]
    if code in ("UNKNOWN", "TIMEOUT", "NO_VALID_PATH"):
        assert rig.tree.status is Status.RUNNING
        assert rig.tree.counts.recoveries == 1
        assert rig.world.cleared >= 1
    else:
        assert rig.tree.status is Status.FAILED
        assert rig.tree.trouble.gave_up == "no recovery helps against this error"
        assert rig.tree.counts == Counts(failed_plans=1)
        assert rig.world.cleared == 0
    assert (code in PLANNER_RECOVERY_HELPS) == (rig.tree.status is Status.RUNNING)


@pytest.mark.parametrize("code", FOLLOW_PATH)
def test_only_some_errors_of_following_lead_to_clearing_and_recovery(code: str) -> None:
    rig = Rig()
    rig.control_fails(code, times=2)
    rig.tick(3)
    assert rig.tree.trouble.error_code == FOLLOW_PATH[code]
    helps = code in ("UNKNOWN", "PATIENCE_EXCEEDED", "FAILED_TO_MAKE_PROGRESS", "NO_VALID_CONTROL")
    assert (rig.tree.status is Status.RUNNING) == helps == (code in CONTROLLER_RECOVERY_HELPS)
    assert rig.tree.counts.failed_controls == (2 if helps else 1)
    # once for the second attempt, once as a recovery
    assert rig.local.cleared == (2 if helps else 0)


def test_an_error_of_following_speaks_for_a_recovery_until_a_path_is_followed_again() -> None:
    rig = Rig()
    rig.control_fails("NO_VALID_CONTROL", times=2)
    rig.tick(2)
    rig.plan_fails("GOAL_OCCUPIED", times=1)  # directly after the recovery
    rig.tick(2)
    assert rig.tree.status is Status.RUNNING
    assert rig.tree.counts.recoveries == 2
    rig.tick(60)  # the wait is over, a path is followed
    rig.plan_fails("GOAL_OCCUPIED", times=1)
    rig.tick(10)
    assert rig.tree.status is Status.FAILED
    assert rig.tree.trouble.error == "GOAL_OCCUPIED"


def test_after_six_recoveries_the_navigation_is_given_up() -> None:
    rig = Rig()
    rig.plan_fails("NO_VALID_PATH")
    rig.tick(300)
    assert rig.tree.status is Status.FAILED
    assert rig.tree.trouble.gave_up == "all retries are used up"
    counts = rig.tree.counts
    assert counts.recoveries == NUMBER_OF_RETRIES == 6
    # clear | no spin, so wait | no backup, so clear | no spin, so wait | no backup, so clear | no
    # spin, so wait
    assert counts.clearings == 3
    assert counts.spins == 3
    assert counts.waits == 3
    assert counts.backups == 2
    assert counts.failed_recoveries == 5
    assert rig.tree.trouble.recovery_error == "UNAVAILABLE"
    assert rig.tree.trouble.recovery_error_code == 0
    assert counts.failed_plans == 14  # two per attempt, of which the first is no retry
    history = rig.tree.trouble.history.split("; ")
    assert history[:2] == [
        "0.0 s no plan (NO_VALID_PATH) (2 times until 0.1 s)",
        "0.1 s clear_costmaps begins",
    ]
    assert [line.split(" s ")[1] for line in history[1:-1:2]] == [
        "clear_costmaps begins",
        "wait begins",
    ] * 3
    assert history[-1] == "16.0 s gave up: all retries are used up"
    assert len(history) == 14
    assert len(rig.planner.stamps) == 14
    assert rig.tick(10) == Twist2D()


def test_a_goal_that_is_sent_again_has_all_retries_again() -> None:
    rig = Rig()
    rig.tree.try_again(0.0)
    assert rig.tree.trouble.history == ""  # it was not given up
    rig.plan_fails("NO_VALID_PATH", times=14)
    rig.tick(300)
    assert rig.tree.status is Status.FAILED
    rig.tree.try_again(30.0)
    assert rig.tick() == DRIVE
    assert (rig.tree._recoveries._next, rig.tree._recoveries._failures) == (0, 0)
    assert rig.tree.status is Status.RUNNING
    assert rig.tree.trouble.gave_up == ""
    assert rig.tree.trouble.history.endswith("30.0 s the goal is sent again")
    rig.plan_fails("NO_VALID_PATH")
    rig.tick(400)
    assert rig.tree.status is Status.FAILED
    assert rig.tree.counts.recoveries == 2 * NUMBER_OF_RETRIES


def test_recoveries_that_lead_to_a_path_are_not_given_back() -> None:
    rig = Rig()
    for _ in range(NUMBER_OF_RETRIES):
        rig.control_fails("FAILED_TO_MAKE_PROGRESS", times=2)
        assert rig.tick(120) == DRIVE
    assert rig.tree.status is Status.RUNNING
    rig.control_fails("FAILED_TO_MAKE_PROGRESS", times=2)
    rig.tick(3)
    assert rig.tree.status is Status.FAILED


def test_a_recovery_stops_planning_and_following_and_planning_begins_at_once_after_it() -> None:
    rig = Rig()
    rig.control_fails("NO_VALID_CONTROL", times=2)
    rig.tick(4)  # cleared
    rig.control_fails("NO_VALID_CONTROL", times=2)
    rig.tick(2)  # waiting, since there is no spin
    planned = len(rig.planner.stamps)
    assert rig.tick(49) == Twist2D()
    assert len(rig.planner.stamps) == planned
    assert rig.tick() == DRIVE
    assert len(rig.planner.stamps) == planned + 1


def test_arriving_ends_it() -> None:
    rig = Rig()
    rig.tick(3)
    rig.controller.arrived = True
    assert rig.tick() == Twist2D()
    assert rig.tree.status is Status.SUCCEEDED
    assert rig.tree.trouble.gave_up == ""
    assert rig.tree.trouble.history == "0.3 s arrived where it believes the goal"


def test_a_new_goal_forgets_retries_recoveries_and_errors() -> None:
    rig = Rig()
    rig.plan_fails("NO_VALID_PATH")
    rig.tick(300)
    rig.tree.reset(Pose2D(1.0, 1.0), np.random.default_rng(0), np.random.default_rng(1))
    assert rig.tree.status is Status.RUNNING
    assert rig.tree.counts == Counts()
    assert rig.tree.trouble.error == rig.tree.trouble.recovery_error == ""
    rig.ticks = 0
    rig.tick(3)
    assert rig.tree.counts.recoveries == 1
    assert rig.tree.counts.clearings == 1

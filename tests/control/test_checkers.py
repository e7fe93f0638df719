import math
from typing import Any

import numpy as np
import pytest

from navstack.control.axis_goal_checker import AxisGoalChecker
from navstack.control.controller import Controller
from navstack.control.goal_checker import (
    PositionGoalChecker,
    SimpleGoalChecker,
    StoppedGoalChecker,
)
from navstack.control.progress_checker import PoseProgressChecker, SimpleProgressChecker
from navstack.errors import (
    InvalidPathError,
    NoLegalVelocity,
    NoProgressError,
    PatienceExceededError,
    PluginError,
)
from navstack.params.checkers import (
    AxisGoalCheckerParams,
    PoseProgressCheckerParams,
    PositionGoalCheckerParams,
    SimpleGoalCheckerParams,
    SimpleProgressCheckerParams,
    StoppedGoalCheckerParams,
)
from navstack.params.extensions import algorithms
from navstack.types import Path, Pose2D, RobotState, Twist2D

from .given import plan_of, server_of

GOAL = Pose2D(1.0, 2.0, 3.1)
STANDING = Twist2D()


def test_a_goal_is_reached_within_both_tolerances_across_the_seam_of_the_angle():
    checker = SimpleGoalChecker(SimpleGoalCheckerParams(stateful=False))
    assert checker.is_goal_reached(Pose2D(1.2, 2.1, -3.1), GOAL, STANDING)
    assert not checker.is_goal_reached(Pose2D(1.2, 2.2, 3.1), GOAL, STANDING)
    assert not checker.is_goal_reached(Pose2D(1.0, 2.0, 2.8), GOAL, STANDING)


@pytest.mark.parametrize(("stateful", "reached"), [(True, True), (False, False)])
def test_a_stateful_checker_remembers_the_position(stateful, reached):
    checker = SimpleGoalChecker(SimpleGoalCheckerParams(stateful=stateful))
    # arrived, looks elsewhere
    assert not checker.is_goal_reached(Pose2D(1.0, 2.0, 0.0), GOAL, STANDING)
    drifted = Pose2D(2.0, 2.0, 3.1)
    assert checker.is_goal_reached(drifted, GOAL, STANDING) is reached
    checker.reset()
    assert not checker.is_goal_reached(drifted, GOAL, STANDING)


def test_the_stopped_checker_wants_the_robot_to_stand():
    checker = StoppedGoalChecker(StoppedGoalCheckerParams())
    assert not checker.is_goal_reached(GOAL, GOAL, Twist2D(0.2, 0.2, 0.0))
    assert not checker.is_goal_reached(GOAL, GOAL, Twist2D(0.0, 0.0, -0.3))
    assert checker.is_goal_reached(GOAL, GOAL, Twist2D(0.2, 0.0, 0.25))


def test_the_position_alone_or_either_heading_may_count():
    backwards = Pose2D(1.2, 2.0, 3.1 - math.pi)
    sideways = Pose2D(1.2, 2.0, 1.5)
    position = PositionGoalChecker(PositionGoalCheckerParams(stateful=False))
    assert position.is_goal_reached(backwards, GOAL, STANDING)
    assert position.is_goal_reached(sideways, GOAL, STANDING)
    assert not position.is_goal_reached(Pose2D(1.3, 2.0, 3.1), GOAL, STANDING)
    either = SimpleGoalChecker(SimpleGoalCheckerParams(symmetric_yaw_tolerance=True))
    assert either.is_goal_reached(backwards, GOAL, STANDING)
    assert either.is_goal_reached(GOAL, GOAL, STANDING)
    assert not either.is_goal_reached(sideways, GOAL, STANDING)


@pytest.mark.parametrize(
    ("x", "y", "changes", "reached"),
    [
        (0.8, 0.0, {}, True),
        (0.7, 0.0, {}, False),
        (0.8, 0.26, {}, False),
        (0.8, 0.26, {"cross_track_tolerance": 0.3}, True),
        (1.3, 0.0, {}, False),
        (1.3, 0.0, {"is_overshoot_valid": True}, True),
        (1.3, 0.3, {"is_overshoot_valid": True}, False),
        (0.5, 0.1, {"along_path_tolerance": 0.6}, True),
        (0.5, 0.1, {"along_path_tolerance": 0.6, "path_length_tolerance": 0.4}, False),
        (1.0, 0.0, {"along_path_tolerance": 1e-9}, True),
        # no pose is far enough: the lesser tolerance about the goal
        (0.9, 0.2, {"direction_estimation_distance": 9.0}, True),
        (0.8, 0.2, {"direction_estimation_distance": 9.0}, False),
    ],
)
@pytest.mark.parametrize("turn", [0.0, 1.0, -2.5])
def test_a_goal_reached_along_the_path_and_across_it(
    x: float,
    y: float,
    changes: dict[str, Any],
    reached: bool,
    turn: float,
) -> None:
    def placed(x: float, y: float) -> Pose2D:
        cos, sin = math.cos(turn), math.sin(turn)
        return Pose2D(3.0 + cos * x - sin * y, 1.0 + sin * x + cos * y, 0.4)

    line = [placed(x, 0.0) for x in np.linspace(-2.0, 1.0, 61)]
    checker = AxisGoalChecker(AxisGoalCheckerParams(**changes))
    checker.set_plan(Path(np.array([(each.x, each.y, turn) for each in line])))
    assert checker.is_goal_reached(placed(x, y), line[-1], STANDING) is reached


def test_a_robot_that_circles_within_the_radius_is_stuck_after_the_allowance() -> None:
    checker = SimpleProgressChecker(SimpleProgressCheckerParams())
    assert checker.check(Pose2D(0.0, 0.0), 0.0)
    assert checker.check(Pose2D(0.5, 0.0), 10.0)
    assert not checker.check(Pose2D(0.0, 0.5), 10.1)
    assert checker.check(Pose2D(0.0, 0.51), 10.2)
    assert checker.check(Pose2D(0.0, 0.51), 20.2)
    assert not checker.check(Pose2D(0.0, 0.51), 20.3)
    checker.reset()
    assert checker.check(Pose2D(0.0, 0.51), 30.0)


@pytest.mark.parametrize("family", ["goal_checkers", "progress_checkers"])
def test_every_checker_of_the_registry_can_be_made(family):
    entries = algorithms(family)
    assert len(entries) >= 2
    for kind, entry in entries.items():
        assert type(entry.create(entry.params(), parts={})).__name__ == kind.partition("::")[2]


def test_a_symmetric_robot_may_arrive_backwards():
    backwards = Pose2D(1.0, 2.0, 3.1 - math.pi + 0.2)
    assert SimpleGoalChecker(SimpleGoalCheckerParams(symmetric_yaw_tolerance=True)).is_goal_reached(
        backwards, GOAL, STANDING
    )
    assert not SimpleGoalChecker(SimpleGoalCheckerParams()).is_goal_reached(
        backwards, GOAL, STANDING
    )


def test_turning_far_enough_is_progress_for_the_pose_progress_checker():
    checker = PoseProgressChecker(PoseProgressCheckerParams())
    assert checker.check(Pose2D(0.0, 0.0, 3.0), 0.0)
    # 0.38 rad across the seam: in time, but no progress
    assert checker.check(Pose2D(0.1, 0.0, -2.9), 10.0)
    assert not checker.check(Pose2D(0.1, 0.0, -2.8), 10.1)  # 0.48 rad
    assert checker.check(Pose2D(0.1, 0.0, -2.7), 10.2)  # 0.58 rad
    assert checker.check(Pose2D(0.1, 0.0, -2.7), 20.2)
    assert not checker.check(Pose2D(0.1, 0.0, -2.7), 20.3)
    assert checker.check(Pose2D(0.7, 0.0, -2.7), 20.4)


class FailingController(Controller):
    """Fails from the second cycle on."""

    def __init__(self, error):
        self._error = error
        self.cycles = 0
        self.resumed = 0

    def reset(self):
        self.cycles = 0

    def resume(self):
        self.resumed += 1

    def compute_velocity(self, state, plan, surroundings):
        self.cycles += 1
        if self.cycles > 1:
            raise self._error
        return Twist2D(linear_x=0.5)


class Fixed(FailingController):
    """Answers always the same."""

    def compute_velocity(self, state, plan, surroundings):
        return self._error


def serve(error, **params):
    server = server_of(FailingController(error), **params)
    server.begin(plan_of((5.0, 0.0, 0.0)), 0.0)
    return server


def command(server, stamp):
    return server.compute_command(RobotState(Pose2D(), STANDING, stamp), None)


def test_a_lack_of_commands_is_put_up_with_for_the_failure_tolerance():
    server = serve(NoLegalVelocity({}), failure_tolerance=0.3)
    assert command(server, 0.0) == Twist2D(linear_x=0.5)
    assert command(server, 0.3) == STANDING
    with pytest.raises(PatienceExceededError, match="no legal velocity") as caught:
        command(server, 0.35)
    assert caught.value.code == "PATIENCE_EXCEEDED"


def test_a_command_that_is_no_number_is_no_standstill():
    server = server_of(Fixed(Twist2D(math.nan)))
    server.begin(plan_of((5.0, 0.0, 0.0)), 0.0)
    with pytest.raises(PluginError, match="Fixed answered Twist2D"):
        command(server, 0.0)


@pytest.mark.parametrize("tolerance", [0.0, -0.5])
def test_without_tolerance_the_lack_itself_is_the_error(tolerance):
    server = serve(NoLegalVelocity({}), failure_tolerance=tolerance)
    command(server, 0.0)
    with pytest.raises(NoLegalVelocity):
        command(server, 0.0)


def test_a_tolerance_of_minus_one_is_endless():
    server = serve(NoLegalVelocity({}), failure_tolerance=-1.0)
    command(server, 0.0)
    assert command(server, 9.9) == STANDING
    with pytest.raises(NoProgressError):
        command(server, 10.1)


def test_the_controller_is_told_that_it_was_not_asked_for_a_time():
    controller = FailingController(NoLegalVelocity({}))
    server_of(controller).resume(1.0)
    assert controller.resumed == 1


def test_progress_is_what_odometry_says_not_a_belief_that_wanders():
    blocked, driving = (serve(NoLegalVelocity({}), failure_tolerance=-1.0) for _ in range(2))
    for stamp in range(11):
        far = Pose2D(1.0 * stamp, 0.0, 0.0)
        near = Pose2D()
        driving.compute_command(RobotState(near, STANDING, stamp, far), None)
        blocked.compute_command(RobotState(far, STANDING, stamp, near), None)
    driving.compute_command(RobotState(near, STANDING, 11.0, far), None)
    with pytest.raises(NoProgressError):
        blocked.compute_command(RobotState(far, STANDING, 11.0, near), None)


def test_what_more_attempts_would_not_cure_is_raised_at_once():
    server = serve(InvalidPathError("nowhere near"), failure_tolerance=1.0)
    command(server, 0.0)
    with pytest.raises(InvalidPathError):
        command(server, 0.0)


def test_with_a_new_plan_the_position_is_checked_again():
    server = serve(NoLegalVelocity({}))
    goal = plan_of((1.0, 2.0, 3.1))
    server.set_plan(goal)
    # arrived, looks elsewhere
    assert not server.goal_reached(RobotState(Pose2D(1.0, 2.0, 0.0), STANDING))
    drifted = RobotState(Pose2D(2.0, 2.0, 3.1), STANDING)
    assert server.goal_reached(drifted)
    server.set_plan(goal)
    assert not server.goal_reached(drifted)


@pytest.mark.parametrize(("speed", "counts"), [(0.01, False), (0.011, True)])
def test_velocities_up_to_their_threshold_count_as_standing(speed, counts):
    checker = StoppedGoalChecker(StoppedGoalCheckerParams(trans_stopped_velocity=0.0))
    controller = FailingController(NoLegalVelocity({}))
    server = server_of(controller, checker, min_x_velocity_threshold=0.01)
    server.begin(plan_of((1.0, 2.0, 3.1)), 0.0)
    assert server.goal_reached(RobotState(GOAL, Twist2D(linear_x=-speed))) is not counts

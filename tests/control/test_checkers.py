import pytest

from navstack.control.goal_checker import GOAL_CHECKERS, SimpleGoalChecker, StoppedGoalChecker
from navstack.control.progress_checker import PROGRESS_CHECKERS, SimpleProgressChecker
from navstack.params.checkers import SimpleGoalCheckerParams, SimpleProgressCheckerParams, StoppedGoalCheckerParams
from navstack.types import Pose2D, Twist2D

GOAL = Pose2D(1.0, 2.0, 3.1)
STANDING = Twist2D()


def test_a_goal_is_reached_within_both_tolerances_across_the_seam_of_the_angle() -> None:
    checker = SimpleGoalChecker(SimpleGoalCheckerParams(stateful=False))
    assert checker.is_goal_reached(Pose2D(1.2, 2.1, -3.1), GOAL, STANDING)
    assert not checker.is_goal_reached(Pose2D(1.2, 2.2, 3.1), GOAL, STANDING)
    assert not checker.is_goal_reached(Pose2D(1.0, 2.0, 2.8), GOAL, STANDING)


@pytest.mark.parametrize(("stateful", "reached"), [(True, True), (False, False)])
def test_a_stateful_checker_remembers_the_position(stateful: bool, reached: bool) -> None:
    checker = SimpleGoalChecker(SimpleGoalCheckerParams(stateful=stateful))
    assert not checker.is_goal_reached(Pose2D(1.0, 2.0, 0.0), GOAL, STANDING)  # arrived, looks elsewhere
    drifted = Pose2D(2.0, 2.0, 3.1)
    assert checker.is_goal_reached(drifted, GOAL, STANDING) is reached
    checker.reset()
    assert not checker.is_goal_reached(drifted, GOAL, STANDING)


def test_the_stopped_checker_wants_the_robot_to_stand() -> None:
    checker = StoppedGoalChecker(StoppedGoalCheckerParams())
    assert not checker.is_goal_reached(GOAL, GOAL, Twist2D(0.2, 0.2, 0.0))
    assert not checker.is_goal_reached(GOAL, GOAL, Twist2D(0.0, 0.0, -0.3))
    assert checker.is_goal_reached(GOAL, GOAL, Twist2D(0.2, 0.0, 0.25))


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


def test_the_names_are_nav2s() -> None:
    assert GOAL_CHECKERS["nav2_controller::SimpleGoalChecker"] is SimpleGoalChecker
    assert GOAL_CHECKERS["nav2_controller::StoppedGoalChecker"] is StoppedGoalChecker
    assert PROGRESS_CHECKERS["nav2_controller::SimpleProgressChecker"] is SimpleProgressChecker

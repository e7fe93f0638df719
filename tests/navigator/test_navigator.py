"""The tick and the tree, closed over an ideal robot on small maps.

No physics, so that every cause is in the brain.
"""

import math

import pytest

from navstack.behavior_tree import NUMBER_OF_RETRIES
from navstack.clock import Clock
from navstack.costmap.occupancy_grid import OCCUPIED
from navstack.navigation_status import Status
from navstack.types import Pose2D


@pytest.mark.parametrize("name", ["tuned", "stock"])
def test_it_arrives_and_says_so(room, make, drive, name: str) -> None:
    navigator, localizer = make(room(), name)
    goal = Pose2D(13.0, 5.0, 0.0)
    driven = drive(navigator, localizer, Pose2D(2.0, 2.0, math.pi), goal, 60.0)
    tolerance = 1.8 if name == "tuned" else 0.25
    assert math.hypot(driven.pose.x - goal.x, driven.pose.y - goal.y) <= tolerance + 0.1
    # the tuned file's 1.8 m makes it turn to the goal's yaw on the spot, far from it
    if name == "stock":
        assert navigator.status is Status.SUCCEEDED
    assert navigator.counts.failed_plans == 0
    assert max(abs(command.linear_x) for command in driven.commands) <= 3.0


def test_the_tuned_file_turns_to_the_path_before_it_drives(room, make, drive) -> None:
    navigator, localizer = make(room())
    driven = drive(navigator, localizer, Pose2D(3.0, 4.0, math.pi), Pose2D(13.0, 4.0, 0.0), 1.0)
    assert all(command.linear_x == 0.0 for command in driven.commands)
    assert abs(driven.commands[-1].angular_z) > 0.5


def test_a_goal_that_nothing_reaches_ends_after_nav2s_retries(room, make, drive) -> None:
    grid = room()
    grid.data[:, 150:160] = OCCUPIED
    navigator, localizer = make(grid)
    driven = drive(
        navigator, localizer, Pose2D(2.0, 4.0), Pose2D(13.0, 4.0), 90.0, grid.data == OCCUPIED
    )
    assert navigator.status is Status.FAILED
    assert navigator.trouble.error == "NO_VALID_PATH"
    assert navigator.trouble.error_code == 208
    assert navigator.trouble.gave_up == "all retries are used up"
    counts = navigator.counts
    assert counts.recoveries == NUMBER_OF_RETRIES
    assert counts.clearings == 2
    assert counts.spins == 2
    assert counts.waits == 1
    assert counts.backups == 1
    assert counts.failed_recoveries == 0
    assert counts.plans == 0
    # 5 s of waiting, 2 s of backing up, two spins of at most 4 s, and 14 plans, one per update of
    # the global costmap
    assert 7.0 <= driven.seconds <= 5.0 + 2.0 + 2 * 4.0 + 14 * 1.0 + 1.0
    assert math.hypot(driven.pose.x - 2.0, driven.pose.y - 4.0) == pytest.approx(0.3, abs=0.05)
    assert driven.pose.yaw == pytest.approx(2 * 1.57, abs=0.4)
    assert not driven.touched


def test_a_new_goal_starts_afresh(room, make, drive) -> None:
    navigator, localizer = make(room())
    first = drive(navigator, localizer, Pose2D(2.0, 2.0), Pose2D(13.0, 5.0), 5.0)
    drive(navigator, localizer, Pose2D(12.0, 6.0), Pose2D(3.0, 2.0), 3.0)
    assert drive(navigator, localizer, Pose2D(2.0, 2.0), Pose2D(13.0, 5.0), 5.0) == first


@pytest.mark.parametrize(("frequency", "runs"), [(30.0, 30), (20.0, 20), (1.0, 1), (7.0, 7)])
def test_a_rate_runs_as_often_as_it_says(frequency: float, runs: int) -> None:
    clock = Clock(frequency)
    assert sum(clock.is_due(k / 120.0) for k in range(120)) == runs
    assert sum(clock.is_due(10.0 + k / 120.0) for k in range(120)) == runs

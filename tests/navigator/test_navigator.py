"""The tick and the tree, closed over an ideal robot on small maps: no physics, so that every cause is in the brain."""

import math

import numpy as np
import pytest

from harness.resources import shipped
from navstack.behavior_tree import NUMBER_OF_RETRIES, Status
from navstack.build import build_navigator
from navstack.clock import Clock
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.localization.localizer import Localizer
from navstack.navigator import Navigator
from navstack.params.nav2_file import load_nav2
from navstack.types import Belief, LaserScan, Observation, Odometry, Pose2D, Twist2D

TICK = 1.0 / 60.0  # [s]
BEAMS = 360


class Knows(Localizer):
    """Believes what the test tells it."""

    pose = Pose2D()

    def reset(self, belief: Belief) -> None:
        self.pose = belief.pose

    def update(self, observation: Observation) -> Belief:
        return Belief(self.pose, stamp=observation.stamp)


def room(width: float = 16.0, height: float = 8.0) -> OccupancyGrid:
    """An empty room with walls; its lower left corner is the origin."""
    cells = np.full((round(height / 0.05), round(width / 0.05)), FREE, dtype=np.int8)
    cells[:2] = cells[-2:] = OCCUPIED
    cells[:, :2] = cells[:, -2:] = OCCUPIED
    return OccupancyGrid(cells, 0.05, Pose2D())


def make(grid: OccupancyGrid, name: str = "tuned") -> tuple[Navigator, Knows]:
    localizer = Knows()
    nav2 = load_nav2(shipped("params") / "nav2" / f"{name}.yaml")
    return build_navigator(nav2, localizer, grid, None), localizer


def drive(
    navigator: Navigator, localizer: Knows, start: Pose2D, goal: Pose2D, seconds: float, wall_ahead: float = math.inf
) -> tuple[Pose2D, list[Twist2D]]:
    """Close the loop over a robot that does at once as it is told; returns where it ended and all commands."""
    navigator.reset(goal, Belief(start), np.random.default_rng(0))
    pose, twist, commands = start, Twist2D(), []
    for k in range(round(seconds / TICK)):
        ranges = np.full(BEAMS, wall_ahead)
        scan = LaserScan(k * TICK, ranges, -math.pi, 2.0 * math.pi / BEAMS, 0.05, 30.0)
        localizer.pose = pose
        observation = Observation(k * TICK, odometry=Odometry(k * TICK, pose, twist), scan=scan)
        twist = navigator.tick(observation)
        commands.append(twist)
        yaw = pose.yaw + twist.angular_z * TICK
        step = twist.linear_x * TICK
        pose = Pose2D(pose.x + step * math.cos(yaw), pose.y + step * math.sin(yaw), yaw)
        if navigator.status is not Status.RUNNING:
            break
    return pose, commands


@pytest.mark.parametrize("name", ["tuned", "stock"])
def test_it_arrives_and_says_so(name: str) -> None:
    navigator, localizer = make(room(), name)
    goal = Pose2D(13.0, 5.0, 0.0)
    pose, commands = drive(navigator, localizer, Pose2D(2.0, 2.0, math.pi), goal, 60.0)
    tolerance = 1.8 if name == "tuned" else 0.25
    assert math.hypot(pose.x - goal.x, pose.y - goal.y) <= tolerance + 0.1
    if name == "stock":  # the tuned file's 1.8 m makes it turn to the goal's yaw on the spot, far from it
        assert navigator.status is Status.SUCCEEDED
    assert navigator.counts.failed_plans == 0
    assert max(abs(command.linear_x) for command in commands) <= 3.0


def test_the_tuned_file_turns_to_the_path_before_it_drives() -> None:
    navigator, localizer = make(room())
    _, commands = drive(navigator, localizer, Pose2D(3.0, 4.0, math.pi), Pose2D(13.0, 4.0, 0.0), 1.0)
    assert all(command.linear_x == 0.0 for command in commands)
    assert abs(commands[-1].angular_z) > 0.5


def test_a_goal_that_nothing_reaches_ends_after_nav2s_retries() -> None:
    grid = room()
    grid.data[:, 150:160] = OCCUPIED
    navigator, localizer = make(grid)
    pose, commands = drive(navigator, localizer, Pose2D(2.0, 4.0), Pose2D(13.0, 4.0), 60.0)
    assert navigator.status is Status.FAILED
    assert navigator.last_error == "NO_VALID_PATH"
    assert navigator.counts.recoveries == NUMBER_OF_RETRIES
    assert (pose.x, pose.y) == (2.0, 4.0)
    assert all(command == Twist2D() for command in commands)


def test_obstacles_all_around_end_in_recoveries() -> None:
    navigator, localizer = make(room())
    pose, _ = drive(navigator, localizer, Pose2D(5.0, 4.0), Pose2D(13.0, 4.0), 30.0, wall_ahead=0.8)
    assert navigator.counts.recoveries > 0
    assert math.hypot(pose.x - 5.0, pose.y - 4.0) < 0.6


def test_a_new_goal_starts_afresh() -> None:
    navigator, localizer = make(room())
    first = drive(navigator, localizer, Pose2D(2.0, 2.0), Pose2D(13.0, 5.0), 5.0)
    drive(navigator, localizer, Pose2D(12.0, 6.0), Pose2D(3.0, 2.0), 3.0)
    assert drive(navigator, localizer, Pose2D(2.0, 2.0), Pose2D(13.0, 5.0), 5.0) == first


@pytest.mark.parametrize(("frequency", "runs"), [(30.0, 30), (20.0, 20), (1.0, 1), (7.0, 7)])
def test_a_rate_runs_as_often_as_it_says(frequency: float, runs: int) -> None:
    clock = Clock(frequency)
    assert sum(clock.is_due(k / 120.0) for k in range(120)) == runs
    assert sum(clock.is_due(10.0 + k / 120.0) for k in range(120)) == runs

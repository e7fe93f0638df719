"""Robots in trouble, from start to end.

What they try, what helps, and what they say when nothing does.
"""

import math

import numpy as np
import pytest

from navstack.behavior_tree import NUMBER_OF_RETRIES
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.navigation_status import Status
from navstack.types import Pose2D

FILES = pytest.mark.parametrize("name", ["tuned", "stock"])


def with_boxes(grid: OccupancyGrid, *boxes: tuple[float, float, float, float]) -> np.ndarray:
    """The map's solid cells, and boxes (x0, x1, y0, y1) in [m] that are not on it."""
    solid = grid.data == OCCUPIED
    for x0, x1, y0, y1 in boxes:
        solid[round(y0 / 0.05) : round(y1 / 0.05), round(x0 / 0.05) : round(x1 / 0.05)] = True
    return solid


def room_with_door(room) -> OccupancyGrid:
    """Two halves, joined by a doorway 2 m wide."""
    grid = room()
    grid.data[:, 160:164] = OCCUPIED
    grid.data[60:100, 160:164] = FREE
    return grid


@FILES
def test_a_corridor_blocked_off_the_map_is_given_up_after_all_recoveries(
    room, make, drive, name: str
) -> None:
    grid = room(16.0, 3.2)
    navigator, localizer = make(grid, name)
    blocked = with_boxes(grid, (8.0, 8.3, 0.0, 3.2))
    driven = drive(navigator, localizer, Pose2D(2.0, 1.6), Pose2D(13.0, 1.6), 90.0, blocked)
    assert navigator.status is Status.FAILED
    assert navigator.trouble.error == "NO_VALID_PATH"
    assert navigator.trouble.gave_up == "all retries are used up"
    counts = navigator.counts
    assert counts.recoveries == NUMBER_OF_RETRIES
    assert (
        counts.clearings + counts.spins + counts.waits + counts.backups - counts.failed_recoveries
        == 6
    )
    assert driven.seconds < 40.0
    assert not driven.touched


@FILES
def test_somebody_in_a_doorway_is_waited_for(room, make, drive, name: str) -> None:
    grid = room_with_door(room)
    occupied = with_boxes(grid, (7.9, 8.3, 3.0, 5.0))
    free = with_boxes(grid)
    navigator, localizer = make(grid, name)
    goal = Pose2D(13.0, 4.0)
    driven = drive(
        navigator,
        localizer,
        Pose2D(3.0, 4.0),
        goal,
        60.0,
        lambda now: occupied if now < 12.0 else free,
    )
    assert navigator.status is Status.SUCCEEDED
    assert 1 <= navigator.counts.recoveries < NUMBER_OF_RETRIES
    assert navigator.counts.waits == 1
    assert (
        max(
            pose.x for pose, t in zip(driven.poses, np.arange(720) / 60.0, strict=False) if t < 12.0
        )
        < 7.9
    )
    assert math.hypot(driven.pose.x - goal.x, driven.pose.y - goal.y) < 1.9
    assert not driven.touched


@FILES
def test_a_robot_with_its_nose_in_the_inflation_backs_out_of_it(
    room, make, drive, name: str
) -> None:
    """The file has no spin, so that recovery fails and the next ones run."""
    grid = room()
    navigator, localizer = make(grid, name, behavior_server__behavior_plugins=["backup", "wait"])
    driven = drive(
        navigator, localizer, Pose2D(15.6, 4.0), Pose2D(4.0, 4.0, math.pi), 60.0, with_boxes(grid)
    )
    assert navigator.status is Status.SUCCEEDED
    counts = navigator.counts
    assert counts.clearings == 1
    assert counts.spins == 1
    assert counts.waits == 1
    assert counts.backups == 1
    assert counts.recoveries == 3
    assert counts.failed_recoveries == 1
    assert navigator.trouble.recovery_error == "UNAVAILABLE"
    assert navigator.trouble.gave_up == ""
    backing = [command.linear_x for command in driven.commands if command.linear_x < 0.0]
    assert min(backing) == pytest.approx(-0.15)
    assert sum(backing) / 60.0 == pytest.approx(-0.3, abs=0.03)


def test_a_boxed_in_robot_breaks_off_its_spin_before_the_tail_meets_the_box(
    room, make, drive
) -> None:
    """The box is just wider than the footprint, with whose global padding the map is cleared."""
    grid = room()
    navigator, localizer = make(grid)
    sides = [(4.35, 6.05, 3.35, 3.4), (4.35, 6.05, 4.6, 4.65)]
    ends = [(4.35, 4.4, 3.35, 4.65), (6.0, 6.05, 3.35, 4.65)]
    driven = drive(
        navigator,
        localizer,
        Pose2D(5.35, 4.0),
        Pose2D(13.0, 4.0),
        8.0,
        with_boxes(grid, *sides, *ends),
    )
    assert navigator.trouble.error_code == 208
    assert navigator.trouble.recovery_error == "COLLISION_AHEAD"
    assert navigator.trouble.recovery_error_code == 703
    counts = navigator.counts
    assert counts.clearings == 1
    assert counts.spins == 1
    assert counts.waits == 1
    assert counts.backups == 0
    assert counts.recoveries == 2
    assert counts.failed_recoveries == 1
    assert 0.2 < driven.pose.yaw < 0.8
    assert not driven.touched


@FILES
def test_a_start_in_an_obstacle_is_given_up(room, make, drive, name: str) -> None:
    grid = room()
    grid.data[70:90, 90:110] = OCCUPIED
    navigator, localizer = make(grid, name)
    driven = drive(navigator, localizer, Pose2D(5.0, 4.0), Pose2D(13.0, 4.0), 90.0)
    assert navigator.status is Status.FAILED
    assert navigator.trouble.error_code == 208
    assert navigator.trouble.recovery_error_code == 703
    assert navigator.counts.recoveries == NUMBER_OF_RETRIES
    assert driven.seconds < 50.0
    assert math.hypot(driven.pose.x - 5.0, driven.pose.y - 4.0) < 0.1


@FILES
def test_a_goal_in_an_obstacle_is_approached_as_far_as_the_planner_may(
    room, make, drive, name: str
) -> None:
    grid = room()
    grid.data[78:82, 258:262] = OCCUPIED
    navigator, localizer = make(grid, name)
    driven = drive(
        navigator, localizer, Pose2D(3.0, 4.0), Pose2D(13.0, 4.0), 60.0, with_boxes(grid)
    )
    assert navigator.status is Status.SUCCEEDED
    reach = 0.5 * math.sqrt(2.0) + (
        1.8 if name == "tuned" else 0.25
    )  # the planner's square and the goal checker's circle
    assert math.hypot(driven.pose.x - 13.0, driven.pose.y - 4.0) < reach + 0.1
    assert navigator.counts.recoveries == 0


@FILES
def test_a_goal_in_an_obstacle_without_tolerance_is_refused_at_once(
    room, make, drive, name: str
) -> None:
    grid = room()
    grid.data[78:82, 258:262] = OCCUPIED
    navigator, localizer = make(grid, name, planner_server__GridBased__tolerance=0.0)
    driven = drive(navigator, localizer, Pose2D(3.0, 4.0), Pose2D(13.0, 4.0), 10.0)
    assert navigator.status is Status.FAILED
    assert navigator.trouble.error_code == 206
    assert navigator.trouble.gave_up == "no recovery helps against this error"
    assert navigator.counts.recoveries == 0
    assert driven.seconds < 0.1


def test_what_a_behavior_commands_goes_through_the_smoother(room, make, drive) -> None:
    grid = room()
    grid.data[:, 150:160] = OCCUPIED
    navigator, localizer = make(grid, velocity_smoother__max_accel=[2.5, 0.0, 0.6])
    driven = drive(navigator, localizer, Pose2D(2.0, 4.0), Pose2D(13.0, 4.0), 12.0)
    turns = np.array([command.angular_z for command in driven.commands])
    assert turns.max() > 0.8
    assert np.diff(turns).max() <= 0.6 / 20.0 + 1e-9


@pytest.mark.parametrize(("polygons", "stops"), [(["FootprintApproach"], True), ([], False)])
def test_the_collision_monitor_stops_a_robot_that_sees_nothing_any_more(
    room, make, drive, polygons, stops
) -> None:
    grid = room()
    navigator, localizer = make(grid, "stock", collision_monitor__polygons=polygons)
    blind = _without_scans(navigator, after=3.0)
    driven = drive(blind, localizer, Pose2D(2.0, 4.0), Pose2D(13.0, 4.0), 6.0)
    late = [
        command.linear_x for k, command in enumerate(driven.commands) if k / 60.0 > 3.0 + 1.0 + 0.2
    ]
    assert max(command.linear_x for command in driven.commands[: 3 * 60]) > 0.5
    assert (max(late) == 0.0) == stops


def _without_scans(navigator, after: float):
    """The same navigator, to which no scan gets through any more from a time [s] on."""
    tick = navigator.tick

    def blinded(observation):
        if observation.stamp < after:
            return tick(observation)
        return tick(type(observation)(observation.stamp, odometry=observation.odometry))

    navigator.tick = blinded
    return navigator

"""What a policy sees, and how its waypoints are followed, against cases worked out by hand."""

import math

import numpy as np
import pytest

from harness.policy.interface import ROUTE_POINTS
from harness.policy.senses import Route, _in_frame
from harness.policy.waypoints import BEHIND, TURN_RATE, WaypointFollower
from navstack.types import FloatArray, Path, Pose2D


def straight(length: float) -> Path:
    x = np.arange(0.0, length + 0.01, 0.05)
    return Path(np.column_stack((x, np.zeros_like(x), np.zeros_like(x))))


def test_the_route_ahead_in_the_robots_frame() -> None:
    ahead = Route(straight(20.0)).ahead(Pose2D(3.0, 1.0, math.pi / 2.0))
    # one metre to the left of the route, facing away from it: the route lies behind, from left to
    # right
    assert ahead == pytest.approx(
        np.column_stack((np.full(10, -1.0), -np.arange(1.0, 11.0))), abs=1e-9
    )


@pytest.mark.parametrize("at", [0.0, 10.0, 20.0, 24.9, 37.3])
def test_a_sparse_route_leads_ahead_wherever_the_robot_is(at: float) -> None:
    """As the straight line to the goal."""
    route = Route(Path(np.array([(0.0, 0.0, 0.0), (50.0, 0.0, 0.0)])))
    ahead = route.ahead(Pose2D(at, 0.0, 0.0))
    assert ahead[:, 0] == pytest.approx(np.arange(1.0, 11.0), abs=0.5)


def test_beyond_its_end_the_route_stays_there() -> None:
    ahead = Route(straight(4.0)).ahead(Pose2D(1.5, 0.0, 0.0))
    assert ahead[:, 0] == pytest.approx([1.0, 2.0] + [2.5] * (ROUTE_POINTS - 2))


def test_a_route_that_passes_the_same_place_twice_goes_on() -> None:
    there = np.arange(0.0, 8.01, 0.05)
    x = np.concatenate((there, there[::-1]))
    y = np.concatenate((np.zeros_like(there), np.full_like(there, 0.2)))
    route = Route(Path(np.column_stack((x, y, np.zeros_like(x)))))
    for at in np.arange(0.0, 8.0, 0.5):
        route.ahead(Pose2D(float(at), 0.0, 0.0))
    assert route.ahead(Pose2D(4.0, 0.2, math.pi))[0] == pytest.approx((1.0, 0.0), abs=0.06)


def test_a_robot_that_was_carried_away_finds_its_place_again() -> None:
    route = Route(straight(40.0))
    route.ahead(Pose2D(0.0, 0.0, 0.0))
    assert route.ahead(Pose2D(30.0, 0.0, 0.0))[0] == pytest.approx((1.0, 0.0))


def test_people_nearest_first_in_the_robots_frame() -> None:
    people = np.array(((5.0, 0.0, 0.0, 1.0), (np.nan, np.nan, 0.0, 0.0), (1.0, 2.0, -1.0, 0.0)))
    seen = _in_frame(Pose2D(1.0, 0.0, math.pi / 2.0), people)
    assert seen == pytest.approx(np.array(((2.0, 0.0, 0.0, 1.0), (0.0, -4.0, 1.0, 0.0))))


def drive(waypoints: FloatArray, start: Pose2D, seconds: float, speed: float = 1.0) -> Pose2D:
    """A robot that does what it is told to at once."""
    follower, pose = WaypointFollower(speed), start
    follower.take(waypoints, start)
    for _ in range(int(seconds / 0.01)):
        command = follower.follow(pose)
        yaw = pose.yaw + 0.01 * command.angular_z
        step = 0.01 * command.linear_x
        pose = Pose2D(pose.x + step * math.cos(yaw), pose.y + step * math.sin(yaw), yaw)
    return pose


def test_waypoints_are_reached_wherever_the_robot_stands() -> None:
    for start in (Pose2D(), Pose2D(3.0, -2.0, 2.5)):
        end = drive(np.array(((1.0, 0.0), (2.0, 0.5), (3.0, 1.0))), start, 20.0)
        cos, sin = math.cos(start.yaw), math.sin(start.yaw)
        assert math.hypot(end.x - start.x - 3 * cos + sin, end.y - start.y - 3 * sin - cos) < 0.06


def test_an_arc_of_waypoints_is_driven_as_its_circle() -> None:
    # pure pursuit of a point on a circle through the robot, tangent to its heading: that circle
    # (curvature 2 y / d2)
    angle = np.linspace(0.05, 1.5, 40)
    follower = WaypointFollower(1.0)
    follower.take(np.column_stack((4.0 * np.sin(angle), 4.0 * (1.0 - np.cos(angle)))), Pose2D())
    command = follower.follow(Pose2D())
    assert command.linear_x == 1.0
    assert command.angular_z == pytest.approx(1.0 / 4.0)


def test_what_is_behind_is_turned_to_first() -> None:
    follower = WaypointFollower(1.0)
    follower.take(np.array(((-2.0, -0.5),)), Pose2D())
    command = follower.follow(Pose2D())
    assert (command.linear_x, command.angular_z) == (0.0, -TURN_RATE)
    follower.take(2.0 * np.array(((math.cos(BEHIND - 0.01), math.sin(BEHIND - 0.01)),)), Pose2D())
    assert follower.follow(Pose2D()).linear_x == 1.0


def test_it_slows_down_for_the_last_waypoint_and_stands_there() -> None:
    follower = WaypointFollower(2.0)
    follower.take(np.array(((0.5, 0.0),)), Pose2D())
    assert follower.follow(Pose2D()).linear_x == pytest.approx(1.0)  # sqrt(2 * 1 m/s2 * 0.5 m)
    assert follower.follow(Pose2D(0.47, 0.0, 0.0)).linear_x == 0.0

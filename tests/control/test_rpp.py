"""Regulated pure pursuit: its formulas, its rules, and its place in a Nav2 file."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.random import default_rng
from pytest import approx

from navstack.control.footprint_cost import footprint_cost
from navstack.control.path_window import PathWindow, in_base_frame, window_bounds
from navstack.control.rpp.arc_check import ArcCheck
from navstack.control.rpp.lookahead import (
    arc_curvature,
    beyond,
    distance_to_cusp,
    lookahead_point,
    lookahead_point_on_circle,
    path_length,
)
from navstack.control.rpp.regulation import speed_in_curve, speed_near_obstacle, speed_on_approach
from navstack.control.rpp.rpp_controller import RegulatedPurePursuitController
from navstack.costmap.costmap import LETHAL_OBSTACLE, NO_INFORMATION, Costmap
from navstack.costmap.inflation import inflation_cost
from navstack.errors import ControlError, InvalidPathError, NoLegalVelocity, ParameterError
from navstack.geometry import relative_to
from navstack.params.extensions import algorithms
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.views import read_controller, read_primary_controller
from navstack.params.rpp import RppParams
from navstack.types import Path, Pose2D, RobotState, Twist2D

from .given import box, command_of, ground_with, robot, straight

FOOTPRINT = box(0.3, -0.3, 0.25)
PARAMS = RppParams()
STILL = Twist2D()


def make(**given):
    return RegulatedPurePursuitController(
        replace(PARAMS, **given), FOOTPRINT, 20.0, xy_goal_tolerance=0.25
    )


def arc(radius, angle=2.0):
    turn = np.linspace(0.0, angle, 81)
    return Path(np.column_stack((radius * np.sin(turn), radius * (1.0 - np.cos(turn)), turn)))


def drive(controller, plan, *pose, twist=STILL):
    return command_of(controller, RobotState(Pose2D(*pose), twist), plan)


def test_the_carrot_lies_along_the_path():
    path = np.array(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 2.0, 0.0)))
    assert lookahead_point(path, 0.5, False) == (0.5, 0.0)
    assert lookahead_point(path, 1.5, False) == (1.0, 0.5)
    assert lookahead_point(path, 4.0, False) == (1.0, 2.0)
    assert lookahead_point(path, 4.0, True) == approx((1.0, 3.0))
    assert lookahead_point(path[:1], 0.5, False) == (0.0, 0.0)
    # 1 m each, then on to the left
    aslant = path[:1] + ((1.0, -2.0, 0.0), (1.6, -1.2, 0.0), (1.0, -0.4, 0.0))
    assert lookahead_point(aslant, 1.5, True) == approx((1.3, -0.8))
    assert lookahead_point(aslant, 4.5, True) == approx((1.0 - 2.5 * 0.6, -0.4 + 2.5 * 0.8))
    assert path_length(path) == 3.0


def test_the_carrot_may_lie_on_a_circle_about_the_robot():
    path = np.array(((0.0, 0.3, 0.0), (1.0, 0.3, 0.0), (1.0, 2.0, 0.0)))
    x, y = lookahead_point_on_circle(path, 0.5, False)
    assert (x, y) == approx((0.4, 0.3))
    x, y = lookahead_point_on_circle(path, 1.5, False)
    assert (x, math.hypot(x, y)) == approx((1.0, 1.5))
    assert lookahead_point_on_circle(path, 0.2, False) == (0.0, 0.3)
    assert lookahead_point_on_circle(path, 3.0, False) == (1.0, 2.0)
    assert lookahead_point_on_circle(path, 3.0, True) == approx((1.0, math.sqrt(8.0)))
    # (0.6 + 0.6 t)^2 + (-0.2 + 0.8 t)^2 = t^2 + 0.4 t + 0.4 = 2^2
    rest = -0.2 + math.sqrt(0.04 + 3.6)
    for side in (1.0, -1.0):  # to the right and to the left of straight on
        aslant = np.array(((0.0, -1.0, 0.0), (0.6, -0.2, 0.0))) * (side, 1.0, 1.0)
        expected = approx((side * (0.6 + 0.6 * rest), -0.2 + 0.8 * rest))
        assert lookahead_point_on_circle(aslant, 2.0, True) == expected
    # as Nav2, it lies ahead until the goal is half of the distance behind
    for behind, side in ((0.28, 1.0), (0.32, -1.0)):
        passed = np.array(((-0.5, -0.2, 0.0), (-behind, -0.2, 0.0)))
        expected = approx((side * math.sqrt(0.6**2 - 0.2**2), -0.2))
        assert lookahead_point_on_circle(passed, 0.6, True) == expected
    commands = [
        drive(
            make(lookahead_along_path=along, use_rotate_to_heading=False), straight(), 0.0, 0.3, 0.0
        )
        for along in (True, False)
    ]
    curvatures = [command.angular_z / command.linear_x for command in commands]
    assert curvatures == approx([-0.6 / (0.36 + 0.09), -0.6 / 0.36])


def test_the_path_turns_back_at_a_cusp():
    path = np.array(((0.0, 0.0, 0.0), (1.0, 0.5, 0.0), (2.0, 1.0, 0.0), (1.5, 1.0, 0.0)))
    assert distance_to_cusp(path) == approx(math.hypot(2.0, 1.0))
    assert distance_to_cusp(path[:3]) == math.inf
    on_the_spot = np.array(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 1.0), (1.5, 0.0, 1.0)))
    assert distance_to_cusp(on_the_spot) == 1.0
    assert distance_to_cusp(on_the_spot[:3]) == 1.0, "a turn at the end"
    one_heading = np.array(((0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1.0, 0.0, 1.0), (1.5, 0.0, 1.0)))
    assert distance_to_cusp(one_heading) == math.inf, "a pose that stands twice is no turn"


@pytest.mark.parametrize("radius", [0.5, 1.0, 4.0])
def test_on_a_circle_the_curvature_is_the_circles(radius):
    x, y = lookahead_point(arc(radius).poses, 0.4 * radius, False)
    assert arc_curvature(x, y) == approx(1.0 / radius, rel=1e-2)
    assert arc_curvature(x, -y) == -arc_curvature(x, y)
    assert arc_curvature(0.02, 0.02) == 0.0


@pytest.mark.parametrize("seed", range(20))
def test_window_kernel_equals_slow_twin(seed):
    rng = default_rng(seed)
    poses = np.column_stack(
        (rng.normal(0.1, 0.1, (40, 2)).cumsum(axis=0), rng.uniform(-3.0, 3.0, 40))
    )
    first, x, y = int(rng.integers(0, 38)), *rng.uniform(0.0, 4.0, 2)
    search = rng.uniform(0.1, 3.0)
    extent = rng.uniform(1.0, 3.0)
    travelled = np.concatenate(((0.0,), np.hypot(*np.diff(poses[first:, :2], axis=0).T).cumsum()))
    candidates = np.hypot(poses[first:, 0] - x, poses[first:, 1] - y)[travelled <= search]
    nearest = int(candidates.argmin())
    is_last = nearest == len(candidates) - 1 and nearest > 0
    keeps_two = bool(rng.integers(2))
    begin = first + nearest - (keeps_two and is_last)
    far = np.hypot(poses[begin:, 0] - x, poses[begin:, 1] - y) > extent
    end = begin + (int(far.argmax()) if far.any() else len(far))
    assert window_bounds(poses, first, x, y, search, extent, keeps_two) == (begin, end)
    seen = in_base_frame(poses, x, y, 0.7)
    for ours, pose in zip(seen, poses, strict=True):
        np.testing.assert_allclose(
            ours, relative_to(Pose2D(x, y, 0.7), Pose2D(*pose)).as_array(), atol=1e-12
        )


def test_a_turn_on_the_spot_is_passed_where_the_robot_stands():
    """Of poses at one place the last is the nearest: the path goes on from there."""
    turn = [(0.0, 0.0, 0.25 * k) for k in range(7)]
    onward = [(0.0, 0.05 * k, 0.5 * math.pi) for k in range(1, 40)]
    poses = np.array(turn + onward)
    for keeps_two in (False, True):
        assert window_bounds(poses, 0, 0.0, 0.02, 1.0, 3.0, keeps_two) == (6, len(poses))
    for keeps_two, begin in ((False, len(poses) - 1), (True, len(poses) - 2)):
        assert window_bounds(poses, 0, 0.0, 1.95, 5.0, 3.0, keeps_two)[0] == begin


def test_the_window_ends_with_the_costmaps_longer_half_and_forgets_what_is_behind():
    """Half of 80 cells of 0.05 m to every side, and poses every 0.1 m; 3 m is the nearest place."""
    plan = Path(np.column_stack((0.1 * np.arange(101), np.zeros((101, 2)))))
    wide, high = (
        Costmap(np.zeros(shape, dtype=np.uint8), 0.05, 0.0, 0.0) for shape in ((40, 80), (80, 40))
    )
    for costmap, search, begins in (
        (wide, -1.0, 3.0),
        (high, -1.0, 3.0),
        (wide, 2.55, 2.4),
        (wide, None, 1.9),
    ):
        # which looks no farther than so, and for a pose to come from
        window = PathWindow(search, fewest_poses=2, keeps_two=True)
        seen = window.seen_from(Pose2D(3.02, 0.0, math.pi), plan, costmap)
        assert seen[[0, -1], 0] == approx((3.02 - begins, 3.02 - 5.0))
        assert seen[:, 1] == approx(0.0)
        assert seen[:, 2] == approx(-math.pi)
        with pytest.raises(
            InvalidPathError, match=r"farther than 2.00 m from the robot at \(-0.15, 0.00\)"
        ):
            window.seen_from(Pose2D(-0.15), plan, costmap)
        window.reset()
        assert len(window.seen_from(Pose2D(0.0), plan, costmap)) == 21


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        (Twist2D(0.5, 0.0, 0.9), 0.1),
        (Twist2D(-0.02, 0.0, 0.9), 2.5),
        # the farthest corner, 0.4 m away, moves 0.05 m
        (Twist2D(0.0, 0.0, 0.4), 2.0 * math.sin(0.0625) / 0.4),
        (Twist2D(0.009, 0.0, -0.4), 2.0 * math.sin(0.0625) / 0.4),
        (Twist2D(0.005, 0.0, 0.01), 10.0),  # turns too slowly to turn on the spot
        (STILL, math.inf),
    ],
)
def test_between_two_looks_along_an_arc_the_robot_moves_a_cell(command, expected):
    assert ArcCheck(PARAMS, FOOTPRINT, 0.4)._time_step(command, 0.05) == approx(expected)


@pytest.mark.parametrize(
    ("given", "speed", "carrot", "expected"),
    [
        ({}, 0.5, 0.4, (1.0, 0.4)),
        ({"min_distance_to_obstacle": 0.9}, -0.5, 0.4, (1.8, 0.4)),
        # at the least speed of the approach, 0.05 m/s
        ({"min_distance_to_obstacle": 0.9}, 0.01, 0.4, (18.0, 0.4)),
        ({"min_distance_to_obstacle": 0.3}, 0.5, 0.4, (1.0, 0.4)),
        (
            {"min_distance_to_obstacle": 0.3, "min_approach_linear_velocity": 0.0},
            0.0,
            0.4,
            (math.inf, 0.4),
        ),
        (
            {"min_distance_to_obstacle": 0.7, "use_velocity_scaled_lookahead_dist": True},
            0.5,
            0.4,
            (1.4, 0.7),
        ),
        (
            {"min_distance_to_obstacle": 0.7, "use_velocity_scaled_lookahead_dist": True},
            0.5,
            0.8,
            (1.4, 0.8),
        ),
        (
            {"min_distance_to_obstacle": 1.2, "use_velocity_scaled_lookahead_dist": True},
            0.5,
            0.4,
            (2.4, 0.9),
        ),
    ],
)
def test_it_looks_ahead_for_a_time_and_a_distance(given, speed, carrot, expected):
    params = replace(PARAMS, **given)
    assert ArcCheck(params, FOOTPRINT, 0.4)._horizon(speed, carrot) == approx(expected)


def test_a_curve_slows_down_in_proportion_to_its_radius():
    assert speed_in_curve(2.0, 1.0 / 0.45, 0.9) == approx(1.0)
    assert speed_in_curve(2.0, -1.0 / 0.3, 0.9) == approx(2.0 / 3.0)
    assert speed_in_curve(2.0, 1.0, 0.9) == speed_in_curve(2.0, 0.0, 0.9) == 2.0


def test_costs_slow_down_by_the_distance_they_stand_for():
    cost = inflation_cost(0.5, 0.25, 3.0)  # half a metre from an obstacle
    assert speed_near_obstacle(1.0, cost, 0.25, PARAMS) == approx(0.5 / 0.6, rel=0.01)
    assert speed_near_obstacle(1.0, cost, 0.25, replace(PARAMS, cost_scaling_gain=0.5)) == approx(
        0.25 / 0.6, rel=0.01
    )
    assert speed_near_obstacle(1.0, inflation_cost(0.7, 0.25, 3.0), 0.25, PARAMS) == 1.0
    assert (
        speed_near_obstacle(1.0, 0, 0.25, PARAMS)
        == speed_near_obstacle(1.0, NO_INFORMATION, 0.25, PARAMS)
        == 1.0
    )


def test_costs_become_the_distances_of_the_inflation_layer():
    """An inscribed cell's 253 lies at the inscribed radius: 0.25 m, and 252 so much farther out."""
    farther = math.log(253.0 / 252.0) / PARAMS.inflation_cost_scaling_factor
    expected = approx((0.25 + farther) / PARAMS.cost_scaling_dist)
    assert speed_near_obstacle(1.0, 252, 0.25, PARAMS) == expected


def test_the_approach_slows_down_by_the_straight_distance_to_the_end():
    assert speed_on_approach(0.5, straight(0.3).poses, PARAMS) == approx(0.25)
    assert speed_on_approach(0.5, straight(0.7).poses, PARAMS) == 0.5
    assert (
        speed_on_approach(0.5, straight(0.01).poses, PARAMS) == PARAMS.min_approach_linear_velocity
    )
    assert speed_on_approach(0.02, straight(0.01).poses, PARAMS) == 0.02


def test_it_follows_a_circle():
    command = drive(make(), arc(2.0))
    assert command.linear_x == 0.5
    assert command.angular_z == approx(0.25, rel=0.02)


def test_the_lookahead_grows_with_the_speed():
    scaled = make(use_velocity_scaled_lookahead_dist=True, use_rotate_to_heading=False)
    slow, fast = (drive(scaled, straight(), 0.0, 0.2, twist=Twist2D(v)) for v in (0.0, 0.5))
    assert slow.angular_z / slow.linear_x < fast.angular_z / fast.linear_x < 0.0


def test_the_fixed_point_steers_and_may_lie_beyond_the_goal():
    given = {
        "use_rotate_to_heading": False,
        "lookahead_along_path": True,
        "curvature_lookahead_dist": 1.0,
        "use_regulated_linear_velocity_scaling": False,
    }
    plan = straight(0.5)
    free = make(**given)
    fixed = make(**given, use_fixed_curvature_lookahead=True)
    beyond = make(
        **given,
        use_fixed_curvature_lookahead=True,
        interpolate_curvature_after_goal=True,
    )
    commands = [drive(each, plan, 0.0, 0.1) for each in (free, fixed, beyond)]
    curvatures = [command.angular_z / command.linear_x for command in commands]
    assert curvatures[0] == approx(curvatures[1]) == approx(-0.2 / 0.26)
    assert curvatures[2] == approx(-0.2 / 1.01)
    with pytest.raises(InvalidPathError, match="needs 2"):
        drive(beyond, Path(plan.poses[:1]), 0.0, 0.1)


def test_cells_wider_than_the_robot_are_looked_at_one_after_the_other():
    check = ArcCheck(PARAMS, box(0.1, -0.1, 0.1), 0.1)
    coarse = Costmap(np.zeros((8, 8), dtype=np.uint8), 1.0, -4.0, -4.0)
    assert not check.collides(Twist2D(angular_z=1.0), Pose2D(), 1.0, coarse)


def test_beyond_a_single_pose_lies_what_it_looks_at():
    assert beyond(np.array([(1.0, 2.0, 0.5 * math.pi)]), 3.0) == approx((1.0, 5.0))


def test_it_turns_to_a_path_far_off_the_heading_within_the_acceleration():
    command = drive(make(), straight(), 0.0, 0.0, -1.5, twist=Twist2D(angular_z=0.3))
    assert command == Twist2D(angular_z=approx(0.3 + 3.2 / 20.0))
    fast = drive(make(), straight(), 0.0, 0.0, -0.8, twist=Twist2D(angular_z=1.8))
    assert fast.angular_z == 1.8
    assert drive(make(use_rotate_to_heading=False), straight(), 0.0, 0.0, -1.5).linear_x > 0.0


def test_at_the_goal_it_turns_to_the_goals_yaw_and_stays_at_it():
    poses = straight(1.0).poses.copy()
    poses[-1, 2] = 1.0
    plan = Path(poses)
    stateful = make()
    stateless = make(stateful=False)
    for controller in (stateful, stateless):
        assert drive(controller, plan, 0.7).linear_x > 0.0
        assert drive(controller, plan, 0.8) == Twist2D(angular_z=approx(0.16))
    slow = drive(stateful, plan, 0.8, 0.0, 0.999, twist=Twist2D(angular_z=0.2))
    assert slow.angular_z == approx(math.sqrt(2.0 * 3.2 * 0.001))
    assert drive(stateful, plan, 0.7).linear_x == 0.0  # drifted out again
    assert drive(stateless, plan, 0.7).linear_x > 0.0
    assert drive(stateful, Path(poses), 0.7).linear_x > 0.0  # a new plan
    drive(stateful, plan, 0.8)
    stateful.reset()
    assert drive(stateful, plan, 0.7).linear_x > 0.0


def test_it_reverses_up_to_the_cusp():
    poses = straight(-1.0).poses.copy()
    forward = straight(2.0).poses[1:] + (-1.0, 0.1, 0.0)
    plan = Path(np.vstack((poses, forward)))
    backwards = make(allow_reversing=True, use_rotate_to_heading=False)
    assert drive(backwards, plan).linear_x < 0.0
    assert drive(backwards, plan, -0.95).linear_x < 0.0  # the carrot stays at the cusp
    assert drive(make(use_rotate_to_heading=False), plan).linear_x > 0.0
    turned = make(allow_reversing=True)
    # its back points along the path
    assert drive(turned, straight(-3.0), 0.0, 0.0, 0.2).linear_x < 0.0


def test_what_has_been_passed_is_forgotten_until_the_next_plan():
    there_and_back = np.vstack(
        (straight(2.0).poses, straight(2.0).poses[::-1] + (0.0, 0.3, math.pi))
    )
    plan = Path(there_and_back)
    controller = make(max_robot_pose_search_dist=0.5, use_rotate_to_heading=False)
    for x in (0.0, 0.4, 0.8):
        # not taken for the way back
        assert abs(drive(controller, plan, x).angular_z) < 1e-9
    with pytest.raises(InvalidPathError, match="farther than"):
        drive(make(), straight(), 0.0, -3.0 - 4.0)
    with pytest.raises(InvalidPathError, match="0 poses"):
        drive(make(), Path(np.empty((0, 3))), 0.0, 0.0, 0.0)


def test_a_speed_limit_holds_until_it_is_lifted():
    controller = make()
    for limit, is_percentage, expected in ((0.3, False, 0.3), (80.0, True, 0.4), (0.0, False, 0.5)):
        controller.set_speed_limit(limit, is_percentage)
        controller.reset()
        assert drive(controller, straight()).linear_x == approx(expected)


def test_it_refuses_to_drive_into_an_obstacle():
    state = robot()
    # front at 0.3 m, 0.5 m in a second
    for x, is_free in ((0.2, False), (0.7, False), (1.2, True)):
        ahead = ground_with((x, 0.0), (x, 0.25), (x, -0.25))
        if is_free:
            assert command_of(make(), state, around=ahead).linear_x == 0.5
        else:
            with pytest.raises(NoLegalVelocity, match="collision ahead"):
                command_of(make(), state, around=ahead)
        assert command_of(make(use_collision_detection=False), state, around=ahead).linear_x == 0.5
    longer = make(min_distance_to_obstacle=0.9, use_velocity_scaled_lookahead_dist=True)
    with pytest.raises(NoLegalVelocity):
        command_of(longer, state, around=ground_with((1.0, 0.0), (1.0, 0.25), (1.0, -0.25)))


def test_unknown_cells_are_no_obstacles_and_the_carrot_ends_the_look():
    unknown = ground_with((0.6, 0.0), (0.6, 0.25), (0.6, -0.25), cost=NO_INFORMATION)
    assert command_of(make(), around=unknown).linear_x == 0.5
    check = ArcCheck(PARAMS, FOOTPRINT, 0.39)
    wall = ground_with((0.6, 0.25), (0.6, 0.0), (0.6, -0.25)).costmap
    assert check.collides(Twist2D(0.5), Pose2D(), 0.5, wall)
    assert not check.collides(Twist2D(0.5), Pose2D(), 0.2, wall)
    assert not check.collides(STILL, Pose2D(), 0.5, wall)


@pytest.mark.parametrize("seed", range(12))
def test_arc_kernel_equals_slow_twin(seed):
    rng = default_rng(seed)
    costmap = ground_with(*rng.uniform(-1.5, 1.5, (5, 2))).costmap
    speed, yaw_rate, carrot = rng.uniform((0.05, -1.5, 0.1), (1.0, 1.5, 1.0))
    step = costmap.resolution / speed
    poses = [(0.0, 0.0, 0.0)]
    x = 0.0
    y = 0.0
    yaw = 0.0
    count = 1
    while count * step < PARAMS.max_allowed_time_to_collision_up_to_carrot:
        count += 1
        x = x + step * speed * math.cos(yaw)
        y = y + step * speed * math.sin(yaw)
        yaw = yaw + step * yaw_rate
        if math.hypot(x, y) > carrot:
            break
        poses.append((x, y, yaw))
    expected = any(
        footprint_cost(costmap, FOOTPRINT, Pose2D(*pose)) >= LETHAL_OBSTACLE for pose in poses
    )
    ours = ArcCheck(PARAMS, FOOTPRINT, 0.39).collides(
        Twist2D(speed, 0.0, yaw_rate), Pose2D(), carrot, costmap
    )
    assert ours == expected


def test_a_robot_off_its_costmap_is_told_so():
    plan = Path(straight().poses + (3.0, 0.0, 0.0))
    with pytest.raises(ControlError, match="off the local costmap"):
        drive(make(), plan, 4.2)


@pytest.mark.parametrize(
    "wrong",
    [
        {"lookahead_dist": 0.0},
        {"max_lookahead_dist": 0.1},
        {"approach_velocity_scaling_dist": -1.0},
    ],
)
def test_impossible_parameters_are_refused(wrong):
    with pytest.raises(ParameterError, match=next(iter(wrong))):
        RppParams(**wrong)


def test_without_a_scaling_factor_costs_do_not_count():
    near = ground_with((0.0, 0.0), cost=200)
    state = robot()
    assert command_of(make(), state, around=near).linear_x < 0.5
    assert command_of(make(inflation_cost_scaling_factor=0.0), state, around=near).linear_x == 0.5


SHIM = """
controller_server:
  ros__parameters:
    controller_plugins: ["FollowPath"]
    FollowPath:
      plugin: "nav2_rotation_shim_controller::RotationShimController"
      primary_controller: "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
      angular_dist_threshold: 0.5
      desired_linear_vel: 0.8
      rotate_to_heading_angular_vel: 1.1
"""


def test_it_runs_below_a_rotation_shim(tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_text(SHIM)
    file = load_nav2(path)
    primary = read_primary_controller(file, read_controller(file))
    assert primary.params == RppParams(desired_linear_vel=0.8, rotate_to_heading_angular_vel=1.1)
    parts = {"footprint": FOOTPRINT, "control_frequency": 20.0, "xy_goal_tolerance": 0.25}
    below = algorithms("controllers")[primary.type].create(primary.params, parts=parts)
    assert command_of(below).linear_x == 0.8

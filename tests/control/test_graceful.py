"""The graceful controller: its control law, its rules, and its place in a Nav2 file."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx

from navstack.control.graceful import graceful_controller
from navstack.control.graceful.control_law import (
    Law,
    LocalGround,
    drive_to,
    turn_on_the_spot,
    velocity_to,
)
from navstack.control.graceful.graceful_controller import (
    COLLISION_AHEAD,
    GracefulController,
    add_orientations,
)
from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE
from navstack.errors import InvalidPathError, NoLegalVelocity, ParameterError
from navstack.params.extensions import algorithms
from navstack.params.graceful import GracefulParams
from navstack.params.local_costs import LocalCosts
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.views import read_controller
from navstack.types import Path, Pose2D, RobotState, Twist2D

from .given import box, command_of, ground_with, straight

FOOTPRINT = box(0.3, -0.3, 0.25)
PARAMS = GracefulParams()
LAW = Law(2.0, 1.0, 0.4, 2.0, 0.1, 0.5, 1.0, 1.5, 0.5, 0.25, 0.75)


def make(**given):
    return GracefulController(replace(PARAMS, **given), FOOTPRINT, 20.0, xy_goal_tolerance=0.25)


def drive(controller, plan, *pose, around=None):
    return command_of(
        controller, RobotState(Pose2D(*pose), Twist2D()), plan, around or ground_with()
    )


def test_the_law_is_the_papers():
    """Equations 13 and 15, with angles as the paper measures them.

    From the line of sight to the headings.
    """
    target = (2.0, 1.0, 0.7)
    pose = (0.5, -0.5, 0.2)
    distance = math.hypot(1.5, 1.5)
    theta = 0.7 - math.pi / 4.0
    delta = 0.2 - math.pi / 4.0
    bend = (
        -1.0
        / distance
        * (
            1.0 * (delta - math.atan(-2.0 * theta))
            + (1.0 + 2.0 / (1.0 + (2.0 * theta) ** 2)) * math.sin(delta)
        )
    )
    speed = 0.5 / (1.0 + 0.4 * bend**2)
    assert velocity_to(target, pose, False, LAW) == approx((speed, bend * speed))


def test_the_law_slows_down_near_the_target_and_in_tight_curves():
    assert velocity_to((3.0, 0.0, 0.0), (0.0, 0.0, 0.0), False, LAW) == (0.5, 0.0)
    assert velocity_to((0.75, 0.0, 0.0), (0.0, 0.0, 0.0), False, LAW)[0] == approx(0.25)
    assert velocity_to((0.1, 0.0, 0.0), (0.0, 0.0, 0.0), False, LAW)[0] == 0.1
    assert (
        velocity_to((0.1, 0.0, 0.0), (0.0, 0.0, 0.0), False, LAW._replace(slowdown_radius=0.0))[0]
        == 0.5
    )
    speed, turn = velocity_to((0.0, 0.1, 1.57), (0.0, 0.0, 0.0), False, LAW)
    assert turn == 1.0  # the limit; the speed keeps to the curve
    assert 0.0 < speed < 0.1


def test_what_lies_behind_the_target_stops_nobody():
    costmap = ground_with((1.38, 0.0)).costmap
    ground = LocalGround(costmap.data, costmap.grid, FOOTPRINT, False, (0.0, 0.0, 0.0))
    # with it the robot is hardly there within three times the way
    law = LAW._replace(slowdown_radius=0.0)
    assert [drive_to((x, 0.0, 0.0), False, False, True, law, ground)[0] for x in (1.0, 1.2)] == [
        True,
        False,
    ]


def test_backwards_is_the_mirror_of_forwards():
    speed, turn = velocity_to((1.5, 0.4, 0.3), (0.0, 0.0, 0.0), False, LAW)
    mirrored = velocity_to((-1.5, 0.4, -0.3), (0.0, 0.0, 0.0), True, LAW)
    assert mirrored == approx((-speed, -turn))


@pytest.mark.parametrize(
    "start", [(0.0, 1.0, 0.0), (0.0, -1.0, 1.0), (-1.0, 2.0, -1.5), (1.0, 0.5, 2.0)]
)
def test_the_law_leads_to_the_pose(start):
    """Exponentially stable: from wherever it begins, the robot ends at the target with its yaw."""
    x, y, yaw = start
    law = LAW._replace(v_linear_min=0.0)
    for _ in range(6000):
        speed, turn = velocity_to((3.0, 0.0, 0.0), (x, y, yaw), False, law)
        x = x + 0.01 * speed * math.cos(yaw)
        y = y + 0.01 * speed * math.sin(yaw)
        yaw = yaw + 0.01 * turn
    assert math.hypot(3.0 - x, y) < 0.02
    assert abs(math.remainder(yaw, 2.0 * math.pi)) < 0.05


def test_turns_on_the_spot_have_a_least_rate():
    assert turn_on_the_spot(1.2, LAW) == approx(0.6)
    assert turn_on_the_spot(-0.1, LAW) == -0.25


def test_on_a_straight_path_it_drives_straight():
    command = drive(make(), straight())
    assert command.angular_z == approx(0.0, abs=1e-9)
    # slows down for the pose 1 m ahead, as upstream
    assert command.linear_x == approx(0.5 * 1.0 / 1.5)
    assert drive(make(slowdown_radius=0.5), straight()).linear_x == 0.5


def test_a_new_path_is_turned_to_first():
    sideways = straight(yaw=1.5)
    controller = make()
    assert drive(controller, sideways) == Twist2D(angular_z=approx(0.5 * 1.5))
    assert drive(controller, sideways, 0.0, 0.0, 1.0).linear_x > 0.0  # 0.5 rad are left
    assert drive(controller, sideways).linear_x > 0.0  # not again on the same path
    assert drive(controller, straight(yaw=1.5)).linear_x == 0.0  # on a new one
    assert drive(make(initial_rotation=False), sideways).linear_x > 0.0


def test_it_takes_the_farthest_target_without_an_obstacle_on_the_way():
    controller = make(initial_rotation=False, min_lookahead=0.0)
    free = drive(controller, straight())
    assert controller.decision.samples == 1
    assert controller.decision.rejected == 0
    # the nose reaches 0.3 m ahead
    near = drive(controller, straight(), around=ground_with((1.1, 0.0)))
    assert 0.0 < near.linear_x < free.linear_x
    assert controller.decision.rejected == controller.decision.samples - 1 > 0
    assert (
        drive(make(use_collision_detection=False), straight(), around=ground_with((0.9, 0.0)))
        == free
    )


def test_it_gives_up_where_no_target_far_enough_can_be_reached():
    controller = make(min_lookahead=0.5)
    with pytest.raises(NoLegalVelocity) as told:
        drive(controller, straight(), around=ground_with((0.6, 0.0)))
    assert told.value.rejections[COLLISION_AHEAD] == controller.decision.rejected > 0
    assert controller.decision.command == Twist2D()
    assert drive(make(min_lookahead=0.1), straight(), around=ground_with((0.6, 0.0))).linear_x > 0.0


def test_at_the_end_of_the_path_it_drives_straight_and_turns_there():
    bent = straight(0.8)
    bent.poses[-1, 2] = 1.5
    assert drive(make(), bent).angular_z == approx(0.0, abs=1e-9)
    assert abs(drive(make(prefer_final_rotation=False), bent).angular_z) > 0.1
    controller = make()
    assert drive(controller, bent, 0.7) == Twist2D(angular_z=approx(0.75))
    # once there it turns, even if it drifts out again
    assert drive(controller, bent, 0.4).linear_x == 0.0
    wall = ground_with(*((0.7, side) for side in (-0.32, 0.32)))
    assert drive(make(), bent, 0.7, around=wall).linear_x > 0.0  # no room to turn
    assert drive(make(use_collision_detection=False), bent, 0.7, around=wall).linear_x == 0.0


@pytest.mark.parametrize(("length", "ends"), [(1.0, False), (0.875, True)])
def test_a_path_ends_within_the_greatest_lookahead(length, ends):
    """Only there the robot drives straight to the last pose, whatever its yaw."""
    plan = Path(np.zeros((round(8.0 * length) + 1, 3)))
    plan.poses[:, 0] = np.linspace(0.0, length, len(plan))
    plan.poses[-1, 2] = 1.5
    assert (drive(make(), plan).angular_z == approx(0.0, abs=1e-9)) == ends


def test_of_a_round_robot_its_centres_cost_counts():
    """Along an inscribed cell, which the outline passes: not so for a robot with a footprint."""
    inscribed = ground_with((0.5, 0.0), cost=INSCRIBED_INFLATED_OBSTACLE)
    lethal = ground_with((-0.2, 0.2))
    costs = LocalCosts(is_round=True)
    for around, passes, passes_round in ((inscribed, True, False), (lethal, False, True)):
        for given, free in (({}, passes), ({"local_costs": costs}, passes_round)):
            controller = make(initial_rotation=False, min_lookahead=0.9, **given)
            if free:
                assert drive(controller, straight(), around=around).linear_x > 0.0
            else:
                with pytest.raises(NoLegalVelocity):
                    drive(controller, straight(), around=around)


def test_at_the_last_pose_it_turns_to_the_goals_yaw():
    plan = Path(np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 1.5)]))
    command = drive(make(), plan, 1.9)
    assert command == Twist2D(angular_z=approx(0.5 * 1.5))


def test_a_turn_at_the_goal_is_looked_at_every_few_degrees(monkeypatch):
    looks = []
    monkeypatch.setattr(
        graceful_controller,
        "can_turn",
        lambda angle, count, ground: looks.append((angle, count)) or True,
    )
    for yaw in (0.05, -0.31, 1.5):
        plan = straight(0.8)
        plan.poses[-1, 2] = yaw
        drive(make(in_place_collision_resolution=0.1), plan, 0.7)
    assert looks == [(approx(0.05), 1), (approx(-0.31), 3), (approx(1.5), 15)]


def test_backwards_only_where_no_turn_is_asked_for():
    behind = straight(yaw=math.pi)
    assert drive(make(allow_backward=True, initial_rotation=False), behind).linear_x < 0.0
    # Nav2 takes the turn where both are given
    assert drive(make(allow_backward=True), behind).linear_x == 0.0


def test_speed_limits_are_upstreams():
    controller = make(slowdown_radius=0.5)
    for limit, is_percentage, speed, rate in (
        (0.25, False, 0.25, 0.5),
        (50.0, True, 0.25, 0.5),
        (0.05, False, 0.1, 0.1),
        (0.0, False, 0.5, 1.0),
    ):
        controller.set_speed_limit(limit, is_percentage)
        assert drive(controller, straight()).linear_x == approx(speed)
        turn = drive(controller, straight(yaw=2.0)).angular_z
        assert turn == approx(max(0.5 * 2.0 * rate, 0.25))


def test_paths_without_orientations_get_them():
    path = np.array(((0.0, 0.0, 0.5), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 2.0)))
    add_orientations(path)
    assert_allclose(path[:, 2], (0.0, math.pi / 2.0, math.pi, 2.0))
    turned = np.array(((0.0, 0.0, 0.5), (1.0, 0.0, 0.3), (1.0, 1.0, 0.1), (0.0, 1.0, 2.0)))
    before = turned.copy()
    add_orientations(turned)
    assert_array_equal(turned, before)
    add_orientations(turned[:2])
    assert_array_equal(turned, before)


def test_it_follows_a_bend_within_a_few_centimetres():
    turn = np.linspace(0.0, 1.5, 61)
    plan = Path(np.column_stack((1.5 * np.sin(turn), 1.5 * (1.0 - np.cos(turn)), turn)))
    controller = make()
    x = 0.0
    y = 0.0
    yaw = 0.0
    apart = []
    for _ in range(200):
        command = drive(controller, plan, x, y, yaw)
        x += 0.05 * command.linear_x * math.cos(yaw)
        y += 0.05 * command.linear_x * math.sin(yaw)
        yaw += 0.05 * command.angular_z
        apart.append(float(np.hypot(plan.poses[:, 0] - x, plan.poses[:, 1] - y).min()))
    assert max(apart) < 0.1
    assert abs(yaw - 1.5) < 0.02
    assert math.hypot(x - plan.poses[-1, 0], y - plan.poses[-1, 1]) < 0.25


def test_an_empty_plan_is_told():
    with pytest.raises(InvalidPathError, match="this controller needs 1"):
        drive(make(), Path(np.empty((0, 3))))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"v_linear_max": 0.0}, "v_linear_max 0.0 must be more than 0"),
        ({"lambda_": -1.0}, "lambda -1.0 must be 0 or more"),
        ({"min_lookahead": -0.1}, "min_lookahead -0.1 must be 0 or more"),
    ],
)
def test_values_out_of_range_are_named(given, message):
    with pytest.raises(ParameterError, match=message):
        replace(PARAMS, **given)


FILE = """controller_server:
  ros__parameters:
    controller_plugins: ["FollowPath"]
    FollowPath:
      plugin: "nav2_graceful_controller::GracefulController"
      lambda: 1.5
      max_lookahead: 0.8
      k_phi: 3.0
"""


def test_a_nav2_file_names_its_parameters(tmp_path):
    (tmp_path / "nav2.yaml").write_text(FILE)
    file = load_nav2(tmp_path / "nav2.yaml")
    plugin = read_controller(file)
    given = GracefulParams(lambda_=1.5, max_lookahead=0.8, k_phi=3.0)
    assert replace(plugin.params, local_costs=given.local_costs) == given
    assert plugin.params.local_costs.is_round
    assert algorithms("controllers")[plugin.type].params is GracefulParams
    (tmp_path / "bad.yaml").write_text(FILE.replace("lambda: 1.5", "lambda: steep"))
    with pytest.raises(ParameterError, match=r"FollowPath\.lambda: 'steep' is not a number"):
        load_nav2(tmp_path / "bad.yaml")

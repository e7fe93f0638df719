"""The branches of the rotation shim that no recorded rollout takes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.random import default_rng
from pytest import approx

from navstack.control.controller import Controller, Surroundings
from navstack.control.rotation_shim import RotationShimController
from navstack.costmap.costmap import Costmap
from navstack.params.rotation_shim import RotationShimParams
from navstack.types import Path, Pose2D, Twist2D

from .given import DELIVERY_ROBOT, OPEN, command_of, ground_with, robot, straight

PRIMARY = Twist2D(99.0, 0.0, 0.25)
PARAMS = RotationShimParams(
    angular_dist_threshold=1.0472,
    angular_disengage_threshold=0.1745,
    forward_sampling_distance=1.0,
    rotate_to_heading_angular_vel=1.0,
    max_angular_accel=2.5,
    simulate_ahead_time=1.5,
    closed_loop=False,
)


class Primary(Controller):
    """Always the same command."""

    def __init__(self):
        self.resets = self.resumed = 0

    def reset(self):
        self.resets += 1

    def resume(self):
        self.resumed += 1

    def compute_velocity(self, state, plan, surroundings):
        return PRIMARY


def make(params=PARAMS, frequency=30.0):
    return RotationShimController(
        params, Primary(), DELIVERY_ROBOT, frequency, xy_goal_tolerance=0.25
    )


def test_a_predicted_collision_hands_over_until_the_next_plan():
    shim = make()
    state = robot(yaw=-2.0)
    blocked = ground_with((0.42, 0.57))  # the tail sweeps over it
    plan = straight()
    assert command_of(shim, state, plan).linear_x == 0.0
    shim.reset()
    assert command_of(shim, state, plan, ground_with((0.5, 2.0))).linear_x == 0.0
    shim.reset()
    turning = robot(yaw=-2.0, w=1.0)
    closed = make(replace(PARAMS, closed_loop=True))
    assert command_of(closed, turning, plan, blocked) == PRIMARY
    # the same plan is not looked at again
    assert command_of(closed, turning, plan) == PRIMARY
    assert command_of(closed, turning).angular_z == 1.0


def test_a_turn_over_too_high_a_cost_hands_over():
    state = robot(yaw=-2.0)
    costly = Costmap(np.full((60, 100), 200, dtype=np.uint8), 0.05, -1.0, -1.5)
    unknown = Costmap(np.full((60, 100), 255, dtype=np.uint8), 0.05, -1.0, -1.5)
    for threshold, costmap, turns in (
        (254.0, costly, True),
        (201.0, costly, True),
        (200.0, costly, False),
        (300.0, costly, True),
        (300.0, unknown, False),
    ):
        shim = make(replace(PARAMS, max_cost_threshold=threshold))
        around = Surroundings(costmap)
        assert (command_of(shim, state, straight(), around) != PRIMARY) is turns


def test_open_loop_accelerates_from_its_last_command_and_closed_loop_from_the_measurement():
    still = robot(yaw=2.0)
    step = 2.5 / 30.0
    for closed_loop, expected in (
        (False, [-step, -2 * step, -3 * step]),
        (True, [-step, -step, -step]),
    ):
        shim = make(replace(PARAMS, closed_loop=closed_loop))
        plan = straight()
        rates = [command_of(shim, still, plan).angular_z for _ in range(3)]
        assert rates == approx(expected)


def test_it_turns_to_the_goals_heading_within_the_tolerance_and_stays_at_it():
    poses = straight(1.0).poses.copy()
    poses[-1, 2] = 1.5
    shim = make(replace(PARAMS, rotate_to_goal_heading=True))
    plan = Path(poses)
    far = robot(0.7)
    near = robot(0.8)
    assert command_of(shim, far, plan) == PRIMARY
    turn = command_of(shim, near, plan)
    assert turn.linear_x == 0.0
    assert turn.angular_z > 0.0
    drifted = command_of(shim, far, plan)
    assert drifted.linear_x == 0.0
    # not asked for
    assert command_of(make(), near, plan) == PRIMARY


def test_rotate_to_heading_once_looks_again_only_for_another_goal():
    once = make(replace(PARAMS, rotate_to_heading_once=True))
    along = robot()
    across = robot(yaw=2.0)
    assert command_of(once, along) == PRIMARY
    assert command_of(once, across) == PRIMARY
    assert command_of(once, across, straight(2.0)).linear_x == 0.0
    assert command_of(make(), across).linear_x == 0.0


def test_a_turn_begins_at_rest_after_a_time_in_which_it_was_not_asked():
    shim = make()
    plan = straight()
    state = robot(yaw=-2.0)
    rates = [command_of(shim, state, plan).angular_z for _ in range(3)]
    shim.resume()
    assert command_of(shim, state, plan).angular_z == rates[0]


def test_a_turn_goes_on_in_the_next_attempt_and_ends_with_the_navigation():
    shim = make()
    plan = straight()
    assert command_of(shim, robot(yaw=-2.0), plan).linear_x == 0.0
    near = robot(yaw=-0.6)  # between the thresholds
    shim.reset()
    assert command_of(shim, near, plan).linear_x == 0.0
    shim.seed(default_rng(0))
    shim.reset()
    assert command_of(shim, near, plan) == PRIMARY


def test_rotate_to_heading_once_does_not_turn_again_in_the_next_attempt_to_the_same_goal():
    once = make(replace(PARAMS, rotate_to_heading_once=True))
    along = robot()
    across = robot(yaw=2.0)
    assert command_of(once, along) == PRIMARY
    once.reset()
    assert command_of(once, across) == PRIMARY
    once.seed(default_rng(0))
    once.reset()
    assert command_of(once, across).linear_x == 0.0


def test_path_orientations_may_give_the_heading():
    poses = straight().poses.copy()
    poses[:, 2] = math.pi / 2.0
    state = robot()
    plan = Path(poses)
    assert command_of(make(), state, plan) == PRIMARY
    by_orientation = make(replace(PARAMS, use_path_orientations=True))
    assert command_of(by_orientation, state, plan).angular_z > 0.0


def test_a_plan_shorter_than_the_sampling_distance_is_looked_at_its_end():
    plan = Path(np.array(((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1, 0.1, 0.0))))
    assert make()._heading_error(Pose2D(0.0, 0.0, 0.2), plan) == approx(math.pi / 4.0 - 0.2)


def test_a_plan_is_looked_at_its_first_point_at_the_sampling_distance():
    plan = Path(np.array(((0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.5, 0.0, 0.0))))
    assert make()._heading_error(Pose2D(0.0, 0.0, 0.2), plan) == approx(math.pi / 2.0 - 0.2)


@pytest.mark.parametrize(
    ("error", "last", "yaw_rate"),
    [
        (1.5, 0.0, 0.1),
        (1.5, 0.95, 1.0),
        (-1.5, 0.0, -0.1),
        (-1.5, 0.5, 0.4),
        (1.5, -0.5, -0.4),
        (0.06, 0.9, 0.6),  # as fast as it can still stop
    ],
)
def test_turns_keep_to_the_acceleration_and_can_be_stopped_in_time(error, last, yaw_rate):
    params = replace(
        PARAMS,
        rotate_to_heading_angular_vel=1.0,
        max_angular_accel=3.0,
        closed_loop=False,
    )
    shim = make(params, 30.0)
    shim._last_yaw_rate = last
    command = shim._safe_turn(error, robot(), OPEN.costmap)
    assert command == Twist2D(angular_z=approx(yaw_rate))


def test_a_plan_of_one_pose_reset_and_resume_reach_the_primary():
    primary = Primary()
    shim = RotationShimController(PARAMS, primary, DELIVERY_ROBOT, 30.0, 0.25)
    state = robot(yaw=2.0)
    assert command_of(shim, state, Path(np.zeros((1, 3)))) == PRIMARY
    before = primary.resets
    shim.reset()
    shim.resume()
    assert primary.resets == before + 1
    assert primary.resumed == 1


def test_it_acts_at_rest_where_its_primary_does():
    primary = Primary()
    primary.acts_at_rest = True
    shim = RotationShimController(PARAMS, primary, DELIVERY_ROBOT, 30.0, 0.25)
    assert shim.acts_at_rest and not make().acts_at_rest

import dataclasses

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navstack.control.controller import Controller
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.dwb.rollouts import RolloutGenerator
from navstack.control.rotation_shim import RotationShimController
from navstack.errors import ParameterError
from navstack.params.dwb import DwbParams
from navstack.params.rotation_shim import RotationShimParams
from navstack.types import Twist2D

from .given import SMALL_ROBOT, ground_with, robot, server_of, straight

PARAMS = DwbParams(
    min_vel_x=-0.4,
    max_vel_x=3.0,
    max_vel_y=0.6,
    max_vel_theta=1.2,
    max_speed_xy=2.5,
    acc_lim_x=50.0,
    acc_lim_y=50.0,
    acc_lim_theta=50.0,
    decel_lim_x=-50.0,
    decel_lim_y=-50.0,
    decel_lim_theta=-50.0,
    critics=("PathDist", "GoalDist"),
    linear_granularity=0.05,
)


def limited(limit, is_percentage):
    """What KinematicsHandler::setSpeedLimit makes of the parameters, written down by hand."""
    share = limit / 100.0 if is_percentage else limit / PARAMS.max_speed_xy
    names = ("max_vel_x", "max_vel_y", "max_vel_theta", "max_speed_xy")
    return dataclasses.replace(PARAMS, **{name: getattr(PARAMS, name) * share for name in names})


@pytest.mark.parametrize(
    ("limit", "is_percentage"), [(50.0, True), (10.0, True), (100.0, True), (1.0, False)]
)
@pytest.mark.parametrize("speed", [0.0, 1.2])
def test_dwb_samples_as_if_its_limits_were_lower(limit, is_percentage, speed):
    sampler = RolloutGenerator(PARAMS, 20.0)
    sampler.limit_speed(limit, is_percentage)
    expected = RolloutGenerator(limited(limit, is_percentage), 20.0).sample(Twist2D(speed))
    assert_allclose(sampler.sample(Twist2D(speed)), expected, atol=1e-12)


def test_no_limit_restores_and_a_limit_above_the_largest_speed_changes_nothing():
    free = RolloutGenerator(PARAMS, 20.0)
    sampler = RolloutGenerator(PARAMS, 20.0)
    sampler.limit_speed(2.5, False)
    assert_array_equal(sampler.sample(Twist2D()), free.sample(Twist2D()))
    sampler.limit_speed(0.5, False)
    slow = sampler.sample(Twist2D())
    assert np.hypot(slow[:, 0], slow[:, 1]).max() <= 0.5 + 1e-4
    sampler.limit_speed(9.0, False)  # as upstream the earlier limit stays
    assert_array_equal(sampler.sample(Twist2D()), slow)
    sampler.limit_speed(0.0, False)
    assert_array_equal(sampler.sample(Twist2D()), free.sample(Twist2D()))
    sampler.limit_speed(20.0, True)
    sampler.limit_speed(40.0, True)  # shares of the parameters, not of each other
    assert sampler.sample(Twist2D())[:, 0].max() == pytest.approx(0.4 * 2.5, abs=0.2)
    sampler.limit_speed(0.0, True)
    assert_array_equal(sampler.sample(Twist2D()), free.sample(Twist2D()))


@pytest.mark.parametrize("has_shim", [False, True])
def test_the_limit_outlives_a_new_goal(has_shim):
    controller = DwbController(PARAMS, SMALL_ROBOT, 20.0)
    if has_shim:
        controller = RotationShimController(
            RotationShimParams(), controller, SMALL_ROBOT, 20.0, 0.25
        )
    server = server_of(controller)
    plan = straight(4.0, count=81)
    speeds = []
    for limit in (0.0, 20.0, 0.0):
        controller.set_speed_limit(limit, True)
        server.begin(plan, 0.0)
        speeds.append(server.compute_command(robot(v=1.0), ground_with(cells=200)).linear_x)
    assert speeds[1] == pytest.approx(0.2 * 2.5, abs=0.05)
    assert speeds[0] == speeds[2] > 1.1  # the 2 m of plan that it sees, in sim_time


class Unlimited(Controller):
    """Knows no speed limit."""

    def reset(self): ...

    def compute_velocity(self, state, plan, surroundings):
        return Twist2D()


def test_a_controller_that_cannot_limit_its_speed_says_so():
    with pytest.raises(
        ParameterError, match="Unlimited knows no speed limit, and a speed filter asks for 30%"
    ):
        Unlimited().set_speed_limit(30.0, True)

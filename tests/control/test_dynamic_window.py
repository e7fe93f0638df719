"""Dynamic Window Pure Pursuit.

The chosen velocity against a fine search, and what the wheels are asked for.
"""

import itertools
import math

import numpy as np
import pytest
from pytest import approx

from navstack.control.rpp.dynamic_window import VelocityWindow, best_velocity, reachable, regulated
from navstack.control.rpp.rpp_controller import RegulatedPurePursuitController
from navstack.errors import ParameterError
from navstack.params.rpp import RppParams
from navstack.types import Path, Pose2D, RobotState, Twist2D

from .given import box, ground_with, moved

FOOTPRINT = box(0.3, -0.3, 0.2)
PERIOD = 0.05
LIMITS = {
    "max_linear_accel": 0.8,
    "max_linear_decel": -1.2,
    "max_angular_accel": 1.5,
    "max_angular_decel": -2.0,
    "max_angular_vel": 1.0,
}


def test_what_can_be_reached_in_a_cycle():
    params = RppParams(desired_linear_vel=1.0, **LIMITS)
    ahead = reachable(Twist2D(0.5, 0.0, -0.4), params, PERIOD)
    assert ahead == approx((0.5 - 0.06, 0.5 + 0.04, -0.4 - 0.075, -0.4 + 0.1))
    still = reachable(Twist2D(), params, PERIOD)
    assert still == approx((-0.04, 0.04, -0.075, 0.075))
    fast = reachable(Twist2D(0.99, 0.0, 0.98), params, PERIOD)
    assert fast.max_v == 1.0
    assert fast.max_w == 1.0


def test_regulation_cuts_the_window_to_what_is_nearest():
    window = VelocityWindow(0.2, 0.4, -1.0, 1.0)
    assert regulated(window, 0.3)[:2] == (0.2, 0.3)
    assert regulated(window, 0.1)[:2] == (0.2, 0.2)
    assert regulated(window, -0.5)[:2] == (0.2, 0.2)
    assert regulated(VelocityWindow(-0.4, -0.2, -1.0, 1.0), -0.3)[:2] == (-0.3, -0.2)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_the_best_velocity_is_that_of_a_fine_search(direction):
    rng = np.random.default_rng(4)
    on_the_arc = 0
    for _ in range(300):
        v = rng.uniform(-0.6, 0.6)
        w = rng.uniform(-1.0, 1.0)
        window = VelocityWindow(v, v + rng.uniform(0.02, 0.3), w, w + rng.uniform(0.05, 0.5))
        curvature = rng.uniform(-3.0, 3.0)
        best = best_velocity(window, curvature, direction)
        assert window.min_v - 1e-12 <= best.linear_x <= window.max_v + 1e-12
        assert window.min_w - 1e-12 <= best.angular_z <= window.max_w + 1e-12
        speeds = np.linspace(window.min_v, window.max_v, 400)
        crossing = speeds[
            (curvature * speeds >= window.min_w) & (curvature * speeds <= window.max_w)
        ]
        if len(crossing):
            on_the_arc += 1
            assert best.angular_z == approx(curvature * best.linear_x, abs=1e-9)
            assert best.linear_x * direction >= (crossing * direction).max() - 1e-9
        else:
            grid = itertools.product(np.linspace(*window[:2], 20), np.linspace(*window[2:], 20))
            nearest = min(abs(curvature * a - b) for a, b in grid)
            off = abs(curvature * best.linear_x - best.angular_z)
            assert off <= nearest + 1e-3 * math.hypot(curvature, 1.0) + 1e-9
    assert 50 < on_the_arc < 250


def test_straight_on_the_yaw_rate_is_the_least_that_can_be():
    assert best_velocity(VelocityWindow(0.1, 0.3, 0.2, 0.4), 0.0, 1.0) == Twist2D(0.3, 0.0, 0.2)
    assert best_velocity(VelocityWindow(0.1, 0.3, -0.4, -0.2), 0.0, -1.0) == Twist2D(0.1, 0.0, -0.2)
    assert best_velocity(VelocityWindow(0.1, 0.3, -0.4, 0.2), 0.0, 1.0).angular_z == 0.0


def drive(**given):
    """The commands of 60 cycles on a path that bends sharply, by a robot that does as told."""
    params = RppParams(
        desired_linear_vel=0.8,
        use_rotate_to_heading=False,
        use_collision_detection=False,
        **LIMITS,
        **given,
    )
    controller = RegulatedPurePursuitController(params, FOOTPRINT, 1.0 / PERIOD)
    x = np.concatenate((np.linspace(0.0, 1.5, 31), np.full(30, 1.5)))
    y = np.concatenate((np.zeros(31), np.linspace(0.05, 1.5, 30)))
    plan = Path(np.column_stack((x, y, np.zeros(61))))
    around = ground_with()
    pose = Pose2D()
    twist = Twist2D()
    commands = []
    for k in range(60):
        state = RobotState(pose, twist, k * PERIOD)
        twist = controller.compute_velocity(state, plan, around)
        commands.append((twist.linear_x, twist.angular_z))
        pose = moved(pose, twist, PERIOD)
    return np.array(commands)


@pytest.mark.parametrize("feedback", ["OPEN_LOOP", "CLOSED_LOOP"])
def test_commands_keep_to_the_accelerations(feedback):
    free = drive()
    kept = drive(use_dynamic_window=True, velocity_feedback=feedback)
    steps = np.diff(np.vstack(((0.0, 0.0), kept)), axis=0)
    assert steps[:, 0].max() <= 0.8 * PERIOD + 1e-9
    assert steps[:, 0].min() >= -1.2 * PERIOD - 1e-9
    assert np.abs(steps[:, 1]).max() <= 2.0 * PERIOD + 1e-9
    assert np.abs(np.diff(free[:, 0])).max() > 0.8 * PERIOD or free[0, 0] > 0.8 * PERIOD
    with pytest.raises(ParameterError, match="velocity_feedback"):
        drive(velocity_feedback="NONE")

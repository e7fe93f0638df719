"""Where rules about limits begin to fire, and what they say of each limit."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from navstack.errors import ParameterError
from navstack.params.costmap import ObservationSourceParams
from navstack.params.dwb import MOST_SAMPLES, DwbParams
from navstack.params.lint.dwb_limits import few_samples
from navstack.params.lint.layers import endless_beams
from navstack.params.lint.robot import MORE, faster_than_robot, harder_than_robot
from navstack.params.lint.speed import large_deadband
from navstack.params.lint.subject import Drive, RobotLimits
from navstack.params.safety import VelocitySmootherParams

BODY = RobotLimits("testbot", np.array([[0.2, 0.1], [0.2, -0.1], [-0.2, 0.0]]), 1.0, 2.0, 3.0, 2.5, 4.0)
DRIVE = Drive("DWB", "FollowPath")
AT_THE_LIMIT = DwbParams(
    max_vel_theta=MORE * 2.0,
    acc_lim_x=MORE * 3.0,
    decel_lim_x=-MORE * 2.5,
    acc_lim_theta=MORE * 4.0,
    decel_lim_theta=-MORE * 4.0,
)


@pytest.mark.parametrize(
    ("key", "value", "told", "advice"),
    [
        ("acc_lim_x", 3.5, "3.5 m/s2, but testbot can do 3 m/s2", "acc_lim_x: 3.0"),
        ("decel_lim_x", -3.0, "-3 m/s2, but testbot can do -2.5 m/s2", "decel_lim_x: -2.5"),
        ("acc_lim_theta", 5.0, "5 rad/s2, but testbot can do 4 rad/s2", "acc_lim_theta: 4.0"),
        ("decel_lim_theta", -4.5, "-4.5 rad/s2, but testbot can do -4 rad/s2", "decel_lim_theta: -4.0"),
    ],
)
def test_accelerations_are_held_against_the_robots(key, value, told, advice):
    assert not [*harder_than_robot.check(BODY, AT_THE_LIMIT, DRIVE)]
    (finding,) = harder_than_robot.check(BODY, dataclasses.replace(AT_THE_LIMIT, **{key: value}), DRIVE)
    assert (finding.name, finding.found, finding.advice) == (f"FollowPath.{key}", told, advice)


@pytest.mark.parametrize(
    ("top_speed", "yaw_rate", "told"),
    [
        (MORE, MORE * 2.0, []),
        (1.25, 2.0, [("speed", "1.25 m/s, but testbot can do 1 m/s", "speed: 1.0")]),
        (1.0, 2.5, [("FollowPath.max_vel_theta", "2.5 rad/s, but testbot can do 2 rad/s", "max_vel_theta: 2.0")]),
    ],
)
def test_speeds_are_held_against_the_robots(top_speed, yaw_rate, told):
    dwb = dataclasses.replace(AT_THE_LIMIT, max_vel_theta=yaw_rate)
    subject = SimpleNamespace(speed_name="speed", drive=DRIVE, dwb=dwb)
    found = [*faster_than_robot.check(subject, BODY, top_speed)]
    assert [(each.name, each.found, each.advice) for each in found] == told


@pytest.mark.parametrize(
    ("given", "keys"),
    [
        ({"vx_samples": 2, "max_vel_x": 0.5, "min_vel_x": 0.4}, ["vx_samples"]),
        ({"vx_samples": 2, "max_vel_x": 0.5, "min_vel_x": 0.5}, []),
        ({"vy_samples": 1, "max_vel_y": 0.1, "min_vel_y": -0.1}, ["vy_samples"]),
        ({"vy_samples": 1, "max_vel_y": 0.0, "min_vel_y": 0.0}, []),
        ({"vtheta_samples": 2, "max_vel_theta": 0.6}, ["vtheta_samples"]),
        ({"vtheta_samples": 3, "max_vel_theta": 0.6}, []),
        ({"vtheta_samples": 2, "max_vel_theta": 0.0}, []),
    ],
)
def test_an_axis_that_moves_needs_three_samples(given, keys):
    many = {"vx_samples": 9, "vy_samples": 9, "vtheta_samples": 9}
    found = [*few_samples.check(DwbParams(**{**many, **given}), DRIVE)]
    assert [each.name for each in found] == [f"FollowPath.{key}" for key in keys]
    for each, key in zip(found, keys, strict=True):
        assert each.found == f"{key} is {given[key]}"
        assert each.advice == f"{key}: {getattr(DwbParams(), key)} (Nav2's default)"


@pytest.mark.parametrize(
    ("top_speed", "linear", "angular", "count"),
    [(2.0, 0.5, 0.4, 0), (2.0, 0.51, 0.4, 1), (0.0, 0.51, 0.4, 0), (2.0, 0.5, 0.41, 1), (2.0, 0.6, 0.6, 2)],
)
def test_a_deadband_is_large_beyond_a_quarter_of_the_top_speed(top_speed, linear, angular, count):
    subject = SimpleNamespace(number=lambda node, name, usual: usual, has=lambda node: True)
    smoother = VelocitySmootherParams(deadband_velocity=(linear, 0.0, angular))
    assert len([*large_deadband.check(subject, smoother, top_speed)]) == count


@pytest.mark.parametrize(("reach", "fires"), [(5.0, False), (5.01, True)])
def test_beams_without_a_return_matter_beyond_five_metres(reach, fires):
    source = ObservationSourceParams(clearing=True, obstacle_max_range=reach)
    view = SimpleNamespace(node="local_costmap", sources=lambda: [("obstacle_layer.scan", source)])
    subject = SimpleNamespace(value=lambda node, name, usual: usual)
    assert bool([*endless_beams.check(subject, view)]) == fires


@pytest.mark.parametrize("axis", range(3))
def test_samples_are_as_many_as_fit_into_memory(axis):
    counts = np.roll((MOST_SAMPLES // 10, 10, 0), axis).tolist()
    names = ("vx_samples", "vy_samples", "vtheta_samples")
    DwbParams(**dict(zip(names, counts, strict=True)))
    counts[axis] += 1
    with pytest.raises(ParameterError, match="100,010 trajectories; at most 100,000 are allowed"):
        DwbParams(**dict(zip(names, counts, strict=True)))

"""A command reaches the drive as late as the robot's computer is slow."""

import dataclasses

import pytest

from harness.world.physics.command_delay import CommandDelay
from navstack.errors import ParameterError

DT = 1.0 / 120.0


def slow(robot, latency):
    return dataclasses.replace(robot, compute_latency=latency)


def paths(lab, robot, params, ticks=60):
    """Where the robot is after each tick of two physics steps, driving ahead all the time."""
    with lab.world(robot, params) as world:
        return [truth.pose.x for truth in lab.drive(world, ticks, v=1.0)]


@pytest.mark.parametrize(
    ("latency", "steps"), [(0.0, 0), (1e-9, 0), (DT, 1), (0.05, 6), (0.051, 7), (0.1, 12)]
)
def test_latency_is_rounded_up_to_whole_steps(latency, steps):
    line = CommandDelay(latency, DT)
    line.send(1.0, 0.5, step=4)
    heard = [line.receive(step) for step in range(4, 20)]
    assert heard == [(0.0, 0.0)] * steps + [(1.0, 0.5)] * (16 - steps)


def test_commands_arrive_in_order_and_none_is_lost():
    line = CommandDelay(0.05, DT)
    heard = []
    for step in range(20):
        line.send(float(step), 0.0, step)
        heard.append(line.receive(step)[0])
    assert heard == [0.0] * 6 + [float(step) for step in range(14)]


def test_a_new_episode_hears_nothing_of_the_last():
    line = CommandDelay(0.05, DT)
    line.send(1.0, 0.0, 0)
    line.reset()
    assert line.receive(100) == (0.0, 0.0)


def test_the_robot_starts_just_that_much_later(lab, robot, params):
    prompt, late = (paths(lab, slow(robot, latency), params) for latency in (0.0, 0.1))
    assert late[:6] == pytest.approx([0.0] * 6, abs=1e-6)  # 0.1 s are six ticks of two steps
    assert late[6:] == pytest.approx(prompt[:-6], abs=1e-6)


def test_without_latency_nothing_changes(lab, robot, params):
    assert robot.compute_latency == 0.0
    assert paths(lab, robot, params) == paths(lab, slow(robot, 0.0), params)


def test_a_negative_latency_is_refused(robot):
    with pytest.raises(ParameterError, match="compute_latency -0.01 must be 0 or more"):
        slow(robot, -0.01)

"""The controller: choice, errors, memory."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pytest import approx

from navstack.control.decision import CriticScore
from navstack.control.dwb.dwb_controller import DwbController
from navstack.errors import InvalidPathError, NoLegalVelocity
from navstack.params.dwb import DwbParams
from navstack.types import Path, Pose2D, RobotState, Twist2D

from ..given import (
    DWB,
    SMALL_ROBOT,
    FixedCosts,
    command_of,
    filled,
    ground_with,
    moved,
    robot,
    straight,
)


def make(params=DWB):
    return DwbController(params, SMALL_ROBOT, 20.0)


def test_all_illegal_raises_with_the_counts_per_critic():
    controller = make()
    with pytest.raises(
        NoLegalVelocity, match="no legal velocity; rejected by: BaseObstacle 419"
    ) as caught:
        command_of(controller, around=filled(254))
    assert caught.value.rejections == {"BaseObstacle": 419}
    assert controller.last_decision is not None
    assert not controller.last_decision.is_legal
    assert controller.last_decision.command == Twist2D()


def test_rejections_count_the_first_critic_that_objects():
    controller = make(replace(DWB, xy_goal_tolerance=0.5))
    state = robot(2.8)
    with pytest.raises(NoLegalVelocity) as caught:
        command_of(controller, state, around=filled(254, 2.8))
    # 20 samples turn on the spot
    assert caught.value.rejections == {"RotateToGoal": 399, "BaseObstacle": 20}


def test_without_any_sample_it_says_so():
    with pytest.raises(NoLegalVelocity, match="none sampled"):
        command_of(make(DwbParams()))


def test_plan_that_is_empty_or_elsewhere():
    state = robot()
    with pytest.raises(InvalidPathError, match="no poses"):
        command_of(make(), state, Path(np.empty((0, 3))))
    elsewhere = Path(straight().poses + (50.0, 0.0, 0.0))
    with pytest.raises(
        InvalidPathError, match=r"none of the plan's 61 poses lies within 2.00 m of the robot"
    ):
        command_of(make(), state, elsewhere)


def test_the_first_of_equals_wins_and_the_decision_explains_itself():
    one = FixedCosts(2.0, {7: 1.0, 9: 1.0, 3: math.inf})
    two = FixedCosts(0.5, {7: 4.0, 9: 4.0})
    idle = FixedCosts(0.0, {7: math.inf})
    controller = DwbController(
        DWB, SMALL_ROBOT, 20.0, critics={"One": one, "Two": two, "Idle": idle}
    )
    command = command_of(controller)
    decision = controller.last_decision
    assert decision.choice.index == 7
    assert decision.scores.totals[7] == decision.scores.totals[9] == np.float32(4.0)
    assert decision.record().scores == (
        CriticScore("One", 1.0, 2.0, 1),
        CriticScore("Two", 4.0, 2.0, 0),
        CriticScore("Idle", 0.0, 0.0, 0),
    )
    assert one.commands == two.commands == [command]


def test_a_new_plan_resets_the_critics_and_the_same_plan_does_not():
    critic = FixedCosts(1.0)
    controller = DwbController(DWB, SMALL_ROBOT, 20.0, critics={"Constant": critic})
    state = robot()
    plan = straight()
    for following in (plan, plan, straight()):
        command_of(controller, state, following)
    assert critic.resets == 2
    controller.reset()
    assert controller.last_decision is None
    command_of(controller, state, plan)
    assert critic.resets == 3


def test_what_has_been_passed_is_forgotten():
    there_and_back = np.concatenate(
        (straight(5.0, count=101).poses, straight(5.0, count=101).poses[::-1])
    )
    controller = make()
    plan = Path(there_and_back)
    for x in (0.0, 1.5, 3.0, 4.5):
        command_of(controller, robot(x), plan, ground_with(middle=(x, 0.0)))
    begin = controller._window._begin
    assert there_and_back[begin, 0] == approx(2.55)
    with pytest.raises(InvalidPathError):
        command_of(controller, robot(-3.0), plan, ground_with(middle=(-3.0, 0.0)))


def test_it_drives_to_the_goal_and_turns_to_its_heading():
    poses = straight().poses.copy()
    poses[-1, 2] = 1.0
    controller = make()
    plan = Path(poses)
    pose = Pose2D(0.0, 0.2, 0.3)
    v = w = 0.0
    for i in range(300):
        state = RobotState(pose, Twist2D(v, 0.0, w), i / 20.0)
        command = command_of(controller, state, plan, ground_with(middle=(pose.x, pose.y)))
        v = min(max(command.linear_x, v - 2.5 / 20.0), v + 2.5 / 20.0)
        w = min(max(command.angular_z, w - 3.5 / 20.0), w + 3.5 / 20.0)
        pose = moved(pose, Twist2D(v, 0.0, w), 1.0 / 20.0)
    assert math.hypot(pose.x - 3.0, pose.y) < 0.25 + 0.1
    assert pose.yaw == approx(1.0, abs=0.25)  # the tolerance of Nav2's goal checker


def test_short_circuit_never_changes_the_winner():
    rng = np.random.default_rng(0)
    for _ in range(5):
        here = rng.uniform(-0.5, 0.5, 3)
        state = robot(*here, v=rng.uniform(0.0, 1.0), w=0.2)
        commands = [
            command_of(make(replace(DWB, short_circuit_trajectory_evaluation=on)), state)
            for on in (True, False)
        ]
        assert commands[0] == commands[1]


def test_the_limited_generator_commands_only_what_one_period_allows():
    params = replace(DWB, trajectory_generator_name="dwb_plugins::LimitedAccelGenerator")
    controller = make(params)
    command_of(controller, robot(v=0.5))
    rollouts = controller.last_decision.scores.rollouts
    assert rollouts.commands[:, 0].min() == approx(0.5 - 2.5 / 20.0)
    assert rollouts.commands[:, 0].max() == approx(0.5 + 2.5 / 20.0)
    fastest = int((rollouts.commands[:, 0] - 10.0 * np.abs(rollouts.commands[:, 2])).argmax())
    # no ramp
    assert rollouts.x[fastest, -1] == approx(1.7 * rollouts.commands[fastest, 0])

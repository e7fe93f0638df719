"""What controllers tell of a cycle."""

import math
from dataclasses import replace

import numpy as np
import pytest

from navstack.control.decision import RUNNER_UP, SLOWER, CriticScore, DecisionRecord
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.rotation_shim import RotationShimController
from navstack.control.rpp.rpp_controller import RegulatedPurePursuitController
from navstack.errors import ControlError, NoLegalVelocity
from navstack.params.rotation_shim import RotationShimParams
from navstack.params.rpp import RppParams
from navstack.types import Twist2D

from .given import (
    DWB,
    SMALL_ROBOT,
    FixedCosts,
    command_of,
    filled,
    ground_with,
    robot,
    server_of,
    straight,
)

PARAMS = replace(
    DWB,
    critics=(),
    max_vel_theta=1.0,
    acc_lim_x=2.0,
    decel_lim_x=-2.0,
    acc_lim_theta=3.0,
    decel_lim_theta=-3.0,
    vx_samples=3,
    vtheta_samples=3,
    linear_granularity=0.5,
)


def dwb(one, two):
    return DwbController(
        PARAMS,
        SMALL_ROBOT,
        20.0,
        critics={"One": one, "Two": two, "Idle": FixedCosts(0.0, otherwise=1.0)},
    )


def blocked():
    """A controller whose first critic rejects everything."""
    return dwb(FixedCosts(1.0, otherwise=math.inf), FixedCosts(1.0, otherwise=0.0))


def test_dwb_tells_the_scores_of_what_it_chose():
    controller = dwb(
        FixedCosts(2.0, {4: 1.0, 0: math.inf}, 3.0),
        FixedCosts(0.5, {4: 4.0, 1: math.inf, 0: math.inf}, 6.0),
    )
    assert controller.decision is None
    command = command_of(controller, robot(stamp=7.5))
    count = len(controller.last_decision.scores.totals)
    assert controller.decision == DecisionRecord(
        7.5,
        "DWBLocalPlanner",
        command,
        samples=count,
        rejected=2,
        total=4.0,
        scores=(
            CriticScore("One", 1.0, 2.0, 1),
            CriticScore("Two", 4.0, 2.0, 1),
            CriticScore("Idle", 0.0, 0.0, 0),
        ),
    )
    assert command == Twist2D(*controller.last_decision.scores.rollouts.commands[4].tolist())


def test_dwb_tells_what_its_choice_was_preferred_to():
    controller = dwb(
        FixedCosts(2.0, {4: 1.0, 0: math.inf}, 3.0), FixedCosts(0.5, {4: 4.0, 7: 5.0}, 6.0)
    )
    assert controller.alternatives == ()
    command = command_of(controller)
    commands = controller.last_decision.scores.rollouts.commands
    slow = np.flatnonzero(np.abs(commands[:, 0]) <= 0.5 * command.linear_x)
    second, slower = controller.alternatives
    assert second.kind == RUNNER_UP
    assert slower.kind == SLOWER
    assert second.command == Twist2D(*commands[7].tolist())
    assert second.total == 8.5
    assert second.scores == (
        CriticScore("One", 3.0, 6.0, 0),
        CriticScore("Two", 5.0, 2.5, 0),
        CriticScore("Idle", 0.0, 0.0, 0),
    )
    # the first is forbidden, the fifth chosen
    legal = [index for index in slow.tolist() if index not in (0, 4)]
    assert slower.command == Twist2D(*commands[legal[0]].tolist())
    assert slower.total == (8.5 if legal[0] == 7 else 9.0)


def test_where_one_velocity_is_legal_there_is_no_other():
    controller = dwb(FixedCosts(1.0, {2: 1.0}, math.inf), FixedCosts(1.0, otherwise=0.0))
    command_of(controller)
    assert controller.alternatives == ()
    with pytest.raises(NoLegalVelocity):
        dwb_none = blocked()
        command_of(dwb_none)
    assert dwb_none.alternatives == ()


def test_a_cycle_without_a_legal_velocity_tells_who_rejected():
    controller = dwb(FixedCosts(1.0, {0: 1.0}, math.inf), FixedCosts(1.0, otherwise=math.inf))
    with pytest.raises(NoLegalVelocity) as caught:
        command_of(controller, robot(stamp=1.0))
    told = controller.decision
    count = len(controller.last_decision.scores.totals)
    assert caught.value.rejections == {"One": count - 1, "Two": 1}
    assert told.command == Twist2D()
    assert told.samples == told.rejected == count
    assert told.total is None
    assert [(s.critic, s.raw, s.weighted, s.rejections) for s in told.scores] == [
        ("One", None, None, count - 1),
        ("Two", None, None, 1),
        ("Idle", None, None, 0),
    ]


def test_the_server_still_knows_the_decision_that_ended_an_attempt():
    controllers = server_of(blocked(), failure_tolerance=0.0)
    controllers.begin(straight(), 2.0)
    with pytest.raises(ControlError):
        controllers.compute_command(robot(stamp=2.0), ground_with())
    controllers.begin_again(2.0)
    assert controllers.decision.stamp == 2.0
    assert controllers.decision.rejected > 0
    controllers.reset(np.random.default_rng(0))
    assert controllers.decision is None


def test_a_patient_server_shows_each_failed_cycle():
    controllers = server_of(blocked(), failure_tolerance=1.0)
    controllers.begin(straight(), 0.0)
    for stamp in (0.0, 0.05, 0.1):
        assert controllers.compute_command(robot(stamp=stamp), ground_with()) == Twist2D()
        assert controllers.decision.stamp == stamp
        assert controllers.decision.total is None


def test_only_the_controllers_cycles_are_timed():
    controllers = server_of(blocked(), failure_tolerance=1.0)
    with pytest.raises(ControlError):
        controllers.compute_command(robot(stamp=0.0), ground_with())  # there is no plan
    controllers.begin(straight(), 0.0)
    controllers.compute_command(robot(stamp=0.0), ground_with())
    controllers.compute_command(robot(stamp=0.05), ground_with())
    assert len(controllers.stopwatch.durations) == 2
    assert all(0.0 < duration < 60.0 for duration in controllers.stopwatch.durations)


def test_a_turn_is_the_shims_and_the_rest_the_primary_controllers():
    primary = dwb(FixedCosts(1.0, otherwise=1.0), FixedCosts(1.0, otherwise=1.0))
    shim = RotationShimController(RotationShimParams(), primary, SMALL_ROBOT, 20.0, 0.25)
    assert shim.decision is None
    turn = command_of(shim, plan=straight(yaw=1.5))
    assert shim.decision == DecisionRecord(0.0, "RotationShimController", turn)
    command_of(shim, robot(stamp=0.05))
    assert shim.decision.stamp == 0.05
    assert shim.decision.decided_by == "DWBLocalPlanner"


@pytest.mark.parametrize(("cost", "rejected"), [(0, 0), (254, 1)])
def test_pure_pursuit_tells_of_its_one_arc(cost, rejected):
    controller = RegulatedPurePursuitController(RppParams(), SMALL_ROBOT, 20.0)
    try:
        command = command_of(controller, robot(stamp=3.0), around=filled(cost))
    except NoLegalVelocity:
        command = Twist2D()
    told = controller.decision
    assert told.stamp == 3.0
    assert told.decided_by == "RegulatedPurePursuitController"
    assert told.command == command
    assert told.samples == 1
    assert told.rejected == rejected
    assert told.scores == (CriticScore("collision ahead", None, None, rejected),)

"""What controllers tell of a cycle."""

import math

import numpy as np
import pytest

from navstack.control.controller import Controller, Surroundings
from navstack.control.controller_server import ControllerServer
from navstack.control.decision import RUNNER_UP, SLOWER, CriticScore, DecisionRecord
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import Scene
from navstack.control.goal_checker import SimpleGoalChecker
from navstack.control.progress_checker import SimpleProgressChecker
from navstack.control.rotation_shim import RotationShimController
from navstack.control.rpp.rpp_controller import RegulatedPurePursuitController
from navstack.costmap.costmap import Costmap
from navstack.errors import ControlError, NoLegalVelocity
from navstack.params.checkers import SimpleGoalCheckerParams, SimpleProgressCheckerParams
from navstack.params.dwb import DwbParams
from navstack.params.rotation_shim import RotationShimParams
from navstack.params.rpp import RppParams
from navstack.params.servers import ControllerServerParams
from navstack.types import FloatArray, Path, Pose2D, RobotState, Twist2D

FOOTPRINT = np.array(((0.2, 0.2), (0.2, -0.2), (-0.4, -0.2), (-0.4, 0.2)))
PARAMS = DwbParams(
    critics=(), max_vel_x=1.0, max_speed_xy=1.0, max_vel_theta=1.0, acc_lim_x=2.0, decel_lim_x=-2.0,
    acc_lim_theta=3.0, decel_lim_theta=-3.0, vx_samples=3, vtheta_samples=3,
)  # fmt: skip


class Fixed(Critic):
    """The cost of each trajectory is set."""

    def __init__(self, weight: float, costs: dict[int, float], otherwise: float) -> None:
        self.weight, self.costs, self.otherwise = weight, costs, otherwise

    def scale(self, scene: Scene) -> float:
        return self.weight

    def raw_costs(self, rollouts: Rollouts, scene: Scene) -> FloatArray:
        costs = np.full(len(rollouts.commands), self.otherwise)
        for index, cost in self.costs.items():
            costs[index] = cost
        return costs


def plan(yaw: float = 0.0) -> Path:
    along = np.linspace(0.0, 3.0, 61)
    return Path(np.column_stack((along * math.cos(yaw), along * math.sin(yaw), np.full(61, yaw))))


def around(value: int = 0) -> Surroundings:
    return Surroundings(Costmap(np.full((160, 160), value, dtype=np.uint8), 0.05, -4.0, -4.0))


def state(stamp: float) -> RobotState:
    return RobotState(Pose2D(), Twist2D(), stamp)


def dwb(one: Fixed, two: Fixed) -> DwbController:
    return DwbController(
        PARAMS, FOOTPRINT, 20.0, critics={"One": one, "Two": two, "Idle": Fixed(0.0, {}, 1.0)}
    )


def server(controller: Controller, failure_tolerance: float) -> ControllerServer:
    goal_checker, progress_checker = (
        SimpleGoalChecker(SimpleGoalCheckerParams()),
        SimpleProgressChecker(SimpleProgressCheckerParams()),
    )
    params = ControllerServerParams(failure_tolerance=failure_tolerance)
    return ControllerServer(params, controller, goal_checker, progress_checker)


def test_dwb_tells_the_scores_of_what_it_chose() -> None:
    controller = dwb(
        Fixed(2.0, {4: 1.0, 0: math.inf}, 3.0), Fixed(0.5, {4: 4.0, 1: math.inf, 0: math.inf}, 6.0)
    )
    assert controller.decision is None
    command = controller.compute_velocity(state(7.5), plan(), around())
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


def test_dwb_tells_what_its_choice_was_preferred_to() -> None:
    controller = dwb(Fixed(2.0, {4: 1.0, 0: math.inf}, 3.0), Fixed(0.5, {4: 4.0, 7: 5.0}, 6.0))
    assert controller.alternatives == ()
    command = controller.compute_velocity(state(0.0), plan(), around())
    commands = controller.last_decision.scores.rollouts.commands
    slow = np.flatnonzero(np.abs(commands[:, 0]) <= 0.5 * command.linear_x)
    second, slower = controller.alternatives
    assert (second.kind, slower.kind) == (RUNNER_UP, SLOWER)
    assert (second.command, second.total) == (Twist2D(*commands[7].tolist()), 8.5)
    assert second.scores == (
        CriticScore("One", 3.0, 6.0, 0),
        CriticScore("Two", 5.0, 2.5, 0),
        CriticScore("Idle", 0.0, 0.0, 0),
    )
    # the first is forbidden, the fifth chosen
    legal = [index for index in slow.tolist() if index not in (0, 4)]
    assert slower.command == Twist2D(*commands[legal[0]].tolist())
    assert slower.total == (8.5 if legal[0] == 7 else 9.0)


def test_where_one_velocity_is_legal_there_is_no_other() -> None:
    controller = dwb(Fixed(1.0, {2: 1.0}, math.inf), Fixed(1.0, {}, 0.0))
    controller.compute_velocity(state(0.0), plan(), around())
    assert controller.alternatives == ()
    with pytest.raises(NoLegalVelocity):
        dwb_none = dwb(Fixed(1.0, {}, math.inf), Fixed(1.0, {}, 0.0))
        dwb_none.compute_velocity(state(0.0), plan(), around())
    assert dwb_none.alternatives == ()


def test_a_cycle_without_a_legal_velocity_tells_who_rejected() -> None:
    controller = dwb(Fixed(1.0, {0: 1.0}, math.inf), Fixed(1.0, {}, math.inf))
    with pytest.raises(NoLegalVelocity) as caught:
        controller.compute_velocity(state(1.0), plan(), around())
    told = controller.decision
    count = len(controller.last_decision.scores.totals)
    assert caught.value.rejections == {"One": count - 1, "Two": 1}
    assert (told.command, told.samples, told.rejected, told.total) == (
        Twist2D(),
        count,
        count,
        None,
    )
    assert [(s.critic, s.raw, s.weighted, s.rejections) for s in told.scores] == [
        ("One", None, None, count - 1),
        ("Two", None, None, 1),
        ("Idle", None, None, 0),
    ]


def test_the_server_still_knows_the_decision_that_ended_an_attempt() -> None:
    controllers = server(dwb(Fixed(1.0, {}, math.inf), Fixed(1.0, {}, 0.0)), failure_tolerance=0.0)
    controllers.begin(plan(), 2.0)
    with pytest.raises(ControlError):
        controllers.compute_command(state(2.0), around())
    controllers.begin_again(2.0)
    assert controllers.decision.stamp == 2.0 and controllers.decision.rejected > 0
    controllers.reset(np.random.default_rng(0))
    assert controllers.decision is None


def test_a_patient_server_shows_each_failed_cycle() -> None:
    controllers = server(dwb(Fixed(1.0, {}, math.inf), Fixed(1.0, {}, 0.0)), failure_tolerance=1.0)
    controllers.begin(plan(), 0.0)
    for stamp in (0.0, 0.05, 0.1):
        assert controllers.compute_command(state(stamp), around()) == Twist2D()
        assert controllers.decision.stamp == stamp and controllers.decision.total is None


def test_only_the_controllers_cycles_are_timed() -> None:
    controllers = server(dwb(Fixed(1.0, {}, math.inf), Fixed(1.0, {}, 0.0)), failure_tolerance=1.0)
    with pytest.raises(ControlError):
        controllers.compute_command(state(0.0), around())  # there is no plan
    controllers.begin(plan(), 0.0)
    controllers.compute_command(state(0.0), around())
    controllers.compute_command(state(0.05), around())
    assert len(controllers.stopwatch.durations) == 2
    assert all(0.0 < duration < 60.0 for duration in controllers.stopwatch.durations)


def test_a_turn_is_the_shims_and_the_rest_the_primary_controllers() -> None:
    primary = dwb(Fixed(1.0, {}, 1.0), Fixed(1.0, {}, 1.0))
    shim = RotationShimController(RotationShimParams(), primary, FOOTPRINT, 20.0, 0.25)
    assert shim.decision is None
    turn = shim.compute_velocity(state(0.0), plan(1.5), around())
    assert shim.decision == DecisionRecord(0.0, "RotationShimController", turn)
    shim.compute_velocity(state(0.05), plan(0.0), around())
    assert (shim.decision.stamp, shim.decision.decided_by) == (0.05, "DWBLocalPlanner")


@pytest.mark.parametrize(("cost", "rejected"), [(0, 0), (254, 1)])
def test_pure_pursuit_tells_of_its_one_arc(cost: int, rejected: int) -> None:
    controller = RegulatedPurePursuitController(RppParams(), FOOTPRINT, 20.0)
    try:
        command = controller.compute_velocity(state(3.0), plan(), around(cost))
    except NoLegalVelocity:
        command = Twist2D()
    told = controller.decision
    assert (told.stamp, told.decided_by, told.command) == (
        3.0,
        "RegulatedPurePursuitController",
        command,
    )
    assert (told.samples, told.rejected) == (1, rejected)
    assert told.scores == (CriticScore("collision ahead", None, None, rejected),)

"""The controller: choice, errors, memory."""

import math
from dataclasses import replace

import numpy as np
import pytest

from navstack.control.controller import Surroundings
from navstack.control.decision import CriticScore
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import Scene
from navstack.costmap.costmap import Costmap
from navstack.errors import InvalidPathError, NoLegalVelocity
from navstack.params.dwb import (
    AlignParams,
    DistParams,
    DwbParams,
    ObstacleParams,
    RotateToGoalParams,
)
from navstack.types import Path, Pose2D, RobotState, Twist2D

PARAMS = DwbParams(
    critics=(
        "RotateToGoal",
        "Oscillation",
        "BaseObstacle",
        "GoalAlign",
        "PathAlign",
        "PathDist",
        "GoalDist",
    ),
    max_vel_x=1.0,
    max_speed_xy=1.0,
    max_vel_theta=1.2,
    acc_lim_x=2.5,
    decel_lim_x=-2.5,
    acc_lim_theta=3.5,
    decel_lim_theta=-3.5,
    linear_granularity=0.05,
    RotateToGoal=RotateToGoalParams(scale=32.0),
    BaseObstacle=ObstacleParams(scale=0.02),
    GoalAlign=AlignParams(scale=24.0, forward_point_distance=0.1),
    PathAlign=AlignParams(scale=32.0, forward_point_distance=0.1),
    PathDist=DistParams(scale=32.0),
    GoalDist=DistParams(scale=24.0),
)
FOOTPRINT = np.array(((0.2, 0.2), (0.2, -0.2), (-0.4, -0.2), (-0.4, 0.2)))


def straight_plan(length: float = 3.0) -> Path:
    poses = np.zeros((int(length / 0.05) + 1, 3))
    poses[:, 0] = np.linspace(0.0, length, len(poses))
    return Path(poses)


def around(x: float = 0.0, y: float = 0.0, value: int = 0) -> Surroundings:
    return Surroundings(Costmap(np.full((160, 160), value, dtype=np.uint8), 0.05, x - 4.0, y - 4.0))


def make(params: DwbParams = PARAMS) -> DwbController:
    return DwbController(params, FOOTPRINT, 20.0)


def test_all_illegal_raises_with_the_counts_per_critic() -> None:
    controller = make()
    with pytest.raises(
        NoLegalVelocity, match="no legal velocity; rejected by: BaseObstacle 419"
    ) as caught:
        controller.compute_velocity(
            RobotState(Pose2D(), Twist2D()), straight_plan(), around(value=254)
        )
    assert caught.value.rejections == {"BaseObstacle": 419}
    assert controller.last_decision is not None
    assert not controller.last_decision.is_legal
    assert controller.last_decision.command == Twist2D()


def test_rejections_count_the_first_critic_that_objects() -> None:
    controller = make(replace(PARAMS, xy_goal_tolerance=0.5))
    state = RobotState(Pose2D(2.8, 0.0, 0.0), Twist2D())
    with pytest.raises(NoLegalVelocity) as caught:
        controller.compute_velocity(state, straight_plan(), around(2.8, value=254))
    # 20 samples turn on the spot
    assert caught.value.rejections == {"RotateToGoal": 399, "BaseObstacle": 20}


def test_without_any_sample_it_says_so() -> None:
    with pytest.raises(NoLegalVelocity, match="none sampled"):
        make(DwbParams()).compute_velocity(
            RobotState(Pose2D(), Twist2D()), straight_plan(), around()
        )


def test_plan_that_is_empty_or_elsewhere() -> None:
    state = RobotState(Pose2D(), Twist2D())
    with pytest.raises(InvalidPathError, match="no poses"):
        make().compute_velocity(state, Path(np.empty((0, 3))), around())
    elsewhere = Path(straight_plan().poses + (50.0, 0.0, 0.0))
    with pytest.raises(
        InvalidPathError, match=r"none of the plan's 61 poses lies within 2.00 m of the robot"
    ):
        make().compute_velocity(state, elsewhere, around())


class Constant(Critic):
    """The same cost for all trajectories, or one's own for some."""

    def __init__(self, scale: float, special: dict[int, float]) -> None:
        super().__init__(scale)
        self._special = special
        self.resets = 0
        self.commands: list[Twist2D] = []

    def reset(self) -> None:
        self.resets += 1

    def raw_costs(self, rollouts: Rollouts, scene: Scene) -> np.ndarray:
        costs = np.full(len(rollouts.commands), 5.0)
        for index, cost in self._special.items():
            costs[index] = cost
        return costs

    def debrief(self, scene: Scene, command: Twist2D) -> None:
        self.commands.append(command)


def test_the_first_of_equals_wins_and_the_decision_explains_itself() -> None:
    one, two = Constant(2.0, {7: 1.0, 9: 1.0, 3: math.inf}), Constant(0.5, {7: 4.0, 9: 4.0})
    idle = Constant(0.0, {7: math.inf})
    controller = DwbController(
        PARAMS, FOOTPRINT, 20.0, critics={"One": one, "Two": two, "Idle": idle}
    )
    command = controller.compute_velocity(
        RobotState(Pose2D(), Twist2D()), straight_plan(), around()
    )
    decision = controller.last_decision
    assert decision.choice.index == 7
    assert decision.scores.totals[7] == decision.scores.totals[9] == np.float32(4.0)
    assert decision.record().scores == (
        CriticScore("One", 1.0, 2.0, 1),
        CriticScore("Two", 4.0, 2.0, 0),
        CriticScore("Idle", 0.0, 0.0, 0),
    )
    assert one.commands == two.commands == [command]


def test_a_new_plan_resets_the_critics_and_the_same_plan_does_not() -> None:
    critic = Constant(1.0, {})
    controller = DwbController(PARAMS, FOOTPRINT, 20.0, critics={"Constant": critic})
    state, plan = RobotState(Pose2D(), Twist2D()), straight_plan()
    for following in (plan, plan, straight_plan()):
        controller.compute_velocity(state, following, around())
    assert critic.resets == 2
    controller.reset()
    assert controller.last_decision is None
    controller.compute_velocity(state, plan, around())
    assert critic.resets == 3


def test_what_has_been_passed_is_forgotten() -> None:
    there_and_back = np.concatenate((straight_plan(5.0).poses, straight_plan(5.0).poses[::-1]))
    controller, plan = make(), Path(there_and_back)
    for x in (0.0, 1.5, 3.0, 4.5):
        controller.compute_velocity(RobotState(Pose2D(x), Twist2D()), plan, around(x))
    begin = controller._window._begin
    assert there_and_back[begin, 0] == pytest.approx(2.55)
    with pytest.raises(InvalidPathError):
        controller.compute_velocity(RobotState(Pose2D(-3.0), Twist2D()), plan, around(-3.0))


def test_it_drives_to_the_goal_and_turns_to_its_heading() -> None:
    poses = straight_plan().poses.copy()
    poses[-1, 2] = 1.0
    controller, plan = make(), Path(poses)
    x, y, yaw, v, w = 0.0, 0.2, 0.3, 0.0, 0.0
    for i in range(300):
        state = RobotState(Pose2D(x, y, yaw), Twist2D(v, 0.0, w), i / 20.0)
        command = controller.compute_velocity(state, plan, around(x, y))
        v = min(max(command.linear_x, v - 2.5 / 20.0), v + 2.5 / 20.0)
        w = min(max(command.angular_z, w - 3.5 / 20.0), w + 3.5 / 20.0)
        x, y, yaw = x + v * math.cos(yaw) / 20.0, y + v * math.sin(yaw) / 20.0, yaw + w / 20.0
    assert math.hypot(x - 3.0, y) < 0.25 + 0.1
    assert yaw == pytest.approx(1.0, abs=0.25)  # the tolerance of Nav2's goal checker


def test_short_circuit_never_changes_the_winner() -> None:
    rng = np.random.default_rng(0)
    for _ in range(5):
        state = RobotState(
            Pose2D(*rng.uniform(-0.5, 0.5, 3)), Twist2D(rng.uniform(0.0, 1.0), 0.0, 0.2)
        )
        commands = [
            make(replace(PARAMS, short_circuit_trajectory_evaluation=on)).compute_velocity(
                state, straight_plan(), around()
            )
            for on in (True, False)
        ]
        assert commands[0] == commands[1]


def test_the_limited_generator_commands_only_what_one_period_allows() -> None:
    params = replace(PARAMS, trajectory_generator_name="dwb_plugins::LimitedAccelGenerator")
    controller = make(params)
    controller.compute_velocity(
        RobotState(Pose2D(), Twist2D(0.5, 0.0, 0.0)), straight_plan(), around()
    )
    rollouts = controller.last_decision.scores.rollouts
    assert rollouts.commands[:, 0].min() == pytest.approx(0.5 - 2.5 / 20.0)
    assert rollouts.commands[:, 0].max() == pytest.approx(0.5 + 2.5 / 20.0)
    straight = int((rollouts.commands[:, 0] - 10.0 * np.abs(rollouts.commands[:, 2])).argmax())
    # no ramp
    assert rollouts.x[straight, -1] == pytest.approx(1.7 * rollouts.commands[straight, 0])

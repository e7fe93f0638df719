"""The choice by the ends of the trajectories is the one that all scores make."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal

from navstack.control.controller import Surroundings
from navstack.control.dwb import rollouts
from navstack.control.dwb.critics import build_critics
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.dwb.end_kernels import end_poses
from navstack.control.dwb.pose_score import locate, plan_cells
from navstack.control.dwb.rollouts import RolloutGenerator
from navstack.control.dwb.scene import DwbScene
from navstack.control.dwb.scoring import Scoring
from navstack.costmap.costmap import Costmap
from navstack.errors import PluginError
from navstack.params.dwb import (
    AlignParams,
    DistParams,
    ObstacleParams,
    OscillationParams,
    RotateToGoalParams,
)
from navstack.types import Pose2D, RobotState, Twist2D

from ..given import DWB, SMALL_ROBOT, STANDARD_CRITICS, FixedCosts

OUTLINES = tuple(
    "ObstacleFootprint" if name == "BaseObstacle" else name for name in STANDARD_CRITICS
)
PARAMS = replace(
    DWB,
    min_vel_x=-0.3,
    max_vel_x=1.5,
    max_speed_xy=1.5,
    min_speed_theta=0.1,
    vx_samples=9,
    vtheta_samples=10,
    RotateToGoal=RotateToGoalParams(),
    ObstacleFootprint=ObstacleParams(scale=3.0),
)
# cells along a side, [m]
SIZE = 100
RESOLUTION = 0.05


def random_scene(rng):
    """A curved plan that may leave the map, past obstacles and unknown cells.

    Sometimes the robot stands in one.
    """
    costs = rng.integers(0, 200, (SIZE, SIZE)).astype(np.uint8)
    for cost in (253, 254, 255):
        for _ in range(int(rng.integers(0, 12))):
            my, mx = rng.integers(0, SIZE - 4, 2)
            costs[my : my + 4, mx : mx + 4] = cost
    heading = rng.uniform(-math.pi, math.pi) + np.cumsum(rng.uniform(-0.1, 0.1, 70))
    xy = np.cumsum(
        rng.choice((0.03, 0.12)) * np.column_stack((np.cos(heading), np.sin(heading))), axis=0
    )
    plan = np.column_stack((xy + rng.uniform(-0.3, 0.3, 2), heading))
    pose = Pose2D(*rng.uniform(-0.6, 0.6, 2), heading[0] + rng.uniform(-1.0, 1.0))
    velocity = Twist2D(rng.uniform(-0.3, 1.5), 0.0, rng.uniform(-1.2, 1.2))
    half = SIZE * RESOLUTION / 2.0
    costmap = Costmap(costs, RESOLUTION, -half + rng.uniform(-1.0, 1.0), -half)
    return DwbScene(pose, velocity, 0.0, Pose2D(*plan[-1].tolist()), plan, costmap, SMALL_ROBOT)


CHANGES = {
    "standard": {},
    "limited": {"trajectory_generator_name": "dwb_plugins::LimitedAccelGenerator"},
    "other noses": {"GoalAlign": AlignParams(24.0), "PathAlign": AlignParams(32.0, "last", 0.2)},
    "few critics": {"critics": ("GoalAlign", "PathDist")},
    "no obstacles": {"critics": ("GoalDist", "PathAlign", "PathDist", "Oscillation")},
    "alignment only": {"critics": ("PathAlign", "GoalAlign")},
    "obstacles only": {"critics": ("BaseObstacle",)},
    "outlines": {"critics": OUTLINES},
    "outlines and the way": {"critics": ("ObstacleFootprint", "PathAlign")},
    "outlines and centres": {"critics": ("GoalDist", "BaseObstacle", "ObstacleFootprint")},
    "outlines only": {"critics": ("ObstacleFootprint",)},
    "wide turns": {"angular_granularity": 0.3, "linear_granularity": 0.4},
}
VARIANTS = {name: replace(PARAMS, **change) for name, change in CHANGES.items()}


class YawRate(Critic):
    """A critic that knows only its raw costs.

    Of the command, or of the last pose, none beyond a limit.
    """

    def __init__(self, scale, of_command, most):
        super().__init__(scale)
        self.of_command = of_command
        self.most = most

    def raw_costs(self, rollouts, scene):
        rates = rollouts.commands[:, 2] if self.of_command else rollouts.yaw[:, -1] - scene.pose.yaw
        return np.where(np.abs(rates) > self.most, np.inf, np.abs(rates))


def plan_is_off_the_map(scene):
    return plan_cells(scene.plan, scene.situation).size == 0


def prepare(critics, scene):
    for critic in critics.values():
        critic.prepare(scene)


def check_choices(params, critics, rng):
    """The choices are those of all scores; how many were made without."""
    generator = RolloutGenerator(params, 20.0)
    made = 0
    scoring = Scoring(generator, critics)
    for _ in range(60):
        scene = random_scene(rng)
        prepare(critics, scene)
        choice = scoring.best(scene)
        expected = scoring.score_all(scene).best()
        assert choice == expected or choice is None
        if choice is None:
            assert (
                math.isinf(expected.total) or plan_is_off_the_map(scene) or "GoalAlign" in critics
            )
        made += choice is not None
        for critic in critics.values():
            critic.debrief(scene, expected.command)
    return made


@pytest.mark.parametrize("name", VARIANTS)
def test_it_is_the_choice_of_all_scores_on_random_scenes(name):
    params = VARIANTS[name]
    assert check_choices(params, build_critics(params), default_rng(len(name))) > 25


def test_a_critic_that_is_named_twice_scores_twice():
    scene = random_scene(default_rng(0))
    totals = []
    for names in (("PathDist",), ("PathDist", "PathDist")):
        params = replace(PARAMS, critics=names)
        critics = build_critics(params)
        prepare(critics, scene)
        scores = Scoring(RolloutGenerator(params, 20.0), critics).score_all(scene)
        totals.append(scores.best().total)
    assert list(critics) == ["PathDist", "PathDist_2"]
    assert math.isfinite(totals[0]) and totals[0] > 0.0
    assert totals[1] == pytest.approx(2.0 * totals[0], rel=1e-12)


@pytest.mark.parametrize("of_command", [True, False])
def test_ones_own_critic_takes_part(of_command):
    first = build_critics(PARAMS)
    last = {"Own": YawRate(20.0, of_command, 0.6)}
    assert check_choices(PARAMS, {**last, **first}, default_rng(5)) > 15
    assert check_choices(PARAMS, {**first, **last}, default_rng(6)) > 15


@pytest.mark.parametrize(("away", "is_chosen"), [(0.0, True), (50.0, False)])
@pytest.mark.parametrize("critics", [("GoalDist",), ("PathDist",), ("GoalAlign",)])
def test_nothing_is_chosen_where_the_plan_is_off_the_map(critics, away, is_chosen):
    params = replace(PARAMS, critics=critics)
    scene = random_scene(default_rng(2))
    scene.costmap.data[:] = 0
    scene = replace(
        scene, plan=scene.plan + (away, 0.0, 0.0), goal=Pose2D(scene.goal.x + away, scene.goal.y)
    )
    made = build_critics(params)
    prepare(made, scene)
    assert (Scoring(RolloutGenerator(params, 20.0), made).best(scene) is not None) == is_chosen


def test_a_critic_of_the_commands_alone_needs_no_poses(monkeypatch):
    monkeypatch.setattr(rollouts, "roll_out", None)
    scene = random_scene(default_rng(2))
    scene.costmap.data[:] = 0
    critics = build_critics(PARAMS) | {"Own": YawRate(1.0, True, 5.0)}
    prepare(critics, scene)
    assert Scoring(RolloutGenerator(PARAMS, 20.0), critics).best(scene) is not None


@pytest.mark.parametrize("cost", [math.nan, -1.0])
def test_a_cost_that_is_none_is_refused_by_both_searches(cost):
    scene = random_scene(default_rng(2))
    critics = {"Odd": FixedCosts(1.0, otherwise=cost)}
    scoring = Scoring(RolloutGenerator(PARAMS, 20.0), critics)
    for search in (scoring.best, scoring.score_all):
        with pytest.raises(PluginError, match="FixedCosts answered"):
            search(scene)


@pytest.mark.parametrize("scale", [1.0, -1.0])
def test_what_a_critic_forbids_is_forbidden_whatever_its_weight(scale):
    scene = random_scene(default_rng(2))
    scene.costmap.data[:] = 0
    critics = {"Odd": FixedCosts(scale, {5: math.inf}, otherwise=3.0)}
    scores = Scoring(RolloutGenerator(PARAMS, 20.0), critics).score_all(scene)
    assert np.isinf(scores.totals).sum() == 1 and scores.totals[5] == np.inf
    assert scores.best().total == 3.0 * scale


def test_forbidden_signs_are_kept():
    params = replace(
        PARAMS,
        Oscillation=OscillationParams(oscillation_reset_dist=-1.0, oscillation_reset_angle=-1.0),
    )
    critics = build_critics(params)
    rng = default_rng(3)
    scoring = Scoring(RolloutGenerator(params, 20.0), critics)
    for velocity in (
        Twist2D(0.2, 0.0, 0.3),
        Twist2D(-0.2, 0.0, 0.3),
        Twist2D(0.0, 0.0, 0.3),
        Twist2D(0.0, 0.0, -0.3),
    ):
        critics["Oscillation"].debrief(random_scene(rng), velocity)
    forbidden = 0
    for _ in range(40):
        scene = random_scene(rng)
        prepare(critics, scene)
        choice = scoring.best(scene)
        scores = scoring.score_all(scene)
        if choice is not None:
            assert choice == scores.best()
            assert choice.command.linear_x <= 0.0
            assert choice.command.angular_z <= 0.0
            assert scores.rejections()["Oscillation"] == int(np.isinf(scores.raw[1]).sum())
            forbidden += scores.rejections()["Oscillation"]
    assert forbidden > 1000


@pytest.mark.parametrize("limited", [False, True])
def test_ends_are_those_of_the_rollouts_to_the_last_bit(limited):
    rng = default_rng(1)
    for granularity in (0.025, 0.4):  # the latter with turns beyond the range of the series
        params = replace(
            VARIANTS["limited" if limited else "standard"], angular_granularity=granularity
        )
        generator = RolloutGenerator(params, 20.0)
        for _ in range(20):
            scene = random_scene(rng)
            driven = generator.generate(scene.pose, scene.velocity)
            pose = scene.pose
            v = scene.velocity
            robot = np.array((pose.x, pose.y, pose.yaw, v.linear_x, v.linear_y, v.angular_z))
            x, y, yaw, sine, cosine = end_poses(
                robot, driven.commands, driven.steps, generator.sampling.limits, params.sim_time
            )
            assert_array_equal(x, driven.x[:, -1])
            assert_array_equal(y, driven.y[:, -1])
            assert_array_equal(yaw, driven.yaw[:, -1])
            assert_allclose((sine, cosine), (np.sin(yaw), np.cos(yaw)), atol=1e-12)


def test_a_nose_on_a_border_is_in_the_cell_of_the_exact_cosine():
    yaw = np.linspace(-3.0, 3.0, 50)
    ends = np.stack((np.zeros(50), np.zeros(50), yaw, np.sin(yaw) + 1e-12, np.cos(yaw) - 1e-12))
    scene = random_scene(default_rng(0))
    for k in range(50):  # the grid's origin makes nose k lie exactly on a border
        grid = (0.1 * math.cos(yaw[k]) - 1.0, 0.1 * math.sin(yaw[k]) - 1.0, 0.05)
        cells = np.empty((2, 50), dtype=np.int32)
        locate(ends, 0.1, scene.situation._replace(grid=grid), cells)
        expected = np.stack((0.1 * np.cos(yaw) - grid[0], 0.1 * np.sin(yaw) - grid[1])) / 0.05
        assert_array_equal(cells, np.floor(expected))


@pytest.mark.parametrize(
    ("change", "is_quick"),
    [
        ({"critics": (*STANDARD_CRITICS, "Twirling")}, True),
        ({"PathDist": DistParams(aggregation_type="sum")}, True),
        ({"PathDist": DistParams(scale=-1.0)}, False),
        ({"BaseObstacle": ObstacleParams(sum_scores=True)}, True),
        ({"critics": OUTLINES, "ObstacleFootprint": ObstacleParams(sum_scores=True)}, True),
        ({"limit_vel_cmd_in_traj": True}, False),
        ({"discretize_by_time": True}, False),
        ({"max_vel_y": 0.2}, False),
    ],
)
def test_where_the_ends_do_not_tell_everything_the_choice_is_the_same(change, is_quick):
    params = replace(PARAMS, **change)
    assert (check_choices(params, build_critics(params), default_rng(2)) > 15) == is_quick


def test_it_follows_a_speed_limit_and_the_scores_told_afterwards_are_those_of_the_cycle():
    controller = DwbController(PARAMS, SMALL_ROBOT, 20.0)
    rng = default_rng(8)
    for limit in (0.0, 0.4):
        controller.set_speed_limit(limit, is_percentage=False)
        for _ in range(10):
            scene = random_scene(rng)
            state = RobotState(scene.pose, scene.velocity)
            decision = controller.decide(state, scene.plan, scene.goal, Surroundings(scene.costmap))
            assert decision.command.linear_x <= (limit or 1.5) + 1e-4
            if decision.is_legal:
                assert decision.choice == decision.scores.best()
                told = decision.record()
                assert told.total == pytest.approx(
                    sum(score.weighted for score in told.scores), rel=1e-5
                )

"""The choice by the ends of the trajectories is the one that all scores make."""

import math
from dataclasses import replace

import numpy as np
import pytest

from navstack.control.controller import Surroundings
from navstack.control.dwb import end_score_kernels
from navstack.control.dwb.critics import build_critics
from navstack.control.dwb.decision import Choice, Explanation, score_all
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.dwb.end_choice import EndChoice
from navstack.control.dwb.end_kernels import end_poses
from navstack.control.dwb.rollouts import RolloutGenerator
from navstack.control.dwb.scene import Scene
from navstack.costmap.costmap import Costmap
from navstack.params.dwb import AlignParams, DistParams, DwbParams, ObstacleParams, OscillationParams
from navstack.types import Pose2D, RobotState, Twist2D

STANDARD = ("RotateToGoal", "Oscillation", "BaseObstacle", "GoalAlign", "PathAlign", "PathDist", "GoalDist")
OUTLINES = tuple("ObstacleFootprint" if name == "BaseObstacle" else name for name in STANDARD)
PARAMS = DwbParams(
    critics=STANDARD,
    min_vel_x=-0.3,
    max_vel_x=1.5,
    max_speed_xy=1.5,
    max_vel_theta=1.2,
    min_speed_theta=0.1,
    acc_lim_x=2.5,
    decel_lim_x=-2.5,
    acc_lim_theta=3.5,
    decel_lim_theta=-3.5,
    vx_samples=9,
    vtheta_samples=10,
    linear_granularity=0.05,
    BaseObstacle=ObstacleParams(scale=0.02),
    ObstacleFootprint=ObstacleParams(scale=3.0),
    GoalAlign=AlignParams(scale=24.0, forward_point_distance=0.1),
    PathAlign=AlignParams(scale=32.0, forward_point_distance=0.1),
    PathDist=DistParams(scale=32.0),
    GoalDist=DistParams(scale=24.0),
)
FOOTPRINT = np.array(((0.2, 0.2), (0.2, -0.2), (-0.4, -0.2), (-0.4, 0.2)))
SIZE, RESOLUTION = 100, 0.05  # cells along a side, [m]


def random_scene(rng: np.random.Generator) -> Scene:
    """A curved plan that may leave the map, past obstacles and unknown cells; sometimes the robot stands in one."""
    costs = rng.integers(0, 200, (SIZE, SIZE)).astype(np.uint8)
    for cost in (253, 254, 255):
        for _ in range(int(rng.integers(0, 12))):
            my, mx = rng.integers(0, SIZE - 4, 2)
            costs[my : my + 4, mx : mx + 4] = cost
    heading = rng.uniform(-math.pi, math.pi) + np.cumsum(rng.uniform(-0.1, 0.1, 70))
    xy = np.cumsum(rng.choice((0.03, 0.12)) * np.column_stack((np.cos(heading), np.sin(heading))), axis=0)
    plan = np.column_stack((xy + rng.uniform(-0.3, 0.3, 2), heading))
    pose = Pose2D(*rng.uniform(-0.6, 0.6, 2), heading[0] + rng.uniform(-1.0, 1.0))
    velocity = Twist2D(rng.uniform(-0.3, 1.5), 0.0, rng.uniform(-1.2, 1.2))
    half = SIZE * RESOLUTION / 2.0
    costmap = Costmap(costs, RESOLUTION, -half + rng.uniform(-1.0, 1.0), -half)
    return Scene(pose, velocity, 0.0, Pose2D(*plan[-1].tolist()), plan, costmap, FOOTPRINT)


VARIANTS = {
    "standard": PARAMS,
    "limited": replace(PARAMS, trajectory_generator_name="dwb_plugins::LimitedAccelGenerator"),
    "other noses": replace(
        PARAMS, GoalAlign=AlignParams(24.0), PathAlign=AlignParams(32.0, forward_point_distance=0.2)
    ),
    "few critics": replace(PARAMS, critics=("GoalAlign", "PathDist")),
    "no obstacles": replace(PARAMS, critics=("GoalDist", "PathAlign", "PathDist", "Oscillation")),
    "alignment only": replace(PARAMS, critics=("PathAlign", "GoalAlign")),
    "obstacles only": replace(PARAMS, critics=("BaseObstacle",)),
    "outlines": replace(PARAMS, critics=OUTLINES),
    "outlines and the way": replace(PARAMS, critics=("ObstacleFootprint", "PathAlign")),
    "outlines and centres": replace(PARAMS, critics=("GoalDist", "BaseObstacle", "ObstacleFootprint")),
    "outlines only": replace(PARAMS, critics=("ObstacleFootprint",)),
    "wide turns": replace(PARAMS, angular_granularity=0.3, linear_granularity=0.4),
}


@pytest.mark.parametrize("name", VARIANTS)
def test_it_is_the_choice_of_all_scores_on_random_scenes(name: str) -> None:
    rng = np.random.default_rng(len(name))
    params = VARIANTS[name]
    generator, critics = RolloutGenerator(params, 20.0), build_critics(params)
    chooser = EndChoice(generator, critics)
    made = 0
    for _ in range(60):
        scene = random_scene(rng)
        for critic in critics.values():
            critic.prepare(scene)
        choice, expected = chooser.choose(scene), Choice.of(score_all(generator, critics, scene))
        assert choice == expected or (choice is None)
        if choice is not None:
            scores = score_all(generator, critics, scene)
            told = None if "ObstacleFootprint" in critics else Explanation.of(scores, critics, choice.index)
            assert chooser.explain(scene) == told
        if choice is None:
            assert math.isinf(expected.total) or len(scene.path_cells) == 0 or "GoalAlign" in critics
        made += choice is not None
        for critic in critics.values():
            critic.debrief(scene, expected.command)
    assert made > 25


def test_rejections_are_those_of_all_scores_in_open_space_and_at_the_borders() -> None:
    rng = np.random.default_rng(4)
    params = replace(PARAMS, max_vel_x=0.8, max_speed_xy=0.8)
    generator, critics = RolloutGenerator(params, 20.0), build_critics(params)
    chooser = EndChoice(generator, critics)
    free, off = 0, {"BaseObstacle": 0, "GoalAlign": 0}
    for _ in range(300):
        scene = random_scene(rng)
        scene.costmap.data[scene.costmap.data >= 253] = 0
        if rng.random() < 0.5:  # one obstacle somewhere
            my, mx = rng.integers(0, SIZE, 2)
            scene.costmap.data[my, mx] = 253
        half = rng.choice((0.1, 0.5)) * SIZE * RESOLUTION
        place = rng.uniform(-half, half, 2)
        scene.pose = Pose2D(*place.tolist(), scene.pose.yaw)
        scene.velocity = Twist2D(rng.uniform(-0.3, 0.8), 0.0, scene.velocity.angular_z)
        for critic in critics.values():
            critic.prepare(scene)
        choice = chooser.choose(scene)
        if choice is not None:
            told = chooser.explain(scene)
            assert told == Explanation.of(score_all(generator, critics, scene), critics, choice.index)
            assert math.isclose(sum(told.weighted.values()), choice.total, rel_tol=1e-5)
            free += not told.rejections
            for name in off:
                off[name] += told.rejections.get(name, 0)
    assert free > 30
    assert off["BaseObstacle"] > 200
    assert off["GoalAlign"] > 10


def test_forbidden_signs_are_kept() -> None:
    params = replace(PARAMS, Oscillation=OscillationParams(oscillation_reset_dist=-1.0, oscillation_reset_angle=-1.0))
    generator, critics = RolloutGenerator(params, 20.0), build_critics(params)
    chooser, rng = EndChoice(generator, critics), np.random.default_rng(3)
    for velocity in (Twist2D(0.2, 0.0, 0.3), Twist2D(-0.2, 0.0, 0.3), Twist2D(0.0, 0.0, 0.3), Twist2D(0.0, 0.0, -0.3)):
        critics["Oscillation"].debrief(random_scene(rng), velocity)
    forbidden = 0
    for _ in range(40):
        scene = random_scene(rng)
        for critic in critics.values():
            critic.prepare(scene)
        scores = score_all(generator, critics, scene)
        choice = chooser.choose(scene)
        if choice is not None:
            assert choice == Choice.of(scores)
            told = chooser.explain(scene)
            assert told == Explanation.of(scores, critics, choice.index)
            assert told.rejections["Oscillation"] > 0
            assert choice.command.linear_x <= 0.0
            assert choice.command.angular_z <= 0.0
            forbidden += int(np.isinf(scores.raw[1]).sum())
    assert forbidden > 1000


@pytest.mark.parametrize("limited", [False, True])
def test_ends_are_those_of_the_rollouts_to_the_last_bit(limited: bool) -> None:
    rng = np.random.default_rng(1)
    for granularity in (0.025, 0.4):  # the latter with turns beyond the range of the series
        params = replace(VARIANTS["limited" if limited else "standard"], angular_granularity=granularity)
        generator = RolloutGenerator(params, 20.0)
        for _ in range(20):
            scene = random_scene(rng)
            rollouts = generator.generate(scene.pose, scene.velocity)
            pose, v = scene.pose, scene.velocity
            robot = np.array((pose.x, pose.y, pose.yaw, v.linear_x, v.linear_y, v.angular_z))
            x, y, yaw, sine, cosine = end_poses(
                robot, rollouts.commands, rollouts.steps, generator.limits, params.sim_time
            )
            np.testing.assert_array_equal(x, rollouts.x[:, -1])
            np.testing.assert_array_equal(y, rollouts.y[:, -1])
            np.testing.assert_array_equal(yaw, rollouts.yaw[:, -1])
            np.testing.assert_allclose((sine, cosine), (np.sin(yaw), np.cos(yaw)), atol=1e-12)


def test_a_nose_on_a_border_is_in_the_cell_of_the_exact_cosine() -> None:
    yaw = np.linspace(-3.0, 3.0, 50)
    ends = np.stack((np.zeros(50), np.zeros(50), yaw, np.sin(yaw) + 1e-12, np.cos(yaw) - 1e-12))
    for k in range(50):  # the grid's origin makes nose k lie exactly on a border
        grid = (0.1 * math.cos(yaw[k]) - 1.0, 0.1 * math.sin(yaw[k]) - 1.0, 0.05)
        cells = np.empty((2, 50), dtype=np.int32)
        end_score_kernels.locate(ends, 0.1, 60, 60, grid, cells)
        expected = np.stack((0.1 * np.cos(yaw) - grid[0], 0.1 * np.sin(yaw) - grid[1])) / 0.05
        np.testing.assert_array_equal(cells, np.floor(expected))


@pytest.mark.parametrize(
    "change",
    [
        {"critics": (*STANDARD, "Twirling")},
        {"limit_vel_cmd_in_traj": True},
        {"discretize_by_time": True},
        {"max_vel_y": 0.2},
        {"PathDist": DistParams(aggregation_type="sum")},
        {"PathDist": DistParams(scale=-1.0)},
        {"BaseObstacle": ObstacleParams(sum_scores=True)},
        {"critics": OUTLINES, "ObstacleFootprint": ObstacleParams(sum_scores=True)},
    ],
)
def test_where_the_ends_do_not_tell_everything_it_does_not_choose(change: dict) -> None:
    params = replace(PARAMS, **change)
    generator, critics = RolloutGenerator(params, 20.0), build_critics(params)
    scene = random_scene(np.random.default_rng(2))
    for critic in critics.values():
        critic.prepare(scene)
    assert EndChoice(generator, critics).choose(scene) is None


def test_it_follows_a_speed_limit_and_the_scores_told_afterwards_are_those_of_the_cycle() -> None:
    controller, rng = DwbController(PARAMS, FOOTPRINT, 20.0), np.random.default_rng(8)
    for limit in (0.0, 0.4):
        controller.set_speed_limit(limit, is_percentage=False)
        for _ in range(10):
            scene = random_scene(rng)
            state = RobotState(scene.pose, scene.velocity)
            decision = controller.decide(state, scene.plan, scene.goal, Surroundings(scene.costmap))
            assert decision.command.linear_x <= (limit or 1.5) + 1e-4
            if decision.is_legal:
                assert decision.choice == Choice.of(decision.scores)
                told = decision.record()
                assert told.total == pytest.approx(sum(score.weighted for score in told.scores), rel=1e-5)

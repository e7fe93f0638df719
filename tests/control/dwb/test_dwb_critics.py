"""Every critic keeps the contract, and each does what its name says."""

import math

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx

from navstack.control.dwb.critics import build_critics
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.rollouts import RolloutGenerator
from navstack.control.dwb.scene import DwbScene
from navstack.costmap.costmap import Costmap
from navstack.errors import ParameterError, UnknownNameError
from navstack.params.dwb import (
    AlignParams,
    DistParams,
    DwbParams,
    OscillationParams,
    RotateToGoalParams,
)
from navstack.params.registry.controllers import DWB_CRITICS as CRITICS
from navstack.types import Pose2D, Twist2D

from ..given import SMALL_ROBOT

LIMITS = {
    "min_vel_x": -0.5,
    "max_vel_x": 1.0,
    "max_vel_theta": 1.2,
    "max_speed_xy": 1.0,
    "acc_lim_x": 2.5,
    "decel_lim_x": -2.5,
    "acc_lim_theta": 3.5,
    "decel_lim_theta": -3.5,
    "vx_samples": 8,
    "vtheta_samples": 7,
    "linear_granularity": 0.05,
}
HERE = Pose2D(0.0, 0.0, 0.1)


def make_params(**more):
    return DwbParams(**{**LIMITS, **more})


def make_scene(costs=None, pose=HERE, **more):
    costs = np.zeros((120, 120), dtype=np.uint8) if costs is None else costs
    plan = np.zeros((60, 3))
    plan[:, 0] = np.linspace(-0.5, 2.0, 60)
    fields = {
        "pose": pose,
        "velocity": Twist2D(0.4, 0.0, 0.1),
        "stamp": 3.0,
        "goal": Pose2D(2.0, 0.0, 0.0),
        "plan": plan,
        "costmap": Costmap(costs, 0.05, -3.0, -3.0),
        "footprint": SMALL_ROBOT,
    }
    return DwbScene(**{**fields, **more})


def roll_out(params, scene):
    rollouts = RolloutGenerator(params, 20.0).generate(scene.pose, scene.velocity)
    scene.rollouts = rollouts
    return rollouts


def make_critic(name, params=None):
    params = params or make_params()
    critic: Critic = CRITICS[name].create(getattr(params, name), parts={"dwb": params})
    return critic


def random_costs(seed):
    rng = default_rng(seed)
    costs = rng.integers(0, 200, (120, 120)).astype(np.uint8)
    costs[rng.random(costs.shape) < 0.002] = 254
    costs[rng.random(costs.shape) < 0.001] = 255
    return costs


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", CRITICS)
def test_contract(name, seed):
    rng = default_rng(seed)
    scene = make_scene(
        random_costs(seed), Pose2D(*rng.uniform((-2.5, -2.5, -3.0), (2.5, 2.5, 3.0)))
    )
    rollouts = roll_out(make_params(), scene)
    before = (
        rollouts.x.copy(),
        rollouts.yaw.copy(),
        rollouts.commands.copy(),
        scene.costmap.data.copy(),
    )
    answers = []
    for _ in range(2):
        critic = make_critic(name)
        critic.prepare(scene)
        assert critic.scale(scene) >= 0.0
        answers.append(critic.raw_costs(rollouts, scene).copy())
        critic.debrief(scene, Twist2D(0.3, 0.0, 0.1))
        critic.reset()
        critic.prepare(scene)
        answers.append(critic.raw_costs(rollouts, scene).copy())
    for answer in answers:
        assert answer.shape == (len(rollouts.commands),)
        assert answer.dtype == np.float64
        assert (answer >= 0.0).all()  # neither negative nor NaN
        assert_array_equal(answer, answers[0])
    after = rollouts.x, rollouts.yaw, rollouts.commands, scene.costmap.data
    for old, new in zip(before, after, strict=True):
        assert_array_equal(old, new)


@pytest.mark.parametrize("name", CRITICS)
def test_nothing_to_score_is_no_error(name):
    params = DwbParams()  # all limits 0: no sample moves
    scene = make_scene()
    rollouts = roll_out(params, scene)
    critic = make_critic(name, params)
    critic.prepare(scene)
    assert critic.raw_costs(rollouts, scene).shape == (0,)


@pytest.mark.parametrize(
    "given", ["PathDist", "PathDistCritic", "dwb_critics::PathDist", "dwb_critics::PathDistCritic"]
)
def test_names_as_nav2_resolves_them(given):
    assert list(build_critics(make_params(critics=(given,)))) == ["PathDist"]


@pytest.mark.parametrize("given", ["PathDistance", "my_critics::PathDist"])
def test_unknown_name_is_answered_with_the_nearest(given):
    with pytest.raises(UnknownNameError, match="did you mean 'PathDist'"):
        build_critics(make_params(critics=(given,)))


def test_wrong_values_are_named():
    with pytest.raises(UnknownNameError, match="unknown aggregation_type 'mean'"):
        build_critics(
            make_params(critics=("PathDist",), PathDist=DistParams(aggregation_type="mean"))
        )
    with pytest.raises(UnknownNameError, match="unknown trajectory generator"):
        RolloutGenerator(make_params(trajectory_generator_name="Custom"), 20.0)
    with pytest.raises(ParameterError, match="linear_granularity 0.0 must be more than 0"):
        make_params(linear_granularity=0.0)


@pytest.mark.parametrize(
    ("samples", "steps", "is_allowed"),
    [((20, 1, 20), 5000, True), ((3, 1, 0), 666_667, False), ((0, 3, 1), 666_666, True)],
)
def test_no_more_than_two_million_poses_are_made(samples, steps, is_allowed):
    names = ("vx_samples", "vy_samples", "vtheta_samples")
    given: dict[str, object] = dict(zip(names, samples, strict=True))
    given |= {"sim_time": float(steps), "time_granularity": 1.0, "discretize_by_time": True}
    if is_allowed:
        RolloutGenerator(make_params(**given), 20.0)
    else:
        with pytest.raises(
            ParameterError, match="make 3 trajectories of 666,667 poses; at most 2,000,000 poses"
        ):
            make_params(**given)


def test_base_obstacle_minds_the_centre_and_obstacle_footprint_the_outline():
    costs = np.zeros((120, 120), dtype=np.uint8)
    # 0.5 m ahead, 0.2 m to the left: beside the centre's way, under the outline
    costs[64, 70] = 254
    scene = make_scene(costs, Pose2D())
    rollouts = roll_out(make_params(), scene)
    straight = int(np.argmax(rollouts.commands[:, 0] - 10.0 * np.abs(rollouts.commands[:, 2])))
    assert make_critic("BaseObstacle").raw_costs(rollouts, scene)[straight] == 0.0
    assert make_critic("ObstacleFootprint").raw_costs(rollouts, scene)[straight] == math.inf


def test_a_trajectory_off_the_map_is_illegal_for_whoever_reads_the_map():
    scene = make_scene(pose=Pose2D(2.8, 0.0, 0.0))
    params = make_params()
    rollouts = roll_out(params, scene)
    off = rollouts.x[:, -1] >= 3.0
    assert 0 < off.sum() < len(off)
    for name in ("BaseObstacle", "PathDist", "GoalDist"):
        critic = make_critic(name)
        critic.prepare(scene)
        assert_array_equal(np.isinf(critic.raw_costs(rollouts, scene)), off)


def test_without_a_plan_on_the_map_dist_rejects_all_and_align_is_indifferent():
    plan = np.zeros((5, 3))
    plan[:, 0] = np.linspace(50.0, 51.0, 5)
    scene = make_scene(plan=plan)
    rollouts = roll_out(make_params(), scene)
    for name, expected in (
        ("PathDist", math.inf),
        ("GoalDist", math.inf),
        ("PathAlign", 120 * 120 + 1.0),
    ):
        critic = make_critic(name)
        critic.prepare(scene)
        assert (critic.raw_costs(rollouts, scene) == expected).all()


@pytest.mark.parametrize("aggregation", ["last", "sum", "product"])
def test_aggregation_over_the_real_poses_only(aggregation):
    scene = make_scene(pose=Pose2D(0.0, 0.4, 0.2))
    params = make_params(PathDist=DistParams(aggregation_type=aggregation))
    rollouts = roll_out(params, scene)
    critic = make_critic("PathDist", params)
    critic.prepare(scene)
    ours = critic.raw_costs(rollouts, scene)
    rows = np.floor((rollouts.y + 3.0) / 0.05)
    columns = np.floor((rollouts.x + 3.0) / 0.05)
    plan = np.arange(50, 100)  # columns from -0.5 to 2.0 m, in row 60
    least = np.abs(columns[..., None] - plan).min(axis=-1) + np.abs(rows - 60)
    for k in range(len(ours)):
        distances = least[k, : rollouts.lengths[k]]
        expected = {"last": distances[-1], "sum": distances.sum(), "product": distances.prod()}[
            aggregation
        ]
        assert ours[k] == approx(expected, rel=1e-12)


def test_align_scores_the_nose():
    scene = make_scene(pose=Pose2D(0.0, 0.0, 0.0))
    params = make_params(PathAlign=AlignParams(forward_point_distance=0.5))
    rollouts = roll_out(params, scene)
    critic = make_critic("PathAlign", params)
    critic.prepare(scene)
    costs = critic.raw_costs(rollouts, scene)
    nose_x = rollouts.x[:, -1] + 0.5 * np.cos(rollouts.yaw[:, -1])
    nose_y = rollouts.y[:, -1] + 0.5 * np.sin(rollouts.yaw[:, -1])
    beside = (nose_x > -0.4) & (nose_x < 1.9)  # the plan runs along y = 0 from -0.5 to 2.0 m
    assert beside.sum() > 20
    rows = np.floor((nose_y + 3.0) / 0.05)
    assert_array_equal(costs[beside], np.abs(rows - 60)[beside])
    near_goal = make_scene(pose=Pose2D(1.6, 0.0, 0.0))
    assert critic.scale(near_goal) == 0.0
    assert critic.scale(scene) == approx(0.05 * 0.5)


def test_rotate_to_goal_slows_down_then_only_turns():
    params = make_params(xy_goal_tolerance=0.5)
    critic = make_critic("RotateToGoal", params)
    far = make_scene(pose=Pose2D(0.0, 0.0, 0.0))
    rollouts = roll_out(params, far)
    critic.prepare(far)
    assert (critic.raw_costs(rollouts, far) == 0.0).all()

    moving = make_scene(pose=Pose2D(1.7, 0.0, 0.0), goal=Pose2D(2.0, 0.0, 1.0))
    rollouts = roll_out(params, moving)
    critic.prepare(moving)
    speeds = np.abs(rollouts.commands[:, 0])
    costs = critic.raw_costs(rollouts, moving)
    assert_array_equal(np.isinf(costs), speeds >= 0.4)
    slow = speeds < 0.4
    expected = 5.0 * speeds**2 + np.abs(1.0 - rollouts.yaw[:, -1])
    assert_allclose(costs[slow], expected[slow], atol=1e-12)

    rollouts.commands[:3] = ((0.4, 0.0, 0.0), (np.nextafter(0.4, 0.0), 0.0, 0.0), (-0.4, 0.0, 0.0))
    # not slower is illegal
    assert np.isinf(critic.raw_costs(rollouts, moving))[:3].tolist() == [True, False, True]
    speeds = np.abs(rollouts.commands[:, 0])

    stopped = make_scene(
        pose=Pose2D(1.7, 0.0, 0.0),
        goal=Pose2D(2.0, 0.0, 1.0),
        velocity=Twist2D(0.1, 0.0, 0.0),
    )
    critic.prepare(stopped)
    critic.prepare(moving)  # remembered, although the robot moves again
    assert_array_equal(np.isinf(critic.raw_costs(rollouts, moving)), speeds > 0.0)


def test_rotate_to_goal_looks_ahead_in_time():
    params = make_params(
        xy_goal_tolerance=0.5,
        max_vel_x=0.0,
        min_vel_x=0.0,
        RotateToGoal=RotateToGoalParams(lookahead_time=0.5),
    )
    scene = make_scene(
        pose=Pose2D(1.7, 0.0, 0.0),
        goal=Pose2D(2.0, 0.0, 1.0),
        velocity=Twist2D(0.0, 0.0, 1.2),
    )
    rollouts = roll_out(params, scene)
    critic = make_critic("RotateToGoal", params)
    critic.prepare(scene)
    fastest = int(rollouts.commands[:, 2].argmax())
    assert critic.raw_costs(rollouts, scene)[fastest] == approx(abs(1.0 - 0.5 * 1.2), abs=1e-9)
    assert_allclose(rollouts.yaw_at(99.0), rollouts.yaw[:, -1])


def test_rotate_to_goal_may_look_at_the_heading_of_now():
    scene = make_scene(
        pose=Pose2D(1.7, 0.0, 0.2),
        goal=Pose2D(2.0, 0.0, 1.0),
        velocity=Twist2D(0.5),
    )
    for time, is_alike in ((0.0, True), (-1.0, False)):  # a negative time: the last pose
        params = make_params(
            xy_goal_tolerance=0.5, RotateToGoal=RotateToGoalParams(lookahead_time=time)
        )
        rollouts = roll_out(params, scene)
        critic = make_critic("RotateToGoal", params)
        critic.prepare(scene)
        costs = critic.raw_costs(rollouts, scene) - 5.0 * rollouts.commands[:, 0] ** 2
        assert np.allclose(costs[np.isfinite(costs)], 0.8, atol=1e-12) == is_alike


def test_a_short_plan_is_asked_for_only_when_so_set():
    near = make_scene(pose=Pose2D(1.9, 0.0, 0.0), velocity=Twist2D())
    # the plan is 2.5 m long
    for tolerance, rejects in ((math.inf, True), (2.0, False), (3.0, True)):
        params = make_params(path_length_tolerance=tolerance)
        rollouts = roll_out(params, near)
        critic = make_critic("RotateToGoal", params)
        critic.prepare(near)
        assert np.isinf(critic.raw_costs(rollouts, near)).any() == rejects


@pytest.mark.parametrize(
    ("given", "place", "stamp", "still_forbidden"),
    [
        ({}, (0.04, 0.0, 0.1), 3.0, True),
        ({}, (0.06, 0.0, 0.1), 3.0, False),
        ({}, (-0.06, 0.0, 0.1), 3.0, False),
        ({}, (0.0, -0.06, 0.1), 3.0, False),
        ({}, (0.037, 0.037, 0.1), 3.0, False),  # 0.0523 m away
        ({}, (0.034, -0.034, 0.1), 3.0, True),  # 0.0481 m
        ({}, (0.0, 0.0, 0.35), 3.0, False),
        ({}, (0.0, 0.0, -0.15), 3.0, False),  # turned by 0.25 rad
        ({}, (0.0, 0.0, -0.05), 3.0, True),
        ({"angle": -1.0}, (0.0, 0.0, 0.35), 3.0, True),
        ({}, (0.0, 0.0, 0.1), 99.0, True),
        ({"time": 2.0}, (0.0, 0.0, 0.1), 5.5, False),
        ({"time": 0.5}, (0.0, 0.0, 0.1), 3.6, False),
        ({"time": 0.5}, (0.0, 0.0, 0.1), 3.4, True),
        ({"dist": -1.0}, (0.06, 0.0, 0.1), 3.0, True),
    ],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_oscillation_forbids_a_second_turn_until_reset(given, place, stamp, still_forbidden, side):
    params = {f"oscillation_reset_{name}": value for name, value in given.items()}
    critic = make_critic("Oscillation", make_params(Oscillation=OscillationParams(**params)))
    here = make_scene()
    there = make_scene(pose=Pose2D(*place), stamp=stamp)
    rollouts = roll_out(make_params(), here)
    turns_back = side * rollouts.commands[:, 2] > 0.0
    critic.debrief(here, Twist2D(angular_z=0.5 * side))
    critic.prepare(here)
    assert (critic.raw_costs(rollouts, here) == 0.0).all()
    # the first change is allowed, going back is not
    critic.debrief(here, Twist2D(angular_z=-0.5 * side))
    # of the cycle that ended with this command
    assert (critic.raw_costs(rollouts, here) == 0.0).all()
    critic.prepare(here)
    assert_array_equal(np.isinf(critic.raw_costs(rollouts, here)), turns_back)
    critic.debrief(there, Twist2D())
    critic.prepare(there)
    assert np.isinf(critic.raw_costs(rollouts, here)).any() == still_forbidden


def test_oscillation_minds_turning_only_while_hardly_driving():
    critic = make_critic("Oscillation")
    scene = make_scene()
    rollouts = roll_out(make_params(), scene)
    for yaw_rate in (0.5, -0.5):
        critic.debrief(scene, Twist2D(0.5, 0.0, yaw_rate))
    critic.prepare(scene)
    assert (critic.raw_costs(rollouts, scene) == 0.0).all()


def test_prefer_forward_and_twirling():
    scene = make_scene()
    rollouts = roll_out(make_params(), scene)
    forward = make_critic("PreferForward").raw_costs(rollouts, scene)
    for (vx, _, yaw_rate), cost in zip(rollouts.commands, forward, strict=True):
        penalised = vx < 0.0 or (vx < 0.1 and abs(yaw_rate) < 0.2)
        assert cost == (1.0 if penalised else abs(yaw_rate) * 10.0)
    assert_array_equal(
        make_critic("Twirling").raw_costs(rollouts, scene), np.abs(rollouts.commands[:, 2])
    )

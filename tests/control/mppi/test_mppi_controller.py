"""MPPI as a controller: what it drives, keeps to and tells, and its place in a Nav2 file."""

import math
from dataclasses import replace
from pathlib import Path as FilePath

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_array_equal
from pytest import approx

from navstack.control.controller import Surroundings
from navstack.control.mppi.mppi_controller import MppiController
from navstack.control.rotation_shim import RotationShimController
from navstack.errors import InvalidPathError, NoLegalVelocity, ParameterError
from navstack.geometry import compose
from navstack.params.costmap import InflationLayerParams
from navstack.params.extensions import algorithms
from navstack.params.filters import KeepoutFilterParams, SpeedFilterParams
from navstack.params.local_costs import LocalCosts
from navstack.params.mppi import MppiParams
from navstack.params.mppi_critics import CostParams, PathAlignParams
from navstack.params.nav2_file.file import inspect_nav2, load_nav2
from navstack.params.nav2_file.views import (
    _local_costs,
    read_controller,
    read_costmap,
    read_primary_controller,
)
from navstack.params.rotation_shim import RotationShimParams
from navstack.types import Path, Pose2D, RobotState, Twist2D

from ..given import DELIVERY_ROBOT, LAYER, command_of, inflated, moved, robot, straight

FREQUENCY = 20.0  # [Hz]
CRITICS = (  # of Nav2's own file
    "ConstraintCritic",
    "CostCritic",
    "GoalCritic",
    "GoalAngleCritic",
    "PathAlignCritic",
    "PathFollowCritic",
    "PathAngleCritic",
    "PreferForwardCritic",
)
PARAMS = MppiParams(
    critics=CRITICS,
    batch_size=600,
    vx_max=1.0,
    vx_min=0.0,
    vx_std=0.4,
    prune_distance=3.0,
    local_costs=LocalCosts({"inflation_layer": LAYER}, ends_inflated=True),
    CostCritic=CostParams(consider_footprint=True),
)


def make(params=PARAMS, seed=0, frequency=FREQUENCY):
    controller = MppiController(params, DELIVERY_ROBOT, frequency, xy_goal_tolerance=0.25)
    controller.seed(default_rng(seed))
    return controller


def surroundings(*boxes):
    return Surroundings(inflated(400, 200, (-5.0, -5.0), *boxes))


FREE = surroundings()


def line(length=6.0):
    return straight(length, count=round(length / 0.05) + 1)


ORIGIN = Pose2D()


def ask(controller, at=None, plan=None, around=FREE):
    return command_of(controller, at, line() if plan is None else plan, around)


def drive(controller, plan, seconds, around=FREE, pose=ORIGIN):
    """Rows (t, x, y, yaw, v, w) of a robot that does at once as it is told.

    It ends at the plan's end.
    """
    twist = Twist2D()
    rows = []
    for cycle in range(round(seconds * FREQUENCY)):
        stamp = cycle / FREQUENCY
        twist = ask(controller, RobotState(pose, twist, stamp), plan, around)
        pose = moved(pose, twist, 1.0 / FREQUENCY)
        rows.append((stamp, pose.x, pose.y, pose.yaw, twist.linear_x, twist.angular_z))
        if math.hypot(pose.x - plan.poses[-1, 0], pose.y - plan.poses[-1, 1]) < 0.25:
            break
    return np.array(rows)


def test_it_drives_to_the_end_of_a_path():
    rows = drive(make(), line(), 12.0)
    assert rows[-1, 0] < 11.0
    assert abs(rows[-1, 2]) < 0.1
    assert rows[:, 4].max() > 0.9  # [m/s] nearly as fast as it may


def test_it_turns_to_a_path_behind_it():
    rows = drive(make(), line(), 12.0, pose=Pose2D(yaw=2.8))
    assert math.hypot(rows[-1, 1] - 6.0, rows[-1, 2]) < 0.25
    assert rows[:, 4].min() >= 0.0


def test_it_drives_around_what_the_path_goes_round():
    x = np.linspace(0.0, 6.0, 121)
    y = 1.1 * np.exp(-((x - 3.0) ** 2) / 1.2)
    plan = Path(np.column_stack((x, y, np.arctan2(np.gradient(y), np.gradient(x)))))
    around = surroundings((2.8, 3.2, -0.4, 0.1))
    rows = drive(make(), plan, 15.0, around)
    assert math.hypot(rows[-1, 1] - 6.0, rows[-1, 2]) < 0.25
    for _, px, py, yaw, _, _ in rows[::5]:
        corners = (px, py) + DELIVERY_ROBOT @ np.array(
            ((math.cos(yaw), math.sin(yaw)), (-math.sin(yaw), math.cos(yaw)))
        )
        assert max(around.costmap.cost_at(*corner) for corner in corners) < 254


def test_control_cost_bounds_the_speed():
    """The speed at which PathFollowCritic's pull and the control cost balance.

    Weight dt std^2 / gamma.
    """
    weight = PARAMS.PathFollowCritic.cost_weight
    std = 0.2
    rows = drive(make(replace(PARAMS, vx_max=2.0, vx_std=std, batch_size=2000)), line(12.0), 6.0)
    assert rows[-40:, 4].mean() == approx(weight * 0.05 * std**2 / PARAMS.gamma, rel=0.08)


@pytest.mark.parametrize("seed", range(6))
def test_limits_are_held_wherever_it_stands(seed):
    rng = default_rng(seed)
    params = replace(
        PARAMS,
        vx_min=-0.3,
        ax_max=1.5,
        ax_min=-2.0,
        az_max=2.0,
        wz_max=0.8,
        batch_size=200,
        vx_std=0.6,
    )
    controller = make(params, seed)
    sequences = controller._optimizer
    for cycle in range(40):
        pose = Pose2D(*rng.uniform((-0.5, -0.5, -3.0), (2.0, 0.5, 3.0)))
        twist = Twist2D(*rng.uniform((-0.3, 0.0, -0.8), (1.0, 0.0, 0.8)))
        command = ask(controller, RobotState(pose, twist, cycle / FREQUENCY))
        assert -0.3 <= command.linear_x <= 1.0
        assert abs(command.angular_z) <= 0.8 + 1e-6
        sequences._limit(sequences._sequences)
        changes, turns = np.diff(sequences._sequences) * FREQUENCY
        is_forward = sequences._sequences[0, :-1] > 0.0
        sped_up = np.where(is_forward, changes, -changes)  # backwards, speeds are negative
        assert sped_up.min() >= -2.0 - 1e-4
        assert sped_up.max() <= 1.5 + 1e-4
        assert abs(turns).max() <= 2.0 + 1e-4


@pytest.mark.parametrize("least", [1.0, 1.5])
def test_a_least_speed_above_the_largest_gives_the_largest(least):
    """Nav2's ``utils::clamp`` takes the upper bound last."""
    controller = make(replace(PARAMS, vx_max=0.3, vx_min=least, batch_size=200))
    state = RobotState(ORIGIN, Twist2D(linear_x=0.3), 0.0)
    assert ask(controller, state).linear_x == approx(0.3, abs=1e-6)


def test_a_sequence_that_the_optimizer_leaves_keeps_the_limits_before_it_is_smoothed(
    monkeypatch,
):
    kept = []
    controller = make(replace(PARAMS, ax_max=1.0, ax_min=-1.5, az_max=1.0, wz_max=0.5))
    conclude = controller._optimizer._conclude

    def spy(colliding):
        kept.append(controller._optimizer._sequences.copy())
        return conclude(colliding)

    monkeypatch.setattr(controller._optimizer, "_conclude", spy)
    drive(controller, line(), 2.0)
    for v, w in kept:
        assert v.min() >= 0.0
        assert v.max() <= 1.0
        assert abs(w).max() <= 0.5
        assert np.diff(v).max() <= 0.05 + 1e-6
        assert np.diff(v).min() >= -0.075 - 1e-6
        assert abs(np.diff(w)).max() <= 0.05 + 1e-6


def test_where_all_collide_it_tries_again_and_says_so(monkeypatch):
    controller = make(replace(PARAMS, retry_attempt_limit=2))
    inside = surroundings((-3.0, 3.0, -3.0, 3.0))
    attempts = []
    optimize = controller._optimizer._optimize
    monkeypatch.setattr(
        controller._optimizer, "_optimize", lambda scene: attempts.append(1) or optimize(scene)
    )
    with pytest.raises(NoLegalVelocity) as error:
        ask(controller, around=inside)
    assert error.value.rejections == {"CostCritic": 600}
    assert len(attempts) == 3
    told = controller.decision
    assert told is not None
    assert told.status == "failed"
    assert told.total is None
    assert told.rejected == told.samples == 600
    assert [score.rejections for score in told.scores if score.critic == "CostCritic"] == [600]


def test_a_second_attempt_may_succeed(monkeypatch):
    controller = make()
    optimizer = controller._optimizer
    answers = [{"CostCritic": 600}, {"CostCritic": 3}]
    monkeypatch.setattr(optimizer, "_optimize", lambda scene: answers.pop(0))
    optimizer._sequences[0] = 1.0
    command = ask(controller)
    # the sequence was forgotten before the second one
    assert command == Twist2D()
    assert not answers


def test_an_omnidirectional_robot_slides_to_a_path_beside_it():
    params = replace(PARAMS, motion_model="Omni", vy_max=0.6, vy_std=0.3, ay_max=1.5, ay_min=1.5)
    controller = make(params)
    pose = Pose2D(0.0, 0.6)
    twist = Twist2D()
    sideways = []
    for cycle in range(round(4.0 * FREQUENCY)):
        state = RobotState(pose, twist, cycle / FREQUENCY)
        twist = ask(controller, state)
        sideways.append(twist.linear_y)
        step = np.array((twist.linear_x, twist.linear_y, twist.angular_z)) / FREQUENCY
        pose = compose(pose, Pose2D(*step))
    assert abs(pose.y) < 0.1
    assert pose.x > 2.0
    assert min(sideways) < -0.1
    assert np.abs(sideways).max() <= 0.6
    assert ask(make(), state).linear_y == 0.0


def test_same_generator_same_commands():
    first, again, other = (drive(make(seed=seed), line(), 1.5) for seed in (5, 5, 6))
    assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_noise_is_kept_until_the_next_reset_unless_it_is_to_be_new():
    state = robot()
    controller = make()
    ask(controller, state)
    noise = controller._optimizer._noise
    ask(controller, replace(state, stamp=0.05))
    assert controller._optimizer._noise is noise
    controller.reset()
    ask(controller, state)
    assert not np.array_equal(controller._optimizer._noise.values, noise.values)
    assert noise.values.std(axis=(1, 2)) == approx(0.4, rel=0.02)

    controller = make(replace(PARAMS, regenerate_noises=True))
    ask(controller, state)
    noise = controller._optimizer._noise
    ask(controller, replace(state, stamp=0.05))
    assert not np.array_equal(controller._optimizer._noise.values, noise.values)


def test_the_sequence_is_forgotten_after_a_pause():
    """As in Humble; later ones keep it until the attempt ends."""
    for period, forgets in ((1.0, True), (None, False)):
        controller = make(replace(PARAMS, reset_period=period))
        drive(controller, line(), 1.0)
        kept = controller._optimizer._sequences[0].copy()
        assert kept.max() > 0.3
        ask(controller, robot(stamp=10.0))
        assert (controller._optimizer._sequences[0].max() < 0.5 * kept.max()) == forgets


def test_one_value_is_used_per_cycle_where_the_model_step_is_a_control_period():
    state = robot(v=0.5)
    for frequency, index in ((20.0, 1), (50.0, 0)):
        controller = make(frequency=frequency)
        command = ask(controller, state)
        solution = controller._cycle.solution
        assert command.linear_x == approx(solution.sequences[0, index])
        kept = solution.sequences[0, index:]
        assert_array_equal(controller._optimizer._sequences[0][: len(kept)], kept)
    with pytest.raises(ParameterError, match="shorter than a control period"):
        make(frequency=10.0)


def test_a_speed_limit_lowers_the_speed_and_can_be_lifted():
    controller = make()
    controller.set_speed_limit(0.4, is_percentage=False)
    assert drive(controller, line(), 3.0)[:, 4].max() <= 0.4 + 1e-6
    controller.reset()
    assert drive(controller, line(), 3.0)[:, 4].max() <= 0.4 + 1e-6
    for limit, is_percentage in ((3.0, False), (150.0, True)):  # no limit makes it faster
        controller.set_speed_limit(limit, is_percentage)
        assert drive(controller, line(), 4.0)[:, 4].max() <= 1.0 + 1e-6
    controller.set_speed_limit(70.0, is_percentage=True)
    assert 0.5 < drive(controller, line(), 4.0)[:, 4].max() <= 0.7 + 1e-6
    controller.set_speed_limit(0.0, is_percentage=False)
    assert drive(controller, line(), 4.0)[:, 4].max() > 0.8


def test_a_decision_tells_what_the_chosen_sequence_costs():
    controller = make()
    assert controller.decision is None
    rows = drive(controller, line(), 2.0)
    told = controller.decision
    assert told is not None
    assert told.decided_by == "MPPIController"
    assert told.status == "solved"
    assert told.command == Twist2D(rows[-1, 4], 0.0, rows[-1, 5])
    assert told.samples == 600
    assert [score.critic for score in told.scores] == list(CRITICS)
    weighted = {score.critic: score.weighted for score in told.scores}
    assert weighted["GoalCritic"] is None
    assert weighted["PathFollowCritic"] > 0.1
    assert told.total == approx(sum(value for value in weighted.values() if value is not None))
    raw = {score.critic: score.raw for score in told.scores}
    assert weighted["PathFollowCritic"] == approx(5.0 * raw["PathFollowCritic"])
    sequence = controller._optimizer._sequences[0].copy()
    assert controller.decision == told  # asking changes nothing
    assert_array_equal(controller._optimizer._sequences[0], sequence)


def test_plans_that_cannot_be_followed():
    state = robot()
    with pytest.raises(InvalidPathError, match="no poses"):
        ask(make(), state, Path(np.empty((0, 3))))
    with pytest.raises(InvalidPathError, match="off the local costmap"):
        ask(make(), state, Path(line().poses + (40.0, 0.0, 0.0)))


def test_a_cusp_ends_the_path_until_the_robot_is_there():
    there = np.column_stack((np.linspace(0.0, 2.0, 41), np.zeros((41, 2))))
    back = np.column_stack((np.linspace(1.95, 0.0, 40), np.zeros((40, 2))))
    plan = Path(np.vstack((there, back)))
    controller = make(replace(PARAMS, enforce_path_inversion=True, prune_distance=10.0))
    handler = controller._path_handler
    assert len(handler.near(plan, Pose2D(0.0, 0.0, 0.0), FREE.costmap)) == 41
    assert len(handler.near(plan, Pose2D(1.9, 0.0, 0.1), FREE.costmap)) <= 4
    assert len(handler.near(plan, Pose2D(1.9, 0.0, 0.1), FREE.costmap)) >= 38


def test_the_plans_end_is_no_cusp():
    handler = make(replace(PARAMS, enforce_path_inversion=True, prune_distance=10.0))._path_handler
    plan = Path(np.column_stack((np.linspace(0.0, 2.0, 41), np.zeros((41, 2)))))
    for _ in range(3):
        assert handler.near(plan, Pose2D(2.0, 0.0, 0.0), FREE.costmap)[-1].tolist() == [
            2.0,
            0.0,
            0.0,
        ]


FILE = """
controller_server:
  ros__parameters:
    controller_frequency: 20.0
    controller_plugins: ["FollowPath"]
    FollowPath:
      plugin: "nav2_mppi_controller::MPPIController"
      vx_max: 0.8
      visualize: true
      TrajectoryVisualizer:
        trajectory_step: 5
      critics: ["CostCritic", "PathAlignCritic"]
      PathAlignCritic:
        cost_weight: 14.0
local_costmap:
  local_costmap:
    ros__parameters:
      track_unknown_space: true
      footprint: "[[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]"
      plugins: ["obstacle_layer", "inflation_layer"]
      obstacle_layer:
        plugin: "nav2_costmap_2d::ObstacleLayer"
      inflation_layer:
        plugin: "nav2_costmap_2d::InflationLayer"
        inflation_radius: 0.7
"""


def loaded(folder, text):
    path = folder / "robot.yaml"
    path.write_text(text)
    return load_nav2(path)


def test_a_nav2_file_gives_its_parameters_and_nav2s_defaults(tmp_path):
    file = loaded(tmp_path, FILE)
    plugin = read_controller(file)
    costs = LocalCosts(
        {"inflation_layer": InflationLayerParams(inflation_radius=0.7)}, True, False, True
    )
    assert plugin.params == MppiParams(
        vx_max=0.8,
        critics=("CostCritic", "PathAlignCritic"),
        PathAlignCritic=PathAlignParams(cost_weight=14.0),
        local_costs=costs,
    )
    own = {name for name in file.ignored if "FollowPath" in name}
    assert own == {
        "controller_server: FollowPath.visualize",
        "controller_server: FollowPath.TrajectoryVisualizer",
    }
    parts = {"footprint": DELIVERY_ROBOT, "control_frequency": 20.0, "xy_goal_tolerance": 0.25}
    assert isinstance(
        algorithms("controllers")[plugin.type].create(plugin.params, parts=parts), MppiController
    )


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (
            "motion_model: Tracks",
            "motion_model Tracks must be one of DiffDrive, Ackermann, Omni",
        ),
        (
            "motion_model: Omni\n      vy_std: 0.0",
            "vy_std 0.0 must be 0.001 or more with Omni",
        ),
    ],
)
def test_one_line_says_what_is_wrong(tmp_path, line, said):
    with pytest.raises(ParameterError) as error:
        loaded(tmp_path, FILE.replace("vx_max: 0.8", line))
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "extreme",
    [
        *({"temperature": value} for value in (1e-6, 1e6)),
        *({"gamma": value, "vx_std": 1e-3, "wz_std": 1e-3} for value in (0.0, 1e3)),
        *({"vx_std": value, "wz_std": value, "gamma": 1e3} for value in (1e-3, 1e3)),
        *(
            {"model_dt": 1.0, "ax_max": value, "ax_min": value, "az_max": value}
            for value in (1e-3, 1e3)
        ),
        *({"vx_max": value, "wz_max": value} for value in (1e-3, 100.0)),
        *({"prune_distance": value, "max_robot_pose_search_dist": -value} for value in (0.01, 1e4)),
        *({"time_steps": 2, "iteration_count": count} for count in (1, 1000)),
        {
            "CostCritic": CostParams(
                cost_power=10,
                cost_weight=1e6,
                collision_cost=1e9,
                trajectory_point_step=10_000,
            )
        },
        {
            "PathAlignCritic": PathAlignParams(
                cost_power=10,
                cost_weight=1e6,
                offset_from_furthest=10_000,
            )
        },
        {"PathAlignCritic": PathAlignParams(offset_from_furthest=0, trajectory_point_step=10_000)},
    ],
)
def test_the_ends_of_the_allowed_ranges_can_be_used(extreme):
    controller = make(replace(PARAMS, batch_size=50, **extreme))
    for around in (FREE, surroundings((1.0, 1.3, -0.2, 0.1))):
        for stamp in range(3):
            state = robot(stamp=0.05 * stamp)
            try:
                command = ask(controller, state, around=around)
            except NoLegalVelocity:
                continue
            assert math.isfinite(command.linear_x)
            assert math.isfinite(command.angular_z)


def test_a_robot_of_a_radius_has_no_outline(tmp_path):
    text = FILE.replace("vx_max: 0.8", "CostCritic.consider_footprint: true")
    text = text.replace('      footprint: "[[', '      robot_base_frame: "[[')
    with pytest.raises(ParameterError, match="local_costmap has no footprint"):
        read_controller(loaded(tmp_path, text))


def test_it_runs_below_a_rotation_shim(tmp_path):
    shim = """      plugin: "nav2_rotation_shim_controller::RotationShimController"
      primary_controller: "nav2_mppi_controller::MPPIController"
"""
    text = FILE.replace('      plugin: "nav2_mppi_controller::MPPIController"\n', shim)
    file = loaded(tmp_path, text)
    primary = read_primary_controller(file, read_controller(file))
    assert primary.params.vx_max == 0.8
    assert primary.params.PathAlignCritic.cost_weight == 14.0
    below = RotationShimController(RotationShimParams(), make(), DELIVERY_ROBOT, 20.0, 0.25)
    below.seed(default_rng(0))
    assert ask(below).linear_x > 0.0


def test_the_stacks_file_is_without_errors():
    path = FilePath(__file__).parents[3] / "params" / "nav2" / "mppi.yaml"
    file = inspect_nav2(path)
    assert not file.errors
    plugin = read_controller(file)
    assert plugin.params.critics == CRITICS
    assert plugin.params.local_costs.ends_inflated


@pytest.mark.parametrize(
    ("last", "ends_inflated"),
    [
        (SpeedFilterParams(filter_info_topic="info"), True),
        (KeepoutFilterParams(filter_info_topic="info"), False),
    ],
)
def test_only_a_filter_that_writes_costs_hides_distances(last, ends_inflated):
    costmap = read_costmap(
        load_nav2(FilePath(__file__).parents[3] / "params" / "nav2" / "mppi.yaml"), "local_costmap"
    )
    filtered = replace(costmap, filters=("last",), layers={**costmap.layers, "last": last})
    assert _local_costs(filtered).ends_inflated == ends_inflated


def test_numbers_that_are_none_are_forgotten():
    critics = ("PathAlignCritic", "PathFollowCritic")  # nobody looks for collisions
    controller = make(replace(PARAMS, critics=critics))
    free = surroundings()
    plan = line()
    sound = ask(controller, robot(v=0.5), plan, free)
    assert math.isfinite(sound.linear_x)
    assert sound.linear_x > 0.1
    for stamp, pose, twist in (
        (0.05, Pose2D(yaw=math.nan), Twist2D(0.5)),
        (0.10, Pose2D(), Twist2D(math.inf)),
        (0.15, Pose2D(), Twist2D(0.5, 0.0, math.nan)),
    ):
        with pytest.raises(NoLegalVelocity, match="no finite cost 600"):
            ask(controller, RobotState(pose, twist, stamp), plan, free)
    again = ask(controller, robot(v=0.5, stamp=0.2), plan, free)
    assert math.isfinite(again.linear_x)
    assert again.linear_x > 0.1

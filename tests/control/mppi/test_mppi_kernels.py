"""MPPI's kernels against a slow twin in NumPy.

Trajectories, every critic, the update of the sequence.
"""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx

from navstack.control.footprint_cost import outline_cost, walk_outline
from navstack.control.mppi import control_sequence
from navstack.control.mppi.body import clearance, make_body
from navstack.control.mppi.critics import build_critics
from navstack.control.mppi.optimizer import Noise, Optimizer
from navstack.control.mppi.path_critics import MppiPathAlignCritic
from navstack.control.mppi.path_handler import first_cusp, window
from navstack.control.mppi.path_kernels import furthest_point, nearest_along, nearest_table
from navstack.control.mppi.rollouts import MppiRollouts, roll_out
from navstack.control.mppi.scene import MppiScene
from navstack.params.local_costs import LocalCosts
from navstack.params.mppi import CRITICS, OMNI, AckermannParams, MppiParams
from navstack.params.mppi_critics import (
    CostParams,
    GoalAngleParams,
    ObstaclesParams,
    PathAlignParams,
    PathAngleParams,
    VelocityDeadbandParams,
)
from navstack.types import Pose2D, RobotState, Twist2D

from ..given import DELIVERY_ROBOT, LAYER, inflated
from . import mppi_twin

COSTS = LocalCosts({"inflation_layer": LAYER}, ends_inflated=True)
TOLERANCE = 0.3  # [m] xy, of the goal checker
FLOAT = np.float32
ALL = MppiParams(
    # its twin: test_expected_contact.py
    critics=tuple(name for name in CRITICS if name != "ExpectedContactCritic"),
    batch_size=150,
    vx_max=1.5,
    vx_min=-0.3,
    vx_std=0.5,
    ax_max=2.0,
    ax_min=-2.5,
    prune_distance=4.0,
    local_costs=COSTS,
    CostCritic=CostParams(consider_footprint=True),
    PathAlignCritic=PathAlignParams(offset_from_furthest=5),
)


def costmap_with(*boxes, unknown=None):
    made = inflated(240, 240, (-6.0, -6.0), *boxes)
    if unknown is not None:
        made.data[unknown] = 255
    return made


BOXES = [
    (1.0, 1.3, 0.6, 1.0),
    (2.0, 2.2, -1.2, -0.7),
    (3.0, 3.4, 0.7, 0.8),
    (-1.5, -1.2, -0.2, 0.4),
]
GRIDS = {
    "free": costmap_with(),
    "boxes": costmap_with(*BOXES),
    "blocked": costmap_with((1.5, 1.9, -0.5, 0.4), *BOXES),
    "unknown": costmap_with(*BOXES, unknown=(slice(100, 140), slice(150, 160))),
}
POSES = {  # where the robot is, and how fast
    "on the path": (Pose2D(0.02, -0.03, 0.1), Twist2D(0.9, 0.0, 0.2)),
    "looking back": (Pose2D(0.31, 0.21, 2.6), Twist2D(0.0, 0.0, -0.4)),
    "before the goal": (Pose2D(3.31, -0.02, -0.3), Twist2D(0.5, 0.0, 0.0)),
    "at the goal": (Pose2D(3.89, -0.12, 0.2), Twist2D(0.1, 0.0, 0.1)),
    "at the edge": (Pose2D(-5.71, 0.12, 2.9), Twist2D(0.8, 0.0, 0.0)),
}


def bent_path():
    x = np.linspace(0.0, 4.0, 81)
    y = 0.3 * np.sin(x)
    return np.column_stack((x, y, np.arctan2(np.gradient(y), np.gradient(x))))


def both(params, grid, place, seed=0):
    """Kernels' rollouts and scene, and the twin, after the same samples."""
    pose, twist = POSES[place]
    rng = default_rng(seed)
    steps = np.arange(params.time_steps)
    axes = 3 if params.motion_model == OMNI else 2
    sequences = np.array(
        (
            np.linspace(twist.linear_x, 1.0, len(steps)),
            0.3 * np.sin(steps / 9.0),
            0.2 * np.cos(steps / 7.0),
        )
    ).astype(FLOAT)[:axes]
    noise = rng.standard_normal((axes, len(steps), params.batch_size), dtype=FLOAT)
    noise *= np.array((0.5, 0.4, 0.3), dtype=FLOAT)[:axes, None, None]
    path = bent_path()
    goal = Pose2D(*path[-1])
    scene = MppiScene(
        RobotState(pose, twist, 0.0), path, goal, GRIDS[grid], params.local_costs.tracks_unknown
    )
    critics = build_critics(params, DELIVERY_ROBOT, TOLERANCE)
    optimizer = Optimizer(params, critics, 0.05)
    optimizer.seed(rng)
    sampled = Noise(noise, float(np.abs(noise[1]).max()))
    rollouts = optimizer._roll_out(optimizer._rollouts, sequences, sampled, scene)
    twin = mppi_twin.Twin(params, DELIVERY_ROBOT, TOLERANCE)
    twin.roll_out(noise.transpose(0, 2, 1), sequences.astype(float), pose, twist)
    twin.look(path, goal, pose, GRIDS[grid])
    return rollouts, scene, optimizer, twin, sequences


@pytest.mark.parametrize("motion_model", ["DiffDrive", OMNI])
@pytest.mark.parametrize("az_max", [3.5, 400.0], ids=["small turns", "large turns"])
def test_trajectories_are_the_twins(az_max, motion_model):
    params = replace(
        ALL,
        az_max=az_max,
        model_dt=0.05 if az_max < 10.0 else 0.5,
        motion_model=motion_model,
    )
    rollouts, _, _, twin, _ = both(params, "free", "on the path")
    pose = POSES["on the path"][0]
    assert np.abs(twin.w).max() * params.model_dt > (0.0 if az_max < 10.0 else 0.7)
    assert_allclose(rollouts.x.T, twin.x - pose.x, atol=2e-5)
    assert_allclose(rollouts.y.T, twin.y - pose.y, atol=2e-5)
    assert_allclose(rollouts.yaw.T, twin.yaw, atol=2e-5)
    assert_allclose(rollouts.cosine.T, np.cos(twin.yaw), atol=2e-5)
    for controls, expected in zip(rollouts.controls, twin.controls, strict=True):
        assert_allclose(controls[1:].T, expected, atol=1e-6)
    assert (rollouts.vy is None) == (motion_model != OMNI)


def compare_critics(params, grid, place, tolerance, seed=0):
    """Every critic's weighted scores and its count of collisions with the twin's.

    Returns the names of those that score there.
    """
    scoring = []
    rollouts, scene, optimizer, twin, _ = both(params, grid, place, seed)
    # Single precision puts a few poses into another cell: trajectories with poses that near to an
    # edge are left out.
    cells = np.stack(((twin.x + 6.0) / 0.05, (twin.y + 6.0) / 0.05))
    safe = (abs(cells - np.round(cells)) > 2e-4).all(axis=(0, 2))
    assert safe.mean() > 0.8
    for critic in optimizer._critics:
        scores = critic.score(rollouts, scene)
        expected = twin.cost_of(critic.name)
        assert (scores is None) == (expected is None), critic.name
        if scores is None:
            continue
        scoring.append(critic.name)
        found = critic.weighted(scores.raw)
        # the least of all is subtracted, that of an unsafe one perhaps
        if critic.name == "ObstaclesCritic" and critic.power == 1:
            found = found - np.median((found - expected)[safe])
        assert_allclose(found[safe], expected[safe], **tolerance, err_msg=critic.name)
        if critic.name in ("CostCritic", "ObstaclesCritic"):
            assert abs(scores.colliding - twin.hits.sum()) <= (~safe).sum()
    return scoring


@pytest.mark.parametrize("place", POSES)
@pytest.mark.parametrize("grid", GRIDS)
def test_every_critic_costs_what_the_twin_says(grid, place):
    assert len(compare_critics(ALL, grid, place, {"rtol": 2e-4, "atol": 2e-3})) >= 3


@pytest.mark.parametrize("place", ["before the goal", "at the goal"])
def test_a_symmetric_robot_may_look_the_other_way_at_the_goal(place):
    params = replace(
        ALL,
        critics=("GoalAngleCritic",),
        GoalAngleCritic=GoalAngleParams(symmetric_yaw_tolerance=True, threshold_to_consider=2.0),
    )
    tolerance = {"rtol": 2e-4, "atol": 2e-3}
    assert compare_critics(params, "free", place, tolerance) == ["GoalAngleCritic"]
    rollouts, scene, optimizer, _, _ = both(params, "free", place)
    rollouts.yaw[:] = scene.path_yaw[-1] + FLOAT(math.pi - 0.5)
    assert_allclose(optimizer._critics[0].score(rollouts, scene).raw, 0.5, atol=1e-5)


def test_an_obstacle_under_the_outline_counts_without_an_inflation_layer():
    """The robot's centre is in a free cell; a lethal one lies under its rear."""
    params = replace(
        ALL,
        critics=("ObstaclesCritic",),
        local_costs=LocalCosts(),
        ObstaclesCritic=ObstaclesParams(consider_footprint=True),
    )
    rollouts, scene, optimizer, _, _ = both(params, "free", "on the path")
    critic = optimizer._critics[0]
    assert critic.score(rollouts, scene).colliding == 0
    scene.costs = np.zeros_like(scene.costs)
    scene.costs[117:120, 109:112] = 254  # half a metre behind the robot's place
    assert critic.score(rollouts, scene).colliding == len(rollouts.x[0])


def test_the_scenes_try_all_critics():
    counted = dict.fromkeys(ALL.critics, 0)
    for place in POSES:
        rollouts, scene, optimizer, _, _ = both(ALL, "boxes", place)
        for critic in optimizer._critics:
            counted[critic.name] += critic.score(rollouts, scene) is not None
    assert min(counted.values()) >= 1


@pytest.mark.parametrize(
    "changed",
    [
        {"PathAngleCritic": PathAngleParams(mode=1, max_angle_to_furthest=0.0)},
        {"PathAngleCritic": PathAngleParams(mode=2, max_angle_to_furthest=0.0, cost_power=2)},
        {"PathAngleCritic": PathAngleParams(mode=1, max_angle_to_furthest=0.0), "vx_min": 0.0},
        {
            "PathAlignCritic": PathAlignParams(
                offset_from_furthest=0,
                use_path_orientations=True,
                cost_power=3,
            )
        },
        {
            "CostCritic": CostParams(
                consider_footprint=False,
                trajectory_point_step=3,
                near_collision_cost=200,
            )
        },
        {"CostCritic": CostParams(consider_footprint=True), "local_costs": LocalCosts()},
        {
            "ObstaclesCritic": ObstaclesParams(
                consider_footprint=True,
                collision_margin_distance=0.6,
                cost_power=2,
            )
        },
        {
            # narrower than the robot: its outline counts where its centre has any cost
            "local_costs": LocalCosts(
                {"inflation_layer": replace(LAYER, inflation_radius=0.2)}, ends_inflated=True
            ),
            "ObstaclesCritic": ObstaclesParams(consider_footprint=True),
        },
        {"local_costs": replace(COSTS, tracks_unknown=True)},
        {
            "local_costs": replace(COSTS, tracks_unknown=True),
            "ObstaclesCritic": ObstaclesParams(consider_footprint=True),
        },
        {"motion_model": "Ackermann", "AckermannConstraints": AckermannParams(min_turning_r=0.9)},
        {"motion_model": OMNI, "vx_max": 0.3, "vy_max": 0.2, "vx_min": -0.1},
        {
            "motion_model": OMNI,
            "VelocityDeadbandCritic": VelocityDeadbandParams(deadband_velocities=(0.3, 0.2, 0.1)),
        },
    ],
    ids=lambda changed: " ".join(changed),
)
def test_options_of_critics(changed):
    params = replace(ALL, **changed)
    if not params.local_costs.inflation_layers:
        params = replace(
            params, critics=tuple(name for name in ALL.critics if name != "ObstaclesCritic")
        )
    for place in ("on the path", "looking back"):
        scoring = compare_critics(params, "unknown", place, {"rtol": 1e-3, "atol": 5e-3}, seed=3)
        assert len(scoring) >= 3


@pytest.mark.parametrize("motion_model", ["DiffDrive", OMNI])
def test_the_update_is_the_twins(motion_model):
    rollouts, _, optimizer, twin, sequences = both(
        replace(ALL, motion_model=motion_model), "boxes", "on the path"
    )
    costs = default_rng(1).uniform(0.0, 3.0, ALL.batch_size)
    optimizer._sequences = sequences.copy()
    optimizer._update(rollouts, costs.astype(FLOAT))
    assert_allclose(optimizer._sequences, twin.update(costs, sequences.astype(float)), atol=2e-5)


def test_smoothing_is_a_parabola_through_nine_values():
    rng = default_rng(2)
    for length in (21, 56):
        sequence = rng.standard_normal(length).astype(FLOAT)
        history = rng.standard_normal(4).astype(FLOAT)
        expected = mppi_twin.smoothed(sequence.astype(float), history.astype(float))
        control_sequence.smooth(sequence, history)
        assert_allclose(sequence, expected, atol=1e-6)
    short = np.arange(20, dtype=FLOAT) ** 2
    control_sequence.smooth(short, np.zeros(4, dtype=FLOAT))
    assert_array_equal(short, np.arange(20) ** 2)


def test_shares_prefer_the_cheap():
    shares = control_sequence.softmax(np.array((1.0, 1.3, 200.0), dtype=FLOAT), FLOAT(0.3))
    assert shares.sum() == approx(1.0)
    assert shares[2] == 0.0
    assert shares[0] / shares[1] == approx(math.e, rel=1e-5)


def test_no_turn_is_tighter_than_an_ackermanns_radius():
    v = np.array((1.0, -0.5, 0.0), dtype=FLOAT)
    w = np.array((3.0, -3.0, 1.0), dtype=FLOAT)
    control_sequence.limit_curvature(v, w, FLOAT(0.5))
    assert_allclose(w, (2.0, -1.0, 0.0))


def test_what_has_room_touches_nothing_within_it():
    rng = default_rng(4)
    grid = costmap_with(*[(x, x + 0.3, y, y + 0.2) for x, y in rng.uniform(-5.0, 5.0, (25, 2))])
    body = make_body(DELIVERY_ROBOT, True, COSTS, LAYER, 0.05)
    known = touched = 0
    for x, y, yaw in rng.uniform((-6.2, -6.2, -math.pi), (6.2, 6.2, math.pi), (4000, 3)):
        expected = outline_cost(grid.data, grid.grid, DELIVERY_ROBOT, x, y, yaw)
        place = ((x + 6.0) / 0.05, (y + 6.0) / 0.05, math.cos(yaw), math.sin(yaw))
        assert walk_outline(grid.data, (0.0, 0.0, 1.0), body.corners, *place, True) == expected
        touched += expected == 254
        room = clearance(grid.data, *place, body.circles, body.free_radius, body.radius, body.reach)
        near = np.array((x, y)) + rng.uniform(-1.0, 1.0, 2) * max(room, 0.0) * 0.05 / math.sqrt(2.0)
        for candidate in ((x, y), near):
            worst = outline_cost(grid.data, grid.grid, DELIVERY_ROBOT, *candidate, yaw)
            assert room < 0.0 or worst < 254
        known += room >= 0.0
    assert 400 < touched < 3600
    assert known > 400
    off_its_base = make_body(DELIVERY_ROBOT + (0.9, 0.9), True, COSTS, LAYER, 0.05)
    # circles are looked up on the map only
    assert np.hypot(*off_its_base.circles.T).max() <= off_its_base.radius
    blind = make_body(DELIVERY_ROBOT, True, replace(COSTS, ends_inflated=False), LAYER, 0.05)
    assert not blind.reach.any()  # nothing is known of distances
    earlier = replace(LAYER, cost_scaling_factor=1.0)  # it does not inflate what is marked after it
    both_layers = replace(COSTS, inflation_layers={"earlier": earlier, "last": LAYER})
    assert not make_body(
        DELIVERY_ROBOT, True, both_layers, both_layers.inflation(""), 0.05
    ).reach.any()
    last = both_layers.inflation("last")
    assert make_body(DELIVERY_ROBOT, True, both_layers, last, 0.05).reach.any()


def test_the_furthest_point_is_found_without_looking_at_all():
    rng = default_rng(6)
    for _ in range(50):
        path = np.cumsum(rng.normal((0.04, 0.0), 0.03, (120, 2)), axis=0).astype(FLOAT)
        ends = (path[rng.integers(0, 120, 40)] + rng.normal(0.0, 0.5, (40, 2))).astype(FLOAT)
        furthest = 0
        for end in ends:
            furthest += int(((path[furthest:] - end) ** 2).sum(axis=1).argmin())
        assert furthest_point(path[:, 0], path[:, 1], ends[:, 0], ends[:, 1]) == furthest
    same = np.zeros(5, dtype=FLOAT)
    assert furthest_point(same, same, same, same) == 0


def test_the_nearest_point_along_is_looked_up():
    rng = default_rng(7)
    for count in (1, 2, 90):
        length = np.r_[0.0, np.cumsum(rng.exponential(0.05, count - 1))].astype(FLOAT)
        table = nearest_table(length)
        for driven in rng.uniform(0.0, 1.2 * length[-1] + 0.1, 300).astype(FLOAT):
            found = nearest_along(driven, *table)
            assert abs(length[found] - driven) == approx(abs(length - driven).min(), abs=1e-6)
        for beyond in (1e30, math.inf, math.nan):
            assert nearest_along(FLOAT(beyond), *table) in (0, count - 1)


def test_the_window_begins_at_the_robot_and_ends_at_the_prune_distance():
    poses = np.column_stack((np.arange(0.0, 10.0, 0.1), np.zeros((100, 2))))
    assert window(poses, 0, 2.02, 0.5, 100.0, 1.0) == (20, 31)
    assert window(poses, 0, 2.02, 0.5, 1.05, 1.0)[0] == 10  # not looked for farther along
    assert window(poses, 30, 2.02, 0.5, 100.0, 100.0) == (30, 100)  # what is passed is passed


def test_a_cusp_is_where_the_path_turns_round():
    poses = np.zeros((9, 3))
    poses[:, 0] = (0.0, 1.0, 2.0, 3.0, 2.0, 1.0, 0.0, 1.0, 2.0)
    assert first_cusp(poses, 0) == 4
    assert first_cusp(poses, 4) == 7
    assert first_cusp(poses, 7) == 9


def test_a_cusp_is_the_first_bend_by_more_than_a_right_angle():
    rng = default_rng(8)
    for _ in range(200):
        poses = np.column_stack((np.cumsum(rng.normal(0.6, 0.5, (12, 2)), axis=0), np.zeros(12)))
        steps = np.diff(poses[:, :2], axis=0)
        begin = int(rng.integers(0, 8))
        turned = [i for i in range(begin + 1, 11) if steps[i - 1] @ steps[i] < 0.0]
        assert first_cusp(poses, begin) == (turned[0] + 1 if turned else 12)


def test_a_sequence_alone_is_one_trajectory():
    rollouts = MppiRollouts.empty(30, 1)
    rollouts.v[:] = 1.0
    rollouts.w[:] = 0.0
    roll_out(rollouts, FLOAT(math.pi / 2), FLOAT(0.1), FLOAT(0.1))
    assert_allclose(rollouts.y[:, 0], 0.1 * np.arange(1, 31), atol=1e-5)


@pytest.mark.parametrize(
    ("reached", "blocked", "counts"), [(20, 2, True), (20, 3, False), (50, 5, True), (50, 6, False)]
)
def test_a_path_that_is_blocked_too_much_is_not_aligned_to(monkeypatch, reached, blocked, counts):
    """Two points in obstacles are always ignored, of more of them a tenth of the points reached."""
    monkeypatch.setattr(
        "navstack.control.mppi.path_critics.mean_misalignment", lambda *given: np.ones(3)
    )
    own = PathAlignParams(max_path_occupancy_ratio=0.1)
    params = MppiParams(critics=("PathAlignCritic",), PathAlignCritic=own)
    critic = MppiPathAlignCritic("PathAlignCritic", params)
    free = np.arange(60) >= blocked
    scene = SimpleNamespace(
        goal_distance=9.0,
        furthest=lambda _: reached,
        free=free,
        path_x=free,
        path_y=free,
        path_yaw=free,
    )
    assert (critic.score(None, scene) is not None) == counts

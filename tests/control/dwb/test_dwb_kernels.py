"""DWB's kernels against slow twins in plain Python."""

import math

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal

from navstack.control.dwb import kernels
from navstack.control.dwb.choice_kernels import SampledDrive, is_legal
from navstack.control.dwb.critics.align import PathAlignCritic
from navstack.control.dwb.critics.obstacles import BaseObstacleCritic
from navstack.control.dwb.pose_score import (
    CELL_COST,
    GOAL_ALIGNMENT,
    GOAL_DISTANCE,
    OUTLINE_COST,
    PATH_DISTANCE,
    add_distances,
    locate,
)
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import DwbScene
from navstack.control.footprint_cost import footprint_cost, line_cost
from navstack.control.plan_handling import cells_of_points, densify, window_bounds
from navstack.costmap.costmap import LETHAL_OBSTACLE, NO_INFORMATION, Costmap
from navstack.params.dwb import AlignParams, DwbParams, ObstacleParams
from navstack.types import Pose2D, Twist2D

from ..given import box

ORIGIN = (-1.0, -0.5)
RESOLUTION = 0.05
SHAPE = (40, 60)  # cells [y, x]
NOTHING = np.empty((0, 3))


def random_poses(rng, count, length):
    """Poses of which about one in ten lies off the map of SHAPE."""
    x = rng.uniform(ORIGIN[0] - 0.1, ORIGIN[0] + SHAPE[1] * RESOLUTION + 0.1, (count, length))
    y = rng.uniform(ORIGIN[1] - 0.1, ORIGIN[1] + SHAPE[0] * RESOLUTION + 0.1, (count, length))
    return x, y


def make_scene(costmap, footprint=NOTHING, plan=NOTHING):
    """The robot stands at the origin."""
    return DwbScene(Pose2D(), Twist2D(), 0.0, Pose2D(), plan, costmap, footprint)


def roll_out_twin(start, velocity, command, limits, steps, sim_time):
    """StandardTrajectoryGenerator::generateTrajectory with a new sine and cosine in every step."""
    x, y, yaw = start
    v = list(velocity)
    dt = sim_time / steps
    poses = [(x, y, yaw)]
    for _ in range(steps):
        for axis in range(3):
            a, d = limits[axis]
            if v[axis] < command[axis]:
                v[axis] = min(command[axis], v[axis] + a * dt)
            else:
                v[axis] = max(command[axis], v[axis] + d * dt)
        x += (v[0] * math.cos(yaw) + v[1] * math.cos(math.pi / 2 + yaw)) * dt
        y += (v[0] * math.sin(yaw) + v[1] * math.sin(math.pi / 2 + yaw)) * dt
        yaw += v[2] * dt
        poses.append((x, y, yaw))
    return np.array(poses)


def test_rollouts_agree_with_the_direct_formula_and_repeat_the_last_pose():
    rng = default_rng(1)
    commands = rng.uniform((-1.0, -0.5, -2.0), (3.0, 0.5, 2.0), (50, 3))
    limits = np.array(((4.0, -3.0), (2.0, -2.0), (3.5, -3.0)))
    start = np.array((0.3, -0.2, 2.9))
    velocity = np.array((1.0, 0.1, -1.5))
    sim_time = 1.3
    steps = kernels.step_counts(commands, sim_time, 0.05, 0.025)
    x, y, yaw = (np.full((50, steps.max() + 2), np.nan) for _ in range(3))
    first = np.empty((50, 3))
    kernels.roll_out(start, velocity, commands, limits, steps, sim_time, x, y, yaw, first)
    for k in range(50):
        twin = roll_out_twin(start, velocity, commands[k], limits, int(steps[k]), sim_time)
        n = len(twin)
        ours = np.stack((x[k], y[k], yaw[k]), axis=1)
        assert_allclose(ours[:n], twin, atol=1e-12)
        assert_array_equal(ours[n:], np.broadcast_to(ours[n - 1], ours[n:].shape))
    compiled = x.copy(), y.copy(), yaw.copy(), first.copy()
    kernels.roll_out.py_func(start, velocity, commands, limits, steps, sim_time, x, y, yaw, first)
    for before, after in zip(compiled, (x, y, yaw, first), strict=True):
        assert_array_equal(before, after)  # the compiler changes no bit


def test_a_large_turn_per_step_is_exact_too():
    for angle in (-1.0, -0.100001, -0.1, -0.03, 0.0, 1e-9, 0.05, 0.0999, 0.1001, 2.0):
        sine, cosine = kernels.sine_cosine(angle)
        assert sine == pytest.approx(math.sin(angle), abs=1e-16)
        assert cosine == pytest.approx(math.cos(angle), abs=2.3e-16)


@pytest.mark.parametrize(
    "kind", [CELL_COST, OUTLINE_COST, PATH_DISTANCE, GOAL_DISTANCE, GOAL_ALIGNMENT]
)
def test_a_trajectory_is_legal_where_all_its_poses_are(kind):
    """Cells and outlines mind obstacles, distances the map's edge, and alignment nothing."""
    rng = default_rng(11)
    found = []
    costs = np.zeros(SHAPE, dtype=np.uint8)
    for cost in (252, 253, 254, 255):
        for y, x in rng.integers(0, (SHAPE[0] - 2, SHAPE[1] - 2), (4, 2)):
            costs[y : y + 2, x : x + 2] = cost
    outline = box(0.12, -0.1, 0.08)
    costmap = Costmap(costs, RESOLUTION, *ORIGIN)
    limits = np.array(((4.0, -3.0), (0.5, -9.0), (3.5, -2.0)))
    for _ in range(60):
        start = rng.uniform((-0.6, -0.1, -math.pi), (1.6, 1.1, math.pi))
        (now, command) = rng.uniform((-0.8, 0.0, -1.5), (1.5, 0.0, 1.5), (2, 3))
        steps = int(rng.integers(1, 30))
        expected = True
        for x, y, yaw in roll_out_twin(start, now, command, limits, steps, 1.5):
            mx, my = costmap.world_to_map(x, y)
            if not costmap.contains(mx, my):
                expected &= kind == GOAL_ALIGNMENT
            elif kind in (CELL_COST, OUTLINE_COST):
                turned = Pose2D(x, y, yaw)
                cost = (
                    int(costs[my, mx]) + 1
                    if kind == CELL_COST
                    else footprint_cost(costmap, outline, turned)
                )
                expected &= cost < LETHAL_OBSTACLE
        drive = SampledDrive(
            np.concatenate((start, now)), command[None], np.array((steps,)), limits, 1.5
        )
        situation = make_scene(costmap, outline).situation
        assert is_legal(drive, 0, np.array((GOAL_ALIGNMENT, kind)), situation) == expected
        found.append(expected)
    assert kind == GOAL_ALIGNMENT or 10 < sum(found) < 50


@pytest.mark.parametrize("by_time", [False, True])
def test_there_is_room_for_the_steps_of_every_sample(by_time):
    rng = default_rng(9)
    for _ in range(30):
        low = -rng.uniform(0.0, 3.0, 2)
        high = rng.uniform(0.0, 2.0, 2)
        params = DwbParams(
            critics=("PathDist",),
            min_vel_x=low[0],
            max_vel_x=high[0],
            min_vel_y=low[1],
            max_vel_y=high[1],
            max_vel_theta=float(rng.uniform(0.2, 3.0)),
            linear_granularity=0.1,
            angular_granularity=0.05,
            sim_time=1.7,
            discretize_by_time=by_time,
            time_granularity=0.3,
        )
        corners = [
            (x, y, params.max_vel_theta) for x in (low[0], high[0]) for y in (low[1], high[1])
        ]
        steps = [math.hypot(x, y) * 1.7 / 0.1 for x, y, _ in corners] + [
            params.max_vel_theta * 1.7 / 0.05
        ]
        most = 1.7 / 0.3 if by_time else max(steps)
        assert params.largest_steps - math.ceil(most) in (0, 1)
        assert params.largest_steps >= most


@pytest.mark.parametrize(
    ("forward", "turn", "steps"), [(2.0, 0.1, 21), (0.1, 1.0, 21), (0.05, 0.02, 1), (0.0, 0.0, 1)]
)
def test_there_is_room_for_a_step_more_of_samples_a_little_beyond_the_limits(forward, turn, steps):
    params = DwbParams(
        critics=("PathDist",),
        max_vel_x=forward,
        max_vel_theta=turn,
        sim_time=1.0,
        linear_granularity=0.1,
        angular_granularity=0.05,
    )
    assert params.largest_steps == steps


def test_step_counts_follow_the_command():
    commands = np.zeros((5, 3))
    commands[:, 0] = (0.0, 3.0, 3.0 + 4e-16, 0.3, 0.0)
    commands[3, 1] = 0.4
    commands[[0, 4], 2] = (0.01, -1.2)
    assert kernels.step_counts(commands, 1.0, 0.05, 0.025).tolist() == [1, 60, 61, 10, 48]


def cells_of(x, y, costmap):
    """The cells (2, M) of points as mx and my."""
    poses = np.zeros((5, x.size))
    poses[0] = x.ravel()
    poses[1] = y.ravel()
    cells = np.empty((2, x.size), dtype=np.int32)
    locate(poses, 0.0, make_scene(costmap).situation, cells)
    return cells


def test_cells_equal_the_costmaps_own_rule():
    x, y = random_poses(default_rng(2), 30, 12)
    costmap = Costmap(np.zeros(SHAPE, dtype=np.uint8), RESOLUTION, *ORIGIN)
    found = cells_of(x, y, costmap)
    assert 0.02 < (found < 0).mean() < 0.3
    for point, cell in zip(zip(x.ravel(), y.ravel(), strict=True), found.T.tolist(), strict=True):
        expected = costmap.world_to_map(*point)
        assert cell == (list(expected) if costmap.contains(*expected) else [-1, -1])


@pytest.mark.parametrize("sum_scores", [False, True])
def test_obstacle_costs_equal_the_twin(sum_scores):
    rng = default_rng(3)
    costs = rng.choice(
        np.array((0, 10, 100, 252, 253, 254, 255), dtype=np.uint8),
        200,
        p=(0.4, 0.3, 0.2, 0.07, 0.01, 0.01, 0.01),
    )
    costmap = Costmap(costs.reshape(10, 20), 1.0, 0.0, 0.0)
    cells = rng.integers(0, 200, (80, 10))
    lengths = rng.integers(1, 11, 80)
    cells[rng.random(cells.shape) < 0.03] = -1
    for k in range(80):
        cells[k, lengths[k] :] = cells[k, lengths[k] - 1]
    x = np.where(cells < 0, -1.0, cells % 20 + 0.5)
    y = cells // 20 + 0.5
    scene = make_scene(costmap)
    scene.rollouts = Rollouts(
        np.empty((80, 3)), lengths - 1, lengths, 1.0, lambda: (x, y, np.zeros_like(x))
    )
    critic = BaseObstacleCritic(ObstacleParams(sum_scores=sum_scores), DwbParams(critics=()))
    ours = critic.raw_costs(scene.rollouts, scene)
    for k in range(80):
        seen = [int(costs[c]) if c >= 0 else 255 for c in cells[k, : lengths[k]]]
        expected = math.inf if max(seen) >= 253 else sum(seen) if sum_scores else seen[-1]
        assert ours[k] == expected
    assert 10 < np.isinf(ours).sum() < 70


@pytest.mark.parametrize("aggregation", ["last", "sum"])
def test_distances_are_those_of_the_noses_to_the_plan(aggregation):
    rng = default_rng(7)
    x, y = random_poses(rng, 30, 6)
    yaw = rng.uniform(-4.0, 4.0, x.shape)
    costmap = Costmap(np.zeros(SHAPE, dtype=np.uint8), RESOLUTION, *ORIGIN)
    plan = np.array([(0.525, 0.525 + 0.05 * i, 0.0) for i in range(8)])
    scene = make_scene(costmap, plan=plan)
    rollouts = Rollouts(np.empty((30, 3)), np.full(30, 5), np.full(30, 6), 1.0, lambda: (x, y, yaw))
    params = AlignParams(aggregation_type=aggregation, forward_point_distance=0.3)
    ours = PathAlignCritic(params, DwbParams(critics=())).raw_costs(rollouts, scene)
    for k in range(30):
        expected = 0.0
        for t in range(5 if aggregation == "last" else 0, 6):
            mx, my = costmap.world_to_map(
                x[k, t] + 0.3 * math.cos(yaw[k, t]), y[k, t] + 0.3 * math.sin(yaw[k, t])
            )
            expected += min(abs(mx - 30) + abs(my - row) for row in range(20, 28))
            if not costmap.contains(mx, my):
                expected = math.inf
        assert ours[k] == expected
    assert 2 < np.isinf(ours).sum() < 30


def test_distances_equal_the_breadth_first_wave_front():
    rng = default_rng(4)
    seeds = np.stack((rng.integers(0, SHAPE[1], 9), rng.integers(0, SHAPE[0], 9)))
    grid = np.full(SHAPE, -1)
    front = [(int(mx), int(my)) for mx, my in seeds.T]
    for mx, my in front:
        grid[my, mx] = 0
    while front:
        following = []
        for mx, my in front:
            for nx, ny in ((mx + 1, my), (mx - 1, my), (mx, my + 1), (mx, my - 1)):
                if 0 <= nx < SHAPE[1] and 0 <= ny < SHAPE[0] and grid[ny, nx] < 0:
                    grid[ny, nx] = grid[my, mx] + 1
                    following.append((nx, ny))
        front = following
    my, mx = np.indices(SHAPE, dtype=np.int32)
    distances = np.zeros(grid.size)
    distances[-1] = math.inf  # illegal already
    add_distances(np.stack((mx.ravel(), my.ravel())), seeds.astype(np.int32), distances)
    assert_array_equal(distances[:-1], grid.ravel()[:-1])
    assert distances[-1] == math.inf


def test_totals_accumulate_in_float32_in_order():
    rng = default_rng(5)
    raw = rng.uniform(0.0, 1e4, (6, 40))
    raw[2, 7] = math.inf
    scales = rng.uniform(0.0, 3.0, 6).astype(np.float32)
    scales[4] = 0.0
    raw[4, 3] = math.inf  # of a critic that is left out
    ours = kernels.add_weighted(raw, scales)
    for k in range(40):
        total = np.float32(0.0)
        for c in (0, 1, 2, 3, 5):
            total = np.float32(float(total) + raw[c, k] * float(scales[c]))
        assert ours[k] == total
    assert ours.dtype == np.float32
    assert np.flatnonzero(np.isinf(ours)).tolist() == [7]


def bresenham_twin(x0, y0, x1, y1):
    """LineIterator of nav2_util, with its own variables."""
    dx = abs(x1 - x0)
    dy = abs(y1 - y0)
    inc1 = [1 if x1 >= x0 else -1, 1 if y1 >= y0 else -1]
    inc2 = [1 if x1 >= x0 else -1, 1 if y1 >= y0 else -1]
    if dx >= dy:
        inc1[0] = 0
        inc2[1] = 0
        den = dx
        add = dy
        pixels = dx
    else:
        inc2[0] = 0
        inc1[1] = 0
        den = dy
        add = dx
        pixels = dy
    num = den // 2
    x = x0
    y = y0
    cells = []
    for _ in range(pixels + 1):
        cells.append((x, y))
        num += add
        if num >= den:
            num -= den
            x = x + inc1[0]
            y = y + inc1[1]
        x = x + inc2[0]
        y = y + inc2[1]
    return cells


def test_line_cost_sees_exactly_the_cells_of_nav2s_line():
    rng = default_rng(6)
    costs = rng.integers(0, 256, (25, 25)).astype(np.uint8)
    for _ in range(300):
        x0, y0, x1, y1 = (int(v) for v in rng.integers(0, 25, 4))
        found = [int(costs[y, x]) for x, y in bresenham_twin(x0, y0, x1, y1)]
        expected = LETHAL_OBSTACLE if LETHAL_OBSTACLE in found else max(found)
        assert line_cost(costs, x0, y0, x1, y1) == expected
    assert line_cost(costs, 3, 4, 3, 4) == costs[4, 3]


def test_footprint_cost_turns_with_the_robot_and_ends_at_the_map():
    costs = np.zeros((100, 100), dtype=np.uint8)
    costs[49, 69] = LETHAL_OBSTACLE  # 1 m ahead of the centre
    costmap = Costmap(costs, 0.05, -2.475, -2.475)
    bar = box(1.0, -0.2, 0.1)
    assert footprint_cost(costmap, bar, Pose2D()) == LETHAL_OBSTACLE
    assert footprint_cost(costmap, bar, Pose2D(yaw=0.5)) == 0
    assert footprint_cost(costmap, bar, Pose2D(x=1.6)) == LETHAL_OBSTACLE  # off the map


def test_an_unknown_cell_hides_lethal_ones_under_later_edges_only():
    # front, right side, rear, left side
    bar = box(0.5, -0.5, 0.2)
    front = (49, 59)
    beside = (47, 59)
    side = (45, 49)
    for lethal, unknown, expected in ((front, beside, 254), (front, side, 254), (side, front, 255)):
        costs = np.zeros((100, 100), dtype=np.uint8)
        costs[lethal] = LETHAL_OBSTACLE
        costs[unknown] = NO_INFORMATION
        assert footprint_cost(Costmap(costs, 0.05, -2.475, -2.475), bar, Pose2D()) == expected


def test_window_keeps_what_is_near_and_searches_only_so_far():
    poses = np.zeros((101, 3))
    poses[:, 0] = np.linspace(0.0, 10.0, 101)
    assert window_bounds(poses, 0, 5.0, 0.0, 2.0, 3.0, math.inf) == (31, 81)
    # nothing near within 2.05 m of plan
    assert window_bounds(poses, 0, 5.0, 0.0, 2.0, 3.0, 2.05) == (21, 81)
    assert window_bounds(poses, 0, 50.0, 0.0, 2.0, 3.0, math.inf) == (101, 101)
    assert window_bounds(poses, 40, 5.0, 0.0, 2.0, 3.0, math.inf) == (40, 81)


def test_plan_stops_at_unknown_space_and_skips_what_is_before_the_map():
    costs = np.zeros((20, 20), dtype=np.uint8)
    costs[:, 12:14] = 255
    plan = np.array(((-1.0, 0.5), (2.0, 0.5)))
    points = densify(plan, 0.05)
    # of 57 cells beyond the first two, one less
    assert_allclose(points[:, 0], np.linspace(-1.0, 2.0, 57))
    assert_allclose(points[:, 1], 0.5)
    cells = cells_of_points(points, costs, (0.0, 0.0, 0.05))
    known = points[(points[:, 0] >= 0.0) & (points[:, 0] < 12 * 0.05), 0]
    assert cells.tolist() == [[column, 10] for column in np.unique(np.floor(known / 0.05)).tolist()]


@pytest.mark.parametrize("resolution", [0.05, 0.2])
def test_gaps_of_more_than_two_cells_are_filled_up_evenly(resolution):
    """Of the whole cells beyond the first two there are as many pieces less one."""
    rng = default_rng(12)
    poses = np.cumsum(rng.normal(0.0, 0.3, (30, 3)) * rng.choice((0.1, 1.0, 3.0), (30, 1)), axis=0)
    expected = [poses[:1, :2]]
    for before, after in zip(poses[:-1, :2], poses[1:, :2], strict=True):
        pieces = max(1, math.floor((math.dist(before, after) - 2.0 * resolution) / resolution) - 1)
        expected.append(np.linspace(before, after, pieces + 1)[1:])
    assert_allclose(densify.py_func(poses, resolution), np.concatenate(expected), atol=1e-12)


def test_points_on_the_maps_far_edges_are_off_it():
    costmap = Costmap(np.zeros((3, 4), dtype=np.uint8), 0.5, 1.0, -1.0)
    x = np.array((1.0, 2.99, 3.0, 1.0, 0.99))
    y = np.array((-1.0, 0.49, 0.0, 0.5, 0.0))
    assert cells_of(x, y, costmap).T.tolist() == [[0, 0], [3, 2], [-1, -1], [-1, -1], [-1, -1]]

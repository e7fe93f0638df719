"""Smac's planners against Dijkstra's algorithm, closed forms and shapely."""

import json
import math

import numpy as np
import pytest
import shapely
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from navstack.costmap.costmap import Costmap
from navstack.errors import (
    GoalOccupiedError,
    InputError,
    NoPathFoundError,
    ParameterError,
    PlannerTimedOutError,
)
from navstack.jit import njit
from navstack.params.smac import (
    REEDS_SHEPP,
    Smac2DParams,
    SmacHybridParams,
    SmacLatticeParams,
    SmacSmootherParams,
    iterations_of,
)
from navstack.planning.dubins import shortest_word
from navstack.planning.ompl_kernels import blocked_table
from navstack.planning.planner import RobotShape
from navstack.planning.smac.common import downsampled, smoothed
from navstack.planning.smac.grid_kernels import NEIGHBOURS, SearchLimits, search_grid, trace_back
from navstack.planning.smac.heuristic_kernels import make_field, way_to_goal
from navstack.planning.smac.motions import (
    HEADINGS,
    IN_PLACE,
    LEFT,
    RIGHT,
    STRAIGHT,
    arcs,
    lattice,
    read_lattice,
)
from navstack.planning.smac.pose_kernels import cost_of_motion, dearest, search_poses, step_cost
from navstack.planning.smac.pose_planner import SmacHybrid, SmacLattice
from navstack.planning.smac.pose_problem import Goal, Penalties, SearchGround
from navstack.planning.smac.smac_2d import Smac2D
from navstack.types import Pose2D

from .given import free_map, step_lengths, turns_of

BOX = RobotShape(np.array([(0.4, 0.25), (0.4, -0.25), (-0.5, -0.25), (-0.5, 0.25)]), 0.25)
RAW = {"smooth_path": False}


def make_costs(rng, height=40, width=50):
    """Cells of any cost, with obstacles and unknown cells among them."""
    costs = rng.integers(0, 200, (height, width)).astype(np.uint8)
    draw = rng.random((height, width))
    costs[draw < 0.2] = 254
    costs[draw > 0.95] = 255
    costs[0, 0] = costs[-1, -1] = 0
    return costs


def ways_from(costs, place, multiplier, allow_unknown, reverse=False):
    """The cost of the cheapest way from a cell (column, row) to all cells, by scipy.

    Reverse: to it.
    """
    height, width = costs.shape
    first = []
    second = []
    weights = []
    for row in range(height):
        for column in range(width):
            for dx, dy in NEIGHBOURS:
                x = column + dx
                y = row + dy
                if 0 <= x < width and 0 <= y < height:
                    cost = costs[y, x]
                    if cost in (253, 254) or (cost == 255 and not allow_unknown):
                        continue
                    first.append(row * width + column)
                    second.append(y * width + x)
                    weights.append(math.hypot(dx, dy) * (1.0 + multiplier * min(cost, 252) / 252.0))
    graph = csr_array((weights, (first, second)), shape=(costs.size, costs.size))
    return dijkstra(graph, indices=place[1] * width + place[0])


@pytest.mark.parametrize("allow_unknown", [True, False])
def test_the_grid_search_finds_the_cheapest_way(allow_unknown):
    found = 0
    for seed in range(6):
        costs = make_costs(default_rng(seed))
        expected = ways_from(costs, (0, 0), 2.0, allow_unknown)
        travelled = np.full(costs.size, np.inf, dtype=np.float32)
        came_by = np.empty(costs.size, dtype=np.uint8)
        last = costs.shape[1] - 1, costs.shape[0] - 1
        limits = SearchLimits(0.0, 10**6, 10)
        given = (costs, blocked_table(252, allow_unknown), (0, 0), last, 2.0, limits)
        reached, _ = search_grid(*given, travelled, came_by)
        if not np.isfinite(expected[-1]):
            assert reached == -1
            continue
        found += 1
        assert reached == costs.size - 1
        assert travelled[-1] == approx(expected[-1], rel=1e-5)
        cells = trace_back(reached, 0, costs.shape[1], came_by)
        assert cells[0].tolist() == [0, 0]
        assert cells[-1].tolist() == list(last)
        assert np.abs(np.diff(cells, axis=0)).max() == 1
        assert not np.isin(costs[cells[1:, 1], cells[1:, 0]], (253, 254)).any()
    assert found >= 3


@njit()
def ask(ground, goal, places):
    """The heuristic at places (n, 2), one after the other, of a robot near the first cell."""
    field, waiting = make_field(ground, np.array((2.5, 3.5, 0.0)), goal)
    return [way_to_goal(ground, field, waiting, 2.0, x, y) for x, y in places]


@pytest.mark.parametrize("coarse", [1, 2])
def test_the_heuristic_is_the_cheapest_way_wherever_it_is_asked(coarse):
    costs = make_costs(default_rng(3))
    costs[costs == 255] = 254
    goal = Goal(np.array((30.5, 20.5, 0.0)), 0, 3.0, 10**6, 10, coarse, 0.0, 1.0)
    costs[18:23, 28:33] = 0
    low = costs.reshape(20, 2, 25, 2).min(axis=(1, 3)) if coarse == 2 else costs
    square = (int(goal.pose[0]) // coarse, int(goal.pose[1]) // coarse)
    expected = ways_from(low, square, 2.0, True).reshape(low.shape)
    blocked = blocked_table(252, True)
    ground = SearchGround(
        costs,
        blocked,
        np.zeros((3, 2)),
        0.0,
        True,
        np.zeros(costs.shape, dtype=np.uint8),
    )
    places = default_rng(0).uniform((0.0, 0.0), costs.shape[::-1], (60, 2))
    right = [coarse * expected[int(y) // coarse, int(x) // coarse] for x, y in places]
    assert_allclose(ask(ground, goal, places), right, rtol=1e-4)
    assert np.isfinite(right).sum() > 20


@pytest.mark.parametrize("coarse", [1, 2])
@pytest.mark.parametrize("axis", [0, 1])
def test_the_heuristic_knows_no_way_round_the_maps_edge(axis, coarse):
    """A wall from edge to edge parts it.

    In plain Python, in which a place beyond an array's end is an error.
    """
    low = np.zeros((7, 7), dtype=np.uint8)
    low[(3, ...) if axis == 0 else (..., 3)] = 254
    costs = low.repeat(coarse, axis=0).repeat(coarse, axis=1)
    goal = Goal(np.array((1.5 * coarse, 1.5 * coarse, 0.0)), 0, 0.0, 10**6, 10, coarse, 0.0, 1.0)
    ground = SearchGround(
        costs,
        blocked_table(252, True),
        np.zeros((3, 2)),
        0.0,
        True,
        np.zeros_like(costs),
    )
    field, waiting = make_field.py_func(ground, np.array((0.5, 0.5, 0.0)), goal)
    for place in np.ndindex(7, 7):
        aside, ahead = sorted(abs(k - 1) for k in place)
        way = coarse * (ahead + (math.sqrt(2.0) - 1.0) * aside) if place[axis] < 3 else math.inf
        y, x = (coarse * (k + 0.5) for k in place)
        assert way_to_goal.py_func(ground, field, waiting, 2.0, x, y) == approx(way)


@pytest.mark.parametrize("cell", [(0, 0), (11, 0), (0, 7), (11, 7)])
def test_a_goal_in_a_corner_of_the_map_is_reached(cell):
    costmap = free_map(8, 12, 0.5, 1.0, 2.0)
    goal = Pose2D(1.0 + 0.5 * (cell[0] + 0.5), 2.0 + 0.5 * (cell[1] + 0.5), 0.7)
    poses = Smac2D(Smac2DParams(**RAW)).plan(Pose2D(3.75, 4.25), goal, costmap).poses
    assert_allclose(poses[[0, -1]], ((3.75, 4.25, poses[0, 2]), goal.as_array()))
    assert len(poses) == max(abs(cell[0] - 5), abs(cell[1] - 4)) + 1


def test_arcs_leave_their_cell_and_turn_by_whole_bins():
    motions = arcs(72, 8.0, True)
    assert motions.ends.shape == (72, 6)
    size = 2.0 * math.pi / 72
    for b in range(72):
        for k in range(6):
            x, y, yaw = motions.poses[b, k, motions.counts[b, k] - 1]
            assert math.hypot(x, y) >= math.sqrt(2.0) - 1e-9
            assert (yaw - motions.ends[b, k] * size + math.pi) % (2.0 * math.pi) == approx(
                math.pi, abs=1e-9
            )
            ahead = x * math.cos(b * size) + y * math.sin(b * size)
            aside = y * math.cos(b * size) - x * math.sin(b * size)
            assert (ahead < 0.0) == bool(motions.is_reverse[b, k])
            kind = motions.kinds[b, k]
            if kind == STRAIGHT:
                assert aside == approx(0.0, abs=1e-9)
            else:  # on the circle of 8 cells to that side
                side = 8.0 if kind == LEFT else -8.0
                assert ahead**2 + (aside - side) ** 2 == approx(64.0)
                assert kind in (LEFT, RIGHT)


def test_a_lattice_leads_from_cell_centre_to_cell_centre_along_arcs_that_are_wide_enough():
    motions = lattice(10.0)
    assert motions.ends.shape == (16, 3)
    for b, (x, y) in enumerate(HEADINGS):
        assert motions.headings[b] == approx(math.atan2(y, x) % (2.0 * math.pi))
        for k in range(3):
            poses = motions.poses[b, k, : motions.counts[b, k]]
            assert_array_equal(poses[-1, :2], np.round(poses[-1, :2]))
            way = np.vstack(((0.0, 0.0, motions.headings[b]), poses))
            steps = step_lengths(way)
            turns = turns_of(way)
            assert steps.max() <= 1.0 + 1e-9
            assert steps.sum() == approx(motions.lengths[b, k], rel=0.01)
            assert (turns <= steps / 10.0 * 1.001 + 1e-9).all()
            along = np.arctan2(*np.diff(way[:, :2], axis=0).T[::-1])
            middle = (
                way[:-1, 2] + ((np.diff(way[:, 2]) + math.pi) % (2.0 * math.pi) - math.pi) / 2.0
            )
            assert np.cos(along - middle).min() > 0.999
    quarter = motions.poses[4, :, :, :2] - motions.poses[0, :, :, :2] @ np.array(
        ((0.0, 1.0), (-1.0, 0.0))
    )
    assert np.abs(quarter).max() < 1e-9


def test_what_motions_cost():
    penalties = Penalties(2.0, 0.5, 1.2, 3.0, 0.1, 5.0)
    assert step_cost(penalties, 2.0, 0, STRAIGHT, 0, False) == approx(1.8)
    assert step_cost(penalties, 2.0, 126, STRAIGHT, 0, True) == approx(2.0 * (0.9 + 1.5))
    assert step_cost(penalties, 2.0, 255, STRAIGHT, 1, False) == approx(2.0 * 2.0 * 3.9)
    assert step_cost(penalties, 2.0, 0, LEFT, 0, False) == approx(1.8 * 1.2)
    assert step_cost(penalties, 2.0, 0, LEFT, 0, True) == approx(1.8 * (1.2 + 0.5))
    assert step_cost(penalties, 0.0, 252, IN_PLACE, 0, True) == approx(5.0 * 4.0)


def test_what_a_change_of_side_is():
    """Hybrid's six motions are six sides; straight motions of a lattice are of the left, as
    ``left_turn`` in Nav2's files says.
    """
    hybrid = arcs(16, 4.0, True)
    assert len(np.unique(hybrid.sides[0])) == 6
    of_lattice = lattice(5.0)
    for kind, side in ((STRAIGHT, 1), (LEFT, 1), (RIGHT, 0)):
        assert (of_lattice.sides[of_lattice.kinds == kind] == side).all()


def test_a_lattices_motion_costs_what_its_dearest_cell_does():
    costs = np.zeros((10, 10), dtype=np.uint8)
    costs[2, 4] = 200
    poses = np.array(((1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (3.0, 0.0, 0.0), (99.0, 0.0, 0.0)))
    assert dearest(costs, 2.5, 2.5, poses) == 200
    assert dearest(costs, 2.5, 3.5, poses) == 0
    penalties = Penalties(2.0, 0.0, 1.0, 1.0, 0.0, 5.0)
    found = []
    for motions in (arcs(16, 4.0, False), lattice(5.0)):
        k = int(np.flatnonzero(motions.kinds[0] == LEFT)[0])
        under = motions.poses[0, k, : motions.counts[0, k], :2] + 20.5
        costs = np.zeros((60, 60), dtype=np.uint8)
        costs[int(under[0, 1]), int(under[0, 0])] = 252
        assert costs[int(under[-1, 1]), int(under[-1, 0])] == 0
        way = cost_of_motion(costs, motions, penalties, 20.5, 20.5, 0, k, -1)
        found.append(way / motions.lengths[0, k])
    assert found == [approx(1.0), approx(1.0 + 1.0)]


@pytest.mark.parametrize(
    "planner",
    [Smac2D(Smac2DParams()), SmacHybrid(SmacHybridParams()), SmacLattice(SmacLatticeParams())],
    ids=lambda planner: type(planner).__name__,
)
def test_a_goal_in_the_robots_own_cell_is_turned_to_where_it_stands(planner):
    costmap = Costmap(np.zeros((100, 100), dtype=np.uint8), 0.05, 0.0, 0.0)
    path = planner.plan(Pose2D(2.01, 2.01, 0.0), Pose2D(2.04, 2.04, 1.5), costmap)
    assert path.poses.tolist() == [[2.01, 2.01, 1.5]]
    assert len(planner.plan(Pose2D(2.01, 2.01), Pose2D(3.06, 2.01), costmap).poses) > 1


def test_a_lattice_file_says_how_tight_its_curves_are(tmp_path):
    """A U-turn with room: as wide as the file's turning radius asks."""
    tightest = []
    for radius in (0.5, 1.0):
        file = tmp_path / f"{radius}.json"
        write_lattice(file, lattice(radius / 0.1), radius)
        params = SmacLatticeParams(lattice_filepath=str(file), smooth_path=False)
        costmap = Costmap(np.zeros((120, 120), dtype=np.uint8), 0.1, 0.0, 0.0)
        path = SmacLattice(params).plan(
            Pose2D(4.05, 5.05, 0.0), Pose2D(5.25, 6.65, math.pi), costmap
        )
        turns = np.abs((np.diff(path.poses[:, 2]) + math.pi) % (2.0 * math.pi) - math.pi)
        steps = np.hypot(*np.diff(path.poses[:, :2], axis=0).T)
        moved = steps > 0.03
        tightest.append((steps[moved] / np.maximum(turns[moved], 1e-9)).min())
    assert 0.45 < tightest[0] < 0.6
    assert tightest[1] > 0.95


def test_curves_reach_as_far_on_a_downsampled_costmap_as_nav2s(monkeypatch):
    """The limit of their length is in cells of the costmap itself: twice as far at factor 2."""
    used = []

    def search(*given):
        used.append(given[-1].max_length)
        return search_poses(*given)

    monkeypatch.setattr("navstack.planning.smac.pose_planner.search_poses", search)
    costmap = Costmap(np.zeros((100, 100), dtype=np.uint8), 0.05, 0.0, 0.0)
    for factor in (1, 2):
        params = SmacHybridParams(
            downsample_costmap=factor > 1,
            downsampling_factor=factor,
            analytic_expansion_max_length=3.0,
        )
        SmacHybrid(params).plan(Pose2D(1.0, 1.0), Pose2D(4.0, 1.0), costmap)
    assert used == [approx(60.0), approx(60.0)]


def street(gap=1.2):
    """10 m x 10 m with a wall that has a gap, and its surroundings inflated."""
    data = np.zeros((100, 100), dtype=np.uint8)
    data[:, 48:52] = 254
    half = round(gap / 0.2)
    data[50 - half : 50 + half, 48:52] = 0
    return Costmap(data, 0.1, 1.0, -3.0)


def squares(costmap):
    """The obstacles' cells as a shape."""
    rows, columns = np.nonzero(costmap.data == 254)
    x = costmap.origin_x + columns * costmap.resolution
    y = costmap.origin_y + rows * costmap.resolution
    return shapely.union_all(shapely.box(x, y, x + costmap.resolution, y + costmap.resolution))


def placed(pose):
    turn = np.array(
        ((math.cos(pose[2]), math.sin(pose[2])), (-math.sin(pose[2]), math.cos(pose[2])))
    )
    return shapely.Polygon(BOX.footprint @ turn + pose[:2])


@pytest.mark.parametrize(
    "planner",
    [
        SmacHybrid(SmacHybridParams(minimum_turning_radius=0.6, **RAW), BOX),
        SmacHybrid(SmacHybridParams(minimum_turning_radius=0.6), BOX),
        SmacHybrid(
            SmacHybridParams(
                minimum_turning_radius=0.6,
                motion_model_for_search=REEDS_SHEPP,
                **RAW,
            ),
            BOX,
        ),
        SmacLattice(SmacLatticeParams(**RAW), BOX),
    ],
)
def test_a_path_of_poses_touches_nothing_and_starts_and_ends_as_asked(planner):
    costmap = street()
    start = Pose2D(3.05, 3.05, 0.5)
    goal = Pose2D(9.05, 0.05, -1.2)
    poses = planner.plan(start, goal, costmap).poses
    assert_allclose(poses[-1], goal.as_array())
    assert np.hypot(*(poses[0, :2] - (start.x, start.y))) < 0.1
    walls = squares(costmap)
    assert all(placed(pose).intersection(walls).area < 1e-9 for pose in poses[1:])
    assert step_lengths(poses).max() < 0.2


def test_hybrid_keeps_to_its_radius_and_is_hardly_longer_than_the_shortest_curve():
    open_ground = free_map(120, 120)
    planner = SmacHybrid(SmacHybridParams(minimum_turning_radius=0.8, **RAW))
    rng = default_rng(2)
    for _ in range(10):
        start, goal = (Pose2D(*rng.uniform(3.0, 9.0, 2), rng.uniform(-3.0, 3.0)) for _ in range(2))
        poses = planner.plan(start, goal, open_ground).poses
        steps = step_lengths(poses)
        turns = turns_of(poses)
        inner = slice(1, -2)  # the first pose takes the nearest of the 72 headings
        assert (turns[inner] <= 1.05 * steps[inner] / 0.8 + 0.01).all()
        _, *lengths = shortest_word(start.as_array(), goal.as_array(), 0.8)
        assert steps.sum() <= 1.15 * sum(lengths) + 0.5


def test_hybrid_turns_within_no_less_than_a_cell():
    start = Pose2D(3.05, 3.05, 0.5)
    goal = Pose2D(9.05, 0.05, -1.2)
    radii = (0.02, 0.1, 0.15)
    planners = [SmacHybrid(SmacHybridParams(minimum_turning_radius=r), BOX) for r in radii]
    plans = [planner.plan(start, goal, street()).poses for planner in planners]
    assert_array_equal(plans[0], plans[1])
    assert not np.array_equal(plans[1], plans[2])


def test_only_a_robot_that_may_reverse_leaves_a_dead_end():
    data = np.full((60, 60), 254, dtype=np.uint8)
    data[27:34, 5:55] = 0  # a passage of 0.7 m, in which the robot looks at the end
    data[5:55, 40:55] = 0
    costmap = Costmap(data, 0.1, 0.0, 0.0)
    start = Pose2D(1.2, 3.05, math.pi)
    goal = Pose2D(4.75, 4.5, math.pi / 2.0)
    with pytest.raises(NoPathFoundError):
        SmacHybrid(SmacHybridParams(), BOX).plan(start, goal, costmap)
    params = SmacHybridParams(motion_model_for_search=REEDS_SHEPP, **RAW)
    poses = SmacHybrid(params, BOX).plan(start, goal, costmap).poses
    heading = np.column_stack((np.cos(poses[:-1, 2]), np.sin(poses[:-1, 2])))
    backwards = np.sum(np.diff(poses[:, :2], axis=0) * heading, axis=1)
    assert (backwards < 0.0).sum() > 10


def test_a_goal_in_an_obstacle_is_refused_or_approached():
    costmap = street(gap=4.0)
    costmap.data[20:26, 80:86] = 254
    start = Pose2D(3.05, 1.05, 0.0)
    goal = Pose2D(9.28, -0.72, 0.0)
    with pytest.raises(GoalOccupiedError):
        Smac2D(Smac2DParams(tolerance=0.0)).plan(start, goal, costmap)
    with pytest.raises(GoalOccupiedError):
        SmacHybrid(SmacHybridParams(tolerance=0.0)).plan(start, goal, costmap)
    poses = Smac2D(Smac2DParams(tolerance=0.5)).plan(start, goal, costmap).poses
    assert 0.0 < math.hypot(poses[-1, 0] - goal.x, poses[-1, 1] - goal.y) <= 0.5
    poses = Smac2D(Smac2DParams(tolerance=0.5, **RAW)).plan(start, goal, costmap).poses
    assert step_lengths(poses[1:]).min() == approx(0.1), "cell by cell, to the last"
    for kind, params in ((SmacHybrid, SmacHybridParams), (SmacLattice, SmacLatticeParams)):
        poses = kind(params(tolerance=0.5)).plan(start, goal, costmap).poses
        assert 0.3 < math.hypot(poses[-1, 0] - goal.x, poses[-1, 1] - goal.y) <= 0.5
        with pytest.raises(NoPathFoundError):
            kind(params(tolerance=0.2)).plan(start, goal, costmap)  # the obstacle reaches farther


def test_a_goal_without_a_heading_is_looked_at_along_the_map():
    start = Pose2D(3.05, 1.05, 0.0)
    for yaw, expected in ((math.nan, 0.0), (2.0, 2.0)):
        path = Smac2D(Smac2DParams()).plan(start, Pose2D(9.05, -0.95, yaw), street())
        assert path.poses[-1, 2] == expected


def test_a_search_ends_after_max_iterations():
    costmap = street()
    start = Pose2D(3.05, 3.05, 0.0)
    goal = Pose2D(9.05, 0.05, 0.0)
    for planner in (
        Smac2D(Smac2DParams(max_iterations=20)),
        SmacHybrid(SmacHybridParams(max_iterations=20)),
        SmacLattice(SmacLatticeParams(max_iterations=20)),
    ):
        with pytest.raises(PlannerTimedOutError, match="max_iterations"):
            planner.plan(start, goal, costmap)
    assert len(Smac2D(Smac2DParams(max_iterations=-1)).plan(start, goal, costmap).poses) > 50


def test_planning_time_counts_as_iterations():
    assert iterations_of(SmacHybridParams(max_planning_time=1.5)) == 750_000
    assert iterations_of(SmacLatticeParams(max_planning_time=2.0, max_iterations=70)) == 70
    assert iterations_of(SmacHybridParams(max_planning_time=0.0)) == 1_000_000


def test_larger_cells_have_the_highest_cost_below_them():
    data = np.arange(35, dtype=np.uint8).reshape(5, 7)
    coarse = downsampled(Costmap(data, 0.1, 1.0, 2.0), 2)
    assert coarse.data.tolist() == [[8, 10, 12, 13], [22, 24, 26, 27], [29, 31, 33, 34]]
    assert coarse.resolution == 0.2
    assert coarse.origin_x == 1.0
    assert coarse.origin_y == 2.0


def test_smoothing_shortens_what_the_grid_made_crooked():
    costmap = street()
    start = Pose2D(3.05, 3.05, 0.0)
    goal = Pose2D(9.05, 0.05, 0.0)
    planners = [Smac2D(Smac2DParams(smooth_path=on)) for on in (False, True)]
    raw, smooth = (planner.plan(start, goal, costmap).length for planner in planners)
    assert smooth < 0.99 * raw


def primitives_of(motions):
    """The motions as in Nav2's lattice files for cells of 0.1 m."""
    return [
        {
            "start_angle_index": b,
            "end_angle_index": int(motions.ends[b, k]),
            "left_turn": bool(motions.kinds[b, k] != RIGHT),
            "trajectory_length": float(motions.lengths[b, k]) * 0.1,
            "poses": [
                [0.0, 0.0, float(motions.headings[b])],
                *(motions.poses[b, k, : motions.counts[b, k]] * (0.1, 0.1, 1.0)).tolist(),
            ],
        }
        for b in range(16)
        for k in range(3)
    ]


def write_lattice(path, motions, radius, *more):
    metadata = {
        "grid_resolution": 0.1,
        "turning_radius": radius,
        "heading_angles": motions.headings.tolist(),
    }
    document = {"lattice_metadata": metadata, "primitives": [*primitives_of(motions), *more]}
    path.write_text(json.dumps(document), encoding="utf-8")


def test_a_lattice_file_of_nav2_is_read(tmp_path):
    motions = lattice(5.0)
    turn = {
        "start_angle_index": 0,
        "end_angle_index": 1,
        "left_turn": True,
        "trajectory_length": 0.0,
        "poses": [[0.0, 0.0, 0.0], [0.0, 0.0, float(motions.headings[1])]],
    }
    path = tmp_path / "lattice.json"
    write_lattice(path, motions, 0.5, turn)
    read, radius = read_lattice(path, 0.1)
    assert radius == 0.5
    assert read.ends.shape == (16, 4)
    assert_allclose(read.poses[:, :3, : motions.poses.shape[2]], motions.poses, atol=1e-9)
    assert read.kinds[0, 3] == IN_PLACE
    planner = SmacLattice(SmacLatticeParams(lattice_filepath=str(path)), BOX)
    assert len(planner.plan(Pose2D(3.05, 3.05, 0.0), Pose2D(9.05, 0.05, 0.0), street()).poses) > 50
    with pytest.raises(ParameterError, match=r"is for 0.1 m per cell, the costmap has 0.05 m"):
        read_lattice(path, 0.05)
    path.write_text("{}", encoding="utf-8")
    read_lattice.cache_clear()
    with pytest.raises(ParameterError, match="is none of Nav2's"):
        read_lattice(path, 0.1)


@pytest.mark.parametrize(
    ("kind", "given", "message"),
    [
        (SmacHybridParams, {"motion_model_for_search": "CAR"}, "CAR"),
        (SmacHybridParams, {"minimum_turning_radius": 0.0}, "0.0 must be more than 0"),
        (SmacHybridParams, {"angle_quantization_bins": 0}, "0 must be 4 to 720"),
        (Smac2DParams, {"tolerance": -0.1}, "-0.1 must be 0 or more"),
        (Smac2DParams, {"downsampling_factor": 0}, "0 must be 1 to 100"),
        (SmacLatticeParams, {"analytic_expansion_ratio": 0.0}, "0.0 must be more than 0"),
    ],
)
def test_parameters_that_cannot_be_are_refused(kind, given, message):
    (name,) = given
    with pytest.raises(InputError, match=f"{name} .*{message}"):
        kind(**given)


def test_the_smoother_group_is_that_of_the_simple_smoother():
    simple = SmacSmootherParams(max_iterations=7, w_smooth=0.1, refinement_num=3).as_simple
    assert simple.max_its == 7
    assert simple.w_smooth == 0.1
    assert simple.refinement_num == 3


@pytest.mark.parametrize(("number", "is_smoothed"), [(9, False), (10, True)])
def test_paths_of_ten_poses_and_more_are_smoothed(number, is_smoothed):
    poses = np.zeros((number, 3))
    poses[:, 0] = 2.0 + 0.1 * np.arange(number)
    poses[:, 1] = 2.0 + 0.03 * (np.arange(number) % 2)
    costmap = free_map(80, 80, 0.05)
    assert (smoothed(poses, costmap, SmacSmootherParams()) is not poses) == is_smoothed

"""What Smac's searches look at on the way, number by number."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx

from navstack.costmap.costmap import Costmap
from navstack.params.smac import SmacHybridParams
from navstack.planning.dubins import shortest_word
from navstack.planning.ompl_kernels import blocked_table
from navstack.planning.smac.grid_kernels import SearchLimits, search_grid
from navstack.planning.smac.motions import _along, arcs
from navstack.planning.smac.node_kernels import make_nodes
from navstack.planning.smac.pose_kernels import Found, curve_to, search_poses, step_cost
from navstack.planning.smac.pose_planner import SmacHybrid
from navstack.planning.smac.pose_problem import (
    NARROW,
    ROOMY,
    Expansion,
    Goal,
    Penalties,
    SearchGround,
)
from navstack.types import Pose2D

PENALTIES = Penalties(2.0, 0.5, 1.2, 3.0, 0.1, 5.0)
NO_CURVE = Expansion(3.5, 0.0, 200, 8.0, False)
BODY = np.array(((2.0, 1.0), (2.0, -1.0), (-2.0, -1.0), (-2.0, 1.0)))


def ground_of(costs):
    return SearchGround(
        costs,
        blocked_table(252, True),
        BODY,
        math.sqrt(5.0),
        True,
        np.zeros(costs.shape, dtype=np.uint8),
    )


def search(costs, start, goal):
    """A search over arcs of 8 cells from heading 3, and the ground that it has looked at."""
    ground = ground_of(costs)
    return ground, search_poses(ground, arcs(72, 8.0, False), start, 3, goal, PENALTIES, NO_CURVE)


def octile(dx, dy):
    return max(abs(dx), abs(dy)) + (math.sqrt(2.0) - 1.0) * min(abs(dx), abs(dy))


def test_each_pose_of_a_search_has_its_cost_and_a_bound_of_the_way_on():
    motions = arcs(72, 8.0, False)
    goal = Goal(np.array((30.3, 12.7, 0.6)), 7, 0.0, 4, 10, 1, 7.5, 8.0)
    _, found = search(np.zeros((30, 40), dtype=np.uint8), np.array((20.5, 10.5, 0.26)), goal)
    nodes = found.nodes
    near = []
    assert found.node == -1
    assert found.iterations == 4
    count = (nodes.keys >= 0).sum()
    assert sorted(nodes.numbers[nodes.keys >= 0]) == list(range(count))
    for n in range(1, count):
        (x, y) = nodes.places[n]
        parent = nodes.parents[n]
        k = nodes.by[n]
        b = nodes.headings[parent]
        changes = False
        if parent > 0:
            before = motions.sides[nodes.headings[nodes.parents[parent]], nodes.by[parent]]
            changes = bool(before != motions.sides[b, k])
        way = step_cost(PENALTIES, motions.lengths[b, k], 0, motions.kinds[b, k], 0, changes)
        assert nodes.travelled[n] == approx(nodes.travelled[parent] + way)
        end = motions.poses[b, k, motions.counts[b, k] - 1, :2]
        assert_allclose((x, y), nodes.places[parent] + end)
        bound = octile(30 - int(x), 12 - int(y))
        if octile(30.3 - x, 12.7 - y) < 7.5:
            yaw = motions.headings[nodes.headings[n]]
            bound = max(bound, sum(shortest_word(np.array((x, y, yaw)), goal.pose, 8.0)[1:]))
            near.append(n)
        assert nodes.ahead[n] == approx(bound)
    assert 3 <= len(near) <= count - 3


def test_a_cell_is_roomy_where_no_obstacle_is_within_the_bodys_reach():
    rng = np.random.default_rng(2)
    costs = np.where(rng.random((60, 60)) < 0.02, 254, 0).astype(np.uint8)
    costs[28:33, 8:13] = 0
    goal = Goal(np.array((55.5, 30.5, 0.0)), 0, 0.0, 2000, 10, 1, 0.0, 8.0)
    ground, _ = search(costs, np.array((10.5, 30.5, 0.26)), goal)
    rows, columns = np.nonzero(costs)
    reach = math.sqrt(5.0) + math.sqrt(0.5)
    for row, column in np.argwhere(ground.room):
        dx = np.maximum(np.abs(columns - column) - 0.5, 0.0)
        dy = np.maximum(np.abs(rows - row) - 0.5, 0.0)
        assert ground.room[row, column] == (ROOMY if np.hypot(dx, dy).min() > reach else NARROW)
    assert min((ground.room == ROOMY).sum(), (ground.room == NARROW).sum()) > 100


@pytest.mark.parametrize(
    ("cost", "row", "most", "longest", "count"),
    [
        (200, 8, 200, 9.0, 10),
        (201, 8, 200, 9.0, 0),
        (201, 7, 200, 9.0, 10),  # beside the centre's way
        (255, 8, 200, 9.0, 10),  # unknown cells cost nothing
        (254, 8, 255, 9.0, 0),
        (0, 8, 200, 8.9, 0),
    ],
)
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("backwards", [False, True])
def test_a_curve_to_the_goal_is_short_cheap_and_free(
    cost,
    row,
    most,
    longest,
    count,
    axis,
    backwards,
):
    costs = np.zeros((20, 30), dtype=np.uint8)
    yaw = 0.5 * math.pi * axis
    costs[row, 10] = cost
    start = np.array((5.5, 8.5, yaw))
    goal = np.array((14.5, 8.5, yaw))
    if axis:
        costs = costs.T.copy()
        start[:2] = start[1::-1].copy()
        goal[:2] = goal[1::-1].copy()
    ends = (goal, start) if backwards else (start, goal)
    poses = curve_to(ground_of(costs), Expansion(3.5, longest, most, 8.0, backwards), *ends)
    assert_allclose(poses, np.linspace(*ends, 10)[:count], atol=1e-9)
    forwards = curve_to(ground_of(costs), Expansion(3.5, longest, most, 8.0, False), *ends)
    assert len(forwards) == (0 if backwards else count)


@pytest.mark.parametrize(
    ("ratio", "longest", "iterations", "by_curve"),
    [(3.5, 10.0, 18, True), (3.5, 15.0, 13, True), (3.5, 14.9, 18, True), (10.0, 15.0, 20, False)],
)
def test_curves_are_tried_the_more_often_the_nearer_the_goal_is(
    ratio,
    longest,
    iterations,
    by_curve,
):
    """At once, then after 40 / 3.5 steps of 2.09 cells, after 15 / 3.5, and each fourth one.

    With a ratio of 10 each tenth step: the goal, 20 steps off, is nearer than that when a curve is
    too long last.
    """
    goal = Goal(np.array((45.5, 10.5, 0.0)), 0, 0.0, 2000, 10, 1, 0.0, 8.0)
    ground = ground_of(np.zeros((20, 60), dtype=np.uint8))
    way = Expansion(ratio, longest, 200, 8.0, False)
    found = search_poses(
        ground,
        arcs(72, 8.0, False),
        np.array((5.5, 10.5, 0.0)),
        0,
        goal,
        PENALTIES,
        way,
    )
    assert found.iterations == iterations
    assert (len(found.curve) > 0) == by_curve


@pytest.mark.parametrize("side", ["left", "right", "below", "above"])
def test_a_point_finds_its_way_along_the_maps_edge(side):
    costs = np.full((40, 40), 254, dtype=np.uint8)
    line = {"left": (..., 0), "right": (..., 39), "below": (0, ...), "above": (39, ...)}[side]
    costs[line] = 0
    rows, columns = np.nonzero(costs == 0)
    yaw = 0.0 if side in ("below", "above") else 0.5 * math.pi
    start, goal = (Pose2D(columns[n] + 0.4, rows[n] + 0.4, yaw) for n in (2, 37))
    params = SmacHybridParams(
        minimum_turning_radius=8.0,
        analytic_expansion_max_length=0.0,
        smooth_path=False,
    )
    path = SmacHybrid(params).plan(start, goal, Costmap(costs, 1.0, 0.0, 0.0))
    assert_allclose(path.poses[[0, -1]], (start.as_array(), goal.as_array()), atol=1e-9)
    assert path.length == approx(35.0)


@pytest.mark.parametrize(
    ("goal_cost", "limits", "reached"),
    [
        (0, SearchLimits(0.0, 9, 0), -1),  # nine cells are looked at before the goal is
        (0, SearchLimits(0.0, 10, 0), 9),
        (254, SearchLimits(2.0, 100, 0), 7),  # the first cell that is near enough
        (254, SearchLimits(2.0, 100, 1), 8),
        (254, SearchLimits(0.9, 100, 1), -1),
    ],
)
def test_a_search_on_the_grid_keeps_its_limits(goal_cost, limits, reached):
    costs = np.zeros((1, 10), dtype=np.uint8)
    costs[0, 9] = goal_cost
    room = np.full(10, np.inf, dtype=np.float32), np.zeros(10, dtype=np.uint8)
    found = search_grid(costs, blocked_table(252, True), (0, 0), (9, 0), 2.0, limits, *room)
    assert found[0] == reached


@pytest.mark.parametrize(
    ("start", "goal"), [((0, 0), (3, 19)), ((3, 19), (0, 0)), ((3, 0), (0, 19))]
)
def test_a_search_on_the_grid_leads_from_any_corner_to_any_other(start, goal):
    costs = np.zeros((20, 4), dtype=np.uint8)
    travelled = np.full(80, np.inf, dtype=np.float32)
    came_by = np.zeros(80, dtype=np.uint8)
    limits = SearchLimits(0.0, 1000, 10)
    reached, _ = search_grid(
        costs,
        blocked_table(252, True),
        start,
        goal,
        2.0,
        limits,
        travelled,
        came_by,
    )
    assert reached == goal[1] * 4 + goal[0]
    assert travelled[reached] == approx(16.0 + 3.0 * math.sqrt(2.0))


def test_arcs_and_straight_pieces_end_equally_far_away():
    """With 8 cells of radius, 72 headings: a turn by three of them leaves the cell."""
    motions = arcs(72, 8.0, True)
    for b, k in np.ndindex(72, 6):
        end = motions.poses[b, k, motions.counts[b, k] - 1]
        assert math.hypot(*end[:2]) == approx(16.0 * math.sin(math.radians(7.5)))


def test_poses_along_pieces_are_evenly_spread():
    assert_allclose(_along(0.0, ((0.8, 0.0),)), [(0.8, 0.0, 0.0)])
    quarter = 0.5 * math.pi
    poses = _along(quarter, ((2.0, 0.0), (2.0 * quarter, 0.5), (4.0 - math.pi, 0.0)))
    side = 2.0 - 2.0 * np.cos(np.array((0.5, 1.0, 1.5)))
    ahead = 2.0 * np.sin(np.array((0.5, 1.0, 1.5)))
    expected = [(0.0, 1.0, quarter), (0.0, 2.0, quarter)]
    expected += [
        (-x, 2.0 + y, quarter + turn)
        for x, y, turn in zip(side, ahead, (0.5, 1.0, 1.5), strict=True)
    ]
    assert_allclose(poses, [*expected, (math.pi - 6.0, 4.0, math.pi)], atol=1e-12)


@pytest.mark.parametrize(
    ("last", "is_taken"), [((6.0, 8.0), True), ((6.0, 8.01), False), ((5.2, 6.7), True)]
)
def test_a_path_ends_at_the_goal_where_it_comes_within_a_cell(last, is_taken):
    nodes = make_nodes(1)
    nodes.parents[0] = -1
    first = np.array((5.0, 7.0, 0.3))
    goal = np.array((*last, 1.0))
    poses = SmacHybrid(SmacHybridParams())._poses(
        Found(0, nodes, np.empty((0, 3)), 1), arcs(72, 8.0, False), first, goal
    )
    assert_array_equal(poses, [goal if is_taken else first])


def test_a_car_never_turns_on_the_spot():
    assert SmacHybridParams().rotation_penalty == 0.0

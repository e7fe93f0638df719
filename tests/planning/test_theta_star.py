"""Lazy Theta*: lines of sight against a slow twin, paths against what geometry says."""

import math

import numpy as np
import pytest

from navstack.costmap.costmap import Costmap
from navstack.errors import GoalOccupiedError, ParameterError, PlanningError
from navstack.params.planners import ThetaStarParams
from navstack.planning.theta_star import ThetaStarPlanner, line_of_sight
from navstack.types import Pose2D

from .given import free_map

OPEN = np.arange(256) < 253
CROSSING = np.arange(256) / 100.0


def slow_sight(costs, x, y, end_x, end_y):
    """Bresenham's line as nav2_theta_star_planner walks it."""
    dx = abs(end_x - x)
    dy = abs(end_y - y)
    sx = 1 if x < end_x else -1
    sy = 1 if y < end_y else -1
    error = dx - dy
    total = 0.0
    while (x, y) != (end_x, end_y):
        if costs[y, x] >= 253:
            return math.inf
        total += costs[y, x] / 100.0
        twice = 2 * error
        if -dy < twice <= dx:
            if costs[y, x + sx] >= 253 or costs[y + sy, x] >= 253:
                return math.inf
            x = x + sx
            y = y + sy
            error = error + dx - dy
        elif twice > -dy:
            x = x + sx
            error = error - dy
        else:
            y = y + sy
            error = error + dx
    return total


def test_lines_of_sight():
    rng = np.random.default_rng(0)
    costs = rng.integers(0, 200, (30, 40)).astype(np.uint8)
    costs[rng.random(costs.shape) < 0.05] = 254
    seen = 0
    for _ in range(500):
        x, end_x = rng.integers(0, 40, 2).tolist()
        y, end_y = rng.integers(0, 30, 2).tolist()
        expected = slow_sight(costs, x, y, end_x, end_y)
        assert line_of_sight(costs, OPEN, CROSSING, x, y, end_x, end_y) == pytest.approx(expected)
        seen += math.isfinite(expected)
    assert 50 < seen < 450


def test_in_the_open_the_path_is_the_straight_line_but_for_cells():
    costmap = free_map(100, 100)
    start = Pose2D(1.0, 2.0)
    goal = Pose2D(8.3, 6.1, 0.5)
    path = ThetaStarPlanner(ThetaStarParams()).plan(start, goal, costmap)
    # it bends at cells' centres
    assert math.hypot(7.3, 4.1) <= path.length < 1.01 * math.hypot(7.3, 4.1)
    away = (path.poses[:, 0] - 1.0) * 4.1 - (path.poses[:, 1] - 2.0) * 7.3
    assert np.abs(away).max() / math.hypot(7.3, 4.1) < 0.3
    assert path.poses[-1, 2] == 0.5


def test_around_a_corner_it_is_hardly_longer_than_the_tight_string():
    costmap = free_map(100, 100)
    costmap.data[:60, 50] = 254
    start = Pose2D(2.05, 2.05)
    goal = Pose2D(8.05, 2.05)
    # over both corners of the wall's end
    tight = math.hypot(2.95, 3.95) + 0.1 + math.hypot(2.95, 3.95)
    for corners in (4, 8):
        path = ThetaStarPlanner(ThetaStarParams(how_many_corners=corners)).plan(
            start, goal, costmap
        )
        assert tight <= path.length < 1.02 * tight
        columns, rows = (path.poses[:, :2] / 0.1).astype(int).T
        assert not (costmap.data[rows, columns] == 254).any()


def test_costs_are_avoided_as_they_are_weighted():
    costmap = free_map(60, 100)
    costmap.data[10:50, 45:55] = 240
    start = Pose2D(1.0, 3.0)
    goal = Pose2D(9.0, 3.0)
    through, around = (
        ThetaStarPlanner(ThetaStarParams(w_traversal_cost=weight)).plan(start, goal, costmap)
        for weight in (0.0, 10.0)
    )
    assert 8.0 <= through.length < 8.1
    assert np.abs(around.poses[:, 1] - 3.0).max() > 1.9


def test_ends_in_obstacles_are_refused():
    costmap = free_map(60, 100)
    costmap.data[30, 10] = 254
    costmap.data[30, 80] = 255
    planner = ThetaStarPlanner(ThetaStarParams(allow_unknown=False))
    inside, outside = Pose2D(1.05, 3.05), Pose2D(5.0, 3.0)
    with pytest.raises(GoalOccupiedError):
        planner.plan(outside, inside, costmap)
    for ends in ((inside, outside), (outside, Pose2D(8.05, 3.05))):
        with pytest.raises(PlanningError, match="lies in an occupied cell") as refused:
            planner.plan(*ends, costmap)
        assert refused.value.code == "UNKNOWN", "which recoveries answer, as in Nav2"
    assert (
        ThetaStarPlanner(ThetaStarParams())
        .plan(Pose2D(5.0, 3.0), Pose2D(8.05, 3.05), costmap)
        .length
        > 3.0
    )
    with pytest.raises(ParameterError, match="w_euc_cost -1.0 must be 0 or more"):
        ThetaStarParams(w_euc_cost=-1.0)


def test_a_start_in_an_obstacle_is_free_at_the_second_attempt():
    """As in Nav2, which frees the start of the plan before; the costmap stays as it is."""
    costmap = free_map(60, 100)
    costmap.data[30, 10] = 253
    start, goal = Pose2D(1.05, 3.05), Pose2D(4.0, 3.0)
    planner = ThetaStarPlanner(ThetaStarParams())
    for _ in range(2):
        with pytest.raises(PlanningError, match="start .* lies in an occupied cell"):
            planner.plan(start, goal, costmap)
        assert planner.plan(start, goal, costmap).length == pytest.approx(2.95, abs=0.1)
        assert costmap.data[30, 10] == 253
        planner.reset(np.random.default_rng(0))


def test_a_goal_in_the_robots_own_cell_is_turned_to_where_it_stands():
    costmap = free_map(60, 100)
    planner = ThetaStarPlanner(ThetaStarParams())
    path = planner.plan(Pose2D(1.02, 3.02, 0.0), Pose2D(1.08, 3.08, 1.5), costmap)
    assert path.poses.tolist() == [[1.02, 3.02, 1.5]]


@pytest.mark.parametrize("side", ["left", "right", "below", "above"])
def test_a_way_along_the_maps_edge_is_found(side):
    costs = np.full((12, 12), 254, dtype=np.uint8)
    line = {"left": (..., 0), "right": (..., 11), "below": (0, ...), "above": (11, ...)}[side]
    costs[line] = 0
    rows, columns = np.nonzero(costs == 0)
    costmap = Costmap(costs, 1.0, 0.0, 0.0)
    ends = [Pose2D(float(columns[n]) + 0.5, float(rows[n]) + 0.5) for n in (0, 11)]
    path = ThetaStarPlanner(ThetaStarParams()).plan(*ends, costmap)
    assert path.length == pytest.approx(11.0, abs=1.0)

"""NavFn held back by a bound finds the path that it finds without."""

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal

from navstack.costmap.costmap import LETHAL_OBSTACLE, Costmap
from navstack.errors import NoPathFoundError
from navstack.params.planners import NavfnParams
from navstack.planning.navfn import NavfnPlanner
from navstack.types import ByteArray, Pose2D

STREETS = 40  # [cells] between the centre lines of two streets


def city(seed: int) -> ByteArray:
    """Streets of varying cost around blocks."""
    rng = default_rng(seed)
    costs = np.full((401, 401), LETHAL_OBSTACLE, dtype=np.uint8)
    for line in range(20, 400, STREETS):
        half = rng.integers(2, 8)
        costs[line - half : line + half + 1] = rng.integers(0, 120)
        costs[:, line - half : line + half + 1] = rng.integers(0, 120)
    return costs


def costmap(costs: ByteArray, floor: ByteArray | None) -> Costmap:
    return Costmap(costs, 0.05, 0.0, 0.0, floor)


def crossing(column: int, row: int) -> Pose2D:
    return Pose2D(0.05 * (20 + STREETS * column), 0.05 * (20 + STREETS * row))


@pytest.mark.parametrize("seed", range(6))
def test_the_path_is_the_same_among_new_obstacles(seed: int) -> None:
    floor = city(seed)
    rng = default_rng(seed)
    bounded = NavfnPlanner(NavfnParams())
    free = NavfnPlanner(NavfnParams())
    goal = crossing(8, 7)
    visited = []
    for step in range(4):
        costs = floor.copy()
        for x, y in rng.integers(5, 396, size=(30, 2)):
            costs[y - 3 : y + 4, x - 3 : x + 4] = np.maximum(
                costs[y - 3 : y + 4, x - 3 : x + 4], 200
            )
        start = crossing(step, 1)
        with_bound = bounded.plan(start, goal, costmap(costs, floor))
        without = free.plan(start, goal, costmap(costs, None))
        assert_allclose(with_bound.poses, without.poses, atol=0.05)
        visited.append((bounded.potential < 1e9).sum() / (free.potential < 1e9).sum())
    assert min(visited) < 0.9  # it did hold the wave back


def test_a_blocked_way_is_left_for_the_detour() -> None:
    floor = city(0)
    costs = floor.copy()
    costs[60 - 10 : 60 + 11, 200:210] = LETHAL_OBSTACLE  # the street between start and goal
    start = crossing(3, 1)
    goal = crossing(6, 1)
    bounded = NavfnPlanner(NavfnParams())
    free = NavfnPlanner(NavfnParams())
    direct = bounded.plan(start, goal, costmap(floor, floor))
    detour = bounded.plan(start, goal, costmap(costs, floor))
    assert detour.length > direct.length + 1.0
    assert_array_equal(detour.poses, free.plan(start, goal, costmap(costs, None)).poses)


def test_another_map_or_goal_renews_the_bound() -> None:
    planner = NavfnPlanner(NavfnParams())
    for seed, column in ((0, 8), (0, 2), (1, 2)):
        floor = city(seed)
        path = planner.plan(crossing(0, 0), crossing(column, 5), costmap(floor, floor))
        fresh = NavfnPlanner(NavfnParams()).plan(
            crossing(0, 0), crossing(column, 5), costmap(floor, None)
        )
        assert_allclose(path.poses, fresh.poses, atol=0.05)


def test_no_way_is_still_no_way() -> None:
    floor = city(0)
    costs = floor.copy()
    costs[:, 195:206] = LETHAL_OBSTACLE
    planner = NavfnPlanner(NavfnParams())
    planner.plan(crossing(0, 0), crossing(8, 0), costmap(floor, floor))
    with pytest.raises(NoPathFoundError):
        planner.plan(crossing(0, 0), crossing(8, 0), costmap(costs, floor))

"""NavFn against a slow twin, and on real maps."""

import json
import os
from pathlib import Path as FilePath

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx

from navstack.costmap.costmap import Costmap
from navstack.errors import (
    GoalOccupiedError,
    GoalOutsideMapError,
    NoPathFoundError,
    StartOutsideMapError,
)
from navstack.params.planners import NavfnParams
from navstack.planning.navfn import NavfnPlanner
from navstack.planning.navfn_descent import (
    EXHAUSTED,
    FAILED,
    advance,
    descend,
    interpolated_gradient,
    lowest_neighbour,
    take_corners,
)
from navstack.planning.navfn_kernels import POT_HIGH, cost_tables
from navstack.types import Pose2D

DATA = os.environ.get("NAVSTACK_DATA")
GOLDEN = FilePath(__file__).parents[1] / "golden" / "navfn_small.npz"


def slow_update(potential, n, width, cost):
    """The planar wave from the description of updateCell, in float32 scalars."""
    f = np.float32
    a = min(potential[n - 1], potential[n + 1])
    b = min(potential[n - width], potential[n + width])
    low = min(a, b)
    gap = f(abs(f(a - b)))
    if gap >= cost:
        return f(low + cost)
    ratio = float(f(gap / cost))
    return f(low + f(cost * f(-0.2301 * ratio * ratio + 0.5307 * ratio + 0.7040)))


class SlowWave:
    """NavFn's wave with plain lists, written from the description of the algorithm."""

    def __init__(self, costs):
        crossing, _ = cost_tables(allow_unknown=True)
        cost = crossing[costs]
        cost[0] = 254
        cost[-1] = 254
        cost[:, 0] = 254
        cost[:, -1] = 254
        self.width = costs.shape[1]
        self.cost = cost.ravel()
        self.potential = np.full(costs.size, POT_HIGH)
        self.waiting = set()

    def sides(self, n):
        return (n + 1, n - 1, n - self.width, n + self.width)

    def wake(self, cells, n):
        if self.cost[n] < 254 and n not in self.waiting and len(cells) < 10000:
            cells.append(n)
            self.waiting.add(n)

    def visit(self, n, threshold, following, overflow):
        new = slow_update(self.potential, n, self.width, self.cost[n])
        if new >= self.potential[n]:
            return
        self.potential[n] = new
        for m in (n - 1, n + 1, n - self.width, n + self.width):
            if self.potential[m] > np.float32(new + np.float32(0.707106781 * float(self.cost[m]))):
                self.wake(following if new < threshold else overflow, m)

    def run(self, source, target):
        self.potential[source] = 0
        current = []
        overflow = []
        threshold = np.float32(254)
        for n in self.sides(source):
            self.wake(current, n)
        while current:
            self.waiting.difference_update(current)
            following = []
            for n in current:
                self.visit(n, threshold, following, overflow)
            current = following
            if not current:
                threshold = threshold + np.float32(100)
                current = overflow
                overflow = []
            if self.potential[target] < POT_HIGH:
                break
        return self.potential.reshape(-1, self.width)


@pytest.mark.parametrize("seed", range(4))
def test_wave_equals_slow_twin(seed):
    rng = default_rng(seed)
    costs = rng.choice(np.array((0, 0, 0, 30, 120, 252, 253, 254, 255), dtype=np.uint8), (40, 50))
    costs[20, 5] = costs[30, 45] = 0
    planner = NavfnPlanner(NavfnParams(tolerance=0.0))
    try:
        planner.plan(Pose2D(5.0, 20.0), Pose2D(45.0, 30.0), Costmap(costs, 1.0, 0.0, 0.0))
    except NoPathFoundError:
        pass
    assert_array_equal(planner.potential, SlowWave(costs).run(20 * 50 + 5, 30 * 50 + 45))


def test_a_cell_without_a_potential_has_no_lower_neighbour():
    potential = np.full(25, np.float32(3.0))
    potential[12] = POT_HIGH
    assert lowest_neighbour(potential, 5, 12) == 12


def test_the_lowest_neighbour_is_compared_with_whole_numbers():
    """The loop of calcPath.

    ``int minp = potarr[stc]``, then ``if (potarr[st] < minp) minp = potarr[st]``.
    """
    rng = default_rng(0)
    for _ in range(500):
        potential = rng.uniform(98.0, 103.0, 25).astype(np.float32)
        least = int(potential[12])
        lowest = 12
        for n in (6, 7, 8, 11, 13, 16, 17, 18):
            if potential[n] < least:
                least = int(potential[n])
                lowest = n
        assert lowest_neighbour(potential, 5, 12) == lowest


def room(width=80, height=60):
    """A room with a wall that leaves a gap at the top."""
    costs = np.zeros((height, width), dtype=np.uint8)
    costs[: height - 10, width // 2] = 254
    return Costmap(costs, 0.1, -2.0, 1.0)


START = Pose2D(-1.0, 2.0, 0.3)
GOAL = Pose2D(5.0, 2.5, 1.1)


@pytest.mark.parametrize("use_astar", [False, True])
def test_second_plan_does_not_remember_the_first(use_astar):
    planner = NavfnPlanner(NavfnParams(use_astar=use_astar))
    costmap = room()
    planner.plan(START, GOAL, costmap)
    costmap.data[:40, 20] = 254
    costmap.data[5:, 60] = 254
    again = planner.plan(GOAL, START, costmap)
    fresh_planner = NavfnPlanner(NavfnParams(use_astar=use_astar))
    fresh = fresh_planner.plan(GOAL, START, costmap)
    assert_array_equal(again.poses, fresh.poses)
    assert_array_equal(planner.potential, fresh_planner.potential)


def test_a_map_of_another_size_may_follow():
    planner = NavfnPlanner(NavfnParams())
    planner.plan(START, GOAL, room())
    small = room(70, 50)
    fresh = NavfnPlanner(NavfnParams()).plan(START, Pose2D(4.0, 2.0), small)
    assert_array_equal(planner.plan(START, Pose2D(4.0, 2.0), small).poses, fresh.poses)


def test_costmap_is_left_as_it_is():
    costmap = room()
    costmap.data[10, 10] = 254
    before = costmap.data.copy()
    NavfnPlanner(NavfnParams()).plan(Pose2D(-1.0, 2.0), GOAL, costmap)
    assert_array_equal(costmap.data, before)


def test_start_in_an_obstacle_is_cleared():
    costmap = room()
    costmap.data[10, 10] = 254
    path = NavfnPlanner(NavfnParams()).plan(Pose2D(-1.0, 2.0), GOAL, costmap)
    assert_allclose(path.poses[0, :2], (-1.0, 2.0))


def test_path_ends_at_the_goal_with_its_heading():
    path = NavfnPlanner(NavfnParams()).plan(START, GOAL, room(), stamp=7.0)
    assert path.stamp == 7.0
    assert_array_equal(path.poses[-1], GOAL.as_array())
    assert not path.poses[:-1, 2].any()


def test_final_approach_orientation_follows_the_path():
    path = NavfnPlanner(NavfnParams(use_final_approach_orientation=True)).plan(START, GOAL, room())
    step = path.poses[-1, :2] - path.poses[-2, :2]
    assert path.poses[-1, 2] == approx(np.arctan2(step[1], step[0]))


@pytest.mark.parametrize(("final", "yaw"), [(False, 1.5), (True, 0.5)])
def test_start_at_the_goal(final, yaw):
    params = NavfnParams(use_final_approach_orientation=final)
    path = NavfnPlanner(params).plan(Pose2D(0.0, 2.0, 0.5), Pose2D(0.0, 2.0, 1.5), room())
    assert_array_equal(path.poses, [[0.0, 2.0, yaw]])


def test_errors():
    planner = NavfnPlanner(NavfnParams(tolerance=0.0))
    costmap = room()
    with pytest.raises(StartOutsideMapError, match=r"start \(-9, 2\) m .* x -2 to 6 m"):
        planner.plan(Pose2D(-9.0, 2.0), GOAL, costmap)
    with pytest.raises(GoalOutsideMapError):
        planner.plan(START, Pose2D(float("nan"), 0.0), costmap)
    with pytest.raises(GoalOccupiedError, match="nearest free cell is 0.10 m away"):
        planner.plan(START, Pose2D(2.05, 2.05), costmap)
    costmap.data[:, 40] = 254
    with pytest.raises(NoPathFoundError, match="no path from"):
        planner.plan(START, GOAL, costmap)
    costmap.data[:, 40] = 255
    planner.plan(START, GOAL, costmap)
    with pytest.raises(NoPathFoundError):
        NavfnPlanner(NavfnParams(allow_unknown=False)).plan(START, GOAL, costmap)


def test_poses_at_the_very_edge_of_the_map():
    costmap = room()
    path = NavfnPlanner(NavfnParams()).plan(Pose2D(5.99, 4.0), START, costmap)
    assert_array_equal(path.poses[-1], START.as_array())
    path = NavfnPlanner(NavfnParams()).plan(START, Pose2D(5.99, 6.99), costmap)
    assert np.hypot(*(path.poses[-1, :2] - (5.99, 6.99))) < 0.5


def flat_place():
    """Potentials that fall to the left, with a plateau on which the gradient is zero."""
    potential = np.tile(np.arange(9, dtype=np.float32) * 60.0, (9, 1))
    potential[3:6, 3:6] = 180.0
    return potential


def points_to_the_left(potential, gives_up, most=500):
    path = np.zeros((most, 2), dtype=np.float32)
    return descend(potential.ravel(), 9, 4 * 9 + 4, 4 * 9, gives_up, path)


def test_descent_leaves_a_flat_place_along_the_grid():
    potential = flat_place()
    assert points_to_the_left(potential, False) == FAILED  # no lower neighbour at all
    potential[3, 4] = 170.0
    potential[4, 3] = 130.0
    assert points_to_the_left(potential, False) > 0


def test_as_upstream_the_descent_gives_up_where_the_gradient_is_zero():
    potential = flat_place()
    potential[4, 2] = 30.0  # lower ground within reach of the grid, not of the gradient
    assert points_to_the_left(potential, True) == FAILED
    sloping = np.tile(np.arange(9, dtype=np.float32) * 60.0, (9, 1))
    count = points_to_the_left(sloping, True)
    assert count == points_to_the_left(sloping, False) == points_to_the_left(sloping, True, count)
    assert points_to_the_left(sloping, True, count - 1) == EXHAUSTED


def recorded_scene(name):
    with np.load(GOLDEN) as recorded:
        facts = json.loads(str(recorded["meta_json"]))[name]
        costmap = Costmap(recorded[f"{name}_costmap"], facts["resolution"], *facts["origin"])
        paths = [recorded[f"{name}_{algorithm}_path"] for algorithm in ("dijkstra", "astar")]
    return Pose2D(*facts["start_xyyaw"]), Pose2D(*facts["goal_xyyaw"]), costmap, paths


@pytest.mark.parametrize("use_astar", [False, True])
@pytest.mark.parametrize("name", ["walls_infl", "unknown_allowed", "walls_raw", "empty60"])
def test_a_path_longer_than_nav2_allows_is_refused_on_request(name, use_astar):
    start, goal, costmap, paths = recorded_scene(name)
    found = NavfnPlanner(NavfnParams(use_astar=use_astar)).plan(start, goal, costmap).poses
    upstream = NavfnPlanner(NavfnParams(use_astar=use_astar, max_cycles_factor=4))
    if len(paths[use_astar]):
        assert_array_equal(upstream.plan(start, goal, costmap).poses, found)
        return
    assert len(found) > 4 * max(costmap.data.shape)
    with pytest.raises(NoPathFoundError):
        upstream.plan(start, goal, costmap)
    patient = NavfnPlanner(NavfnParams(use_astar=use_astar, max_cycles_factor=8))
    assert_array_equal(patient.plan(start, goal, costmap).poses, found)


@pytest.mark.parametrize("step", [1, -1, 9, -9, 10, 2])
def test_corners_that_are_kept_are_those_taken_anew(step):
    potential = default_rng(0).uniform(0.0, 500.0, 81).astype(np.float32)
    kept = np.empty((4, 2), dtype=np.float32)
    fresh = np.empty((4, 2), dtype=np.float32)
    take_corners(potential, 9, 40, -1, kept)
    take_corners(potential, 9, 40 + step, 40, kept)
    take_corners(potential, 9, 40 + step, -1, fresh)
    assert_array_equal(kept, fresh)


def test_gradients_between_corners_are_bilinear():
    corners = np.array(((0.25, -0.5), (0.75, 0.125), (-1.0, 0.5), (0.5, 1.0)), dtype=np.float32)
    found = interpolated_gradient.py_func(corners, np.float32(0.25), np.float32(0.75))
    weights = np.array((0.75 * 0.25, 0.25 * 0.25, 0.75 * 0.75, 0.25 * 0.75))
    assert found == approx(tuple(weights @ corners), rel=1e-6)


@pytest.mark.parametrize(
    ("offset", "gradient", "expected"),
    [
        ((0.6, 0.0), (1.0, 0.0), (41, 0.1, 0.0)),  # beyond a whole cell: into the next
        ((0.5, 0.0), (1.0, 0.0), (40, 1.0, 0.0)),
        ((-0.7, 0.0), (-1.0, 0.0), (39, -0.2, 0.0)),
        ((0.0, 0.9), (0.0, 1.0), (49, 0.0, 0.4)),
        ((0.0, -0.9), (0.0, -1.0), (31, 0.0, -0.4)),
        ((0.9, -0.9), (0.6, -0.8), (32, 0.2, -0.3)),
        ((0.9, -0.9), (0.0, 0.0), (-1, 0.9, -0.9)),
    ],
)
def test_a_step_is_half_a_cell_down_the_gradient(offset, gradient, expected):
    corners = np.tile(np.array(gradient, dtype=np.float32), (4, 1))
    n, dx, dy = advance.py_func(corners, 9, 40, *np.array(offset, dtype=np.float32))
    assert (n, dx, dy) == approx(expected, abs=1e-6)


@pytest.mark.parametrize(("source", "point"), [(80, [8.0, 8.0]), (0, [0.0, 0.0]), (8, [8.0, 0.0])])
def test_a_descent_from_the_source_is_over_at_once(source, point):
    potential = np.full(81, POT_HIGH, dtype=np.float32)
    path = np.zeros((5, 2), dtype=np.float32)
    potential[source] = 0.0
    assert descend(potential, 9, source, source, False, path) == 1
    assert path[0].tolist() == point


@pytest.mark.skipif(DATA is None, reason="NAVSTACK_DATA is unset: no real maps")
@pytest.mark.parametrize("use_astar", [False, True])
@pytest.mark.parametrize("start", [(428, 746), (350, 400)])
def test_willow_regression(start, use_astar):
    from PIL import Image

    pixels = np.array(Image.open(FilePath(DATA) / "navfn_regression" / "willow_costmap.pgm"))
    costs = np.full(pixels.shape, 254, dtype=np.uint8)  # the file holds NavFn's own costs
    costs[pixels == 50] = 0
    costs[pixels == 253] = 255
    path = NavfnPlanner(NavfnParams(use_astar=use_astar)).plan(
        Pose2D(*start), Pose2D(350.0, 450.0), Costmap(costs, 1.0, 0.0, 0.0)
    )
    cells = np.floor(path.poses[:, :2] + 0.5).astype(int)
    assert (costs[cells[:, 1], cells[:, 0]] != 254).all()
    assert_allclose(path.poses[[0, -1], :2], (start, (350, 450)))


@pytest.mark.skipif(DATA is None, reason="NAVSTACK_DATA is unset: no street maps")
@pytest.mark.parametrize("name", ["Berlin_0_256", "NewYork_0_256"])
def test_street_maps_against_optimal_lengths(name):
    folder = FilePath(DATA) / "movingai"
    rows = (folder / f"{name}.map").read_text().splitlines()[4:]
    # a rim, for NavFn never enters the border of a map
    costs = np.full((258, 258), 254, dtype=np.uint8)
    costs[1:-1, 1:-1] = [[0 if tile in ".GS" else 254 for tile in row] for row in rows]
    costmap = Costmap(costs, 1.0, -1.0, -1.0)
    planner = NavfnPlanner(NavfnParams(tolerance=0.0))
    ratios = []
    for line in (folder / f"{name}.map.scen").read_text().splitlines()[1::3]:
        fields = line.split("\t")
        start_x, start_y, goal_x, goal_y = (float(field) for field in fields[4:8])
        path = planner.plan(Pose2D(start_x, start_y), Pose2D(goal_x, goal_y), costmap)
        if float(fields[8]) > 0.0:
            ratios.append(path.length / float(fields[8]))
    assert len(ratios) > 280
    assert np.median(ratios) < 0.98  # any angle is shorter than eight
    assert max(ratios) < 1.03

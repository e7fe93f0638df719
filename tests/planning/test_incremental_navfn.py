"""The kept field gives paths as good as a fresh NavFn's.

A fresh one, ending its wave early, is up to 2 % from the best.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal

from navstack.costmap.costmap import Costmap
from navstack.errors import GoalOccupiedError, NoPathFoundError
from navstack.params.planners import IncrementalNavfnParams, NavfnParams
from navstack.planning.incremental_kernels import roll_back, seed_edge, take_in_changes
from navstack.planning.incremental_navfn import IncrementalNavfn
from navstack.planning.navfn import NavfnPlanner
from navstack.planning.navfn_kernels import BLOCK_SIZE, POT_HIGH, cost_tables, set_border
from navstack.types import Pose2D

from .given import free_map, step_lengths

RESOLUTION = 0.1
START = Pose2D(1.0, 1.0)
GOAL = Pose2D(27.0, 17.0, 0.4)


def streets(seed=0):
    """Blocks with streets between them, 30 x 20 m, costs rising towards the walls."""
    costs = np.zeros((200, 300), dtype=np.uint8)
    for y in range(20, 180, 55):
        for x in range(20, 280, 65):
            costs[y : y + 35, x : x + 45] = 120
            costs[y + 2 : y + 33, x + 2 : x + 43] = 254
    costs[default_rng(seed).random(costs.shape) < 0.002] = 254
    costs[160:180, 260:280] = 0
    costs[0:20, 0:20] = 0
    return Costmap(costs, RESOLUTION, 0.0, 0.0)


def path_cost(path, costmap):
    """NavFn's cost of a path: crossing costs along it, by the trapezium rule at 0.1 cells."""
    crossing, _ = cost_tables(allow_unknown=True)
    points = path.poses[:, :2] / RESOLUTION
    along = np.concatenate(([0.0], np.cumsum(step_lengths(points))))
    at = np.linspace(0.0, along[-1], int(along[-1] * 10))
    cells = np.floor(
        np.stack((np.interp(at, along, points[:, 0]), np.interp(at, along, points[:, 1]))) + 0.5
    ).astype(int)
    return crossing[costmap.data[cells[1], cells[0]]].mean() * along[-1]


def crosses_obstacle(path, costmap):
    cells = np.floor(path.poses[:, :2] / RESOLUTION + 0.5).astype(int)
    return (costmap.data[cells[:, 1], cells[:, 0]] == 254).any()


def fresh_plan(start, costmap):
    return NavfnPlanner(NavfnParams()).plan(start, GOAL, costmap)


def is_as_good(path, start, costmap):
    """Whether a path costs no more than a fresh NavFn's."""
    return path_cost(path, costmap) <= 1.01 * path_cost(fresh_plan(start, costmap), costmap)


def copy_of(costmap):
    return Costmap(costmap.data.copy(), RESOLUTION, 0.0, 0.0)


def make(**given):
    return IncrementalNavfn(IncrementalNavfnParams(**given))


def put_disc(costs, x, y, radius=5):
    rows, columns = np.ogrid[: costs.shape[0], : costs.shape[1]]
    costs[(columns - x) ** 2 + (rows - y) ** 2 <= radius**2] = 254


def test_first_plan_costs_no_more_than_navfn():
    costmap = streets()
    path = make().plan(START, GOAL, costmap)
    assert_allclose(path.poses[0, :2], (1.0, 1.0))
    assert_array_equal(path.poses[-1], GOAL.as_array())
    assert is_as_good(path, START, costmap)


@pytest.mark.parametrize("seed", range(3))
def test_drive_among_obstacles_that_come_and_go(seed):
    rng = default_rng(seed)
    empty = streets(seed)
    planner = make(change_radius=8.0)
    start = Pose2D(1.0, 1.0)
    for _ in range(25):
        costmap = copy_of(empty)
        column = int(start.x / RESOLUTION)
        row = int(start.y / RESOLUTION)
        for dx, dy in rng.integers(-70, 71, (4, 2)):
            if np.hypot(dx, dy) > 12 and np.hypot(column + dx - 270, row + dy - 170) > 12:
                put_disc(costmap.data, column + dx, row + dy)
        path = planner.plan(start, GOAL, costmap)
        assert not crosses_obstacle(path, costmap)
        assert is_as_good(path, start, costmap)
        start = Pose2D(*path.poses[min(25, len(path) - 2)])


def test_obstacle_on_the_path_is_avoided_and_forgotten():
    costmap = streets()
    planner = make(change_radius=8.0)
    before = planner.plan(START, GOAL, costmap)
    blocked = copy_of(costmap)
    x, y = before.poses[60, :2] / RESOLUTION
    put_disc(blocked.data, x, y)
    around = planner.plan(START, GOAL, blocked)
    assert crosses_obstacle(before, blocked)
    assert not crosses_obstacle(around, blocked)
    after = planner.plan(START, GOAL, costmap)
    assert path_cost(after, costmap) == pytest.approx(path_cost(before, costmap), rel=1e-3)


def test_a_field_is_repaired_where_an_obstacle_comes_and_goes(monkeypatch):
    costmap = streets()
    planner = make(change_radius=8.0)
    before = planner.plan(START, GOAL, costmap)
    blocked = copy_of(costmap)
    put_disc(blocked.data, *(before.poses[60, :2] / RESOLUTION))
    monkeypatch.delattr(IncrementalNavfn, "_descend_anew")  # which would make another one
    for seen in (blocked, costmap):
        path = planner.plan(START, GOAL, seen)
        assert is_as_good(path, START, seen)


def test_obstacle_beyond_the_change_radius_is_noticed_on_the_path():
    costmap = streets()
    planner = make(change_radius=2.0)
    before = planner.plan(START, GOAL, costmap)
    x, y = before.poses[len(before) // 2, :2] / RESOLUTION
    put_disc(costmap.data, x, y)
    assert crosses_obstacle(before, costmap)
    path = planner.plan(START, GOAL, costmap)
    assert not crosses_obstacle(path, costmap)
    assert is_as_good(path, START, costmap)


@pytest.mark.parametrize("closed_row", [5, 60, 115])
def test_a_detour_may_lead_where_the_field_was_not_spread_anew(closed_row):
    start = Pose2D(1.0, 1.0)
    empty = streets(1)
    planner = make(change_radius=8.0)
    path = planner.plan(start, GOAL, empty)
    # somebody who walks along leaves most of the field to be forgotten and only a part spread anew
    for k in range(6):
        start = Pose2D(*path.poses[min(20, len(path) - 2)])
        costmap = copy_of(empty)
        ahead = path.poses[min(60, len(path) - 2), :2] / RESOLUTION
        put_disc(costmap.data, ahead[0] + 4 * (k % 2), ahead[1], 3)
        path = planner.plan(start, GOAL, costmap)
    x, y = path.poses[len(path) // 2, :2] / RESOLUTION
    put_disc(costmap.data, x, y, 16)
    costmap.data[closed_row : closed_row + 5, 20:280] = 254
    path = planner.plan(start, GOAL, costmap)
    assert not crosses_obstacle(path, costmap)
    assert is_as_good(path, start, costmap)


def test_a_street_that_closes_is_left_for_another():
    costmap = streets()
    planner = make()
    before = planner.plan(START, GOAL, costmap)
    columns, rows = np.floor(before.poses[::4, :2].T / RESOLUTION + 0.5).astype(int)
    for x, y in zip(columns[20:60], rows[20:60], strict=True):
        put_disc(costmap.data, x, y, 12)
    path = planner.plan(START, GOAL, costmap)
    assert not crosses_obstacle(path, costmap)
    assert is_as_good(path, START, costmap)


def test_robot_that_leaves_the_field_extends_it():
    costmap = streets()
    planner = make()
    planner.plan(Pose2D(20.5, 12.0), GOAL, costmap)
    path = planner.plan(START, GOAL, costmap)
    assert is_as_good(path, START, costmap)


def test_robot_that_recedes_among_obstacles_extends_it_step_by_step():
    empty = streets()
    planner = make(change_radius=8.0)
    route = planner.plan(Pose2D(1.0, 1.0), GOAL, empty).poses
    planner.reset(default_rng(0))
    rng = default_rng(3)
    for x, y, _ in route[::-1][60::25]:
        costmap = copy_of(empty)
        column = int(x / RESOLUTION)
        row = int(y / RESOLUTION)
        for dx, dy in rng.integers(-70, 71, (3, 2)):
            if np.hypot(dx, dy) > 12 and np.hypot(column + dx - 270, row + dy - 170) > 12:
                put_disc(costmap.data, column + dx, row + dy)
        path = planner.plan(Pose2D(x, y), GOAL, costmap)
        assert not crosses_obstacle(path, costmap)
        assert path_cost(path, costmap) <= 1.01 * path_cost(
            fresh_plan(Pose2D(x, y), costmap), costmap
        )


def test_new_goal_and_new_map_start_afresh():
    costmap = streets()
    planner = make()
    planner.plan(START, GOAL, costmap)
    other = planner.plan(START, Pose2D(1.0, 18.5), costmap)
    assert_allclose(other.poses[-1, :2], (1.0, 18.5))
    shifted = Costmap(costmap.data, RESOLUTION, 100.0, 0.0)
    path = planner.plan(Pose2D(101.0, 1.0), Pose2D(101.0, 18.5), shifted)
    assert_allclose(path.poses[:, :2], other.poses[:, :2] + (100.0, 0.0), atol=1e-9)


def test_what_the_field_cannot_answer_goes_to_navfn():
    costmap = streets()
    put_disc(costmap.data, 270, 170, 3)
    path = make().plan(START, GOAL, costmap)
    assert_array_equal(path.poses, fresh_plan(START, costmap).poses)
    with pytest.raises(GoalOccupiedError):
        make(tolerance=0.0).plan(START, GOAL, costmap)
    costmap.data[:, 150] = 254
    with pytest.raises(NoPathFoundError):
        make().plan(START, GOAL, costmap)


@pytest.mark.parametrize(("column", "row"), [(1, 1), (298, 1), (1, 198), (298, 198)])
def test_the_field_answers_for_cells_beside_the_border(monkeypatch, column, row):
    monkeypatch.delattr(NavfnPlanner, "plan")  # which would answer for it
    open_ground = free_map(200, 300, RESOLUTION)
    start = Pose2D(column * RESOLUTION, row * RESOLUTION)
    path = make().plan(start, GOAL, open_ground)
    assert_allclose(path.poses[0, :2], (start.x, start.y))


@pytest.mark.parametrize(
    ("sound", "gap_limit", "spread", "calls"),
    [
        # the robot's 10000 and 508 lie below what is sound, 2000 more cost no gap's way
        (10509.0, 12000.0, [], []),
        (10508.0, 12000.0, [(11000.0, 13000.0)], [(10508.0, 14000.0)]),
        (10509.0, 11999.0, [(11000.0, 13000.0)], [(3000.0, 14000.0)]),
        (2500.0, 11999.0, [(11000.0, 13000.0)], [(2500.0, 14000.0)]),
        (
            9000.0,
            12000.0,
            [(11001.0, 13000.0), (15000.0, 14000.0)],
            [(9000.0, 14000.0), (3000.0, 15001.0)],
        ),
        (9000.0, 12000.0, [None], [(9000.0, 14000.0)]),
        (9000.0, 12000.0, [(11001.0, 13000.0), None], [(9000.0, 14000.0), (3000.0, 15001.0)]),
    ],
)
def test_a_field_is_spread_anew_as_far_as_ways_over_its_gaps_may_matter(
    sound,
    gap_limit,
    spread,
    calls,
):
    """``spread``: the robot's potential and the limit afterwards, each time.

    None: the field has to be renewed.
    """
    planner = make()
    asked = []
    results = iter(spread)
    planner._field = SimpleNamespace(flat=np.full(600, 10000.0))
    planner._robot = 310
    planner._sound_below = sound
    planner._gap_level = 3000.0
    planner._gap_limit = gap_limit

    def resume(robot, source, costmap, limit):
        asked.append((planner._sound_below, limit))
        if (result := next(results)) is None:
            return False
        planner._field.flat[robot], planner._gap_limit = result
        return True

    planner._resume = resume
    costmap = free_map(20, 30, RESOLUTION)
    assert planner._repair(310, 40, costmap) == (None not in spread)
    assert asked == calls


@pytest.mark.parametrize(
    ("level", "limit", "final", "gap"),
    [
        (508.0, 9000.0, None, (600.0, 8000.0)),  # so low that all is spread anew
        (508.5, 9000.0, 5000.0, (508.5, 9000.0)),
        (600.0, 9000.0, 100.5, (600.0, 9000.0)),
        (700.0, 9000.0, 5000.0, (600.0, 8000.0)),
        (700.0, 7000.0, 100.0, (600.0, 7000.0)),
        (508.5, 1e10, -1.0, (508.5, np.inf)),
    ],
)
def test_what_is_known_of_a_field_that_was_taken_up_again(level, limit, final, gap):
    planner = make()
    asked = []
    planner._known = np.arange(600, dtype=np.uint8)
    planner._sound_below = level
    planner._gap_level = 600.0
    planner._gap_limit = 8000.0
    planner._field = SimpleNamespace(resume=lambda *given: asked.append(given) or final)
    costmap = free_map(20, 30, RESOLUTION, 1.0, 2.0)
    assert planner._resume(310, 40, costmap, limit) == (final is not None and final > 100.0)
    assert (planner._gap_level, planner._gap_limit) == gap
    assert planner._sound_below == (level if final is None else final - 100.0)
    if final is not None:
        ((known, *given),) = asked
        assert given == [40, 310, level, 1000.0, np.inf if limit > 1e9 else limit]
        assert (known.data.ravel() == planner._known).all()
        assert known.grid == costmap.grid


@pytest.mark.parametrize("allow_unknown", [False, True])
def test_cells_are_open_off_the_border_and_the_obstacles(allow_unknown):
    costs = np.zeros((6, 8), dtype=np.uint8)
    costs[2, 2:6] = 252, 253, 254, 255
    planner = make(allow_unknown=allow_unknown)
    found = [planner._is_open(n, Costmap(costs, RESOLUTION, 0.0, 0.0)) for n in range(48)]
    expected = np.zeros((6, 8), dtype=np.bool_)
    expected[1:-1, 1:-1] = True
    expected[2, 3:6] = False, False, allow_unknown
    assert found == expected.ravel().tolist()


def test_what_is_forgotten_and_where_the_wave_begins_again_equal_slow_twins():
    rng = default_rng(9)
    # the last block is not a whole one
    height = 37
    width = 53
    level = 900.0
    crossing, gain = cost_tables(True)
    for share in (0.0, 0.2, 0.6):
        costs = rng.choice(
            np.array((0, 90, 254), dtype=np.uint8), height * width, p=(0.6, 0.3, 0.1)
        )
        hills = (
            20.0 * np.add.outer(np.arange(height), np.arange(width))
            + rng.uniform(0, 200, (height, width))
        ).ravel()
        is_unreached = (rng.random(height * width) < share) | (costs == 254)
        potential = np.where(is_unreached, POT_HIGH, hills).astype(np.float32)
        dirty = np.zeros(-(-(potential.size // BLOCK_SIZE + 1) // 8) * 8, dtype=np.uint8)
        dirty[: potential.size // BLOCK_SIZE + 1] = 1
        tops, edge, buffer = np.zeros(dirty.size, np.float32), *np.empty((2, 5000), dtype=np.uint32)
        for cut in (level + 400.0, level, level):  # blocks that have settled, and none to forget
            blocks = roll_back(potential, dirty, tops, cut, edge)
        expected = np.where(potential >= level, POT_HIGH, potential)
        assert_array_equal(potential, expected)
        highest = [max((p for p in part if p < level), default=0.0) for part in _blocks(expected)]
        assert_array_equal(tops[: len(highest)], highest)
        assert_array_equal(
            edge[:blocks], [i for i, top in enumerate(highest) if top >= level - 254.0]
        )
        set_border(potential, costs, gain, width, -POT_HIGH)
        twin = potential.copy()
        waiting = []
        for n in range(width, potential.size - width):
            for m in (n - 1, n + 1, n - width, n + width):
                if level - 254.0 <= twin[n] < level and twin[m] == POT_HIGH and costs[m] < 253:
                    twin[m] = -POT_HIGH
                    waiting.append(m)
        count = seed_edge(potential, edge[:blocks], costs, gain, width, level, buffer)
        assert len(waiting) > 20
        assert_array_equal(buffer[:count], waiting)
        assert_array_equal(potential, twin)


def _blocks(values):
    return [values[i : i + BLOCK_SIZE] for i in range(0, len(values), BLOCK_SIZE)]


@pytest.mark.parametrize("columns", [(1, 40), (3, 67), (5, 199)])
def test_changes_in_a_window_are_taken_in(columns):
    rng = default_rng(10)
    height = 30
    width = 200
    crossing, _ = cost_tables(True)
    for only_cheaper in (False, True):
        known = rng.choice(np.array((0, 60, 254), dtype=np.uint8), height * width)
        costs = known.copy()
        potential = rng.uniform(0, 5000, height * width).astype(np.float32)
        changed = rng.choice(height * width, 40, replace=False)
        costs[changed] = rng.choice(np.array((0, 60, 254), dtype=np.uint8), 40)
        expected = known.copy()
        level = POT_HIGH
        for n in range(height * width):
            y, x = divmod(n, width)
            inside = columns[0] <= x < columns[1] and 2 <= y < 28
            dearer = crossing[costs[n]] > crossing[known[n]]
            if inside and costs[n] != known[n] and not (only_cheaper and dearer):
                expected[n] = costs[n]
                level = min(level, *potential[[n, n - 1, n + 1, n - width, n + width]])
        found = take_in_changes(
            potential,
            costs,
            known,
            crossing,
            width,
            (*columns, 2, 28),
            only_cheaper,
        )
        assert found == level
        assert_array_equal(known, expected)

"""Sampling-based plans: valid, repeatable, and short where the algorithm promises it."""

import subprocess
import sys

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx
from scipy.ndimage import distance_transform_edt

from harness.plan.path_check import Obstacles
from navstack.costmap.costmap import Costmap
from navstack.errors import (
    GoalOccupiedError,
    NoPathFoundError,
    ParameterError,
    StartOccupiedError,
    UnknownNameError,
)
from navstack.params.planners import OMPL_ALGORITHMS, SE2_ALGORITHMS, OmplParams
from navstack.planning import ompl_search
from navstack.planning.ompl_kernels import (
    Room,
    blocked_table,
    has_corridor,
    has_room,
    is_line_free,
    nearest_free_cell,
)
from navstack.planning.ompl_planner import OmplPlanner
from navstack.planning.ompl_search import ALGORITHMS, Budget
from navstack.planning.planner import RobotShape
from navstack.planning.polyline_kernels import cumulative_length, point_at, polyline_cost, shortcut
from navstack.types import Path, Pose2D

from .given import free_map, step_lengths, turns_of

# costs: contact alone
LONG = RobotShape(np.array(((0.15, 0.25), (0.15, -0.25), (-0.6, -0.25), (-0.6, 0.25))), 0.05)
START = Pose2D(-1.0, 2.0, 0.3)
GOAL = Pose2D(5.0, 2.5, 1.1)
# of the gap in the wall
# [m] around the wall's top, to within some cells
SHORTEST = np.hypot(3.0, 4.0) + 0.1 + np.hypot(2.9, 3.5)
BLOCKED = blocked_table(252, True)


def is_free(costs, *line):
    return is_line_free(costs, BLOCKED, *line)


def room():
    """An 8 x 6 m room with a wall that leaves a gap at the top."""
    costs = np.zeros((60, 80), dtype=np.uint8)
    costs[:50, 40] = 254
    return Costmap(costs, 0.1, -2.0, 1.0)


def make(algorithm="RRTConnect", seed=1, iterations=1500, shape=None, **values):
    given = {"patience": 1000, "fruitless_searches": 0, "smooth": False, **values}
    planner = OmplPlanner(
        OmplParams(algorithm=algorithm, max_iterations=iterations, **given), shape
    )
    planner.reset(default_rng(seed))
    return planner


def is_valid(path, costmap):
    cells = (path.poses[:, :2] - (costmap.origin_x, costmap.origin_y)) / costmap.resolution
    return all(is_free(costmap.data, *a, *b) for a, b in zip(cells[:-1], cells[1:], strict=True))


def test_every_algorithm_named_is_there():
    assert set(ALGORITHMS) == set(OMPL_ALGORITHMS)


@pytest.mark.parametrize("algorithm", OMPL_ALGORITHMS)
def test_path_is_valid_dense_and_faces_along_itself(algorithm):
    costmap = room()
    path = make(algorithm).plan(START, GOAL, costmap, stamp=3.0)
    assert path.stamp == 3.0
    assert is_valid(path, costmap)
    assert_allclose(path.poses[0, :2], (START.x, START.y))
    assert_allclose(path.poses[-1], GOAL.as_array())
    steps = np.diff(path.poses[:, :2], axis=0)
    assert np.hypot(*steps.T).max() <= costmap.resolution + 1e-9
    assert_allclose(path.poses[:-1, 2], np.arctan2(steps[:, 1], steps[:, 0]))
    assert path.length >= SHORTEST - 0.3


@pytest.mark.parametrize("algorithm", sorted({*OMPL_ALGORITHMS} - {"RRTConnect"}))
def test_optimising_algorithms_come_near_the_shortest_path(algorithm):
    path = make(algorithm, iterations=4000, cost_weight=0.0).plan(START, GOAL, room())
    assert path.length < 1.02 * SHORTEST


@pytest.mark.parametrize("algorithm", OMPL_ALGORITHMS)
def test_same_seed_same_path_whatever_came_before(algorithm):
    costmap = room()
    first = make(algorithm, iterations=600).plan(START, GOAL, costmap)
    make("RRTstar", seed=5, iterations=200).plan(GOAL, START, costmap)
    assert_array_equal(
        make(algorithm, iterations=600).plan(START, GOAL, costmap).poses, first.poses
    )
    assert not np.array_equal(make(algorithm, 2, 600).plan(START, GOAL, costmap).poses, first.poses)


@pytest.mark.slow
def test_same_seed_same_path_in_another_process():
    code = (
        "import numpy as np; from navstack.costmap.costmap import Costmap; from "
        "navstack.types import Pose2D\n"
        "from navstack.params.planners import OmplParams; from "
        "navstack.planning.ompl_planner import OmplPlanner\n"
        "costs = np.zeros((60, 80), dtype=np.uint8); costs[:50, 40] = 254\n"
        "params = OmplParams(algorithm='InformedRRTstar', max_iterations=500, smooth=False)\n"
        "planner = OmplPlanner(params); planner.reset(np.random.default_rng(1))\n"
        "path = planner.plan(Pose2D(-1.0, 2.0, 0.3), Pose2D(5.0, 2.5, 1.1), Costmap(costs, "
        "0.1, -2.0, 1.0))\n"
        "print(path.poses.tobytes().hex())"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
    )
    here = make("InformedRRTstar", iterations=500).plan(START, GOAL, room())
    assert answer.stdout.strip() == here.poses.tobytes().hex()
    assert answer.stderr == ""


def test_cost_weight_keeps_clear_of_costly_cells():
    costmap = room()
    costmap.data[:, 41:] = 0
    costmap.data[:50, 40] = 0
    costmap.data[5:30, 20:60] = 250  # costly, not forbidden, on the straight line
    short = make("RRTstar", iterations=3000, cost_weight=0.0).plan(START, GOAL, costmap)
    clear = make("RRTstar", iterations=3000, cost_weight=5.0).plan(START, GOAL, costmap)
    mean_cost = [
        np.mean([costmap.cost_at(x, y) for x, y, _ in path.poses]) for path in (short, clear)
    ]
    assert mean_cost[0] > 100 > 40 > mean_cost[1]
    assert short.length < clear.length


def test_occupied_ends_move_to_the_nearest_free_cell():
    costmap = room()
    costmap.data[8:13, 8:13] = 253
    path = make().plan(START, GOAL, costmap)
    assert_allclose(path.poses[0, :2], (START.x, START.y))
    goal = make().plan(GOAL, START, costmap).poses[-1]
    assert 0.1 < np.hypot(*(goal[:2] - (START.x, START.y))) <= 0.5
    with pytest.raises(StartOccupiedError, match="start .* nearest free cell is"):
        make(tolerance=0.0).plan(START, GOAL, costmap)
    with pytest.raises(GoalOccupiedError):
        make(tolerance=0.0).plan(GOAL, START, costmap)


def test_closed_way_and_unknown_cells():
    costmap = room()
    costmap.data[:, 40] = 255
    make().plan(START, GOAL, costmap)
    with pytest.raises(NoPathFoundError, match="RRTConnect: no path .* obstacles part them"):
        make(iterations=500, allow_unknown=False).plan(START, GOAL, costmap)


def test_why_there_is_no_path():
    costmap = room()
    costmap.data[:50, 40] = 0
    costmap.data[:, 40] = 254
    costmap.data[55, 40] = 0  # a gap that samples hardly ever hit
    with pytest.raises(
        NoPathFoundError, match="within 5 iterations, though free cells connect them; raise max_it"
    ):
        make(iterations=5).plan(START, GOAL, costmap)
    with pytest.raises(NoPathFoundError, match="within 0.05 s, .* raise max_planning_time"):
        make(iterations=10**9, max_planning_time=0.05, shape=LONG).plan(START, GOAL, costmap)
    wide = RobotShape(np.array(((0.9, 0.9), (0.9, -0.9), (-0.9, -0.9), (-0.9, 0.9))), 0.05)
    with pytest.raises(NoPathFoundError, match="goal .* footprint reaches into an obstacle"):
        make(shape=wide).plan(START, Pose2D(2.6, 2.5), room())


def clear_by(path, costmap, footprint, start=START):
    """Of a body from the map's squares, by the harness's own check.

    That shares no code with the planner.
    """
    squares = Obstacles(costmap.data == 254, costmap.resolution, costmap.origin_x, costmap.origin_y)
    return squares.clearance(path.poses, start, GOAL, footprint)


@pytest.mark.parametrize("algorithm", OMPL_ALGORITHMS)
def test_the_body_touches_nothing_turns_included(algorithm):
    costmap = room()
    path = make(algorithm, shape=LONG, iterations=2500, cost_weight=0.0).plan(START, GOAL, costmap)
    assert clear_by(path, costmap, LONG.footprint) > 0.0
    point = make(algorithm, iterations=2500, cost_weight=0.0).plan(START, GOAL, costmap)
    assert clear_by(point, costmap, LONG.footprint) == 0.0  # a point alone cuts the corner


@pytest.mark.parametrize("algorithm", SE2_ALGORITHMS)
def test_poses_on_dubins_curves_keep_the_body_free_and_the_radius(algorithm):
    costmap = room()
    planner = make(
        algorithm,
        shape=LONG,
        iterations=500,
        cost_weight=0.0,
        state_space="SE2",
        minimum_turning_radius=0.4,
    )
    path = planner.plan(START, GOAL, costmap)
    assert_allclose(path.poses[0], START.as_array())
    assert_allclose(path.poses[-1], GOAL.as_array(), atol=1e-9)
    assert clear_by(path, costmap, LONG.footprint) > 0.0
    turn = turns_of(path.poses)
    step = step_lengths(path.poses)
    assert np.all(turn <= step / 0.4 * 1.02 + 1e-6)


def test_the_best_path_gets_better_and_patience_ends_the_search():
    planner = make("RRTstar", iterations=2500, patience=0)
    path = planner.plan(START, GOAL, room())
    seconds, costs = np.array(planner.improvement).T
    assert np.all(np.diff(seconds) >= 0.0)
    assert 0.0 <= seconds[0]
    assert seconds[-1] < 300.0
    assert np.all(np.diff(costs) < 0.0)
    assert len(costs) > 3
    assert path.length <= costs[0]
    hasty = make("RRTstar", iterations=2500, patience=200)
    hasty.plan(START, GOAL, room())
    assert hasty.improvement[-1][1] >= costs[-1]
    assert len(hasty.improvement) < len(costs)


# in cells and back: the same, and not quite
@pytest.mark.parametrize("goal", [GOAL, Pose2D(4.94, 2.65, 1.1)])
def test_a_path_that_is_still_free_is_kept(goal):
    planner = make("InformedRRTstar", iterations=500)
    costmap = room()
    first = planner.plan(START, goal, costmap)
    there = Pose2D(*first.poses[30])
    rest = planner.plan(there, goal, costmap)
    assert_array_equal(rest.poses[1:], first.poses[31:])
    assert planner.improvement == ()
    mx, my = costmap.world_to_map(*first.poses[60, :2])
    costmap.data[my - 1 : my + 2, mx - 1 : mx + 2] = 254
    around = planner.plan(there, goal, costmap)
    assert is_valid(around, costmap)
    assert planner.improvement
    assert not np.array_equal(around.poses[-20:], rest.poses[-20:]) or len(around) != len(rest)
    anew = make("InformedRRTstar", iterations=500, keep_valid_path=False)
    anew.plan(START, GOAL, room())
    anew.plan(START, GOAL, room())
    assert anew.improvement


def test_the_path_gets_better_on_the_way_until_searches_find_nothing_cheaper():
    costmap = free_map(120, 120)
    costmap.data[20:100, 30:34] = costmap.data[20:100, 70:74] = costmap.data[60:64, 34:70] = 254
    planner = make("RRTConnect", seed=3, fruitless_searches=3, simplify=False)
    start = Pose2D(1.0, 6.0)
    goal = Pose2D(11.0, 6.5)
    lengths = []
    searched = []
    for _ in range(40):  # from one place, so that lengths can be compared
        path = planner.plan(start, goal, costmap)
        assert is_valid(path, costmap)
        lengths.append(path.length)
        searched.append(bool(planner.improvement))
    assert all(later <= earlier for earlier, later in zip(lengths, lengths[1:], strict=False))
    assert lengths[-1] < 0.99 * lengths[0]
    assert searched[:4] == [True] * 4
    first_kept = searched.index(False)
    assert not any(searched[first_kept:])
    assert lengths[first_kept - 4] == lengths[first_kept]


def test_a_corner_is_rounded_where_there_is_room():
    costmap = room()
    away = distance_transform_edt(costmap.data == 0) * costmap.resolution
    costmap.data[:] = np.where(away == 0.0, 254, 250.0 * np.exp(-2.0 * away))
    sharp, round_ = (
        make("BITstar", smooth=smooth, cost_weight=20.0).plan(START, GOAL, costmap)
        for smooth in (False, True)
    )
    turns = [turns_of(path.poses[:-1]).max() for path in (sharp, round_)]
    assert turns[1] < 0.7 * turns[0]
    assert is_valid(round_, costmap)


def test_a_kept_path_of_poses_is_tried_with_the_body():
    planner = make(shape=LONG, state_space="SE2", minimum_turning_radius=0.4, iterations=8000)
    costmap = room()
    first = planner.plan(START, GOAL, costmap)
    rest = planner.plan(Pose2D(*first.poses[10]), GOAL, costmap)
    assert_array_equal(rest.poses, first.poses[10:])
    x, y, yaw = first.poses[40]
    mx, my = costmap.world_to_map(x - 0.2 * np.sin(yaw), y + 0.2 * np.cos(yaw))
    costmap.data[my, mx] = 254  # beside the path, under the body
    around = planner.plan(Pose2D(*first.poses[10]), GOAL, costmap)
    assert clear_by(around, costmap, LONG.footprint, Pose2D(*first.poses[10])) > 0.0


def test_a_kept_path_needs_room_at_its_turns():
    planner = make(shape=LONG)
    costmap = room()
    costmap.data[:] = 0
    up = np.arange(2.5, 5.0, 0.1)
    across = np.arange(-1.0, 5.0, 0.1)
    turn_at_the_top = (
        [(-1.0, y, np.pi / 2) for y in up] + [(x, 5.0, 0.0) for x in across] + [GOAL.as_array()]
    )
    planner._kept = Path(np.array(turn_at_the_top))
    start = Pose2D(-1.0, 2.5, np.pi / 2)
    kept = planner.plan(start, GOAL, costmap)
    assert_array_equal(kept.poses[1:], turn_at_the_top[1:])
    mx, my = costmap.world_to_map(-1.45, 5.05)  # beside the way up, under the tail after the turn
    costmap.data[my, mx] = 254
    assert clear_by(kept, costmap, LONG.footprint, start) == 0.0
    around = planner.plan(start, GOAL, costmap)
    assert clear_by(around, costmap, LONG.footprint, start) > 0.0


def test_a_robot_beside_its_path_of_poses_does_not_jump_onto_it():
    planner = make(shape=LONG, state_space="SE2", minimum_turning_radius=0.4, iterations=8000)
    costmap = room()
    x, y, yaw = planner.plan(START, GOAL, costmap).poses[10]
    for aside, turned in ((0.3, 0.0), (0.0, 0.5)):
        there = Pose2D(x + aside * np.sin(yaw), y - aside * np.cos(yaw), yaw + turned)
        path = planner.plan(there, GOAL, costmap).poses
        assert_allclose(path[0], there.as_array(), atol=1e-9)
        step = step_lengths(path)
        assert step.max() <= costmap.resolution + 1e-9
        assert np.all(turns_of(path) <= step / 0.4 * 1.02 + 1e-6)
        planner.plan(START, GOAL, costmap)


def test_a_query_is_in_cells():
    planner = make(shape=LONG, state_space="SE2", minimum_turning_radius=0.4, cost_weight=3.0)
    query = planner._query(START, GOAL, room())
    assert_allclose(np.sort(query.footprint, axis=0), np.sort(LONG.footprint / 0.1, axis=0))
    assert_allclose((query.first, query.last), ((10.0, 10.0, 0.3), (70.0, 15.0, 1.1)))
    assert (query.turning_radius, query.cost_weight) == approx((4.0, 3.0))
    assert query.room == approx((2.5, np.hypot(6.0, 2.5), True))


def test_discs_hold_no_part_of_a_lethal_square():
    rng = default_rng(5)
    costs = np.where(rng.random((30, 40)) < 0.02, 254, 0).astype(np.uint8)
    rows, columns = np.nonzero(costs)
    for x, y, radius in rng.random((400, 3)) * (40, 30, 6):
        dx = np.maximum(np.maximum(columns - x, x - columns - 1), 0.0)
        dy = np.maximum(np.maximum(rows - y, y - rows - 1), 0.0)
        assert has_room(costs, x, y, radius, True) == (np.hypot(dx, dy).min() > radius)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"algorithm": "RRTconect"}, "did you mean 'RRTConnect'"),
        ({"state_space": "SE3"}, "state space"),
        (
            {"algorithm": "BITstar", "state_space": "SE2"},
            "BITstar cannot plan in SE2.*RRTConnect or RRTstar",
        ),
        ({"max_iterations": 0}, "max_iterations"),
        ({"range": 0.0}, "range"),
        ({"tolerance": -1.0}, "tolerance"),
        ({"max_allowed_cost": 253}, "max_allowed_cost"),
        ({"patience": -1}, "patience"),
        ({"max_planning_time": -1.0}, "max_planning_time"),
        ({"fruitless_searches": -1}, "fruitless_searches"),
        ({"minimum_turning_radius": 0.0}, "minimum_turning_radius"),
    ],
)
def test_parameters_are_checked(values, said):
    with pytest.raises((ParameterError, UnknownNameError), match=said):
        OmplParams(**values)


def test_line_check_equals_fine_sampling():
    rng = default_rng(3)
    costs = (rng.random((30, 40)) < 0.06).astype(np.uint8) * 254
    disagreements = 0
    for x0, y0, x1, y1 in rng.random((500, 4)) * (40, 30, 40, 30):
        t = np.linspace(0.0, 1.0, 20001)
        cells = costs[(y0 + t * (y1 - y0)).astype(int), (x0 + t * (x1 - x0)).astype(int)]
        free = is_free(costs, x0, y0, x1, y1)
        assert not (free and cells.any())  # never misses an obstacle
        disagreements += free != (not cells.any())
    assert disagreements <= 2  # a corner clipped by less than the sampling's step


def test_line_check_at_grid_lines_and_off_the_map():
    costs = np.zeros((10, 10), dtype=np.uint8)
    assert is_free(costs, 2.0, 3.0, 7.0, 3.0)
    assert is_free(costs, 5.0, 9.0, 5.0, 1.0)
    assert is_free(costs, 4.5, 4.5, 4.5, 4.5)
    assert not is_free(costs, 4.5, 4.5, 10.0, 4.5)
    assert not is_free(costs, float("nan"), 4.5, 5.0, 4.5)
    costs[3, 5] = 254
    assert not is_free(costs, 2.0, 3.5, 7.0, 3.5)
    assert is_free(costs, 5.5, 4.5, 6.5, 4.5)  # one cell long, above it
    assert is_free(costs, 6.5, 2.5, 6.5, 3.5)  # and beside it


def test_nearest_free_cell_is_nearest():
    costs = np.full((20, 20), 254, dtype=np.uint8)
    costs[4, 10] = 0
    costs[10, 15] = 0
    assert nearest_free_cell(costs, BLOCKED, 10, 10, 8.0) == (15, 10)
    assert nearest_free_cell(costs, BLOCKED, 10, 10, 4.9) == (-1, -1)
    for column, row in ((0, 0), (costs.shape[1] - 1, costs.shape[0] - 1), (0, 9), (9, 0)):
        corner = np.full_like(costs, 254)
        corner[row, column] = 0
        assert nearest_free_cell(corner, BLOCKED, 9, 9, 40.0) == (column, row)


def test_shortcut_straightens_a_zigzag():
    costs = np.zeros((40, 40), dtype=np.uint8)
    zigzag = np.stack((np.arange(1.0, 39.0), 20.0 + 5.0 * (np.arange(38) % 2)), axis=1)
    line = shortcut(costs, BLOCKED, Room(), zigzag, 0.0, default_rng(0).random((300, 2)))
    assert_array_equal(line[[0, -1]], zigzag[[0, -1]])
    assert cumulative_length(line)[-1] < 1.02 * np.hypot(37.0, 5.0)


def test_polyline_cost_weighs_costs():
    costs = np.full((5, 20), 126, dtype=np.uint8)
    line = np.array(((1.5, 2.5), (5.5, 2.5), (5.5, 4.5)))
    assert polyline_cost(costs, line, 0.0) == approx(6.0)
    assert polyline_cost(costs, line, 2.0) == approx(12.0)
    costs[:] = 10 * np.arange(20)
    at_half_cells = np.array((0, 0, 10, 10, 20, 20, 30))  # from 0.25 to 3.25
    line = np.array(((0.25, 2.5), (3.25, 2.5)))
    assert polyline_cost(costs, line, 2.0) == approx(
        3.0 * (1.0 + 2.0 * at_half_cells.mean() / 252.0)
    )


@pytest.mark.parametrize(("row", "is_open"), [(4, False), (5, True)])
def test_a_corridor_needs_room_all_along(row, is_open):
    costs = np.zeros((10, 30), dtype=np.uint8)
    costs[row, 14] = 254
    assert has_corridor.py_func(costs, 2.0, 2.5, 27.0, 2.5, 2.4, True) == is_open


@pytest.mark.parametrize(
    ("x", "yaw", "is_on"),
    [
        (0.0625, 0.125, True),
        (0.0625, -0.125, True),
        (0.063, 0.0, False),
        (0.0, 0.126, False),
        (0.0, 6.2, True),
    ],
)
def test_a_car_is_on_a_path_within_a_cell_and_its_turning(x, yaw, is_on):
    planner = make(shape=LONG, state_space="SE2", minimum_turning_radius=0.5)
    for start in (Pose2D(), Pose2D(3.0, -2.0, 3.0)):
        for aside in ((x, 0.0, yaw), (0.0, -x, yaw)):
            assert planner._is_on(start, start.as_array() + aside, 0.0625) == is_on


@pytest.mark.parametrize(
    ("x", "y", "is_on"),
    [
        (1.0, 0.0, True),
        (0.0, -1.0, True),
        (-1.1, 0.0, False),
        (0.0, 1.1, False),
        (0.7, -0.7, True),
        (0.8, 0.7, False),
    ],
)
def test_a_robot_that_turns_on_the_spot_joins_a_path_within_a_metre(x, y, is_on):
    start = Pose2D(4.0, -2.0, 1.0)
    assert make(shape=LONG)._is_on(start, np.array((4.0 + x, -2.0 + y, -2.0)), 0.05) == is_on


@pytest.mark.parametrize(("inscribed", "corridor"), [(0.39, 2.5), (0.4, 0.0)])
def test_a_strip_needs_no_room_where_costs_keep_the_centre_off_by_its_half_and_a_cells_diagonal(
    inscribed, corridor
):
    # 0.25 + 0.141 m
    room = make(shape=RobotShape(LONG.footprint, inscribed), allow_unknown=False)._room(0.1)
    assert room == approx((corridor, np.hypot(6.0, 2.5), False))
    assert make()._room(0.1) == (0.0, 0.0, True)


@pytest.mark.parametrize("step", [-0.7, 0.7])
@pytest.mark.parametrize("across", [False, True])
def test_a_line_keeps_to_the_cells_that_it_crosses(step, across):
    """It goes over from one column to the next beside it; the columns on both sides are closed."""
    costs = np.zeros((10, 10), dtype=np.uint8)
    costs[:, [3, 6]] = 254
    for way in (1.0, -1.0):
        line = np.array(((5.0 - 0.5 * step, 5.0 - 4.5 * way), (5.0 + 0.5 * step, 5.0 + 4.0 * way)))
        line = line[:, ::-1] if across else line
        assert is_free(costs.T.copy() if across else costs, *line.ravel())


def test_places_along_a_polyline():
    path = np.array(((1.0, 2.0), (4.0, 6.0), (4.0, 12.0)))
    along = cumulative_length.py_func(path)
    assert along.tolist() == [0.0, 5.0, 11.0]
    found = [
        point_at.py_func(path, along, distance).tolist() for distance in (0.0, 2.5, 5.0, 8.0, 12.0)
    ]
    assert found == [[1.0, 2.0], [2.5, 4.0], [4.0, 6.0], [4.0, 9.0], [4.0, 12.0]]


@pytest.mark.parametrize(
    ("patience", "costs", "asked", "lowest"),
    [
        (0, {50: 5.0}, 250, [5.0]),
        (30, {}, 250, []),
        (30, {50: 5.0}, 80, [5.0]),
        (60, {50: 5.0}, 110, [5.0]),
        (60, {50: 5.0, 100: 4.996}, 110, [5.0, 4.996]),  # better by less than a thousandth
        (60, {50: 5.0, 100: 4.994}, 160, [5.0, 4.994]),
        (60, {50: 5.0, 100: 6.0}, 110, [5.0]),
        (60, {50: np.inf, 100: 5.0}, 160, [5.0]),
        # every fifty checks it is looked at
        (60, {49: 9.0, 50: 5.0, 51: 1.0, 100: 5.0}, 110, [5.0]),
    ],
)
def test_a_search_ends_after_its_checks_or_without_an_improvement_worth_it(
    patience,
    costs,
    asked,
    lowest,
):
    budget = Budget(250, 0.0, patience)
    count = 0
    assert not (budget.has_time_limit or budget.is_late)
    budget.best_cost = lambda: costs.get(count + 1, np.inf)
    while not budget():
        count += 1
    assert count == asked
    assert [cost for _, cost in budget.improvement] == lowest


def test_fmt_against_the_clock_keeps_the_first_of_the_cheapest_ways(monkeypatch):
    """With twice the samples each time."""
    ends = ((5.0, 0.0), (3.0, 4.0), (3.0, 0.0), (0.0, 3.0), (9.0, 0.0))
    answers = [None, *(np.array(((0.0, 0.0), end)) for end in ends)]
    now = [0.0]
    samples = []

    def solve(query, make, reach, budget, count):
        samples.append(count)
        now[0] += 1.0
        return answers[len(samples) - 1]

    monkeypatch.setattr(ompl_search, "clock", lambda: now[0])
    monkeypatch.setattr(ompl_search, "_solve", solve)
    monkeypatch.setattr(ompl_search, "path_cost", lambda query, states: float(np.hypot(*states[1])))
    budget = Budget(10**6, 5.5, 0)
    assert ompl_search._fmt(None, 1.0, 10**6, budget) is answers[3]
    assert samples == [1000 * 2**k for k in range(6)]
    assert budget.improvement == [(2.0, 5.0), (4.0, 3.0)]

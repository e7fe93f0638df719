import dataclasses
import math

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from harness.task.shortest_paths import distance_field, path_length
from harness.world.people.params import PedestrianParams
from harness.world.people.pedestrians import RandomWalkPedestrians
from harness.world.people.routes import WalkingNetwork
from harness.world.people.walk_kernels import (
    BLOCKED,
    Walks,
    _least_length,
    count_near,
    find_path,
    walk,
)
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import MapError, ParameterError
from navstack.types import Pose2D

DT = 1 / 60
AWAY = Pose2D(1000.0, 1000.0)


ORIGIN = Pose2D(-5.0, 3.0)


def grid_of(free, resolution=0.05, origin=ORIGIN):
    return OccupancyGrid(np.where(free, 0, 100).astype(np.int8), resolution, origin)


def town(size=800):
    """Streets 5 m wide around four blocks, with furniture; 40 m x 40 m."""
    free = np.ones((size, size), dtype=np.bool_)
    for y, x in ((100, 100), (100, 450), (450, 100), (450, 450)):
        free[y : y + 250, x : x + 250] = False
    for y, x in np.random.default_rng(5).integers(0, size - 20, (25, 2)):
        free[y : y + 12, x : x + 12] = False
    return free


@pytest.fixture(scope="module")
def network(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NAVSTACK_CACHE", str(tmp_path_factory.mktemp("cache")))
        return WalkingNetwork(grid_of(town()), 0.5)


@pytest.fixture(scope="module")
def crowd():
    return RandomWalkPedestrians(PedestrianParams(), grid_of(town()))


def record(crowd, seconds, seed=0, dt=DT, robot=AWAY):
    """States (steps + 1, n, 4) of an episode."""
    crowd.reset(np.random.default_rng(seed), robot)
    states = [crowd.states]
    for _ in range(round(seconds / dt)):
        crowd.step(dt)
        states.append(crowd.states)
    return np.array(states)


def test_the_least_length_between_two_cells_is_the_largest_difference_to_a_landmark():
    a, b = (
        np.array([3.0, 9.0, 5.0, 2.0], dtype=np.float32),
        np.array([3.25, 9.0, 5.0, 2.5], dtype=np.float32),
    )
    assert (_least_length(a, a), _least_length(a, b), _least_length(b, a)) == (0.0, 0.5, 0.5)
    assert (_least_length(a[:2], b[:2]), _least_length(a[2:], b[2:])) == (0.25, 0.5)
    here, farther = np.ones((2, 6), dtype=np.float32), np.eye(6, dtype=np.float32)
    assert [_least_length(here[0], here[0] + each) for each in farther] == [1.0] * 6


@pytest.mark.parametrize(("radius", "number"), [(1.0, 0), (5.0, 1), (5.1, 2), (9.0, 4)])
def test_those_nearer_than_a_radius_are_counted(radius, number):
    states = np.array(((4.0, 2.0), (4.0, 6.0), (-5.0, 2.0), (1.0, 10.0), (math.inf, math.inf)))
    assert count_near(np.hstack((states, np.zeros((5, 2)))), 1.0, 2.0, radius) == number


def test_walking_stops_after_the_step_in_which_somebody_becomes_restless():
    """One walks round a corner at 2 m/s, another stands for three steps of 0.5 s."""
    points = np.array((((1.5, 0.0), (1.5, 9.0)), ((7.0, 8.0), (7.0, 8.0))))
    walks = Walks(
        points, np.array((2, 2)), np.array((0, 2)), np.array((9.0, 1.5)), np.array((2.0, 1.0))
    )
    positions, states, restless = (
        np.array(((0.0, 0.0), (7.0, 8.0))),
        np.empty((2, 4)),
        np.ones(2, dtype=np.bool_),
    )
    assert walk(0.5, 2, walks, positions, states, restless) == (2, 0)
    assert states.tolist() == [[1.5, 0.5, 0.0, 2.0], [7.0, 8.0, 0.0, 0.0]]
    assert restless.tolist() == [False, False]
    assert walk(0.5, 5, walks, positions, states, restless) == (1, 1)
    assert states.tolist() == [[1.5, 1.5, 0.0, 2.0], [7.0, 8.0, 0.0, 0.0]]
    assert restless.tolist() == [False, True]
    assert (walks.pauses.tolist(), walks.next_point.tolist()) == ([9.0, 0.0], [1, 2])


def test_routes_along_a_line_cannot_exceed_its_length_and_a_hundredth():
    """Twelve cells, each of them a landmark."""
    network = WalkingNetwork(grid_of(np.ones((1, 12), dtype=np.bool_), 0.2), 0.0)
    lengths = network.greatest_lengths(network.cells[[0, 4, 11]])
    cells = np.array(((0.0, 4.0, 11.0), (4.0, 0.0, 7.0), (11.0, 7.0, 0.0)))
    assert lengths == pytest.approx(1.01 * 0.2 * cells)


def test_edge_distances_are_those_of_the_cells_centres():
    network = WalkingNetwork(grid_of(np.ones((9, 30), dtype=np.bool_), 0.2), 0.0)
    # [m] from the closed cells to those four cells from the next edge
    middle = [-0.3, -0.1, 0.1, 0.3, 0.5, 0.7]
    assert network.edge_distances()[6, :6] == pytest.approx(middle)


def test_steps_taken_at_once_are_the_same_steps(crowd):
    """To the last bit, although people arrive, stand and set out again in between."""
    single = record(crowd, 60.0)[::7]
    crowd.reset(np.random.default_rng(0), AWAY)
    together = [crowd.states]
    for _ in range(len(single) - 1):
        crowd.steps(DT, 7)
        together.append(crowd.states)
    assert np.array_equal(single, together)
    assert ((single[1:, :, 2] == 0.0) & (single[:-1, :, 2] != 0.0)).any()  # somebody arrived


def test_paths_are_shortest_within_one_percent(network):
    rng = np.random.default_rng(2)
    free = network._free
    for a, b in network.cells[rng.integers(len(network.cells), size=(60, 2))]:
        first, last = np.ravel_multi_index(np.array((a, b)).T, free.shape)
        cells = find_path(
            network._numbers.ravel(),
            free.shape[1],
            network._landmarks,
            first,
            last,
            network._length,
            network._ahead,
            network._arrival,
        )
        assert (cells[0] == a).all() and (cells[-1] == b).all()
        assert free[cells[:, 0], cells[:, 1]].all()
        exact = float(distance_field(free, b)[a[0], a[1]])
        assert exact - 1e-3 <= path_length(cells) <= 1.01 * exact + 1e-3
        assert np.array_equal(network._length.reshape(free.shape), np.where(free, np.inf, BLOCKED))


def test_routes_are_straightened_and_keep_the_distance(network):
    rng = np.random.default_rng(3)
    clearance = distance_transform_edt(np.pad(town(), 1))[1:-1, 1:-1] * 0.05
    for a, b in network.cells[rng.integers(len(network.cells), size=(40, 2))]:
        corners = network.route(a, b)
        np.testing.assert_allclose(corners[[0, -1]], network.positions(np.array((a, b))))
        dense = np.concatenate(
            [
                np.linspace(p, q, 2 + int(20 * math.dist(p, q)))
                for p, q in zip(corners, corners[1:], strict=False)
            ]
            or [corners]
        )
        mx, my = np.floor((dense - (-5.0, 3.0)) / 0.05).astype(int).T
        # between cell centres the path may cut half a cell of 0.2 m
        assert clearance[my, mx].min() > 0.5 - 0.2
        exact = float(distance_field(network._free, b)[a[0], a[1]]) * 0.2
        assert np.hypot(*np.diff(corners, axis=0).T).sum() <= 1.01 * exact + 1e-6


def test_positions_follow_the_origin_of_the_map():
    free = np.ones((40, 80), dtype=np.bool_)
    straight = WalkingNetwork(grid_of(free, origin=Pose2D(1.0, 2.0)), 0.0)
    assert straight.positions(straight.cells)[0] == pytest.approx((1.1, 2.1))
    turned = WalkingNetwork(grid_of(free, origin=Pose2D(1.0, 2.0, math.pi / 2)), 0.0)
    assert turned.positions(turned.cells)[-1] == pytest.approx((1.0 - 1.9, 2.0 + 3.9))


def test_everybody_stays_on_the_walkable_area(crowd):
    free = town()
    states = record(crowd, 120.0).reshape(-1, 4)
    mx, my = np.floor((states[:, :2] - (-5.0, 3.0)) / 0.05).astype(int).T
    # nobody touches a wall
    assert distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1][my, mx].min() * 0.05 > 0.3


def test_people_walk_at_their_speed_or_stand(crowd):
    states = record(crowd, 60.0)
    speed = np.hypot(states[..., 2], states[..., 3])
    for k in range(20):
        values = np.unique(speed[:, k].round(9))
        assert len(values) <= 2 and (len(values) == 1 or values[0] == 0.0)
        assert 0.5 <= values[-1] <= 1.5
    step = np.hypot(*np.diff(states[..., :2], axis=0).transpose(2, 0, 1))
    assert (step <= speed.max(axis=0) * DT + 1e-9).all()
    straight = (np.abs(np.diff(states[..., 2:], axis=0)).sum(axis=2) == 0) & (speed[1:] > 0)
    moved = np.diff(states[..., :2], axis=0)[straight]
    np.testing.assert_allclose(moved, states[1:][straight][:, 2:] * DT, atol=1e-9)


def test_speeds_are_spread_as_stated():
    people = RandomWalkPedestrians(
        PedestrianParams(count=400, speed_std=0.1), grid_of(np.ones((200, 200), np.bool_))
    )
    people.reset(np.random.default_rng(0), AWAY)
    speeds = people._errands.speeds
    assert abs(speeds.mean() - 1.0) < 3 * 0.1 / 20
    assert abs(speeds.std() - 0.1) < 3 * 0.1 / math.sqrt(800)


def test_pauses_last_two_to_five_seconds(crowd):
    states = record(crowd, 300.0)
    standing = (states[..., 2:] == 0.0).all(axis=2)
    lengths = []
    for k in range(20):
        edges = np.flatnonzero(np.diff(standing[:, k].astype(int)))
        starts = edges[~standing[edges, k]]
        lengths += [(edges[edges > s][0] - s) * DT for s in starts if (edges > s).any()]
    assert len(lengths) > 60
    assert min(lengths) >= 2.0 - DT and max(lengths) <= 5.0 + 3 * DT
    deviation = 3.0 / math.sqrt(12)
    assert abs(np.mean(lengths) - 3.5) < 3 * deviation / math.sqrt(len(lengths)) + DT


def test_people_stand_at_shared_goals(crowd):
    states = record(crowd, 200.0, seed=4)
    goals = crowd._errands.network.positions(crowd._errands.goals)
    assert len(np.unique(crowd._errands.goals, axis=0)) == 60
    standing = states[(states[..., 2:] == 0.0).all(axis=2)][:, :2]
    distance = np.hypot(*(np.unique(standing, axis=0)[:, None] - goals).transpose(2, 0, 1)).min(
        axis=1
    )
    assert distance.max() < 1e-9


def test_the_same_seed_gives_the_same_walk_bit_for_bit(crowd):
    first = record(crowd, 60.0, seed=8)
    other = record(crowd, 60.0, seed=9)
    assert np.array_equal(first, record(crowd, 60.0, seed=8))
    fresh = RandomWalkPedestrians(PedestrianParams(), grid_of(town()))
    assert np.array_equal(first, record(fresh, 60.0, seed=8))
    assert not np.array_equal(first, other)


def test_a_walk_does_not_depend_on_the_step_or_on_the_others(crowd):
    fine = record(crowd, 30.0, seed=3, dt=1 / 120)[::2, :, :2]
    np.testing.assert_allclose(fine, record(crowd, 30.0, seed=3)[..., :2], atol=0.1)
    few = RandomWalkPedestrians(PedestrianParams(count=5), grid_of(town()))
    assert np.array_equal(record(few, 30.0, seed=3), record(crowd, 30.0, seed=3)[:, :5])


def test_nobody_starts_near_the_robot(crowd):
    robot = Pose2D(-5.0 + 20.0, 3.0 + 20.0)  # in the middle of the crossing
    for seed in range(10):
        crowd.reset(np.random.default_rng(seed), robot)
        assert np.hypot(*(crowd.states[:, :2] - (robot.x, robot.y)).T).min() >= 2.0


def test_states_given_away_do_not_change(crowd):
    crowd.reset(np.random.default_rng(0), AWAY)
    before = crowd.states
    copy = before.copy()
    crowd.step(DT)
    assert np.array_equal(before, copy)
    assert not np.array_equal(crowd.states, copy)


def test_nobody_is_possible():
    people = RandomWalkPedestrians(
        PedestrianParams(count=0), grid_of(np.ones((100, 100), np.bool_))
    )
    assert record(people, 1.0).shape == (61, 0, 4)


def test_narrow_maps_keep_less_distance():
    wide, narrow, slit = (np.zeros((200, 400), dtype=np.bool_) for _ in range(3))
    wide[80:120] = narrow[80:96] = slit[80:84] = True  # 2 m, 0.8 m and 0.2 m
    kept = [WalkingNetwork(grid_of(free), 0.5).agent_radius for free in (wide, narrow, slit)]
    assert kept == [0.5, 0.25, 0.0]
    states = record(RandomWalkPedestrians(PedestrianParams(), grid_of(slit)), 20.0)
    assert np.ptp(states[..., 1]) == 0.0 and np.ptp(states[..., 0]) > 10.0


def test_only_the_largest_part_is_used():
    free = np.zeros((200, 400), dtype=np.bool_)
    free[:, :150] = free[:, 170:] = True
    states = record(RandomWalkPedestrians(PedestrianParams(), grid_of(free)), 10.0)
    assert states[..., 0].min() > -5.0 + 170 * 0.05


def test_coarse_maps_and_a_single_cell_work():
    people = RandomWalkPedestrians(
        PedestrianParams(count=3), grid_of(np.ones((20, 20), np.bool_), resolution=1.0)
    )
    assert np.isfinite(record(people, 10.0)).all()
    one = np.zeros((9, 9), dtype=np.bool_)
    one[4, 4] = True
    people = RandomWalkPedestrians(PedestrianParams(count=2), grid_of(one, 1.0, Pose2D()))
    states = record(people, 12.0, robot=Pose2D(4.5, 4.5))
    assert (states == (4.5, 4.5, 0.0, 0.0)).all()


def test_a_map_without_walkable_cells_is_an_error():
    with pytest.raises(MapError, match="nothing is walkable"):
        RandomWalkPedestrians(PedestrianParams(), grid_of(np.zeros((50, 50), np.bool_)))


@pytest.mark.parametrize(
    "change", [{"count": -1}, {"goals": 0}, {"speed": 0.0}, {"pause_min": 6.0}, {"radius": 0.0}]
)
def test_impossible_people_are_refused(change):
    with pytest.raises(ParameterError, match="pedestrians"):
        dataclasses.replace(PedestrianParams(), **change)

"""The simple smoother against a slow twin, and its rules."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navstack.costmap.costmap import LETHAL_OBSTACLE, Costmap
from navstack.errors import ParameterError
from navstack.params.planners import SimpleSmootherParams
from navstack.planning.simple_smoother import SimpleSmoother
from navstack.planning.simple_smoother_kernels import (
    face_along,
    meets_obstacle,
    relax,
    stretch_ends,
)
from navstack.types import Path

from .given import free_map


def free(size=100):
    return free_map(size, size, 0.1, -5.0, -5.0)


def zigzag(count=20):
    poses = np.zeros((count, 3))
    poses[:, 0] = np.arange(count) * 0.1
    poses[1::2, 1] = 0.06
    return poses


def test_ends_stay_and_roughness_falls():
    given = Path(zigzag(), stamp=3.5)
    smooth = SimpleSmoother(SimpleSmootherParams()).smooth(given, free())
    assert_array_equal(given.poses, zigzag())
    assert smooth.stamp == 3.5
    assert_array_equal(smooth.poses[[0, -1], :2], given.poses[[0, -1], :2])
    assert smooth.length < 0.95 * given.length
    assert smooth is not given


def slow_relax(given, w_data, w_smooth, tolerance, max_its):
    """The same iteration with one statement per line of arithmetic, without a costmap."""
    last = given.copy()
    now = given.copy()
    for _ in range(max_its - 1):
        change = 0.0
        for i in range(1, len(now) - 1):
            for axis in (0, 1):
                old = now[i, axis]
                pull = w_data * (given[i, axis] - old)
                pull = pull + w_smooth * (now[i + 1, axis] + now[i - 1, axis] - 2.0 * old)
                now[i, axis] = old + pull
                change += abs(now[i, axis] - old)
        last[:] = now
        if change < tolerance:
            break
    return last


@pytest.mark.parametrize(
    ("tolerance", "max_its"), [(1e-10, 1000), (1e-3, 1000), (1e-10, 7), (1e-10, 8)]
)
def test_kernel_equals_slow_twin(tolerance, max_its):
    given = np.random.default_rng(3).normal(size=(30, 2)).cumsum(axis=0) * 0.05
    ours = given.copy()
    costmap = free()
    relax(ours, (0.2, 0.3), tolerance, max_its, costmap.data, costmap.grid)
    assert_array_equal(ours, slow_relax(given, 0.2, 0.3, tolerance, max_its))


def test_it_stops_before_an_obstacle():
    given = zigzag()
    costmap = free_map(400, 400, 0.01, -1.0, -1.0)
    blocked = Costmap(costmap.data.copy(), 0.01, -1.0, -1.0)
    smooth = SimpleSmoother(SimpleSmootherParams()).smooth(Path(given), costmap)
    mx, my = blocked.world_to_map(*smooth.poses[9, :2])
    blocked.data[my, mx] = LETHAL_OBSTACLE
    kept = SimpleSmoother(SimpleSmootherParams()).smooth(Path(given), blocked)
    assert all(blocked.cost_at(x, y) < LETHAL_OBSTACLE for x, y in kept.poses[:, :2])
    assert not np.array_equal(kept.poses[:, :2], smooth.poses[:, :2])


@pytest.mark.parametrize(
    ("x", "y"), [(-4.95, 0.0), (4.95, 0.0), (0.0, -4.95), (0.0, 4.95), (-5.0, -5.0)]
)
def test_obstacles_at_the_maps_edges_count_and_places_beyond_meet_none(x, y):
    costmap = free()
    costmap.data[[0, -1]] = costmap.data[:, [0, -1]] = LETHAL_OBSTACLE
    for at, meets in (((x, y), True), ((1.03 * x, 1.03 * y), False), ((0.9 * x, 0.9 * y), False)):
        places = np.array((at, at, at)).T.copy()
        assert (
            meets_obstacle(places, costmap.data, costmap.grid, np.empty(3, dtype=np.int64)) == meets
        )


def test_a_path_driven_backwards_keeps_its_headings():
    poses = zigzag()
    poses[:, 2] = math.pi
    smooth = SimpleSmoother(SimpleSmootherParams()).smooth(Path(poses), free())
    assert np.all(np.cos(smooth.poses[:, 2]) < 0.0)


@pytest.mark.parametrize("off", [-1.8, -1.4, 0.0, 1.4, 1.8, math.pi])
@pytest.mark.parametrize("direction", np.linspace(-3.0, 3.0, 8))
def test_a_path_is_driven_backwards_where_its_poses_look_more_back_than_ahead(direction, off):
    along = np.arange(20) * 0.1
    poses = np.zeros((20, 3)) + (1.0, -2.0, direction + off)
    poses[:, :2] += np.outer(along, (math.cos(direction), math.sin(direction)))
    smooth = SimpleSmoother(SimpleSmootherParams()).smooth(Path(poses), free())
    expected = 1.0 if abs(off) < 0.5 * math.pi else -1.0
    assert_allclose(np.cos(smooth.poses[:-1, 2] - direction), expected)


@pytest.mark.parametrize(
    ("poses", "ends"),
    [
        (
            [
                (0, 0, 0),
                (1, 0, 0),
                (2, 0, 0),
                (2, 1, 1),
                (2, 2, 1),
                (2, 1.5, 1),
                (2, 1, 1),
                (2, 1, 2),
                (3, 1, 2),
            ],
            [4, 6, 8],
        ),
        ([(0, 0, 0), (1, 0, 0), (0.5, 0, 0), (0, 0, 0)], [1, 3]),
        ([(0, 0, 1), (0, 0.5, 1), (-0.1, 0.4, 1)], [1, 2]),
        ([(0, 0, 1), (0, 0.5, 1), (-0.1, 0.6, 1), (-0.2, 0.7, 1)], [3]),
        # a whole turn is none
        ([(0, 0, 0.1), (1, 0, 0.1), (1, 0, 0.1 + 2.0 * math.pi), (2, 0, 0.1)], [3]),
        ([(0, 0, 3), (1, 0, 3), (1.00005, 0.00005, -3), (2, 0, -3)], [1, 3]),
        ([(0, 0, 3), (1, 0, 3), (1, 0.0002, -3), (2, 0.0002, -3)], [3]),
        ([(0, 0, 3), (1, 0, 3), (1.0002, 0, -3), (2, 0, -3)], [3]),
    ],
)
def test_a_stretch_ends_where_the_path_turns_back_or_on_the_spot(poses, ends):
    assert stretch_ends(np.array(poses, dtype=float)).tolist() == ends


@pytest.mark.parametrize("backwards", [False, True])
def test_poses_look_at_the_next_one_or_away_from_it(backwards):
    poses = np.array(
        [(0, 0, 9), (1, 0, 9), (4, 4, 9), (4, 4.00005, 9), (4, 0, 9), (0, 0, 9)], dtype=float
    )
    ahead = (0.0, math.atan2(4, 3), 9.0, -math.pi / 2, math.pi, 9.0)
    back = (math.pi, math.atan2(4, 3) - math.pi, 9.0, math.pi / 2, 0.0, 9.0)
    places = poses[:, :2].copy()
    face_along(poses, backwards)
    assert_allclose(poses[:, 2], back if backwards else ahead, atol=1e-12)
    assert_array_equal(poses[:, :2], places)


def test_a_turn_on_the_spot_stays_where_it_is():
    poses = np.vstack((zigzag(10), zigzag(10) + (0.9, 0.06, 1.0)))
    turn = poses[9, :2].copy()
    assert_array_equal(poses[10, :2], turn)
    smooth = SimpleSmoother(SimpleSmootherParams()).smooth(Path(poses), free())
    assert_array_equal(smooth.poses[9, :2], turn)
    through = SimpleSmoother(SimpleSmootherParams(enforce_path_inversion=False)).smooth(
        Path(poses), free()
    )
    assert not np.array_equal(through.poses[9, :2], turn)


@pytest.mark.parametrize(("count", "is_smoothed"), [(0, False), (1, False), (4, False), (5, True)])
def test_few_poses_come_back_as_they_are(count, is_smoothed):
    given = zigzag(count)
    smooth = SimpleSmoother(SimpleSmootherParams()).smooth(Path(given), free()).poses
    assert np.array_equal(smooth, given) != is_smoothed


def test_negative_parameters_are_refused():
    with pytest.raises(ParameterError, match="max_its -1"):
        SimpleSmootherParams(max_its=-1)

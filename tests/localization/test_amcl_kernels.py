"""The kernels of AMCL against slow twins, bit for bit."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt
from scipy.stats import chi2, norm

from navstack.costmap.distances import squared_distances
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from navstack.localization import amcl_kernels
from navstack.localization.amcl_kernels import (
    GROUP,
    _reach,
    beam_ends,
    cast_rays,
    count_agreeing,
    sum_over_beams,
)
from navstack.localization.free_space import FreeSpace
from navstack.localization.kld import (
    BIN_ANGLE,
    BIN_LENGTH,
    _empty_table,
    count_bins,
    label_clusters,
    resample,
    sample_limit,
)
from navstack.localization.likelihood_field import LikelihoodField
from navstack.localization.motion_model import SHORTEST_BEARING, move_differential, move_omni
from navstack.localization.particle_filter import cluster_particles
from navstack.types import Pose2D

ALPHAS = (0.03, 0.05, 0.07, 0.11, 0.13)


@pytest.mark.parametrize("share", [0.0, 0.001, 0.02, 0.3, 1.0])
@pytest.mark.parametrize("farthest", [0, 7, 400, 100_000])
def test_squared_distances_are_exact(share, farthest):
    rng = np.random.default_rng(3)
    for height, width in ((1, 1), (1, 40), (40, 1), (57, 63)):
        obstacles = rng.random((height, width)) < share
        exact = np.full((height, width), farthest + 1)
        if obstacles.any():
            exact = np.minimum(np.rint(distance_transform_edt(~obstacles) ** 2), farthest + 1)
        assert np.array_equal(squared_distances(obstacles, farthest), exact)


def end_cells(pose, ends_x, ends_y, shape):
    """Row and column in which each beam ends, held at the border."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    columns = [
        min(max(pose[0] + cos * x - sin * y, 0.0), shape[1] - 1.0)
        for x, y in zip(ends_x, ends_y, strict=True)
    ]
    rows = [
        min(max(pose[1] + sin * x + cos * y, 0.0), shape[0] - 1.0)
        for x, y in zip(ends_x, ends_y, strict=True)
    ]
    return [int(row) for row in rows], [int(column) for column in columns]


@pytest.fixture(params=[1.0, 0.1], ids=["some off the map", "all on the map"])
def looked_up(request):
    """Codes, more particles than are taken together, in cells, and ends of beams."""
    rng = np.random.default_rng(1)
    codes = rng.integers(0, 50, size=(40, 60)).astype(np.uint16)
    off = rng.uniform(-0.5, 0.5, (GROUP + 30, 2)) * (60, 40)
    poses = np.column_stack(((30, 20) + request.param * off, rng.uniform(-7, 7, GROUP + 30)))
    return codes, poses, request.param * rng.uniform(-30, 30, (37, 2))


@pytest.mark.parametrize("beams", [0, 1, 3, 4, 8, 37])
def test_sum_over_beams(looked_up, beams):
    codes, poses, ends = looked_up
    ends = ends[:beams]
    values = np.random.default_rng(2).random(50)
    twin = []
    for pose in poses:
        found = values[codes[end_cells(pose, *ends.T, codes.shape)]]
        lanes = [0.0] * 4
        whole = beams - beams % 4
        for i, value in enumerate(found):
            lanes[i % 4 if i < whole else 0] += value
        twin.append(1.0 + ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])))
    assert np.array_equal(sum_over_beams(codes, values, poses, ends, 1.0), twin)


def test_count_agreeing(looked_up):
    codes, poses, ends = looked_up
    agrees = np.random.default_rng(2).random(50) < 0.4
    twin = sum(agrees[codes[end_cells(pose, *ends.T, codes.shape)]].astype(int) for pose in poses)
    assert np.array_equal(count_agreeing(codes, agrees, poses, ends), twin)


def test_nothing_is_written_beyond_the_last_particle(looked_up, monkeypatch):
    """Plain Python, in which that is an error, gives the same as compiled code."""
    codes, poses, ends = looked_up
    values, ends = np.random.default_rng(2).random(50), ends[:11]
    compiled = (
        sum_over_beams(codes, values, poses, ends, 1.0),
        count_agreeing(codes, values < 0.4, poses, ends),
    )
    for name in ("_take_group", "_end_cells", "_reach", "_add_all", "_add_last"):
        monkeypatch.setattr(amcl_kernels, name, getattr(amcl_kernels, name).py_func)
    assert np.array_equal(sum_over_beams.py_func(codes, values, poses, ends, 1.0), compiled[0])
    assert np.array_equal(count_agreeing.py_func(codes, values < 0.4, poses, ends), compiled[1])


def test_ranges_that_are_too_short_are_taken_for_none():
    for numbers, screened, has_nan in (
        ((0.05, 0.1, math.nan, math.inf, 3.0), (20.0, 20.0, math.nan, math.inf, 3.0), True),
        ((0.11, -1.0, 25.0), (0.11, 20.0, 25.0), False),
    ):
        ranges = np.array(numbers)
        assert amcl_kernels.screen_ranges(ranges, 0.1, 20.0) == has_nan
        np.testing.assert_array_equal(ranges, screened)


def test_poses_are_told_in_cells_from_an_origin():
    poses = np.array(((1.0, 2.0, 0.3), (-4.0, 0.5, -9.0)))
    found = amcl_kernels.cells_of(poses, -2.0, 1.0, 0.25, 1.5)
    assert found.tolist() == [[13.5, 5.5, 0.3], [-6.5, -0.5, -9.0]]


def test_beam_ends_are_those_of_the_returns():
    rng = np.random.default_rng(3)
    ranges, bearings = (
        np.append(rng.uniform(0.0, 40.0, 50), (math.inf, 30.0)),
        rng.uniform(-4.0, 4.0, 52),
    )
    directions, returned = np.stack((np.cos(bearings), np.sin(bearings))), ranges < 30.0
    twin = (0.2, -0.1) + ranges[returned, None] * directions.T[returned]
    assert np.array_equal(beam_ends(ranges, directions, 30.0, 0.2, -0.1), twin)


def bresenham(is_free, x, y, angle, reach):
    """Nav2's walk, one cell after the other; the border is not free."""
    ends = math.floor(x + reach * math.cos(angle)), math.floor(y + reach * math.sin(angle))
    start = math.floor(x), math.floor(y)
    steep = abs(ends[1] - start[1]) > abs(ends[0] - start[0])
    (u, v), (u_end, v_end) = (start[::-1], ends[::-1]) if steep else (start, ends)
    along, across, error = abs(u_end - u), abs(v_end - v), 0
    u_step, v_step = (1 if u < u_end else -1), (1 if v < v_end else -1)
    at = [u, v]
    while True:
        column, row = at[::-1] if steep else at
        inside = 0 <= row < is_free.shape[0] and 0 <= column < is_free.shape[1]
        if not (inside and is_free[row, column]):
            return math.hypot(at[0] - u, at[1] - v)
        if at[0] == u_end + u_step:
            return reach
        at[0] += u_step
        error += across
        if 2 * error >= along:
            at[1] += v_step
            error -= along


def test_rays_visit_the_cells_of_bresenhams_line():
    rng = np.random.default_rng(4)
    is_free = rng.random((60, 80)) > 0.01
    is_free[[0, -1]] = is_free[:, [0, -1]] = False
    clear = np.ceil(np.sqrt(squared_distances(~is_free, 2 * 254**2) / 2.0)).astype(np.uint8)
    sensors = np.column_stack(
        (rng.uniform(0, 80, 60), rng.uniform(0, 60, 60), rng.uniform(-4, 4, 60))
    )
    bearings = np.linspace(-math.pi, math.pi, 23)
    for reach in (0.3, 15.0, 200.0):
        twin = [
            [bresenham(is_free, x, y, yaw + bearing, reach) for bearing in bearings]
            for x, y, yaw in sensors
        ]
        np.testing.assert_allclose(cast_rays(clear, sensors, bearings, reach), twin, rtol=1e-15)


def wrap(angle):
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def differential_twin(pose, yaw, dx, dy, yaw_after, draws):
    a1, a2, a3, a4, _ = ALPHAS
    length = math.sqrt(dx * dx + dy * dy)
    first = 0.0 if length < SHORTEST_BEARING else wrap(math.atan2(dy, dx) - yaw)
    second = wrap(wrap(yaw_after - yaw) - first)
    off1, off2 = (min(abs(wrap(a)), math.pi - abs(wrap(a))) ** 2 for a in (first, second))
    turn = wrap(first - math.sqrt(a1 * off1 + a2 * (length * length)) * draws[0])
    way = length - math.sqrt(a3 * (length * length) + a4 * off1 + a4 * off2) * draws[1]
    last = wrap(second - math.sqrt(a1 * off2 + a2 * (length * length)) * draws[2])
    heading = pose[2] + turn
    return (
        pose[0] + way * math.cos(heading),
        pose[1] + way * math.sin(heading),
        pose[2] + (turn + last),
    )


def omni_twin(pose, yaw, dx, dy, yaw_after, draws):
    a1, a2, a3, a4, a5 = ALPHAS
    turn, squared = wrap(yaw_after - yaw), math.sqrt(dx * dx + dy * dy) ** 2
    length, bearing = math.sqrt(dx * dx + dy * dy), wrap(math.atan2(dy, dx) - yaw)
    along = length + math.sqrt(a3 * squared + a4 * (turn * turn)) * draws[0]
    across = math.sqrt(a4 * (turn * turn) + a5 * squared) * draws[2]
    cos, sin = math.cos(bearing + pose[2]), math.sin(bearing + pose[2])
    turned = turn + math.sqrt(a1 * (turn * turn) + a2 * squared) * draws[1]
    return (
        pose[0] + (along * cos + across * sin),
        pose[1] + (along * sin - across * cos),
        pose[2] + turned,
    )


@pytest.mark.parametrize(
    ("kernel", "twin"), [(move_differential, differential_twin), (move_omni, omni_twin)]
)
@pytest.mark.parametrize(
    "motion",
    [
        (0.3, 0.25, 0.0, 0.3),
        (0.4, 0.0, 0.0, 1.1),
        (3.0, -0.3, 0.05, -3.1),
        (1.0, 0.004, 0.003, 0.5),
    ],
)
def test_motion_models_move_each_particle_by_its_draws(kernel, twin, motion):
    rng = np.random.default_rng(5)
    poses, draws = rng.normal(size=(50, 3)) * 3.0, rng.normal(size=(50, 3))
    expected = [twin(pose, *motion, row) for pose, row in zip(poses, draws, strict=True)]
    kernel(poses, *motion, ALPHAS, draws)
    assert np.array_equal(poses, expected)


def bins_of(poses):
    return [
        tuple(
            math.floor(value / size)
            for value, size in zip(pose, (BIN_LENGTH, BIN_LENGTH, BIN_ANGLE), strict=True)
        )
        for pose in poses
    ]


def test_resampling_draws_until_the_bins_have_enough():
    rng = np.random.default_rng(6)
    poses, weights = rng.normal(size=(200, 3)), rng.random(200)
    cumulative = np.cumsum(weights)
    strays, is_stray, draws = (
        rng.normal(size=(900, 3)) * 9.0,
        rng.random(900) < 0.1,
        rng.random(900),
    )
    expected = []
    for stray, is_it, draw in zip(strays, is_stray, draws, strict=True):
        expected.append(
            stray if is_it else poses[np.flatnonzero(cumulative > draw * cumulative[-1])[0]]
        )
        if len(expected) > sample_limit(len(set(bins_of(expected))), 20, 900, 0.2, 0.99):
            break
    drawn = resample(poses, cumulative, strays, is_stray, draws, 20, 0.2, 0.99)
    assert 20 < len(drawn) < 900
    assert np.array_equal(drawn, expected)
    assert count_bins(drawn) == len(set(bins_of(drawn)))


@pytest.mark.parametrize(("axis", "width"), [(0, BIN_LENGTH), (1, BIN_LENGTH), (2, BIN_ANGLE)])
def test_a_bin_begins_at_its_lower_end(axis, width):
    """Of Nav2's bins: the floor of the coordinate over the width."""
    for value, bins in ((0.0, 1), (0.999 * width, 1), (width, 2), (-1e-9, 2)):
        poses = np.zeros((2, 3))
        poses[1, axis] = value
        assert count_bins(poses) == bins


def test_clusters_are_bins_that_touch():
    rng = np.random.default_rng(7)
    poses = np.concatenate(
        [rng.normal(size=(60, 3)) * 0.3 + centre for centre in rng.uniform(-4, 4, size=(6, 3))]
    )
    bins = bins_of(poses)
    parent = {key: key for key in bins}

    def root(key):
        while parent[key] != key:
            key = parent[key]
        return key

    for a in parent:
        for b in parent:
            if max(abs(i - j) for i, j in zip(a, b, strict=True)) <= 1:
                parent[root(a)] = root(b)
    numbers = {}
    expected = [numbers.setdefault(root(key), len(numbers)) for key in bins]
    assert len(numbers) > 2
    assert label_clusters(poses).tolist() == expected


@pytest.mark.parametrize("origin", [(500_000.0, 5_400_000.0, 0.0), (-600_000.0, -900_000.0, 0.0)])
def test_far_from_the_origin_particles_are_alike(origin):
    """A map may lie in UTM's coordinates."""
    rng = np.random.default_rng(7)
    near = rng.normal(size=(300, 3)) * (2.0, 2.0, 0.1)
    near[0] = 0.25, 0.25, 0.0
    far = near + origin
    assert count_bins(far) == count_bins(near)
    assert label_clusters(far).tolist() == label_clusters(near).tolist()
    weights = np.full(300, 1.0 / 300)
    (one,) = cluster_particles(near, weights, as_one=True)
    (other,) = cluster_particles(far, weights, as_one=True)
    assert other.covariance == pytest.approx(one.covariance, abs=1e-5)
    assert other.pose.x - origin[0] == pytest.approx(one.pose.x, abs=1e-6)


def test_sample_limits_grow_with_the_bins_between_their_bounds():
    limits = [sample_limit(bins, 100, 3000, 0.05, 0.99) for bins in range(2, 400)]
    assert (limits[0], limits[-1]) == (100, 3000)
    assert all(a <= b for a, b in pairwise(limits))
    assert sample_limit(1, 100, 3000, 0.05, 0.99) == 3000


@pytest.mark.parametrize("bins", [3, 11, 101])
def test_sample_limits_are_those_of_the_chi_square_distribution(bins):
    """Fox 2003, eq. 5, of which eq. 7 is an approximation."""
    exact = chi2.ppf(norm.cdf(0.99), bins - 1) / (2.0 * 1e-4)
    assert sample_limit(bins, 1, 10**9, 1e-4, 0.99) == pytest.approx(exact, rel=0.01)


def grid_of(cells):
    return OccupancyGrid(np.asarray(cells, dtype=np.int8), 0.1, Pose2D(-3.0, 2.0))


def test_a_field_knows_every_place_and_ends_with_the_map(tmp_path, monkeypatch):
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path))
    cells = np.full((30, 50), FREE)
    cells[10, 20], cells[5, 5] = OCCUPIED, UNKNOWN
    field = LikelihoodField.of_map(grid_of(cells), 1.0)
    at_obstacle = (-3.0 + 20 * 0.1, 2.0 + 10 * 0.1)
    points = np.array(
        (
            at_obstacle,
            (at_obstacle[0] + 0.3, at_obstacle[1] + 0.4),
            (1.9, 4.9),
            (9.0, 9.0),
            (-9.0, 2.0),
        )
    )
    np.testing.assert_allclose(field.at(points), (0.0, 0.5, 1.0, 1.0, 1.0), atol=1e-12)
    distances = field.distances[field.codes[1:-1, 1:-1]]
    exact = np.minimum(distance_transform_edt(cells != OCCUPIED) * 0.1, 1.0)
    np.testing.assert_allclose(distances, exact, atol=1e-12)
    known = LikelihoodField.of_distances(exact.astype(np.float32), 0.1, Pose2D(-3.0, 2.0), 1.0)
    np.testing.assert_allclose(
        known.distances[known.codes], field.distances[field.codes], atol=1e-7
    )
    thinned = field.thinned(5)
    assert np.array_equal(thinned.distances[thinned.codes[1:-1, 1:-1]], distances[::5, ::5])
    np.testing.assert_allclose(thinned.at(points[:1]), 0.0)


def test_off_the_map_a_field_is_farthest_beside_an_obstacle_too():
    cells = np.full((30, 50), OCCUPIED)
    field = LikelihoodField.of_map(grid_of(cells), 1.0)
    x, y = np.array((-3.0, 1.9)), np.array((2.0, 4.9))  # of the first and the last cell
    corners = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    assert field.at(corners).tolist() == [0.0] * 4
    for off in ((0.1, 0.0), (0.0, 0.1)):
        assert field.at(corners + np.sign(corners - (0.0, 3.0)) * off).tolist() == [1.0] * 4


def test_free_space_gives_every_free_cell_alike():
    rng = np.random.default_rng(8)
    cells = np.where(rng.random((17, 23)) < 0.3, FREE, UNKNOWN)
    poses = FreeSpace(grid_of(cells)).draw(40_000, rng)
    columns, rows = np.rint((poses[:, :2] - (-3.0, 2.0)) / 0.1).astype(int).T
    counts = np.zeros(cells.shape)
    np.add.at(counts, (rows, columns), 1)
    assert (counts[cells != FREE] == 0).all()
    expected = 40_000 / (cells == FREE).sum()
    assert np.abs(counts[cells == FREE] - expected).max() < 5.0 * math.sqrt(expected)
    assert abs(poses[:, 2].mean()) < 0.05
    assert poses[:, 2].std() == pytest.approx(math.pi / math.sqrt(3.0), rel=0.02)
    nowhere = FreeSpace(grid_of(np.full((3, 3), OCCUPIED))).draw(2, rng)
    np.testing.assert_allclose(nowhere[:, :2], [(-3.0, 2.0)] * 2)


def test_of_downsampled_free_space_every_other_row_and_column_counts():
    cells = np.full((5, 7), FREE)
    cells[2, 4] = OCCUPIED
    drawn = FreeSpace(grid_of(cells), downsampled=True).draw(2000, np.random.default_rng(8))
    columns, rows = np.rint((drawn[:, :2] - (-3.0, 2.0)) / 0.1).astype(int).T
    expected = {(row, column) for row in (0, 2, 4) for column in (0, 2, 4, 6)} - {(2, 4)}
    assert set(zip(rows.tolist(), columns.tolist(), strict=True)) == expected


@pytest.mark.parametrize(
    ("ends", "reach"),
    [
        ([], 1.0),
        ([(3.0, -4.0)], 6.0),
        ([(-5.0, 12.0), (0.0, -1.0)], 14.0),
        ([(0.1, 0.0), (-8.0, 6.0)], 11.0),
    ],
)
def test_ends_reach_as_far_as_the_farthest_and_a_cell_more(ends, reach):
    assert _reach.py_func(np.array(ends, dtype=float).reshape(-1, 2)) == reach


@pytest.mark.parametrize(
    ("count", "size"), [(0, 2), (1, 2), (2, 4), (3, 8), (4, 8), (5, 16), (2000, 4096)]
)
def test_tables_have_the_next_power_of_two_that_is_at_least_twice_their_keys(count, size):
    assert _empty_table.py_func(count).tolist() == [-1] * size

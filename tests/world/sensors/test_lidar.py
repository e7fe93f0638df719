import math

import numpy as np
import pytest

from harness.world.physics.body_state import BodyState
from harness.world.sensors.lidar import Lidar, LidarParams, SelfFilter
from harness.world.sensors.lidar_kernels import _meet, cast_grid, clearance_field, finish_scan
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import ParameterError
from navstack.types import Pose2D

NOBODY = np.empty((0, 4))
NO_FILTER = SelfFilter(9.0, 9.0, 9.0, 9.0)


def lidar_params(**changes):
    values = {
        "rate": 10.0,
        "beams": 360,
        "field_of_view": 2.0 * math.pi,
        "range_min": 0.05,
        "range_max": 30.0,
        "noise_std": 0.0,
        "mount": Pose2D(),
        "self_filter": NO_FILTER,
    }
    return LidarParams(**(values | changes))


def make_lidar(geometry, radius=0.3, seed=0, **changes):
    lidar = Lidar(lidar_params(**changes), geometry, radius)
    lidar.reset(BodyState(), np.random.default_rng(seed))
    return lidar


def empty_grid(size=400, resolution=0.05):
    return OccupancyGrid(np.zeros((size, size), dtype=np.int8), resolution, Pose2D(-10.0, -10.0))


def traverse(occupied, x0, y0, dx, dy, reach):
    """Cell by cell (Amanatides & Woo 1987): the length at which the ray enters an occupied cell."""
    height, width = occupied.shape
    cx, cy, t = math.floor(x0), math.floor(y0), 0.0
    while t <= reach and 0 <= cx < width and 0 <= cy < height:
        if occupied[cy, cx]:
            return t
        tx = ((cx + (dx > 0)) - x0) / dx if dx != 0.0 else math.inf
        ty = ((cy + (dy > 0)) - y0) / dy if dy != 0.0 else math.inf
        t = min(tx, ty)
        if tx <= ty:
            cx += 1 if dx > 0 else -1
        else:
            cy += 1 if dy > 0 else -1
    return math.inf


@pytest.mark.parametrize("density", [0.0, 0.0005, 0.01, 0.3])
@pytest.mark.parametrize("shape", [(120, 168), (57, 43)])
def test_squares_ahead_are_the_largest_free_ones(density, shape):
    occupied = np.random.default_rng(1).random(shape) < density
    rows, columns = -(-shape[0] // 4), -(-shape[1] // 4)
    padded = np.ones((4 * rows, 4 * columns), dtype=np.bool_)
    padded[: shape[0], : shape[1]] = occupied
    blocked = padded.reshape(rows, 4, columns, 4).any(axis=(1, 3))
    tiles_up, tiles_right = -(-(rows + 2) // 8), -(-(columns + 2) // 8)
    tiles = clearance_field(occupied)[-1].reshape(4, tiles_up, tiles_right, 8, 8)
    squares = tiles.transpose(0, 1, 3, 2, 4).reshape(4, 8 * tiles_up, 8 * tiles_right)
    squares = squares[:, 1 : rows + 1, 1 : columns + 1]
    for quadrant, (x, y) in enumerate(((1, 1), (-1, 1), (1, -1), (-1, -1))):
        ahead, found = blocked[::y, ::x], squares[quadrant, ::y, ::x]
        for row, column in np.ndindex(rows, columns):
            side = int(found[row, column])
            assert not ahead[row : row + side, column : column + side].any()
            wider = ahead[row : row + side + 1, column : column + side + 1]
            assert wider.any() or wider.shape != (side + 1, side + 1)


@pytest.mark.parametrize("density", [0.0005, 0.005, 0.05, 0.4])
@pytest.mark.parametrize("on_corner", [False, True])
def test_leaping_rays_equal_the_cell_by_cell_traversal(density, on_corner):
    """From anywhere in a cell, and from cells' corners; the grid is no whole number of blocks."""
    rng = np.random.default_rng(7)
    occupied = rng.random((201, 263)) < density
    field = clearance_field(occupied)
    angles = rng.uniform(0.0, 2.0 * math.pi, 200)
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    ranges = np.empty(len(angles))
    places = rng.uniform((0.0, 0.0), (263.0, 201.0), (12, 2))
    for x0, y0 in np.floor(places) if on_corner else places:
        cast_grid(field, x0, y0, 1.0, 0.0, directions, 150.0, ranges)
        exact = [traverse(occupied, x0, y0, dx, dy, 150.0) for dx, dy in directions]
        assert np.array_equal(np.isinf(ranges), np.isinf(exact))
        np.testing.assert_allclose(ranges, exact, atol=1e-9)


def test_an_empty_grid_wider_than_the_widest_square_is_crossed():
    """A square ends at 255 blocks, 1020 cells."""
    occupied = np.zeros((1200, 1200), dtype=np.bool_)
    occupied[1199, 1100] = True
    ranges = np.empty(2)
    directions = np.array([(0.0, 1.0), (1.0, 0.0)])
    cast_grid(clearance_field(occupied), 1100.5, 0.5, 1.0, 0.0, directions, 5000.0, ranges)
    assert ranges.tolist() == [1198.5, math.inf]


def test_rays_along_the_axes_from_cell_borders_and_centres():
    occupied = np.zeros((40, 40), dtype=np.bool_)
    occupied[10, 30] = occupied[10, 5] = occupied[35, 20] = occupied[2, 20] = True
    directions = np.array([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
    ranges = np.empty(4)
    cast_grid(clearance_field(occupied), 20.0, 10.0, 1.0, 0.0, directions, 100.0, ranges)
    assert ranges.tolist() == [10.0, 14.0, 25.0, 7.0]
    cast_grid(clearance_field(occupied), 20.5, 10.5, 1.0, 0.0, directions, 100.0, ranges)
    assert ranges.tolist() == [9.5, 14.5, 24.5, 7.5]


def test_a_wall_is_hit_where_its_cell_begins_whatever_the_frames():
    grid = empty_grid()
    grid.data[:, 300] = 100  # the cell begins at x = 5 m
    lidar = make_lidar(grid, mount=Pose2D(0.4, 0.0, math.pi / 2))
    ranges = lidar.exact_ranges(Pose2D(1.0, 2.0, 0.0), NOBODY)
    angles = -math.pi + np.arange(360) * 2.0 * math.pi / 360 + math.pi / 2
    ahead = np.cos(angles) > 0.5
    np.testing.assert_allclose(ranges[ahead], 3.6 / np.cos(angles[ahead]), rtol=1e-9)
    # the wall is now y = 5 m
    turned = OccupancyGrid(grid.data, grid.resolution, Pose2D(10.0, -10.0, math.pi / 2))
    ranges = make_lidar(turned).exact_ranges(Pose2D(0.0, 1.0, math.pi / 2), NOBODY)
    assert ranges[180] == pytest.approx(4.0)


def test_a_grey_cell_that_stands_as_a_body_is_seen():
    """Of a map in the modes ``scale`` and ``raw``."""
    grid = empty_grid()
    grid.data[:, 300] = 65
    grid.data[:, 290] = 64
    assert make_lidar(grid).exact_ranges(Pose2D(1.0, 2.0, 0.0), NOBODY)[180] == pytest.approx(4.0)


def test_beyond_the_map_and_in_unknown_cells_nothing_is_hit():
    grid = empty_grid()
    grid.data[:] = -1
    lidar = make_lidar(grid)
    assert np.isinf(lidar.exact_ranges(Pose2D(), NOBODY)).all()
    assert np.isinf(lidar.exact_ranges(Pose2D(500.0, 0.0), NOBODY)).all()


def circle_range(px, py, radius, angle):
    """Nearest intersection of a ray from the origin with a circle, by the quadratic formula."""
    b = px * math.cos(angle) + py * math.sin(angle)
    c = px * px + py * py - radius * radius
    return b - math.sqrt(b * b - c) if b > 0 and b * b >= c else math.inf


@pytest.mark.parametrize(
    ("beams", "view"), [(360, 2.0 * math.pi), (722, 2.0 * math.pi), (181, 4.0), (7, 1.0)]
)
def test_people_are_circles(beams, view):
    rng = np.random.default_rng(3)
    lidar = make_lidar(empty_grid(), beams=beams, field_of_view=view)
    for _ in range(60):
        base = Pose2D(*rng.uniform(-3.0, 3.0, 2), rng.uniform(-4.0, 4.0))
        people = np.zeros((5, 4))
        bearing, distance = rng.uniform(-math.pi, math.pi, 5), rng.uniform(0.31, 6.0, 5)
        people[:, 0], people[:, 1] = (
            base.x + distance * np.cos(bearing),
            base.y + distance * np.sin(bearing),
        )
        angles = base.yaw - view / 2 + np.arange(beams) * view / beams
        exact = [
            min(circle_range(x - base.x, y - base.y, 0.3, a) for x, y in people[:, :2])
            for a in angles
        ]
        np.testing.assert_allclose(lidar.exact_ranges(base, people), exact, rtol=1e-9)


@pytest.mark.parametrize(
    ("px", "py", "expected"),
    [(5.0, 0.0, 2.0), (-5.0, 0.0, 9.0), (4.0, 3.0, 4.0), (4.0, 3.1, 9.0)],
    ids=["ahead", "behind", "touched", "passed"],
)
def test_a_beam_meets_the_circles_ahead_of_it(px, py, expected):
    ranges = np.array([9.0])
    _meet(0, px, py, px * px + py * py, 3.0, np.array([[1.0, 0.0]]), ranges)
    assert ranges[0] == pytest.approx(expected)


def test_a_wall_hides_a_person_and_a_person_hides_the_wall():
    grid = empty_grid()
    grid.data[:, 300] = 100  # x = 5 m
    lidar = make_lidar(grid)
    front = np.array([[2.0, 0.0, 0.0, 0.0]])
    behind = np.array([[6.0, 0.0, 0.0, 0.0]])
    assert lidar.exact_ranges(Pose2D(), front)[180] == pytest.approx(1.7)
    assert lidar.exact_ranges(Pose2D(), behind)[180] == pytest.approx(5.0)


def test_a_lidar_that_does_not_see_people_sees_what_stands_behind_them():
    data = np.zeros((400, 400), dtype=np.int8)
    data[:, 300:] = 100
    geometry, person = (
        OccupancyGrid(data, 0.05, Pose2D(-10.0, -10.0)),
        np.array([[2.0, 0.0, 0.0, 0.0]]),
    )
    blind = make_lidar(geometry, sees_people=False)
    scan = blind.measure(BodyState(), person, 0.0)
    np.testing.assert_array_equal(
        scan.ranges, make_lidar(geometry).measure(BodyState(), NOBODY, 0.0).ranges
    )
    assert blind.exact_ranges(Pose2D(), person)[180] == pytest.approx(1.7)  # the truth knows them


def test_a_sensor_inside_a_person_sees_nothing():
    lidar = make_lidar(empty_grid())
    scan = lidar.measure(BodyState(), np.array([[0.1, 0.0, 0.0, 0.0]]), 0.0)
    assert np.isinf(scan.ranges).all()


def test_somebody_touching_the_robot_vanishes_from_the_scan():
    box = SelfFilter(-0.7, 0.2, -0.4, 0.4)
    lidar = make_lidar(empty_grid(), self_filter=box, mount=Pose2D(-0.23, 0.0))
    # nearest point 0.35 m from the axis, inside the box
    beside = np.array([[-0.23, 0.65, 0.0, 0.0]])
    apart = np.array([[-0.23, 0.75, 0.0, 0.0]])  # nearest point 0.45 m from the axis, outside
    assert np.isinf(lidar.measure(BodyState(), beside, 0.0).ranges[270])
    assert lidar.measure(BodyState(), apart, 0.0).ranges[270] == pytest.approx(0.45)


@pytest.mark.parametrize(
    ("direction", "border"), [((1, 0), 1.0), ((-1, 0), 0.75), ((0, 1), 0.5), ((0, -1), 0.25)]
)
def test_what_lies_on_the_robots_own_outline_is_dropped(direction, border):
    box = np.array((-0.75, 1.0, -0.25, 0.5))
    ranges, directions = (
        np.array((border, np.nextafter(border, 9.0))),
        np.array((direction, direction), dtype=float),
    )
    finish_scan(ranges, np.zeros(2), 0.0, 9.0, directions, 0.0, 0.0, box)
    assert ranges.tolist() == [math.inf, np.nextafter(border, 9.0)]


def test_range_limits_read_inf():
    grid = empty_grid()
    grid.data[:, 300] = 100
    near = make_lidar(grid, range_max=4.9).measure(BodyState(), NOBODY, 0.0)
    assert np.isinf(near.ranges).all()
    far = make_lidar(grid, range_min=5.1).measure(BodyState(), NOBODY, 0.0)
    assert np.isinf(far.ranges[180])
    assert np.isfinite(far.ranges[150])


def test_noise_has_the_stated_deviation():
    grid = empty_grid()
    grid.data[:, 300] = 100
    lidar = make_lidar(grid, noise_std=0.03)
    exact = lidar.exact_ranges(Pose2D(), NOBODY)
    seen = np.isfinite(exact)
    errors = np.concatenate(
        [lidar.measure(BodyState(), NOBODY, 0.0).ranges[seen] - exact[seen] for _ in range(200)]
    )
    n = len(errors)
    assert abs(errors.mean()) < 3.0 * 0.03 / math.sqrt(n)
    assert abs(errors.std() - 0.03) < 3.0 * 0.03 / math.sqrt(2 * n)


def test_scan_describes_itself():
    scan = make_lidar(empty_grid(), mount=Pose2D(0.1, 0.2, 0.3)).measure(BodyState(), NOBODY, 1.5)
    assert (scan.stamp, scan.range_min, scan.range_max, scan.sensor_pose) == (
        1.5,
        0.05,
        30.0,
        Pose2D(0.1, 0.2, 0.3),
    )
    assert scan.angle_min == -math.pi
    assert scan.angle_increment * len(scan.ranges) == pytest.approx(2.0 * math.pi)


@pytest.mark.parametrize(
    "changes",
    [{"beams": 0}, {"field_of_view": 7.0}, {"range_min": 40.0}, {"noise_std": -0.1}, {"rate": 0.0}],
)
def test_impossible_lidars_are_refused(changes):
    with pytest.raises(ParameterError, match=next(iter(changes))):
        lidar_params(**changes)

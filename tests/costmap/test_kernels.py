import math

import numpy as np
import pytest

from navstack.costmap import beam_kernels, cell_kernels, inflation_kernels, kernels
from navstack.costmap.inflation import Inflation
from navstack.costmap.window import Window, shift
from navstack.params.costmap import InflationLayerParams


def slow_line(x0: int, y0: int, x1: int, y1: int, longest: float) -> set[tuple[int, int]]:
    """A line in exact arithmetic: halves round up along the shorter axis.

    Odd lengths are excepted, as integers do.
    """
    dx, dy = x1 - x0, y1 - y0
    longer = max(abs(dx), abs(dy))
    if longer == 0:
        return {(x0, y0)}
    cells = set()
    for i in range(min(longer, int(min(1.0, longest / math.hypot(dx, dy)) * longer)) + 1):
        across = (longer // 2 + i * min(abs(dx), abs(dy))) // longer
        along_x, along_y = (i, across) if abs(dx) >= abs(dy) else (across, i)
        cells.add((x0 + int(math.copysign(along_x, dx)), y0 + int(math.copysign(along_y, dy))))
    return cells


@pytest.mark.parametrize("longest", [math.inf, 7.0])
def test_a_beam_frees_the_cells_of_its_line(longest: float) -> None:
    rng = np.random.default_rng(1)
    for _ in range(200):
        x0, y0, x1, y1 = (int(v) for v in rng.integers(0, 30, 4))
        grid = np.full((30, 30), 254, dtype=np.uint8)
        kernels.free_line(grid, *kernels.ray(x0, y0, x1, y1, longest, 0.0))
        freed = {(int(x), int(y)) for y, x in zip(*np.nonzero(grid == 0), strict=True)}
        assert freed == slow_line(x0, y0, x1, y1, longest)


@pytest.mark.parametrize(
    ("ends", "limits", "expected"),
    [
        ((0, 0, 3, 4), (0.0, 10.0), (0, 0, 3, 4, 4)),
        ((0, 0, 3, 4), (5.0, 10.0), (3, 4, 0, 0, 0)),  # as long as it has to be
        ((0, 0, 3, 4), (5.1, 10.0), (0, 0, 0, 0, -1)),
        ((0, 0, 10, 0), (2.0, 4.0), (2, 0, 8, 0, 3)),
        ((1, 2, -5, 4), (0.0, 4.0), (1, 2, -6, 2, 3)),
        ((2, 1, 2, 1), (0.0, 4.0), (2, 1, 0, 0, 0)),
    ],
)
def test_a_line_is_cut_to_its_limits(
    ends: tuple[int, ...],
    limits: tuple[float, float],
    expected: tuple[int, ...],
) -> None:
    assert kernels.ray(*ends, limits[1], limits[0]) == expected


@pytest.mark.parametrize(
    ("point", "limits", "expected"),
    [
        ((1.8, 1.0), (0.0, 0.5), (1.0, 1.5, 1.0, 1.0)),  # cut to the greatest range
        ((1.0, 0.2), (0.0, 2.0), (1.0, 1.0, 0.2, 1.0)),
        ((1.0, 0.2), (0.9, 2.0), (1.0, 1.0, 1.0, 1.0)),  # nearer than the least one
        ((1.0, 1.0), (0.0, 2.0), (1.0, 1.0, 1.0, 1.0)),
    ],
)
def test_bounds_grow_to_the_ends_of_beams(
    point: tuple[float, float],
    limits: tuple[float, float],
    expected: tuple[float, ...],
) -> None:
    grid, bounds = (
        np.zeros((40, 40), dtype=np.uint8),
        np.array((math.inf, -math.inf, math.inf, -math.inf)),
    )
    kernels.clear_rays(grid, np.array((point,)), 1.0, 1.0, np.zeros(2), 0.05, limits, bounds)
    np.testing.assert_allclose(bounds, expected)


@pytest.mark.parametrize(
    ("dx", "dy", "number"),
    [
        (2.0, 0.0, 0.0),
        (0.3, 0.1, 0.25),
        (0.0, 0.5, 1.0),
        (-0.3, 0.1, 1.75),
        (-3.0, 0.0, 2.0),
        (-1.0, -1.0, 2.5),
    ]
    + [(0.0, -2.0, 3.0), (0.1, -0.1, 3.5), (0.0, 0.0, 0.0)],
)
def test_bearings_are_numbered_round_the_sensor(dx: float, dy: float, number: float) -> None:
    assert beam_kernels._bearing.py_func(dx, dy) == pytest.approx(number)


def test_points_off_the_grid_are_drawn_onto_its_edge_along_the_beam() -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        ox, oy = rng.uniform(0.5, 2.5, 2)
        wx, wy = rng.uniform(-4.0, 7.0, 2)
        x, y = kernels.clip_to_grid(ox, oy, wx, wy, 0.0, 0.0, 3.0, 3.0)
        assert -1e-9 <= x < 3.0 + 1e-9
        assert -1e-9 <= y < 3.0 + 1e-9
        off_beam = abs((x - ox) * (wy - oy) - (y - oy) * (wx - ox)) / math.hypot(wx - ox, wy - oy)
        assert off_beam < 0.0015


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((3.0, 3.0), (3.0, 3.0)),
        ((5.0, 1.0), (2.999, 1.0)),  # a millimetre inside the far edges ...
        ((5.0, 2.0), (2.999, 1.5)),  # ... but where the beam meets these
        ((2.0, 5.0), (1.5, 2.999)),
        ((-1.0, 1.0), (0.0, 1.0)),  # and on the near ones
        ((-1.0, 2.0), (0.0, 1.5)),
        ((0.5, -1.0), (0.75, 0.0)),
        ((-1.5, -1.0), (0.0, 0.2)),
        ((-1.0, -1.5), (0.2, 0.0)),  # beyond the second edge still, once it is on the first
    ],
)
def test_clipped_ends_are_a_millimetre_inside_the_far_edges(
    point: tuple[float, float], expected: tuple[float, float]
) -> None:
    assert kernels.clip_to_grid(1.0, 1.0, *point, 0.0, 0.0, 3.0, 3.0) == pytest.approx(
        expected, abs=1e-12
    )


def test_points_are_moved_as_complex_numbers_are() -> None:
    rng = np.random.default_rng(10)
    points, moved = rng.normal(size=(9, 2)), np.empty((9, 2))
    for x, y, yaw in rng.uniform(-3.0, 3.0, (5, 3)):
        kernels.transform.py_func(points, x, y, yaw, moved)
        found = (points[:, 0] + 1j * points[:, 1]) * np.exp(1j * yaw) + complex(x, y)
        np.testing.assert_allclose(moved, np.column_stack((found.real, found.imag)), atol=1e-12)


@pytest.mark.parametrize("corners", [3, 4, 7])
def test_a_polygon_is_freed_between_the_lines_of_its_sides(corners: int) -> None:
    rng = np.random.default_rng(corners)
    for _ in range(30):
        bearings = np.sort(rng.uniform(-math.pi, math.pi, corners))
        polygon = (1.5, 1.2) + rng.uniform(0.3, 1.1) * np.column_stack(
            (np.cos(bearings), np.sin(bearings))
        )
        cells = [(math.floor((x - 0.2) / 0.05), math.floor((y - 0.05) / 0.05)) for x, y in polygon]
        rim = {
            cell for i in range(corners) for cell in slow_line(*cells[i - 1], *cells[i], math.inf)
        }
        expected = np.full((50, 55), 254, dtype=np.uint8)
        for column in {x for x, _ in rim}:
            rows = [y for x, y in rim if x == column]
            expected[min(rows) : max(rows) + 1, column] = 0
        grid, spans = np.full_like(expected, 254), np.empty((2, 55), dtype=np.int64)
        found = kernels.polygon_columns(polygon, np.array((0.2, 0.05)), 0.05, 55, 50, *spans)
        kernels.free_columns(grid, *found, *spans)
        np.testing.assert_array_equal(grid, expected)


def test_a_polygon_fills_its_cells_and_one_off_the_grid_none() -> None:
    lowest, highest = np.empty(40, dtype=np.int64), np.empty(40, dtype=np.int64)
    square = np.array([[0.52, 0.52], [1.48, 0.52], [1.48, 1.08], [0.52, 1.08]])
    first, last = kernels.polygon_columns(square, np.zeros(2), 0.1, 40, 40, lowest, highest)
    assert (first, last) == (5, 14)
    grid = np.full((40, 40), 254, dtype=np.uint8)
    kernels.free_columns(grid, first, last, lowest, highest)
    assert (grid[5:11, 5:15] == 0).all()
    assert (grid == 0).sum() == 60
    assert kernels.polygon_columns(
        square - (0.6, 0.0),
        np.zeros(2),
        0.1,
        40,
        40,
        lowest,
        highest,
    ) == (0, -1)


@pytest.mark.parametrize("limits", [(0.0, 1.42), (0.31, 0.88), (0.52, 1.26)])
def test_returns_within_the_obstacle_ranges_mark_on_the_grid_and_in_the_list(
    limits: tuple[float, float],
) -> None:
    """Nav2's rule: least <= metres < most.

    And: ceil(least) <= whole cells between both cells <= ceil(most).
    """
    rng = np.random.default_rng(7)
    resolution, window, origin = 0.05, np.array((300, -200, 60, 50)), np.array((-0.4, 0.7))
    ox, oy = 1.03, 1.92
    radii, bearings = rng.uniform(0.0, 1.7, 4000), rng.uniform(-math.pi, math.pi, 4000)
    points = np.column_stack((ox + radii * np.cos(bearings), oy + radii * np.sin(bearings)))
    expected = np.zeros((50, 60), dtype=np.uint8)
    for (x, y), radius in zip(points, radii, strict=True):
        column, row = (
            math.floor((x - origin[0]) / resolution),
            math.floor((y - origin[1]) / resolution),
        )
        apart = math.floor(math.hypot(column - 28, row - 24))
        near, far = (-math.floor(-limit / resolution) for limit in limits)
        if (
            0 <= column < 60
            and 0 <= row < 50
            and limits[0] <= radius < limits[1]
            and near <= apart <= far
        ):
            expected[row, column] = 254
    grid, bounds = np.zeros_like(expected), np.array((math.inf, -math.inf, math.inf, -math.inf))
    kernels.mark_points(grid, points, ox, oy, origin, resolution, limits, bounds)
    np.testing.assert_array_equal(grid, expected)
    cells, present = np.empty((len(points), 2), dtype=np.int32), np.zeros_like(expected)
    changed, nothing = (
        np.array((1 << 40, -(1 << 40), 1 << 40, -(1 << 40))),
        np.zeros((1, 1), dtype=np.uint8),
    )
    given = (points, (ox, oy), origin, resolution, limits, nothing, 0, changed)
    count = cell_kernels.mark_cells(cell_kernels.Listed(cells, 0, present, window), *given)
    listed = np.zeros_like(expected)
    listed[cells[:count, 1] + 200, cells[:count, 0] - 300] = 254
    np.testing.assert_array_equal(listed, expected)


@pytest.mark.parametrize(
    ("keep_unknown", "expected"), [(False, [9, 9, 3, 7, 255]), (True, [9, 9, 3, 255, 255])]
)
def test_combining_by_maximum(keep_unknown: bool, expected: list[int]) -> None:
    master = np.array([[9, 3, 3, 255, 255]], dtype=np.uint8)
    layer = np.array([[4, 9, 255, 7, 255]], dtype=np.uint8)
    kernels.combine_maximum(master, (0, 5, 0, 1), layer, 0, 0, keep_unknown)
    assert master[0].tolist() == expected


@pytest.mark.parametrize("keep_unknown", [False, True])
def test_combining_stays_in_the_region_and_on_the_layer(keep_unknown: bool) -> None:
    rng = np.random.default_rng(8)
    for _ in range(100):
        master = rng.choice(np.array((0, 1, 252, 253, 254, 255), dtype=np.uint8), (60, 90))
        layer = rng.choice(
            np.array((0, 1, 252, 253, 254, 255), dtype=np.uint8), rng.integers(1, 80, 2)
        )
        x, y = (int(v) for v in rng.integers(-40, 60, 2))
        x0, y0 = (int(v) for v in rng.integers(0, 40, 2))
        xn, yn = x0 + int(rng.integers(0, 50)), y0 + int(rng.integers(0, 20))
        expected = master.copy()
        for row in range(max(y0, y), min(yn, y + layer.shape[0])):
            for column in range(max(x0, x), min(xn, x + layer.shape[1])):
                old, cost = int(master[row, column]), int(layer[row - y, column - x])
                if cost != 255 and (old < cost or (old == 255 and not keep_unknown)):
                    expected[row, column] = cost
        kernels.combine_maximum(master, (x0, xn, y0, yn), layer, x, y, keep_unknown)
        np.testing.assert_array_equal(master, expected)


def part_of(source: np.ndarray, x: int, y: int, shape: tuple[int, int], fill: int) -> np.ndarray:
    """The source's cells from (x, y) on, and ``fill`` beyond its edges."""
    part = np.full(shape, fill, dtype=np.uint8)
    for row in range(shape[0]):
        for column in range(shape[1]):
            if 0 <= y + row < source.shape[0] and 0 <= x + column < source.shape[1]:
                part[row, column] = source[y + row, x + column]
    return part


def test_a_grid_is_shifted_in_place() -> None:
    rng = np.random.default_rng(6)
    for _ in range(300):
        grid = rng.integers(0, 250, rng.integers(1, 9, 2)).astype(np.uint8)
        dx, dy = (int(v) for v in rng.integers(-9, 10, 2))
        expected = part_of(grid, dx, dy, grid.shape, 7)
        shift(grid, dx, dy, 7)
        np.testing.assert_array_equal(grid, expected)


@pytest.mark.parametrize("radius", [0.0, 0.1, 1.5, 3.4, 13.0])
def test_costs_around_cells_equal_their_kernels_maximum(radius: float) -> None:
    rng = np.random.default_rng(8)
    inflation = Inflation(
        InflationLayerParams(inflation_radius=radius, cost_scaling_factor=0.5), 0.05, 0.1
    )
    reach = inflation.radius
    window = Window(0.0, 0.0, 0.05, 150, 120)
    window.centre_on(20.0, -3.0)
    corner, beyond = np.array((window.cell_x, window.cell_y)), 300 + reach
    for line in range(4):
        cells = (corner + rng.integers(-80, 200, (40, 2))).astype(np.int32)
        cells[:20, line % 2] = cells[0, line % 2]  # some stand in a line
        x0, y0, xn, yn = (int(v) for v in (*rng.integers(0, 60, 2), *rng.integers(60, 121, 2)))
        target = rng.integers(0, 40, (120, 150)).astype(np.uint8)
        padded = np.pad(np.zeros_like(target), beyond)
        for x, y in (cells - corner + beyond)[:35]:
            part = padded[y - reach : y + reach + 1, x - reach : x + reach + 1]
            np.maximum(part, inflation.costs, out=part)
        expected, inner = target.copy(), np.s_[y0:yn, x0:xn]
        expected[inner] = np.maximum(target, padded[beyond:-beyond, beyond:-beyond])[inner]
        box = (x0 + window.cell_x, xn + window.cell_x, y0 + window.cell_y, yn + window.cell_y)
        inflation.spread(target, (window.cell_x, window.cell_y), cells, 35, box)
        np.testing.assert_array_equal(target, expected)


def test_scans_are_projected_as_by_hand() -> None:
    ranges = np.array((0.05, 1.0, math.nan, math.inf, 7.9, 8.0, 3.0))
    angles = np.linspace(-2.0, 2.0, 7)
    directions = np.column_stack((np.cos(angles), np.sin(angles)))
    for endless, valid in ((math.inf, [1, 4, 6]), (7.99, [1, 3, 4, 6])):
        points = np.empty((7, 2))
        sensor = (1.0, -2.0, math.cos(0.3), math.sin(0.3))
        count = beam_kernels.project(ranges, directions, (1.0, 8.0), endless, sensor, points)
        reach = np.where(ranges == math.inf, endless, ranges)[valid]
        bearing = angles[valid] + 0.3
        expected = np.column_stack((1.0 + reach * np.cos(bearing), -2.0 + reach * np.sin(bearing)))
        np.testing.assert_allclose(points[:count], expected, atol=1e-12)


@pytest.mark.parametrize("limits", [(0.0, 1.4), (0.62, 2.5)])
def test_a_cell_is_hit_if_the_line_of_some_beam_holds_it(limits: tuple[float, float]) -> None:
    rng = np.random.default_rng(4)
    origin, window, resolution = np.array((-0.4, 0.7)), np.array((300, -200, 60, 50)), 0.05
    ox, oy = 1.0, 1.9
    points = np.array((ox, oy)) + rng.normal(0.0, 1.2, (40, 2))
    starts, ordered = np.empty(65, dtype=np.int64), np.empty_like(points)
    beam_kernels.sort_by_bearing(points, ox, oy, starts, ordered)
    assert sorted(map(tuple, ordered)) == sorted(map(tuple, points))
    dense = np.full((50, 60), 254, dtype=np.uint8)
    kernels.clear_rays(dense, points, ox, oy, origin, resolution, limits, np.zeros(4))
    cells = np.array([(300 + x, -200 + y) for y in range(50) for x in range(60)], dtype=np.int32)
    present = np.ones((50, 60), dtype=np.uint8)
    lines = np.empty((40, 8), dtype=np.int32)
    lateral = 1.5 if limits[0] == 0.0 else 3.0
    all_cells = cell_kernels.Listed(cells, len(cells), present, window)
    cell_kernels.clear_hit(
        all_cells,
        ordered,
        starts,
        (ox, oy),
        origin,
        resolution,
        limits,
        lateral,
        lines,
    )
    changed = np.array((1 << 40, -(1 << 40), 1 << 40, -(1 << 40)))
    count = cell_kernels.drop_doubted(all_cells, changed)
    kept = np.zeros((50, 60), dtype=np.uint8)
    kept[cells[:count, 1] + 200, cells[:count, 0] - 300] = 254
    np.testing.assert_array_equal(kept, dense)
    assert (dense == 0).sum() > 300


def test_the_points_that_may_lie_near_a_cell_are_all_counted_and_none_twice() -> None:
    rng = np.random.default_rng(6)
    points = rng.normal(0.0, 2.0, (60, 2))
    starts, ordered = np.empty(65, dtype=np.int64), np.empty_like(points)
    beam_kernels.sort_by_bearing(points, 0.0, 0.0, starts, ordered)
    for dx, dy in (
        *rng.normal(0.0, 3.0, (200, 2)),
        (2.0, 1e-3),
        (2.0, -1e-3),
        (2.0, 0.2),
        (0.1, 0.1),
    ):
        begin, count = beam_kernels.candidates(float(dx), float(dy), 20.0, 0.2, starts)
        assert 0 <= begin <= 60 and 0 <= count <= 60
        chosen = {(begin + i) % 60 for i in range(count)}
        # of the cell from a point's beam, times the beam's length
        apart = ordered[:, 0] * dy - ordered[:, 1] * dx
        ahead = ordered @ (dx, dy) > 0.0
        near = (abs(apart) < 0.2 * np.hypot(*ordered.T)) & ahead
        assert set(np.flatnonzero(near)) <= chosen
        if math.hypot(dx, dy) > 2.0:
            assert count < 30
    assert beam_kernels.candidates(21.0, 0.0, 20.0, 0.2, starts) == (0, 0)


def test_boxes_are_copied_and_filled_beyond_the_edges() -> None:
    rng = np.random.default_rng(5)
    source = rng.integers(0, 250, (40, 50)).astype(np.uint8)
    for _ in range(50):
        margin = int(rng.integers(0, 5))
        x, y = (int(v) for v in rng.integers(-60, 60, 2))
        expected = part_of(source, x + margin, y + margin, (30, 35), 7)
        target = np.full((30, 35), 99, dtype=np.uint8)
        boxes = np.array(
            ((x, x + 35, y, y + 10), (x, x + 3, y + 10, y + 30), (x + 3, x + 35, y + 10, y + 30))
        )
        inflation_kernels.copy_boxes(source, margin, 7, target, np.array((x, y, 35, 30)), boxes)
        np.testing.assert_array_equal(target, expected)


@pytest.mark.parametrize(
    ("limits", "is_in"), [((5.0, 6.0), True), ((4.0, 5.0), False), ((5.1, 6.0), False)]
)
def test_a_range_has_its_lower_limit_and_not_its_upper_one(
    limits: tuple[float, float], is_in: bool
) -> None:
    assert kernels.is_in_range(4.0, 6.0, 1.0, 2.0, limits) == is_in

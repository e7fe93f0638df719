import math

import numpy as np
import pytest

from navstack.costmap import inflation_kernels, kernels
from navstack.costmap.inflation import make_kernel
from navstack.params.costmap import InflationLayerParams


def slow_line(x0: int, y0: int, x1: int, y1: int, longest: float) -> set[tuple[int, int]]:
    """A line in exact arithmetic: halves round up along the shorter axis, odd lengths excepted as integers do."""
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


def test_a_polygon_fills_its_cells_and_one_off_the_grid_none() -> None:
    lowest, highest = np.empty(40, dtype=np.int64), np.empty(40, dtype=np.int64)
    square = np.array([[0.52, 0.52], [1.48, 0.52], [1.48, 1.08], [0.52, 1.08]])
    first, last = kernels.polygon_columns(square, np.zeros(2), 0.1, 40, 40, lowest, highest)
    assert (first, last) == (5, 14)
    grid = np.full((40, 40), 254, dtype=np.uint8)
    kernels.free_columns(grid, first, last, lowest, highest)
    assert (grid[5:11, 5:15] == 0).all()
    assert (grid == 0).sum() == 60
    assert kernels.polygon_columns(square - (0.6, 0.0), np.zeros(2), 0.1, 40, 40, lowest, highest) == (0, -1)


@pytest.mark.parametrize(("keep_unknown", "expected"), [(False, [9, 9, 3, 7, 255]), (True, [9, 9, 3, 255, 255])])
def test_combining_by_maximum(keep_unknown: bool, expected: list[int]) -> None:
    master = np.array([[9, 3, 3, 255, 255]], dtype=np.uint8)
    layer = np.array([[4, 9, 255, 7, 255]], dtype=np.uint8)
    kernels.combine_maximum(master, layer, keep_unknown)
    assert master[0].tolist() == expected


@pytest.mark.parametrize("radius", [0.1, 1.5, 1.75, 3.4])
def test_stamped_runs_equal_their_cells_maximum(radius: float) -> None:
    rng = np.random.default_rng(3)
    kernel = make_kernel(InflationLayerParams(inflation_radius=radius, cost_scaling_factor=2.0), 0.05, 0.1)
    runs = np.column_stack((rng.integers(-80, 200, (40, 2)), rng.integers(1, 16, 40))).astype(np.int32)
    target = rng.integers(0, 40, (120, 150)).astype(np.uint8)
    reach = kernel.radius
    padded = np.pad(np.zeros_like(target), 300)
    for x, y, pattern in runs:
        for j in range(inflation_kernels.RUN):
            if pattern >> j & 1:
                part = padded[300 + y - reach : 301 + y + reach, 300 + x + j - reach : 301 + x + j + reach]
                np.maximum(part, kernel.costs, out=part)
    expected = target.copy()
    inner = np.s_[5:111, 9:140]
    expected[inner] = np.maximum(target, padded[300:-300, 300:-300])[inner]
    inflation_kernels.stamp(target, runs, len(runs), kernel.patterns, reach, 9, 140, 5, 111)
    np.testing.assert_array_equal(target, expected)

"""Rectangles and convex polygons, and their cells."""

import math

import numpy as np
import pytest

from harness.world.map.shapes import (
    Rect,
    bounds,
    box,
    fill_convex,
    grow,
    octagon,
    polygon_area,
    window_of,
)

AREA = Rect(1.0, 2.0, 4.0, 7.0)


def test_a_rectangle_knows_its_sides() -> None:
    assert (AREA.width, AREA.depth) == (3.0, 5.0)
    assert AREA.polygon.tolist() == [[1.0, 2.0], [4.0, 2.0], [4.0, 7.0], [1.0, 7.0]]
    assert [AREA.side_length(side) for side in range(4)] == [5.0, 3.0, 5.0, 3.0]
    assert AREA.inset(0.1, 0.2, 0.3, -0.4) == Rect(1.1, 2.2, 3.7, 7.4)
    assert bounds(AREA.polygon) == AREA


@pytest.mark.parametrize(
    ("side", "point"), [(0, (1.25, 3.5)), (1, (2.5, 2.25)), (2, (3.75, 3.5)), (3, (2.5, 6.75))]
)
def test_a_point_beside_a_side_counts_from_its_lower_or_left_end_inwards(
    side: int, point: tuple[float, float]
) -> None:
    assert AREA.beside(side, 1.5, 0.25) == point


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        (Rect(2.0, 3.0, 3.0, 4.0), True),
        (Rect(3.9, 6.9, 9.0, 9.0), True),
        (Rect(-9.0, -9.0, 1.1, 2.1), True),
        (Rect(4.0, 2.0, 5.0, 7.0), False),
        (Rect(0.0, 2.0, 1.0, 7.0), False),
        (Rect(1.0, 7.0, 4.0, 8.0), False),
        (Rect(1.0, 1.0, 4.0, 2.0), False),
    ],
)
def test_rectangles_that_only_share_an_edge_do_not_overlap(other: Rect, expected: bool) -> None:
    assert AREA.overlaps(other) is expected
    assert other.overlaps(AREA) is expected


def test_a_box_lies_along_its_yaw() -> None:
    yaw = math.radians(90.0)
    expected = [
        (1.0 + 0.5, 2.0 - 2.0),
        (1.0 + 0.5, 2.0 + 2.0),
        (1.0 - 0.5, 2.0 + 2.0),
        (1.0 - 0.5, 2.0 - 2.0),
    ]
    assert box(1.0, 2.0, yaw, 4.0, 1.0) == pytest.approx(np.array(expected))
    slanted = box(0.0, 0.0, math.atan2(3.0, 4.0), 10.0, 5.0)
    assert slanted[2] == pytest.approx((0.8 * 5.0 - 0.6 * 2.5, 0.6 * 5.0 + 0.8 * 2.5))


def test_an_octagon_has_a_flat_side_to_the_right() -> None:
    corners = octagon(3.0, -1.0, 2.0)
    half, far = 2.0 * math.sin(math.pi / 8.0), 2.0 * math.cos(math.pi / 8.0)
    expected = [
        (far, half),
        (half, far),
        (-half, far),
        (-far, half),
        (-far, -half),
        (-half, -far),
        (half, -far),
    ]
    assert corners - (3.0, -1.0) == pytest.approx(np.array([*expected, (far, -half)]))
    assert polygon_area(corners) == pytest.approx(2.0 * math.sqrt(2.0) * 4.0)


def test_the_area_is_negative_clockwise() -> None:
    corners = np.array(((0.0, 0.0), (4.0, 1.0), (3.0, 5.0)))
    assert polygon_area(corners) == pytest.approx(0.5 * (4.0 * 5.0 - 3.0 * 1.0))
    assert polygon_area(corners[::-1]) == pytest.approx(-8.5)


def test_a_polygon_grows_by_its_margin_on_every_side() -> None:
    for polygon in (box(1.0, 2.0, 0.4, 1.7, 0.9), octagon(-3.0, 1.0, 0.2)):
        grown = grow(polygon, 0.3)
        edges, normals = np.roll(polygon, -1, axis=0) - polygon, np.roll(grown, -1, axis=0) - grown
        across = (
            edges[:, 0] * (grown - polygon)[:, 1] - edges[:, 1] * (grown - polygon)[:, 0]
        ) / np.hypot(*edges.T)
        assert across == pytest.approx(-0.3)
        assert edges[:, 0] * normals[:, 1] == pytest.approx(edges[:, 1] * normals[:, 0])


def test_filled_cells_are_those_with_their_centre_inside() -> None:
    polygon = box(2.03, 1.01, 0.4, 1.7, 0.9)
    mask = np.zeros((40, 60), dtype=bool)
    fill_convex(mask, polygon, True, 0.1, -1.0, -0.5)
    y, x = np.indices(mask.shape)
    u = np.cos(0.4) * (x * 0.1 - 0.95 - 2.03) + np.sin(0.4) * (y * 0.1 - 0.45 - 1.01)
    v = -np.sin(0.4) * (x * 0.1 - 0.95 - 2.03) + np.cos(0.4) * (y * 0.1 - 0.45 - 1.01)
    assert np.array_equal(mask, (abs(u) <= 0.85) & (abs(v) <= 0.45))
    fill_convex(mask, Rect(-50.0, -50.0, 50.0, 50.0).polygon, False, 0.1, -1.0, -0.5)
    assert not mask.any()
    fill_convex(mask, Rect(90.0, 90.0, 95.0, 95.0).polygon, True, 0.1, -1.0, -0.5)
    assert not mask.any()


def test_a_cell_whose_centre_lies_on_the_edge_is_filled() -> None:
    mask = np.zeros((4, 5), dtype=bool)
    fill_convex(mask, Rect(0.5, 1.5, 2.5, 2.5).polygon, True, 1.0, 0.0, 0.0)
    assert np.argwhere(mask).tolist() == [[1, 0], [1, 1], [1, 2], [2, 0], [2, 1], [2, 2]]


@pytest.mark.parametrize("corner", [(-3.0, -2.0), (4.0, 7.0)])
def test_the_window_around_a_polygon_holds_all_of_its_cells(corner: tuple[float, float]) -> None:
    rng = np.random.default_rng(3)
    for _ in range(30):
        x, y = rng.uniform(-1.0, 7.0, 2) + corner
        polygon = box(x, y, float(rng.uniform(-3.0, 3.0)), *rng.uniform(0.2, 3.0, 2).tolist())
        whole, part = np.zeros((50, 60), dtype=bool), np.zeros((50, 60), dtype=bool)
        fill_convex(whole, polygon, True, 0.1, *corner)
        window, mask = window_of(polygon, whole.shape, 0.1, *corner)
        part[window] = mask
        assert np.array_equal(part, whole)


@pytest.mark.parametrize(
    ("area", "columns", "rows"),
    [
        (Rect(12.2, 21.0, 13.4, 21.6), (4, 7), (2, 4)),
        (Rect(3.0, 20.6, 10.6, 99.0), (0, 2), (1, 6)),
        (Rect(90.0, 90.0, 95.0, 95.0), (8, 8), (6, 6)),
        (Rect(-9.0, -9.0, 0.0, 0.0), (0, 0), (0, 0)),
    ],
)
def test_the_window_is_no_larger_than_needed(
    area: Rect,
    columns: tuple[int, int],
    rows: tuple[int, int],
) -> None:
    window, mask = window_of(area.polygon, (6, 8), 0.5, 10.0, 20.0)
    assert window == (slice(*rows), slice(*columns))
    assert mask.shape == (rows[1] - rows[0], columns[1] - columns[0])

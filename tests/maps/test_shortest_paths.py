"""Shortest paths against scipy's Dijkstra on the same graph and against geometry."""

import math

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from harness.task.shortest_paths import (
    descend,
    distance_field,
    line_of_sight,
    path_length,
    shortest_path,
    string_pull,
)

MOVES = [(y, x) for y in range(-2, 3) for x in range(-2, 3) if math.gcd(y, x) == 1]


def random_mask(seed: int, shape: tuple[int, int] = (40, 55), share: float = 0.3) -> np.ndarray:
    return np.random.default_rng(seed).random(shape) > share


def touched(dy: int, dx: int) -> list[tuple[int, int]]:
    """Cells whose closed square meets the segment from (0, 0) to (dy, dx).

    Exact, by the sides of their corners.
    """
    cells = []
    for a in range(min(dy, 0), max(dy, 0) + 1):
        for b in range(min(dx, 0), max(dx, 0) + 1):
            sides = [dx * (2 * a + i) - dy * (2 * b + j) for i in (-1, 1) for j in (-1, 1)]
            if min(sides) <= 0 <= max(sides):
                cells.append((a, b))
    return cells


def scipy_field(free: np.ndarray, goal: tuple[int, int]) -> np.ndarray:
    height, width = free.shape
    rows, columns, lengths = [], [], []
    for dy, dx in MOVES:
        cells = touched(dy, dx)
        for y in range(height):
            for x in range(width):
                inside = 0 <= y + dy < height and 0 <= x + dx < width
                if inside and all(free[y + a, x + b] for a, b in cells):
                    rows.append(y * width + x)
                    columns.append((y + dy) * width + x + dx)
                    lengths.append(math.hypot(dy, dx))
    graph = csr_array((lengths, (rows, columns)), shape=(free.size, free.size))
    return dijkstra(graph, indices=goal[0] * width + goal[1]).reshape(free.shape)


@pytest.mark.parametrize("seed", range(4))
def test_field_is_scipys_dijkstra(seed: int) -> None:
    free = random_mask(seed, share=0.15 + 0.05 * seed)
    goal = tuple(np.argwhere(free)[100 + seed])
    np.testing.assert_allclose(
        distance_field(free, np.array(goal)), scipy_field(free, goal), rtol=1e-6
    )


def test_field_of_several_goals_is_the_least(seed: int = 7) -> None:
    free = random_mask(seed, share=0.2)
    goals = np.argwhere(free)[[3, 500, 900]]
    each = np.min([distance_field(free, goal) for goal in goals], axis=0)
    assert np.array_equal(distance_field(free, goals), each)


def test_goals_on_obstacles_or_outside_count_for_nothing() -> None:
    free = np.ones((5, 6), dtype=bool)
    free[2, 2] = False
    assert np.isinf(distance_field(free, np.array([[2, 2], [-1, 0], [0, 6], [5, 0]]))).all()
    assert distance_field(free, np.array([[2, 2], [0, 0]]))[0, 5] == 5.0


def test_field_on_open_ground_is_nearly_euclidean() -> None:
    field = distance_field(np.ones((101, 101), dtype=bool), np.array([50, 50]))
    y, x = np.indices(field.shape) - 50
    true = np.hypot(y, x)
    assert (field >= true - 1e-3).all()
    assert (field <= 1.028 * true + 1e-3).all()


def test_corners_are_not_cut_and_walls_are_not_crossed() -> None:
    free = np.ones((4, 4), dtype=bool)
    free[:2, 2:] = False
    free[2:, :2] = False  # two rooms that touch at a corner only
    assert np.isinf(distance_field(free, np.array([0, 0]))[3, 3])
    free = np.ones((7, 9), dtype=bool)
    free[:6, 4] = False
    field = distance_field(free, np.array([0, 0]))
    assert field[0, 8] > 6 + 6


@pytest.mark.parametrize("seed", range(5))
def test_descent_takes_exactly_the_fields_length(seed: int) -> None:
    free = random_mask(seed, share=0.08)
    goal, start = np.argwhere(free)[5], tuple(np.argwhere(free)[-5])
    field = distance_field(free, goal)
    cells = descend(field, start)
    assert tuple(cells[0]) == start
    assert tuple(cells[-1]) == tuple(goal)
    assert path_length(cells) == pytest.approx(field[start], rel=1e-6)
    assert free[cells[:, 0], cells[:, 1]].all()


@pytest.mark.parametrize(
    ("goals", "end"),
    [
        ([(4, 0), (4, 8)], (4, 8)),
        ([(0, 4), (8, 4)], (8, 4)),
        ([(4, 0), (0, 4)], (4, 0)),
        ([(4, 0), (8, 4)], (8, 4)),
    ],
)
def test_of_equally_near_goals_descent_takes_the_one_of_the_first_move(
    goals: list[tuple[int, int]], end: tuple[int, int]
) -> None:
    """Moves are tried right, down, left, up; ``goals`` are four cells from the start."""
    field = distance_field(np.ones((9, 9), dtype=bool), np.array(goals))
    cells = descend(field, (4, 4))
    assert tuple(cells[-1]) == end and len(cells) == 5


def test_descent_from_an_unreachable_cell_is_empty() -> None:
    free = np.ones((5, 5), dtype=bool)
    free[:, 2] = False
    field = distance_field(free, np.array([0, 0]))
    assert descend(field, (0, 4)).shape == (0, 2)
    assert descend(field, (9, 0)).shape == (0, 2)
    assert shortest_path(free, (0, 4), (0, 0)) is None


@pytest.mark.parametrize("seed", range(5))
def test_string_pull_keeps_the_ends_stays_free_and_shortens(seed: int) -> None:
    free = random_mask(seed, (80, 80), 0.05)
    field = distance_field(free, np.argwhere(free)[0])
    cells = descend(field, tuple(np.argwhere(free)[-1]))
    pulled = string_pull(free, cells)
    assert np.array_equal(pulled[[0, -1]], cells[[0, -1]])
    assert path_length(pulled) <= path_length(cells) + 1e-9
    assert len(pulled) < len(cells)
    for a, b in zip(pulled[:-1], pulled[1:], strict=True):
        assert line_of_sight(free, *a, *b)


def test_string_pull_goes_straight_where_it_can() -> None:
    free = np.ones((60, 90), dtype=bool)
    path = shortest_path(free, (3, 4), (50, 81))
    assert path is not None
    assert path.tolist() == [[3, 4], [50, 81]]
    free[:50, 40] = False  # round one corner: two legs
    path = shortest_path(free, (3, 4), (3, 81))
    assert path is not None
    best = 2 * math.hypot(50 - 3, 40 - 4)
    assert (
        best - 1 <= path_length(path) <= 1.02 * math.hypot(47, 36) + 1.02 * math.hypot(47, 41) + 3
    )


def test_line_of_sight_against_dense_sampling() -> None:
    free = random_mask(11, (20, 20), 0.12)
    rng = np.random.default_rng(0)
    seen = 0
    for y0, x0, y1, x1 in rng.integers(0, 20, (300, 4)):
        expected = all(free[y0 + a, x0 + b] for a, b in touched(y1 - y0, x1 - x0))
        assert line_of_sight(free, y0, x0, y1, x1) == expected
        assert line_of_sight(free, y1, x1, y0, x0) == expected
        seen += expected
    assert 30 < seen < 270


def test_a_field_that_ends_at_the_start_leads_the_same_way():
    rng = np.random.default_rng(7)
    compared = 0
    for _ in range(60):
        free = rng.random(rng.integers(5, 50, size=2)) > rng.choice((0.1, 0.3, 0.4))
        cells = np.argwhere(free)
        goal, start = cells[rng.integers(len(cells), size=2)]
        whole, part = distance_field(free, goal), distance_field(free, goal, tuple(start))
        assert np.array_equal(descend(part, tuple(start)), descend(whole, tuple(start)))
        near = whole <= whole[tuple(start)]
        assert np.array_equal(part[near], whole[near]) and (part >= whole).all()
        compared += len(descend(part, tuple(start))) > 2
    assert compared > 20

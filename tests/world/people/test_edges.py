"""The edges of the walkable area on a grid.

Where they are, where they lead away, and that nobody crosses them.
"""

import math

import numpy as np
import pytest

from harness.world.people.edges import (
    Edges,
    away_from_edge,
    cell_of,
    edge_distance,
    keep_inside,
)

FRAME = np.array((-6.0, -6.0, 1.0, 0.0, 0.2))
CENTRES = 0.2 * (np.arange(60) + 0.5)  # [m] from the grid's corner, along its rows or columns
EVERYWHERE = np.ones((60, 60), dtype=np.bool_)


@pytest.mark.parametrize("yaw", [0.0, 0.4, 2.0, -1.3])
def test_a_grid_may_be_turned(yaw):
    frame = np.array((3.0, -2.0, math.cos(yaw), math.sin(yaw), 0.2))
    edges = Edges(np.add.outer(2.0 * CENTRES, CENTRES), EVERYWHERE, frame)
    along, up = 4.37, 7.15  # [m] in the grid
    x, y = (
        3.0 + along * math.cos(yaw) - up * math.sin(yaw),
        -2.0 + along * math.sin(yaw) + up * math.cos(yaw),
    )
    assert cell_of(x, y, edges) == (35, 21)
    assert edge_distance(x, y, edges) == pytest.approx(along + 2.0 * up)
    to_x, to_y = math.cos(yaw) - 2.0 * math.sin(yaw), math.sin(yaw) + 2.0 * math.cos(yaw)
    assert away_from_edge(x, y, edges) == pytest.approx(
        (to_x / math.sqrt(5.0), to_y / math.sqrt(5.0))
    )


@pytest.mark.parametrize(
    ("x", "y", "cell"),
    [
        (-5.9, -5.9, (0, 0)),
        (5.9, -5.7, (1, 59)),
        (99.0, 0.1, (30, 59)),
        (-99.0, 0.1, (30, 0)),
        (0.1, 99.0, (59, 30)),
        (0.1, -99.0, (0, 30)),
    ],
)
def test_a_point_off_the_grid_is_in_the_nearest_cell(x, y, cell):
    assert cell_of(x, y, Edges(np.ones((60, 60)), EVERYWHERE, FRAME)) == cell


@pytest.mark.parametrize(
    ("velocity", "after"),
    [
        ((1.0, 1.0), (-5.4, -5.4, 1.0, 1.0)),  # out of the corner
        ((-1.0, 1.0), (-5.5, -5.5, 0.0, 0.0)),  # along the wall that is there: it cannot
        ((-1.0, -1.0), (-5.5, -5.5, 0.0, 0.0)),  # into the corner: what remains of it is nothing
    ],
)
def test_who_is_in_a_corner_gets_out_or_stands(velocity, after):
    # walls at the lower and left ends
    edges = Edges(np.minimum.outer(CENTRES, CENTRES), EVERYWHERE, FRAME)
    assert keep_inside(-5.5, -5.5, *velocity, 0.1, 0.6, edges) == pytest.approx(after, abs=1e-9)


@pytest.mark.parametrize(
    ("x", "y", "expected"),
    [(-99.0, 0.0, 0.1), (99.0, 0.0, 11.8998), (0.0, -99.0, 100.1), (0.0, 99.0, 111.8998)],
)
def test_off_the_grid_the_distance_is_that_of_its_last_cells(x, y, expected):
    along_x = Edges(np.tile(CENTRES, (60, 1)), EVERYWHERE, FRAME)
    along_y = Edges(np.tile(100.0 + CENTRES, (60, 1)).T.copy(), EVERYWHERE, FRAME)
    assert edge_distance(x, y, along_y if y else along_x) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("velocity", "expected"),
    [
        ((-1.0, 0.2), (-0.736, 0.552)),  # slides along
        ((0.3, -1.0), (0.672, -0.504)),
        ((-0.02, 0.0), (-0.02, 0.0)),  # does not come so far
        ((0.3, 0.4), (0.3, 0.4)),  # walks away
    ],
)
def test_who_runs_into_a_slanting_edge_slides_along_it(velocity, expected):
    """Its normal is (0.6, 0.8); one is 0.45 m from it and may come as near as 0.445 m."""
    edges = Edges(np.add.outer(0.8 * (CENTRES - 6.0), 0.6 * (CENTRES - 6.0)), EVERYWHERE, FRAME)
    x, y = 0.6 * 0.45 - 0.8, 0.8 * 0.45 + 0.6
    after = keep_inside(x, y, *velocity, 0.1, 0.445, edges)
    assert after == pytest.approx(
        (x + 0.1 * expected[0], y + 0.1 * expected[1], *expected), abs=1e-9
    )


@pytest.mark.parametrize(("vx", "expected"), [(-0.5, (-6.1, 0.0)), (0.5, (-6.05, 0.5))])
def test_who_is_beyond_an_edge_only_gets_back(vx, expected):
    edges = Edges(
        np.tile(CENTRES - 0.2, (60, 1)), EVERYWHERE, np.array((-6.2, -6.0, 1.0, 0.0, 0.2))
    )
    x, y, vx, vy = keep_inside(-6.1, 0.0, vx, 0.0, 0.1, 0.3, edges)
    assert (x, vx) == pytest.approx(expected, abs=1e-9)
    assert (y, vy) == (0.0, 0.0)

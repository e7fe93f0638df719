"""Dubins curves against OMPL's own lengths, and footprints against shapely."""

import math

import numpy as np
import ompl.base as ob
import pytest
import shapely
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal

from navstack.planning.dubins import curve, is_curve_free, overlaps_cell, shortest_word, stands_free
from navstack.planning.ompl_kernels import blocked_table

from .given import step_lengths, turns_of

BODY = np.array(((3.0, 2.0), (3.0, -2.0), (-6.0, -2.5), (-6.0, 2.5)))
REACH = float(np.hypot(*BODY.T).max())


def poses(rng, count):
    return np.column_stack(
        (rng.uniform(-6.0, 6.0, (count, 2)), rng.uniform(-math.pi, math.pi, count))
    )


def placed(pose):
    cos = math.cos(pose[2])
    sin = math.sin(pose[2])
    return BODY @ np.array(((cos, -sin), (sin, cos))).T + pose[:2]


@pytest.mark.parametrize("radius", [0.4, 1.3, 3.0])
def test_lengths_equal_ompl(radius):
    space = ob.DubinsStateSpace(radius)
    bounds = ob.RealVectorBounds(2)
    bounds.setLow(-10.0)
    bounds.setHigh(10.0)
    space.setBounds(bounds)
    states = space.allocState(), space.allocState()
    rng = default_rng(1)
    for start, end in zip(poses(rng, 300), poses(rng, 300), strict=True):
        for state, values in zip(states, (start, end), strict=True):
            state.setX(float(values[0]))
            state.setY(float(values[1]))
            state.setYaw(float(values[2]))
        assert sum(shortest_word(start, end, radius)[1:]) == pytest.approx(
            space.distance(*states), abs=1e-9
        )


def test_curves_reach_their_end_and_keep_the_radius():
    rng = default_rng(2)
    for start, end in zip(poses(rng, 200), poses(rng, 200), strict=True):
        line = curve(start, end, 1.3, 0.01)
        assert_array_equal(line[[0, -1]], (start, end))
        steps = step_lengths(line)
        assert steps.max() <= 0.01 + 1e-9
        assert steps.sum() == pytest.approx(sum(shortest_word(start, end, 1.3)[1:]), rel=1e-3)
        turns = turns_of(line)
        assert np.all(turns <= steps / 1.3 + 1e-3 * steps.max() + 1e-9)
        assert_allclose(
            np.cos(np.arctan2(*np.diff(line[:, :2], axis=0).T[::-1]) - line[:-1, 2]), 1.0, atol=1e-4
        )


def test_overlaps_equal_shapely():
    rng = default_rng(3)
    for x, y, yaw in np.column_stack(
        (rng.uniform(-9.0, 9.0, (2000, 2)), rng.uniform(-math.pi, math.pi, 2000))
    ):
        corners = placed((x, y, yaw))
        assert overlaps_cell(corners, 0, 0) == shapely.Polygon(corners).intersects(
            shapely.box(0.0, 0.0, 1.0, 1.0)
        )


@pytest.mark.parametrize(
    ("x", "y"), [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, -1.0)]
)
def test_a_square_that_touches_a_cell_has_a_point_in_common_with_it(x, y):
    square = np.array(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)))
    assert overlaps_cell(square + (7.0 + x, 3.0 + y), 7, 3)
    assert not overlaps_cell(square + (7.0 + 1.001 * x, 3.0 + 1.001 * y), 7, 3)


def test_a_footprint_stands_free_where_no_lethal_square_touches_it():
    rng = default_rng(4)
    costs = np.where(rng.random((60, 60)) < 0.01, 254, 0).astype(np.uint8)
    squares = shapely.MultiPolygon([shapely.box(c, r, c + 1, r + 1) for r, c in np.argwhere(costs)])
    blocked = blocked_table(252, True)
    found = set()
    for pose in np.column_stack(
        (rng.uniform(8.0, 52.0, (500, 2)), rng.uniform(-math.pi, math.pi, 500))
    ):
        free = stands_free(costs, blocked, BODY, REACH, True, pose)
        assert free == (not shapely.Polygon(placed(pose)).intersects(squares))
        found.add(bool(free))
    assert found == {True, False}
    assert not is_curve_free(
        costs,
        blocked,
        BODY,
        REACH,
        True,
        np.array(((1.0, 1.0, 0.0), (-5.0, 1.0, 0.0))),
    )

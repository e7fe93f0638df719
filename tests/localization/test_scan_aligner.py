"""Scans held against maps, from poses whose truth is known."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.ndimage import distance_transform_edt

from navstack.costmap.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, enclosed
from navstack.geometry import normalize_angle
from navstack.scan_matching.kernels import REACH, linearize
from navstack.scan_matching.scan_aligner import ScanAligner
from navstack.scan_matching.surface_field import CODE, MOST, surface_field
from navstack.types import Pose2D

from .made_up_scans import CORRIDOR, SQUARE, map_of, scan_of

TRUTH = Pose2D(0.4, -0.7, 0.5)
UNSURE = np.diag((0.5**2, 0.5**2, 0.03**2))


@pytest.fixture(scope="module")
def square():
    return ScanAligner(map_of(SQUARE))


@pytest.fixture(scope="module")
def corridor():
    return ScanAligner(map_of(CORRIDOR))


def aligned(aligner, boxes, off, covariance=UNSURE, rng=None, people=()):
    """The alignment of a scan from ``TRUTH``, believed ``off`` from there."""
    scan = scan_of(boxes, TRUTH, rng, people)
    believed = Pose2D(*(TRUTH.as_array() + off))
    return aligner.align(aligner.returns(scan), believed, covariance)


@pytest.mark.parametrize("away", [0.1, 0.3, 0.6, 1.0])
@pytest.mark.parametrize("bearing", [0.3, 2.0, 4.4])
def test_the_pose_is_found_wherever_the_belief_may_be(square, away, bearing):
    off = (away * math.cos(bearing), away * math.sin(bearing), 0.02)
    found = aligned(square, SQUARE, off, people=[(2.0, -1.0), (-1.0, 1.0), (1.0, 3.0)])
    assert_allclose(found.pose.as_array(), TRUTH.as_array(), atol=0.03)
    assert len(found.directions) == 3


def test_along_a_corridor_the_belief_holds(corridor):
    off = (0.4, 0.3, 0.02)
    found = aligned(corridor, CORRIDOR, off)
    assert_allclose(found.pose.y, TRUTH.y, atol=0.03)
    assert_allclose(found.pose.yaw, TRUTH.yaw, atol=0.01)
    assert abs(found.pose.x - (TRUTH.x + 0.4)) < 0.05
    assert len(found.directions) == 2
    assert np.abs(found.directions[:, 0]).max() < 0.05
    after = found.covariance(UNSURE)
    assert after[0, 0] > 0.9 * UNSURE[0, 0] and after[1, 1] < 0.1**2


def test_a_hundred_scans_along_a_corridor_do_not_drift(corridor):
    rng = np.random.default_rng(1)
    along = 0.4
    for _ in range(100):
        found = aligned(corridor, CORRIDOR, (along, 0.0, 0.0), rng=rng)
        along = found.pose.x - TRUTH.x
    assert abs(along - 0.4) < 0.1


def test_what_is_farther_than_the_covariance_allows_is_not_found(square):
    sure = np.diag((0.05**2, 0.05**2, 0.01**2))
    found = aligned(square, SQUARE, (1.2, 0.0, 0.0), covariance=sure)
    assert abs(found.pose.x - TRUTH.x) > 0.7


def test_a_scan_of_nothing_on_the_map_says_nothing(square):
    assert aligned(square, CORRIDOR, (0.0, 0.0, 0.0), np.diag((0.1, 0.1, 0.01)) ** 2) is None
    empty = scan_of((), TRUTH)
    assert square.align(square.returns(empty), TRUTH, UNSURE) is None


def test_what_a_scan_says_is_as_good_as_it_states(square):
    """Normalised squared errors, about the truth and along each direction of three."""
    rng = np.random.default_rng(3)
    squares = []
    for _ in range(200):
        off = rng.multivariate_normal(np.zeros(3), UNSURE)
        found = aligned(square, SQUARE, off, rng=rng)
        error = TRUTH.as_array() - found.pose.as_array()
        error[2] = normalize_angle(error[2])
        errors = found.directions @ error - found.offsets
        squares.append(float(errors @ (errors / found.variances)))
    assert np.mean(squares) < 3.0, "no more than of three directions"
    assert np.max(squares) < 16.3, "99.9 % of chi-square"


def test_the_slope_is_the_derivative_of_what_is_minimised(square):
    points = square.returns(scan_of(SQUARE, TRUTH))
    pose = TRUTH.as_array() + (0.06, -0.04, 0.01)
    hessian, slope = np.empty((3, 3)), np.empty(3)
    linearize(points, pose, square.field, hessian, slope)

    def half_squares(at):
        """Tukey's cost whose weights :func:`linearize` uses."""
        cos, sin = np.cos(at[2]), np.sin(at[2])
        ends = points[~np.isnan(points[:, 0])]
        x = at[0] + cos * ends[:, 0] - sin * ends[:, 1]
        y = at[1] + sin * ends[:, 0] + cos * ends[:, 1]
        codes, left, low, cell = square.field
        column, row = (x - left) / cell - 0.5, (y - low) / cell - 0.5
        i, j = np.floor(column).astype(int), np.floor(row).astype(int)
        u, v = column - i, row - j
        value = (1 - v) * ((1 - u) * codes[j, i] + u * codes[j, i + 1])
        value += v * ((1 - u) * codes[j + 1, i] + u * codes[j + 1, i + 1])
        share = np.minimum((CODE * value / REACH) ** 2, 1.0)
        return (REACH**2 / 6.0 / 0.2**2 * (1.0 - (1.0 - share) ** 3)).sum()

    for axis, step in enumerate((1e-5, 1e-5, 1e-6)):
        ahead, behind = pose.copy(), pose.copy()
        ahead[axis] += step
        behind[axis] -= step
        numeric = (half_squares(ahead) - half_squares(behind)) / (2.0 * step)
        assert slope[axis] == pytest.approx(numeric, rel=0.02, abs=1.0)


def test_distances_are_signed_and_unknown_is_behind_a_surface():
    grid = map_of(((-1.0, -1.0, 1.0, 1.0),))
    inside = grid.data.copy()
    inside[390:410, 390:410] = UNKNOWN
    for data in (grid.data, inside):
        codes = surface_field(type(grid)(data, grid.resolution, grid.origin)).codes
        assert codes[400, 400] == pytest.approx(-97.5, abs=1.0)
        assert codes[400, 380] == -2 and codes[400, 379] == 2
        assert codes[400, 360] == pytest.approx(97.5, abs=1.0)
        assert codes[0, 0] == MOST


def test_a_map_and_what_a_lidar_maps_of_it_share_the_distances_to_all_that_is_occupied():
    rng = np.random.default_rng(4)
    seeds = rng.choice(np.array((FREE, OCCUPIED, UNKNOWN), dtype=np.int8), (12, 15))
    cells = np.kron(seeds, np.ones((9, 9), dtype=np.int8))
    occupied, free = cells == OCCUPIED, cells == FREE
    mapped = np.where(enclosed(occupied), np.int8(UNKNOWN), cells)
    whole, surfaces = (
        surface_field(OccupancyGrid(each, 0.05, Pose2D(0.0, 0.0, 0.0))).codes
        for each in (cells, mapped)
    )
    assert whole is surfaces
    beyond = 0.05 * (distance_transform_edt(~occupied) - 0.5)
    within = -0.05 * (distance_transform_edt(~free) - 0.5)
    expected = np.clip(np.rint(np.where(free, beyond, within) / CODE), -MOST, MOST)
    np.testing.assert_array_equal(whole, expected)

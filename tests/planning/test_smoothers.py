"""What every smoother of the name table does, and what Savitzky-Golay and the constrained one do alone."""

import math

import numpy as np
import pytest
from scipy.signal import savgol_filter

from navstack.costmap.costmap import LETHAL_OBSTACLE, Costmap
from navstack.errors import ParameterError
from navstack.params.smoothers import (
    ConstrainedSmootherParams,
    OptimizerParams,
    SavitzkyGolayParams,
    SimpleSmootherParams,
)
from navstack.planning.smoothers import SMOOTHERS
from navstack.planning.smoothers.constrained_kernels import (
    BAND,
    cost_between,
    curvature,
    highest_curvature,
    normal_equations,
    sum_of_squares,
)
from navstack.planning.smoothers.constrained_smoother import ConstrainedSmoother
from navstack.planning.smoothers.savitzky_golay import SavitzkyGolaySmoother
from navstack.types import Path

PARAMS = {
    "nav2_smoother::SimpleSmoother": SimpleSmootherParams(),
    "nav2_smoother::SavitzkyGolaySmoother": SavitzkyGolayParams(),
    "nav2_constrained_smoother::ConstrainedSmoother": ConstrainedSmootherParams(),
}


def free(size=200):
    return Costmap(np.zeros((size, size), dtype=np.uint8), 0.05, -5.0, -5.0)


def staircase(*corners, noise=0.0):
    """Poses 5 cm apart along straight pieces between corners [m], each looking along the path."""
    points = [np.array(corners[:1], dtype=float)]
    for a, b in zip(np.array(corners[:-1], dtype=float), np.array(corners[1:], dtype=float), strict=True):
        count = round(math.hypot(*(b - a)) / 0.05)
        points.append(a + (b - a) * (np.arange(1, count + 1) / count)[:, None])
    line = np.vstack(points)
    line[1:-1] += np.random.default_rng(0).normal(0.0, noise, line[1:-1].shape) if noise else 0.0
    step = np.diff(line, axis=0)
    yaw = np.arctan2(step[:, 1], step[:, 0])
    return np.column_stack((line, np.append(yaw, yaw[-1])))


CORNERS = staircase((-3.0, -2.0), (0.0, -2.0), (1.0, 0.0), (3.0, 0.5), noise=0.004)


def test_every_name_has_parameters():
    assert set(PARAMS) == set(SMOOTHERS)


@pytest.mark.parametrize("name", sorted(SMOOTHERS))
def test_ends_stay_the_path_is_smoother_and_nothing_given_changes(name):
    costmap, given = free(), Path(CORNERS.copy(), stamp=3.5)
    smooth = SMOOTHERS[name](PARAMS[name]).smooth(given, costmap)
    assert smooth is not given
    assert smooth.stamp == 3.5
    assert len(smooth) == len(given)
    np.testing.assert_array_equal(given.poses, CORNERS)
    assert not costmap.data.any()
    np.testing.assert_allclose(smooth.poses[[0, -1], :2], CORNERS[[0, -1], :2], atol=1e-12)
    assert highest_curvature(smooth.poses) < 0.5 * highest_curvature(CORNERS)
    step = np.diff(smooth.poses[:, :2], axis=0)
    np.testing.assert_allclose(smooth.poses[:-1, 2], np.arctan2(step[:, 1], step[:, 0]))


@pytest.mark.parametrize("name", sorted(SMOOTHERS))
@pytest.mark.parametrize("count", [0, 1, 2, 4])
def test_short_paths_stay_as_they_are(name, count):
    smoother = SMOOTHERS[name](PARAMS[name])
    np.testing.assert_array_equal(smoother.smooth(Path(CORNERS[:count]), free()).poses, CORNERS[:count])
    assert smoother.refusal == ""


@pytest.mark.parametrize("name", sorted(SMOOTHERS))
def test_no_pose_comes_into_an_obstacle(name):
    costmap = free()
    costmap.data[60:102, 105:130] = LETHAL_OBSTACLE  # fills the second corner to within a cell of the path
    cells = np.floor((CORNERS[:, :2] + 5.0) / 0.05).astype(int)
    for dx, dy in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)):
        costmap.data[cells[:, 1] + dy, cells[:, 0] + dx] = 0
    smooth = SMOOTHERS[name](PARAMS[name]).smooth(Path(CORNERS), costmap)
    assert all(costmap.cost_at(x, y) < LETHAL_OBSTACLE for x, y, _ in smooth.poses)


def test_savitzky_golay_equals_scipy_away_from_the_ends():
    once = SavitzkyGolayParams(do_refinement=False)
    smooth = SavitzkyGolaySmoother(once).smooth(Path(CORNERS), free()).poses
    expected = savgol_filter(CORNERS[:, :2], 7, 3, axis=0)
    np.testing.assert_allclose(smooth[3:-3, :2], expected[3:-3], atol=1e-12)
    weights = np.array((-2, 3, 6, 7, 6, 3, -2)) / 21.0  # Nav2's
    padded = np.vstack((CORNERS[[0, 0]], CORNERS[:6]))[:, :2]  # the first pose is repeated
    np.testing.assert_allclose(smooth[1, :2], weights @ padded[:7], atol=1e-12)


def test_refinement_is_the_filter_again():
    once, twice = SavitzkyGolayParams(do_refinement=False), SavitzkyGolayParams(refinement_num=1)
    first = SavitzkyGolaySmoother(once).smooth(Path(CORNERS), free())
    again = SavitzkyGolaySmoother(once).smooth(first, free()).poses
    np.testing.assert_allclose(SavitzkyGolaySmoother(twice).smooth(Path(CORNERS), free()).poses, again, atol=1e-12)


def test_savitzky_golay_says_where_it_kept_the_path():
    costmap, smoother = free(), SavitzkyGolaySmoother(SavitzkyGolayParams())
    costmap.data[:] = LETHAL_OBSTACLE
    cells = np.floor((CORNERS[:, :2] + 5.0) / 0.05).astype(int)
    costmap.data[cells[:, 1], cells[:, 0]] = 0
    kept = smoother.smooth(Path(CORNERS), costmap)
    np.testing.assert_array_equal(kept.poses, CORNERS)
    assert "obstacle" in smoother.refusal


@pytest.mark.parametrize("radius", [0.4, 0.8, 1.5])
def test_curvature_is_bounded(radius):
    smoother = ConstrainedSmoother(ConstrainedSmootherParams(minimum_turning_radius=radius))
    smooth = smoother.smooth(Path(CORNERS), free())
    assert smoother.refusal == ""
    assert highest_curvature(CORNERS) > 10.0
    assert highest_curvature(smooth.poses) <= 1.0 / radius
    turn = np.abs(np.diff(np.unwrap(smooth.poses[:, 2])))
    assert np.all(turn[1:-1] <= 1.02 * np.hypot(*np.diff(smooth.poses[1:-1, :2], axis=0).T) / radius)


def test_it_sets_out_and_arrives_along_the_poses_it_must_keep():
    given = CORNERS.copy()
    given[0, 2] += 0.5
    given[-1, 2] += 2.5  # looks elsewhere: it will turn on the spot
    smooth = ConstrainedSmoother(ConstrainedSmootherParams()).smooth(Path(given), free()).poses
    assert smooth[0, 2] == pytest.approx(given[0, 2], abs=0.05)
    assert smooth[-1, 2] == given[-1, 2]
    assert abs(smooth[-2, 2] - CORNERS[-2, 2]) < 0.5
    loose = ConstrainedSmootherParams(keep_start_orientation=False)
    assert abs(ConstrainedSmoother(loose).smooth(Path(given), free()).poses[0, 2] - given[0, 2]) > 0.06


def test_it_keeps_away_from_costs():
    costmap = free()
    y = np.abs(np.arange(200) * 0.05 - 5.0 + 0.2)  # costs fall with the distance from the line y = -0.2
    costmap.data[:] = (200.0 * np.clip(1.0 - y / 0.6, 0.0, 1.0)).astype(np.uint8)[:, None]
    line = Path(staircase((-3.0, 0.0), (3.0, 0.0)))
    smooth = ConstrainedSmoother(ConstrainedSmootherParams()).smooth(line, costmap)
    assert smooth.poses[:, 1].max() > 0.2
    held = ConstrainedSmoother(ConstrainedSmootherParams(w_dist=1e6)).smooth(line, costmap)
    assert np.abs(held.poses[:, 1]).max() < 0.05


def test_what_cannot_be_smoothed_is_given_back_with_the_reason():
    costmap, sharp = free(), staircase((-2.0, 0.0), (0.0, 0.0), (0.0, 2.0))
    costmap.data[:] = LETHAL_OBSTACLE
    cells = np.floor((sharp[:, :2] + 5.0) / 0.05).astype(int)
    for dx, dy in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)):
        costmap.data[cells[:, 1] + dy, cells[:, 0] + dx] = 0
    smoother = ConstrainedSmoother(ConstrainedSmootherParams(minimum_turning_radius=1.5))
    np.testing.assert_array_equal(smoother.smooth(Path(sharp), costmap).poses, sharp)
    assert "given path is kept" in smoother.refusal
    smoother.smooth(Path(sharp), free())
    assert smoother.refusal == ""


def test_stretches_between_cusps_are_smoothed_apart():
    out, back = staircase((-2.0, 0.0), (0.0, 0.0), (1.0, 1.0)), staircase((1.0, 1.0), (0.0, 1.4), (-2.0, 1.4))
    back[:, 2] += math.pi  # backwards
    smooth = ConstrainedSmoother(ConstrainedSmootherParams()).smooth(Path(np.vstack((out, back[1:]))), free()).poses
    np.testing.assert_allclose(smooth[len(out) - 1, :2], (1.0, 1.0), atol=1e-12)
    assert highest_curvature(smooth[: len(out)]) <= 2.5
    assert highest_curvature(smooth[len(out) - 1 :]) <= 2.5
    heading = np.arctan2(*np.diff(smooth[len(out) :, :2], axis=0).T[::-1])
    assert np.all(np.cos(heading - smooth[len(out) : -1, 2]) < -0.99)


def test_normal_equations_equal_finite_differences():
    rng = np.random.default_rng(1)
    points = np.column_stack((np.arange(7) * 0.1, rng.normal(0.0, 0.05, 7)))
    given = points + rng.normal(0.0, 0.02, points.shape)
    costs = rng.integers(0, 250, (60, 60)).astype(np.uint8)
    grid, weights = np.array((-1.0, -1.5, 0.05, 1.0)), np.array((30.0, 2.0, 3.0, 0.1))
    fixed = np.zeros(7, dtype=np.bool_)
    fixed[[0, 3, 6]] = True
    band, slope = np.empty((BAND, 14)), np.empty(14)
    normal_equations(points, given, grid, costs, weights, fixed, band, slope)
    for n in range(14):
        ahead, behind = points.copy(), points.copy()
        ahead[n // 2, n % 2] += 1e-6
        behind[n // 2, n % 2] -= 1e-6
        difference = sum_of_squares(ahead, given, grid, costs, weights)
        difference -= sum_of_squares(behind, given, grid, costs, weights)
        expected = 0.0 if fixed[n // 2] else difference / 4e-6
        assert slope[n] == pytest.approx(expected, rel=1e-4, abs=1e-4)
    dense = np.zeros((14, 14))
    for k in range(BAND):
        diagonal = BAND - 1 - k
        dense += np.diag(band[k, diagonal:], diagonal) + (np.diag(band[k, diagonal:], -diagonal) if diagonal else 0.0)
    assert np.linalg.eigvalsh(dense).min() > -1e-6


def test_curvature_of_a_circle_and_costs_between_cells():
    a = np.linspace(0.0, 1.0, 3)
    circle = 2.0 * np.column_stack((np.cos(a), np.sin(a)))
    assert curvature(*circle.ravel()) == pytest.approx(0.5)
    assert curvature(*circle[::-1].ravel()) == pytest.approx(-0.5)
    assert highest_curvature(np.array(((0.0, 0.0), (1.0, 0.0), (0.5, 0.0)))) == math.inf
    costs = np.array(((0, 100), (50, 150)), dtype=np.uint8)
    assert cost_between(costs, 0.5, 0.5) == pytest.approx(0.0)
    assert cost_between(costs, 1.0, 1.0) == pytest.approx(75.0)
    assert cost_between(costs, 9.0, -9.0) == pytest.approx(100.0, rel=0.01)


def test_parameters_are_checked():
    for values in ({"window_size": 6}, {"window_size": 1}, {"poly_order": 7}, {"refinement_num": -1}):
        with pytest.raises(ParameterError):
            SavitzkyGolayParams(**values)
    for values in ({"w_dist": -1.0}, {"minimum_turning_radius": 0.0}, {"path_downsampling_factor": 0}):
        with pytest.raises(ParameterError):
            ConstrainedSmootherParams(**values)
    with pytest.raises(ParameterError):
        OptimizerParams(max_iterations=-1)

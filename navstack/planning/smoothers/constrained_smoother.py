"""Smooths a path with bounded curvature, after nav2_constrained_smoother of Jazzy; the solver is our own."""

import math

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import solveh_banded

from navstack.costmap.costmap import Costmap
from navstack.params.smoothers import ConstrainedSmootherParams
from navstack.planning.smoother import Smoother
from navstack.planning.smoothers.constrained_kernels import (
    BAND,
    highest_curvature,
    normal_equations,
    sum_of_squares,
)
from navstack.planning.smoothers.simple_smoother_kernels import face_along, is_obstacle
from navstack.types import BoolArray, FloatArray, Path

FEWEST_POSES = 6  # of a stretch that is smoothed
ATTEMPTS = 8
HARDER = 10.0  # times as much weight in the next attempt
FIRST_W_DIST = 1.0  # where the path must be held and nothing holds it yet
KEPT_ANGLE = math.radians(45.0)  # from a pose's heading to the path's, up to which the path keeps the heading
RESERVE = 0.93  # of the curvature allowed that points may have; the curve between them has a little more
DAMPING = (1e-4, 1e8)  # Levenberg and Marquardt's, at first and at the most


class ConstrainedSmoother(Smoother):
    """Gauss and Newton's method (Levenberg-Marquardt) on points of the path, a cubic spline between them.

    Each point weighs its second difference, what its curvature has too much, its distance from where it was, and its
    cost. Where the result is bent too much or meets an obstacle (cost 253 or 254) it is tried again with more weight on
    what failed; where nothing helps, the path is given back as it came, and :attr:`refusal` says why.
    """

    def __init__(self, params: ConstrainedSmootherParams) -> None:
        self._params = params

    def smooth(self, path: Path, costmap: Costmap) -> Path:
        """The path with every stretch between cusps smoothed and its poses evenly apart; a new object."""
        poses, self.refusal = path.poses.copy(), ""
        first = 0
        for last in self._stretch_ends(poses):
            stretch = poses[first : last + 1]
            if len(stretch) >= FEWEST_POSES and np.ptp(stretch[:, :2], axis=0).any():
                self._smooth_stretch(stretch, costmap)
            first = last
        return Path(poses, path.stamp)

    def _stretch_ends(self, poses: FloatArray) -> list[int]:
        """Index of the last pose of each stretch: where the path turns back, and so does the driving along the yaw."""
        if not self._params.reversing_enabled or len(poses) < 3:
            return [len(poses) - 1]
        steps = np.diff(poses[:, :2], axis=0)
        forwards = (steps * np.column_stack((np.cos(poses[:-1, 2]), np.sin(poses[:-1, 2])))).sum(axis=1) >= 0.0
        turns_back = (steps[:-1] * steps[1:]).sum(axis=1) < 0.0
        return [*(np.flatnonzero(turns_back & (forwards[:-1] != forwards[1:])) + 1).tolist(), len(poses) - 1]

    def _smooth_stretch(self, poses: FloatArray, costmap: Costmap) -> None:
        """Smooth poses (N, 3) in place; the positions of the first and the last stay."""
        backwards = bool(np.cos(math.atan2(*(poses[2, 1::-1] - poses[1, 1::-1])) - poses[1, 2]) < 0.0)
        knots = _spread(poses[:, :2], max(len(poses) // self._params.path_downsampling_factor, FEWEST_POSES))
        fixed = self._fix_ends(knots, poses, backwards)
        allowed = 1.0 / self._params.minimum_turning_radius
        w_curve, w_dist = self._params.w_curve, self._params.w_dist
        for _ in range(ATTEMPTS):
            points = _between(self._optimize(knots, fixed, costmap, w_curve, w_dist), len(poses))
            is_bent, is_hit = highest_curvature(points) > allowed, _meets_obstacle(points, costmap)
            if not (is_bent or is_hit):
                poses[:, :2] = points
                face_along(poses, backwards)
                return
            if is_bent:
                w_curve *= HARDER
            if is_hit:
                w_dist = max(w_dist * HARDER, FIRST_W_DIST)
        failure = (
            "an obstacle is met" if is_hit else f"a radius of {self._params.minimum_turning_radius:g} m is not kept"
        )
        self.refusal = f"ConstrainedSmoother: {failure} after {ATTEMPTS} attempts; the given path is kept there"

    def _fix_ends(self, knots: FloatArray, poses: FloatArray, backwards: bool) -> BoolArray:
        """Which points (N,) stay; the second and the last but one are put along the poses' headings, in place."""
        fixed: BoolArray = np.zeros(len(knots), dtype=np.bool_)
        fixed[[0, -1]] = True
        ahead = -1.0 if backwards else 1.0
        for end, beside, keep, pose, sign in (
            (0, 1, self._params.keep_start_orientation, poses[0], ahead),
            (-1, -2, self._params.keep_goal_orientation, poses[-1], -ahead),
        ):
            step = knots[beside] - knots[end]
            along = sign * np.array((math.cos(pose[2]), math.sin(pose[2])))
            length = float(np.hypot(*step))
            if keep and float(step @ along) > length * math.cos(KEPT_ANGLE):
                knots[beside] = knots[end] + length * along
                fixed[beside] = True
        return fixed

    def _optimize(
        self, given: FloatArray, fixed: BoolArray, costmap: Costmap, w_curve: float, w_dist: float
    ) -> FloatArray:
        """Points (N, 2) at which the sum of weighted squares is least, from the given ones."""
        spacing = float(np.hypot(*np.diff(given, axis=0).T).mean())
        w_smooth = self._params.w_smooth * (costmap.resolution / spacing) ** 4  # as if the points were one cell apart
        weights = np.sqrt(np.array((w_smooth, w_curve, w_dist, self._params.w_cost)))
        allowed = RESERVE / self._params.minimum_turning_radius
        grid = np.array((costmap.origin_x, costmap.origin_y, costmap.resolution, allowed))
        band, slope = np.empty((BAND, given.size)), np.empty(given.size)
        points, damping = given.copy(), DAMPING[0]
        total = sum_of_squares(points, given, grid, costmap.data, weights)
        for _ in range(self._params.optimizer.max_iterations):
            normal_equations(points, given, grid, costmap.data, weights, fixed, band, slope)
            diagonal = band[-1].copy()
            lower = math.inf
            while damping < DAMPING[1]:
                band[-1] = diagonal * (1.0 + damping) + (diagonal == 0.0)  # what is fixed does not move
                tried = points - solveh_banded(band, slope, check_finite=False).reshape(-1, 2)
                lower = sum_of_squares(tried, given, grid, costmap.data, weights)
                if lower < total:
                    break
                damping *= HARDER
            if not lower < total:
                break
            is_done = total - lower < self._params.optimizer.fn_tol * total
            points, total, damping = tried, lower, max(damping / HARDER, 1e-9)
            if is_done:
                break
        return points


def _spread(points: FloatArray, count: int) -> FloatArray:
    """``count`` points evenly along a polyline (N, 2), both ends among them."""
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    at = np.linspace(0.0, along[-1], count)
    return np.column_stack((np.interp(at, along, points[:, 0]), np.interp(at, along, points[:, 1])))


def _between(knots: FloatArray, count: int) -> FloatArray:
    """``count`` points along the cubic spline through knots (N, 2), both ends among them."""
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(knots, axis=0).T))))
    points: FloatArray = CubicSpline(along, knots)(np.linspace(0.0, along[-1], count))
    points[[0, -1]] = knots[[0, -1]]
    return points


def _meets_obstacle(points: FloatArray, costmap: Costmap) -> bool:
    cells = (points - (costmap.origin_x, costmap.origin_y)) / costmap.resolution
    return any(is_obstacle(costmap.data, x, y) for x, y in cells)

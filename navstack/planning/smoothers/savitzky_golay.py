"""Smooths a path by fitting a polynomial around each pose: nav2_smoother's ``savitzky_golay_smoother.cpp`` (Jazzy)."""

import math

import numpy as np
from scipy.signal import savgol_coeffs

from navstack.costmap.costmap import Costmap
from navstack.params.smoothers import SavitzkyGolayParams
from navstack.planning.smoother import Smoother
from navstack.planning.smoothers.simple_smoother_kernels import face_along, is_obstacle, stretch_ends
from navstack.types import FloatArray, Path


class SavitzkyGolaySmoother(Smoother):
    """A least-squares polynomial through ``window_size`` poses says where the middle one goes (Savitzky, Golay, 1964).

    Beyond the ends the first and the last pose are repeated, which stay themselves. Unlike Nav2's, which does not look
    at the costmap, it gives back the given stretch where a pose would come into an obstacle (cost 253 or 254).
    """

    def __init__(self, params: SavitzkyGolayParams) -> None:
        self._params = params
        self._weights = savgol_coeffs(params.window_size, params.poly_order, use="dot")

    def smooth(self, path: Path, costmap: Costmap) -> Path:
        """The path with every stretch smoothed that has more than ``window_size`` + 3 poses; a new object."""
        poses, self.refusal = path.poses.copy(), ""
        first = 0
        ends = stretch_ends(poses).tolist() if self._params.enforce_path_inversion and len(poses) else [len(poses) - 1]
        for last in ends:
            if last - first > self._params.window_size + 2:
                self._smooth_stretch(poses[first : last + 1], costmap)
            first = last
        return Path(poses, path.stamp)

    def _smooth_stretch(self, poses: FloatArray, costmap: Costmap) -> None:
        """Smooth poses (N, 3) in place; the positions of the first and the last stay."""
        points = poses[:, :2].copy()
        for _ in range(1 + (self._params.refinement_num if self._params.do_refinement else 0)):
            padded = np.pad(points, ((self._params.window_size // 2,) * 2, (0, 0)), mode="edge")
            windows = np.lib.stride_tricks.sliding_window_view(padded, self._params.window_size, axis=0)
            points[1:-1] = (windows @ self._weights)[1:-1]
        cells = (points - (costmap.origin_x, costmap.origin_y)) / costmap.resolution
        if any(is_obstacle(costmap.data, x, y) for x, y in cells):
            self.refusal = "SavitzkyGolaySmoother: the smoothed path meets an obstacle; the given one is kept there"
            return
        poses[:, :2] = points
        heading = math.atan2(poses[2, 1] - poses[1, 1], poses[2, 0] - poses[1, 0])
        face_along(poses, math.cos(heading - poses[1, 2]) < 0.0)

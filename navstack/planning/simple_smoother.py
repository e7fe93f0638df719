"""Smooths a path by pulling each pose towards its neighbours.

Nav2_smoother's ``simple_smoother.cpp`` (Jazzy).
"""

import math

from navstack.costmap.costmap import Costmap
from navstack.params.planners import SimpleSmootherParams
from navstack.planning.simple_smoother_kernels import face_along, relax, stretch_ends
from navstack.types import FloatArray, Path

FEWEST_POSES = 5  # of a stretch that is smoothed


class SimpleSmoother:
    """Gauss-Seidel relaxation between the given path and the straightest one.

    Where an iteration would put a pose into an obstacle (cost 253 or 254), or the iterations run
    out, the poses before that iteration are taken. There is no limit on wall time, which would make
    results depend on the machine; ``max_its`` and ``refinement_num`` bound the work.
    """

    def __init__(self, params: SimpleSmootherParams) -> None:
        self._params = params

    def smooth(self, path: Path, costmap: Costmap) -> Path:
        """The path with every stretch of at least five poses smoothed; a new object."""
        poses = path.poses.copy()
        if len(poses) < FEWEST_POSES:
            return Path(poses, path.stamp)
        first = 0
        for last in self._stretch_ends(poses):
            if last - first + 1 >= FEWEST_POSES:
                self._smooth_stretch(poses[first : last + 1], costmap)
            first = last
        return Path(poses, path.stamp)

    def _stretch_ends(self, poses: FloatArray) -> list[int]:
        """Index of the last pose of each stretch; the next stretch begins with it."""
        if not self._params.enforce_path_inversion:
            return [len(poses) - 1]
        ends: list[int] = stretch_ends(poses).tolist()
        return ends

    def _smooth_stretch(self, poses: FloatArray, costmap: Costmap) -> None:
        """Smooth poses (N, 3) in place; the positions of the first and the last stay."""
        params = self._params
        passes = 1
        if params.do_refinement:
            passes += params.refinement_num
        converged = True
        for _ in range(passes):
            if converged:
                weights = (params.w_data, params.w_smooth)
                converged = relax(
                    poses, weights, params.tolerance, params.max_its, costmap.data, costmap.grid
                )
        heading = math.atan2(poses[2, 1] - poses[1, 1], poses[2, 0] - poses[1, 0])
        backwards = math.cos(heading - poses[1, 2]) < 0.0
        face_along(poses, backwards)

"""The motion of a lidar between two scans, by point-to-line ICP (Censi, ICRA 2008)."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from navstack.geometry import rotation
from navstack.types import FloatArray, LaserScan

FARTHEST = 25.0  # [m] of returns that are used
_BESIDE = 2  # beams on each side that give a surface's direction
_GAP = 0.4  # [m] between neighbouring returns of one surface
_NEAREST = (0.6, 0.3, 0.15)  # [m] of pairs in the first, the second and all further rounds
_ROUNDS = 25
_LEAST_PAIRS = 40
_DONE = 1e-5  # [m], [rad]
_WEAK = 15.0  # least eigenvalue of the normal equations over which a match is sure


@dataclass(frozen=True, slots=True, eq=False)
class Surfaces:
    """The returns of a scan in the lidar's frame."""

    points: FloatArray  # (N, 2) [m]
    normals: FloatArray  # (N, 2); nan where there is no surface
    tree: cKDTree  # of the points

    @classmethod
    def of(cls, scan: LaserScan) -> "Surfaces":
        """From a scan; beams without a return are left out."""
        angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        with np.errstate(invalid="ignore"):
            longest = min(scan.range_max, FARTHEST)
            kept = (scan.ranges >= scan.range_min) & (scan.ranges < longest)
        ranges, angles = scan.ranges[kept], angles[kept]
        points = np.column_stack((ranges * np.cos(angles), ranges * np.sin(angles)))
        return cls(points, _normals(points), cKDTree(points))


def _normals(points: FloatArray) -> FloatArray:
    """Unit normals (N, 2), by the direction from the neighbours before to those behind."""
    normals = np.full(points.shape, np.nan)
    width = 2 * _BESIDE + 1
    if len(points) < width:
        return normals
    windows = np.lib.stride_tricks.sliding_window_view(points, width, axis=0)
    centred = windows - windows.mean(axis=2, keepdims=True)
    spread = np.einsum("nik,njk->nij", centred, centred)
    _, axes = np.linalg.eigh(spread)
    steps = np.hypot(*np.diff(windows, axis=2).transpose(1, 0, 2))
    is_whole = steps.max(axis=1) < _GAP
    middle = normals[_BESIDE : len(points) - _BESIDE]
    middle[is_whole] = axes[is_whole, :, 0]
    return normals


def match(before: Surfaces, after: Surfaces, guess: FloatArray) -> FloatArray | None:
    """Motion (3,) x, y [m], yaw [rad] of the lidar, in its frame before.

    None: the scans do not tell it, as in a corridor.

    Args:
        before: the first scan.
        after: the second one.
        guess: of the motion.
    """
    motion = np.array(guess, dtype=np.float64)
    if min(len(before.points), len(after.points)) < _LEAST_PAIRS:
        return None
    for number in range(_ROUNDS):
        reach = _NEAREST[min(number, len(_NEAREST) - 1)]
        turned = after.points @ rotation(motion[2]).T
        moved = turned + motion[:2]
        distances, nearest = before.tree.query(moved, distance_upper_bound=reach)
        kept = np.flatnonzero(np.isfinite(distances))
        kept = kept[~np.isnan(before.normals[nearest[kept], 0])]
        if len(kept) < _LEAST_PAIRS:
            return None
        normals, targets = before.normals[nearest[kept]], before.points[nearest[kept]]
        errors = np.einsum("ni,ni->n", normals, moved[kept] - targets)
        across = normals[:, 1] * turned[kept, 0] - normals[:, 0] * turned[kept, 1]
        jacobian = np.column_stack((normals, across))
        scale = 1.4826 * np.median(np.abs(errors)) + 1e-4
        weights = 1.0 / np.maximum(1.0, np.abs(errors) / (2.0 * scale))
        information = jacobian.T @ (jacobian * weights[:, None])
        if np.linalg.eigvalsh(information)[0] < _WEAK:
            return None
        change = -np.linalg.solve(information, jacobian.T @ (weights * errors))
        motion += change
        if number >= len(_NEAREST) and np.abs(change).max() < _DONE:
            return motion
    return None

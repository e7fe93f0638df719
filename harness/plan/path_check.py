"""Whether a body can be moved along a path without touching the map.

Polygons against squares, with shapely.

It shares nothing with the planners, so that it can judge them.
"""

import math

import numpy as np
import shapely
from scipy import ndimage
from scipy.spatial import cKDTree

from navstack.types import BoolArray, FloatArray, Pose2D

REACH = 5.0  # [m] from the body's circle within which obstacles are looked for
TURN = math.radians(3.0)  # between two placements of the body that is turned
APART = 1.0  # [m] at most between two points of a path from which obstacles are looked for
_CHUNK = 4000  # placements at a time


class Obstacles:
    """The cells of a map that a body must not touch, as squares."""

    def __init__(
        self,
        taken: BoolArray,
        resolution: float,
        origin_x: float,
        origin_y: float,
    ) -> None:
        """Keep the cells that have a neighbour that is not taken, as none is beyond the map.

        Who gets inside comes through them.

        Args:
            taken: (height, width) cells that must not be touched.
            resolution: [m/cell].
            origin_x: [m] of the lower left corner of cell (0, 0).
            origin_y: [m].
        """
        rim = taken & ~ndimage.binary_erosion(taken, border_value=0)
        rows, columns = np.nonzero(rim)
        self._corners = np.column_stack(
            (origin_x + columns * resolution, origin_y + rows * resolution)
        )
        self._resolution = resolution
        self._taken, self._origin = taken, (origin_x, origin_y)

    def clearance(
        self,
        path: FloatArray,
        start: Pose2D,
        goal: Pose2D,
        footprint: FloatArray,
    ) -> float:
        """Least distance [m] of a body to the obstacles on its way; 0: it touches one.

        It stands at the start, turns where the path turns, drives forwards along it and turns at
        its end to the goal's heading. Between two placements it sweeps their convex hull.

        Args:
            path: (N, >= 2) points [m]; their yaw is not used.
            start: where it stands at first; only its yaw counts.
            goal: as which heading it ends.
            footprint: (M, 2) polygon [m], base frame.

        Returns:
            The distance, or ``REACH`` where nothing is nearer.
        """
        placements = placements_along(path[:, :2], start.yaw, goal.yaw)
        if self._is_taken(placements[0, :2]):
            return 0.0
        squares = self._near(placements[:, :2], float(np.hypot(*footprint.T).max()))
        if not len(squares):
            return REACH
        tree = shapely.STRtree(squares)
        least = REACH
        for first in range(0, max(len(placements) - 1, 1), _CHUNK):
            bodies = swept(placements[first : first + _CHUNK + 1], footprint)
            _, distances = tree.query_nearest(
                bodies,
                max_distance=REACH,
                return_distance=True,
                all_matches=False,
            )
            least = min(least, float(distances.min(initial=REACH)))
        return least

    def _is_taken(self, point: FloatArray) -> bool:
        """Whether a point (2,) [m] lies in a cell that is taken; beyond the map there is none."""
        column, row = np.floor((point - self._origin) / self._resolution).astype(int)
        height, width = self._taken.shape
        inside = 0 <= row < height and 0 <= column < width
        return inside and bool(self._taken[row, column])

    def _near(self, points: FloatArray, radius: float) -> np.ndarray:
        """Squares that may be within ``REACH`` of a body on its way along points (N, 2).

        Args:
            points: [m].
            radius: [m] of the circle around the body.
        """
        limit = REACH + radius + 2.0 * self._resolution + APART / 2.0
        tree = cKDTree(points_along(points))
        distances, _ = tree.query(self._corners, distance_upper_bound=limit)
        corners = self._corners[np.isfinite(distances)]
        squares: np.ndarray = shapely.box(*corners.T, *(corners + self._resolution).T)
        return squares


def points_along(points: FloatArray) -> FloatArray:
    """The points (N, 2) of a polyline, and further ones where they are far apart."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    counts = np.maximum(np.ceil(steps / APART), 1.0).astype(int)
    pieces = [
        np.linspace(first, second, count, endpoint=False)
        for first, second, count in zip(points[:-1], points[1:], counts, strict=True)
    ]
    return np.vstack((*pieces, points[-1:]))


def placements_along(points: FloatArray, start_yaw: float, goal_yaw: float) -> FloatArray:
    """Poses (M, 3) of a body that drives along a polyline (N, 2) and turns at its corners."""
    steps = np.diff(points, axis=0)
    moves = np.hypot(*steps.T) > 1e-9
    points = np.vstack((points[:-1][moves], points[-1:]))
    headings = np.concatenate(
        ([start_yaw], np.arctan2(steps[moves, 1], steps[moves, 0]), [goal_yaw])
    )
    placed = []
    for point, before, after in zip(points, headings[:-1], headings[1:], strict=True):
        turn = (after - before + math.pi) % (2.0 * math.pi) - math.pi
        count = max(1, math.ceil(abs(turn) / TURN))
        yaws = before + turn * np.arange(count + 1) / count
        placed.append(np.column_stack((np.tile(point, (count + 1, 1)), yaws)))
    return np.vstack(placed)


def swept(placements: FloatArray, footprint: FloatArray) -> np.ndarray:
    """Convex hulls of a body at each two successive placements (N, 3).

    N - 1 polygons; one where N is 1.
    """
    cos, sin = np.cos(placements[:, 2])[:, None], np.sin(placements[:, 2])[:, None]
    x = placements[:, :1] + cos * footprint[:, 0] - sin * footprint[:, 1]
    y = placements[:, 1:2] + sin * footprint[:, 0] + cos * footprint[:, 1]
    corners = np.stack((x, y), axis=-1)
    pairs = corners
    if len(corners) > 1:
        pairs = np.concatenate((corners[:-1], corners[1:]), axis=1)
    hulls: np.ndarray = shapely.convex_hull(shapely.multipoints(shapely.points(pairs)))
    return hulls

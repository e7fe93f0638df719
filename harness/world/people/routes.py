"""Where people can walk, and the shortest paths between such places."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt

from harness.task.shortest_paths import distance_field, string_pull
from harness.world.map.sidewalk import largest_part
from harness.world.people.walk_kernels import BLOCKED, find_path
from navstack.costmap.field_cache import cached_array, content_key
from navstack.costmap.occupancy_grid import FREE, OccupancyGrid
from navstack.errors import MapError
from navstack.geometry import relative_to, transform_points
from navstack.types import BoolArray, Float32Array, FloatArray, IntArray, Pose2D

_CELL = 0.2  # [m] of the grid that is searched; finer maps are coarsened to it
_BORDER = 2  # [cells] closed cells around the grid, as the search needs them
_LANDMARKS = 16
_KEPT_ROUTES = 10_000  # about 5 MB: every stack and every trial of a study meets the same people
_NEAR = 10  # [cells] around a point that are searched first
_ENOUGH = 0.2  # share of the walkable area that must survive the keeping of a distance


class WalkingNetwork:
    """The largest connected part of the walkable area, ready for many shortest paths."""

    def __init__(self, walkable: OccupancyGrid, agent_radius: float) -> None:
        """Prepare the search: about 0.5 s for a map of 200 m x 200 m.

        Args:
            walkable: FREE where people may be; a coarser cell is free when all its cells are.
            agent_radius: [m] that paths keep from the edges. On a map too narrow for it (less than
                a fifth of the area survives) a half, and then nothing is kept.

        Raises:
            MapError: nothing is walkable.
        """
        factor = max(1, round(_CELL / walkable.resolution))
        self._origin = walkable.origin
        self._cell = factor * walkable.resolution
        free = _coarsen(walkable.data == FREE, factor)
        if not free.any():
            raise MapError(
                f"nothing is walkable in a map of {walkable.width} x {walkable.height} cells of "
                f"{walkable.resolution} m; people need a free square of {self._cell:.2f} m at least"
            )
        self.walkable: BoolArray = free  # (H, W) cells, without any distance kept
        # [m] of a centre to the edge
        clearance = _edge_distances(free) * self._cell - 0.5 * self._cell
        for kept in (agent_radius, 0.5 * agent_radius, 0.0):
            self._free = largest_part(free & (clearance >= kept - 1e-9))
            self.agent_radius = kept  # [m] that is really kept
            if self._free.sum() >= _ENOUGH * free.sum():
                break
        # (N, 2) all cells, row by row
        self.cells: IntArray = _kept("free cells", self._free, np.argwhere)
        self.centres = self.positions(self.cells)  # (N, 2) [m]
        # of the cells
        self._numbers: npt.NDArray[np.int32] = _kept("numbers", self._free, _numbers)
        self._landmarks = _kept(
            "landmarks", self._free, lambda free: _landmark_lengths(free, self.cells)
        )
        self._length = _kept("lengths", self._free, _no_lengths)  # work space of the search
        self._ahead = np.empty(len(self.cells))
        self._arrival = np.zeros(self._free.size, dtype=np.uint8)
        self._known_route = lru_cache(_KEPT_ROUTES)(self._find_route)

    @property
    def frame(self) -> FloatArray:
        """Place of the grid (5,); see :class:`~harness.world.people.edges.Edges`."""
        cos, sin = math.cos(self._origin.yaw), math.sin(self._origin.yaw)
        corner = transform_points(
            self._origin, np.array([(-_BORDER * self._cell, -_BORDER * self._cell)])
        )[0]
        return np.array((*corner, cos, sin, self._cell))

    def edge_distances(self) -> FloatArray:
        """Distance (H, W) [m] of each cell's centre to the edge, negative outside of it."""
        inside, outside = _edge_distances(self.walkable), _edge_distances(~self.walkable)
        distances: FloatArray = (
            np.maximum(inside - 0.5, 0.0) - np.maximum(outside - 0.5, 0.0)
        ) * self._cell
        return distances

    def nearest_cell(self, x: float, y: float) -> IntArray:
        """The one of :attr:`cells` nearest to a point [m] in the map frame."""
        at = relative_to(self._origin, Pose2D(x, y))
        middle = np.array((at.y, at.x)) / self._cell + _BORDER - 0.5  # of cell (0, 0) its centre
        low = np.maximum(middle.astype(np.int64) - _NEAR, 0)
        near = (
            np.argwhere(self._free[low[0] : low[0] + 2 * _NEAR, low[1] : low[1] + 2 * _NEAR]) + low
        )
        if not len(near):
            near = self.cells
        cell: IntArray = near[((near - middle) ** 2).sum(axis=1).argmin()]
        return cell

    def positions(self, cells: IntArray) -> FloatArray:
        """Centres (N, 2) of cells (N, 2), in [m] in the map frame."""
        points: FloatArray = ((cells[:, ::-1] - _BORDER).astype(np.float64) + 0.5) * self._cell
        return transform_points(self._origin, points)

    def greatest_lengths(self, cells: IntArray) -> FloatArray:
        """What routes (N, N) between some of :attr:`cells` (N, 2) cannot exceed, in [m].

        0 to itself.

        By the triangle inequality over the landmarks, and the 1 % by which a route may be longer
        than the shortest.
        """
        lengths = self._landmarks[self._numbers[cells[:, 0], cells[:, 1]]].astype(np.float64)
        most = np.full((len(cells), len(cells)), np.inf)
        for along in lengths.T:
            np.minimum(most, along[:, None] + along, out=most)
        np.fill_diagonal(most, 0.0)
        return 1.01 * self._cell * most

    def route(self, start: IntArray, goal: IntArray) -> FloatArray:
        """Corners (M, 2) [m], map frame, of a path between two cells, shortest within 1 %."""
        width = self._free.shape[1]
        return self._known_route(
            int(start[0]) * width + int(start[1]), int(goal[0]) * width + int(goal[1])
        )

    def _find_route(self, start: int, goal: int) -> FloatArray:
        """See :meth:`route`; takes flat indices."""
        cells = find_path(
            self._numbers.ravel(),
            self._numbers.shape[1],
            self._landmarks,
            start,
            goal,
            self._length,
            self._ahead,
            self._arrival,
        )
        return self.positions(string_pull(self._free, cells))


def _coarsen(free: BoolArray, factor: int) -> BoolArray:
    """Cells of ``factor`` x ``factor`` that are free throughout, with a closed border."""
    height, width = (math.ceil(n / factor) for n in free.shape)
    padded = np.zeros((height * factor, width * factor), dtype=np.bool_)
    padded[: free.shape[0], : free.shape[1]] = free
    blocks = padded.reshape(height, factor, width, factor).all(axis=(1, 3))
    coarse: BoolArray = np.pad(blocks, _BORDER)
    return coarse


def _edge_distances(free: BoolArray) -> FloatArray:
    """Distance (H, W) [cells] of each free cell to the nearest that is not free, 0 elsewhere."""
    distances: FloatArray = _kept("distances to closed cells", free, distance_transform_edt)
    return distances


def _numbers(free: BoolArray) -> npt.NDArray[np.int32]:
    """Number (H, W) of each free cell, row by row; -1 elsewhere."""
    return np.where(free, np.cumsum(free).reshape(free.shape) - 1, -1).astype(np.int32)


def _no_lengths(free: BoolArray) -> FloatArray:
    """What the search for a path takes as ``length`` (H * W,)."""
    return np.where(free, np.inf, BLOCKED).ravel()


def _kept(name: str, free: BoolArray, compute: Callable[[BoolArray], Any]) -> Any:
    """What is computed from the free cells (H, W), on disk: in memory once for all processes."""
    key = content_key(f"{name} 1", np.packbits(free), free.shape[1])
    return cached_array(key, lambda: compute(free))


def _landmark_lengths(free: BoolArray, cells: IntArray) -> Float32Array:
    """Lengths (N, L) [cells] of the free cells (N, 2) from landmarks.

    Each landmark is the farthest from those before it.
    """
    lengths = np.empty((len(cells), _LANDMARKS), dtype=np.float32)
    farthest = distance_field(free, cells[0])[free].argmax()
    least = np.full(len(cells), np.inf, dtype=np.float32)
    for i in range(_LANDMARKS):
        found = distance_field(free, cells[farthest])[free]
        lengths[:, i] = found
        np.minimum(least, found, out=least)
        farthest = least.argmax()
    return lengths

"""Glass fronts: a lidar sees them squarely, and mostly looks through them elsewhere."""

import math
from collections.abc import Sequence

import numpy as np

from harness.world.map.scene import Obstacle
from harness.world.map.shapes import grow, window_of
from harness.world.sensors.lidar_kernels import cast_grid, clearance_field
from harness.world.sensors.ray_lanes import Field
from navstack.costmap.occupancy_grid import SOLID_FROM, OccupancyGrid
from navstack.geometry import relative_to, transform_points
from navstack.jit import njit
from navstack.types import FloatArray, IntArray, Pose2D

KINDS = ("building_glass",)  # obstacles whose outside is of glass
_INSIDE = 1e-6  # [cells] behind the border at which a ray entered a cell


class Glass:
    """The glass obstacles of a scene on the cells of its geometry, and what stands behind them.

    A beam that meets glass within ``visible_angle`` of the normal returns: the pane reflects it
    back (Foster, Sun, Park & Kuipers, "VisAGGE: Visible Angle Grid for Glass Environments", ICRA
    2013: glass is seen from a narrow range of angles). Farther from the normal the reflection is
    lost, and the beam passes with probability ``transmission``; else it met a frame, a blind or
    dirt. Having passed one pane it passes all, to what is not of glass.
    """

    def __init__(self, geometry: OccupancyGrid, obstacles: Sequence[Obstacle]) -> None:
        """Find the glass among the cells.

        Args:
            geometry: what the lidar can hit.
            obstacles: of the scene; those of ``KINDS`` are glass.
        """
        panes = [_distinct(obstacle.polygon) for obstacle in obstacles if obstacle.kind in KINDS]
        to_grid = relative_to(geometry.origin, Pose2D())
        # [cells]
        polygons = [transform_points(to_grid, polygon) / geometry.resolution for polygon in panes]
        self._resolution = geometry.resolution
        # Number of the pane in each cell + 1; 0: no glass.
        self._numbers = np.zeros(geometry.data.shape, dtype=np.min_scalar_type(-len(polygons) - 1))
        for number, polygon in enumerate(polygons, 1):
            around = grow(polygon, 0.5)  # the cells that the polygon cuts, too
            window, inside = window_of(around, geometry.data.shape, 1.0, 0.0, 0.0)
            self._numbers[window][inside] = number
        self._first = np.cumsum([0, *(len(polygon) for polygon in polygons)])  # edge of each pane
        edges = [_edges(polygon) for polygon in polygons] or [np.empty((0, 3))]
        self._edges = np.concatenate(edges)
        self._behind = clearance_field((geometry.data >= SOLID_FROM) & (self._numbers == 0))

    def see_through(
        self,
        sensor: Pose2D,
        directions: FloatArray,
        ranges: FloatArray,
        chances: FloatArray,
        transmission: float,
        visible_angle: float,
        range_max: float,
    ) -> None:
        """Lengthen the beams that go through glass to what stands behind it, in place.

        Args:
            sensor: its pose in the frame of the grid, [m].
            directions: (n, 2) unit vectors of the beams in the sensor frame.
            ranges: (n,) [m] to what each beam meets; inf where that is nothing.
            chances: (n,) uniform in [0, 1).
            transmission: probability of passing beyond the visible angle.
            visible_angle: [rad] from the normal.
            range_max: [m] beyond which nothing is seen.
        """
        see_through(
            self._numbers,
            self._first,
            self._edges,
            self._behind,
            (sensor.x, sensor.y, math.cos(sensor.yaw), math.sin(sensor.yaw)),
            directions,
            ranges,
            np.where(chances < transmission, math.cos(visible_angle), -1.0),
            range_max,
            self._resolution,
        )


def _distinct(polygon: FloatArray) -> FloatArray:
    """A polygon (N, 2) without corners that repeat the one before."""
    corners: FloatArray = polygon[(polygon != np.roll(polygon, 1, axis=0)).any(axis=1)]
    return corners


def _edges(polygon: FloatArray) -> FloatArray:
    """Outward unit normal x, y and offset along it of each edge (N, 3) of a polygon (N, 2)."""
    along = np.roll(polygon, -1, axis=0) - polygon
    normals = np.column_stack((along[:, 1], -along[:, 0])) / np.hypot(*along.T)[:, None]
    return np.column_stack((normals, (normals * polygon).sum(axis=1)))


@njit()
def see_through(
    numbers: IntArray,
    first: IntArray,
    edges: FloatArray,
    behind: Field,
    sensor: tuple[float, float, float, float],
    directions: FloatArray,
    ranges: FloatArray,
    limits: FloatArray,
    range_max: float,
    resolution: float,
) -> None:
    """Lengthen the beams that meet glass at less than a cosine of incidence, in place.

    The edge that a beam met is the one whose line is nearest to where it met.

    Args:
        numbers: (H, W) of the pane in each cell + 1; 0: no glass.
        first: (k + 1,) where the edges of each pane begin.
        edges: (e, 3) outward unit normal x, y and offset along it in [cells].
        behind: clearance field of what is not glass.
        sensor: x, y in [m], cosine and sine of its yaw, frame of the grid.
        directions: (n, 2) unit vectors of the beams in the sensor frame.
        ranges: (n,) [m] to what each beam meets.
        limits: (n,) cosines; -1: no glass is passed.
        range_max: [m] beyond which nothing is seen.
        resolution: [m/cell].
    """
    height, width = numbers.shape
    x0, y0, cos, sin = sensor[0] / resolution, sensor[1] / resolution, sensor[2], sensor[3]
    passing, count = np.empty(len(ranges), np.int64), 0
    for i in range(len(ranges)):
        if limits[i] < 0.0 or not math.isfinite(ranges[i]):
            continue
        dx = cos * directions[i, 0] - sin * directions[i, 1]
        dy = sin * directions[i, 0] + cos * directions[i, 1]
        length = ranges[i] / resolution + _INSIDE
        x, y = x0 + length * dx, y0 + length * dy
        column, row = math.floor(x), math.floor(y)
        if not (0 <= column < width and 0 <= row < height) or numbers[row, column] == 0:
            continue
        if (
            _incidence(
                x, y, dx, dy, first[numbers[row, column] - 1], first[numbers[row, column]], edges
            )
            < limits[i]
        ):
            passing[count] = i
            count += 1
    farther = np.empty(count)
    cast_grid(
        behind, x0, y0, cos, sin, directions[passing[:count]], range_max / resolution, farther
    )
    for k in range(count):
        ranges[passing[k]] = farther[k] * resolution


@njit()
def _incidence(
    x: float, y: float, dx: float, dy: float, start: int, end: int, edges: FloatArray
) -> float:
    """Cosine of incidence of a beam along (dx, dy) on the edge that is nearest (x, y).

    Looks at the edges ``start`` to ``end``.
    """
    nearest, incidence = -math.inf, 1.0
    for edge in range(start, end):
        outside = edges[edge, 0] * x + edges[edge, 1] * y - edges[edge, 2]
        if outside > nearest:
            nearest = outside
            incidence = -(edges[edge, 0] * dx + edges[edge, 1] * dy)
    return incidence

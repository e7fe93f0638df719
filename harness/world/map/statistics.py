"""Measures of a world's navigation mesh and furniture, and the known ones of the paper's."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from harness.world.map.scene import Scene
from harness.world.map.shapes import polygon_area
from navstack.costmap.occupancy_grid import FREE, OCCUPIED
from navstack.types import BoolArray, FloatArray

WIDTH_PERCENTILES = (5, 10, 25, 50, 75, 90, 95)
SPACING_PERCENTILES = (10, 50, 90)
GAP_PERCENTILES = (50, 95)
PIECE_AREA = (0.05, 10.0)  # [m2] what counts as a piece of furniture


@dataclass(frozen=True, slots=True)
class MapStatistics:
    """Measures of a scene's navigation mesh and furniture."""

    walkable_area: float  # [m2] of the mesh
    connected_parts: int  # of the mesh, 4-connected
    widths: tuple[float, ...]  # [m] at WIDTH_PERCENTILES over the medial axis of the mesh
    pieces: int  # of furniture between 0.05 and 10 m2
    medium_share: float  # of those between 0.3 and 1 m2
    # [m] at SPACING_PERCENTILES of the distance between nearest pieces' centres
    spacings: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class EdgeStatistics:
    """How a navigation mesh's edges lie to what a lidar can hit."""

    open_half_metre: float  # share of the edges with nothing to hit within 0.5 m
    open_metre: float  # share of the edges with nothing to hit within 1 m
    # [m] at GAP_PERCENTILES between the other edges and what stands behind them
    gaps: tuple[float, ...]


# The paper's world, from its published map.
PUBLISHED = MapStatistics(
    walkable_area=12_620.0,
    connected_parts=1,
    widths=(0.5, 0.8, 1.8, 2.9, 4.1, 7.0, 9.4),
    pieces=330,
    medium_share=0.5,
    spacings=(1.6, 3.1, 6.6),
)
PUBLISHED_EDGES = EdgeStatistics(open_half_metre=0.6, open_metre=0.4, gaps=(0.2, 0.9))
TOLERANCE = 0.15  # relative deviation from the paper's world that counts as alike


def deviation(measured: MapStatistics) -> float:
    """The largest relative deviation of a measure from the paper's world."""
    pairs = zip(_numbers(measured), _numbers(PUBLISHED), strict=True)
    return max(abs(value / published - 1.0) for value, published in pairs)


def _numbers(s: MapStatistics) -> tuple[float, ...]:
    return (s.walkable_area, s.connected_parts, *s.widths, s.pieces, s.medium_share, *s.spacings)


def measure(scene: Scene) -> MapStatistics:
    """Measure a scene; furniture is what is neither a building nor of unknown kind."""
    mesh = scene.navigation_mesh
    free = mesh.data == FREE
    furniture = [
        o for o in scene.obstacles if not o.kind.startswith("building") and o.kind != "unknown"
    ]
    sizes = np.array([polygon_area(obstacle.polygon) for obstacle in furniture])
    counted = (sizes >= PIECE_AREA[0]) & (sizes <= PIECE_AREA[1])
    centres = np.array([o.polygon.mean(axis=0) for o in furniture]).reshape(-1, 2)[counted]
    nearest = np.empty(0)
    if len(centres) > 1:
        nearest = cKDTree(centres).query(centres, k=2)[0][:, 1]
    medium_share = 0.0
    if counted.any():
        medium_share = float(((sizes >= 0.3) & (sizes <= 1.0))[counted].mean())
    widths = medial_widths(free) * mesh.resolution
    return MapStatistics(
        walkable_area=float(free.sum()) * mesh.resolution**2,
        connected_parts=int(ndimage.label(free)[1]),
        widths=_percentiles(widths, WIDTH_PERCENTILES),
        pieces=int(counted.sum()),
        medium_share=medium_share,
        spacings=_percentiles(nearest, SPACING_PERCENTILES),
    )


def measure_edges(scene: Scene) -> EdgeStatistics | None:
    """Measure how far what a lidar can hit stands behind the edges of the mesh.

    None: there are no edges or no walls.

    An edge is a free cell with a neighbour that is not; the distance is that between the borders of
    the two cells.
    """
    free, solid = scene.navigation_mesh.data == FREE, scene.geometry.data == OCCUPIED
    edge = free & ~ndimage.binary_erosion(free, border_value=True)
    if not edge.any() or not solid.any():
        return None
    cells = np.maximum(ndimage.distance_transform_edt(~solid)[edge] - 1.0, 0.0)
    gaps = cells * scene.geometry.resolution
    return EdgeStatistics(
        open_half_metre=float((gaps > 0.5).mean()),
        open_metre=float((gaps > 1.0).mean()),
        gaps=_percentiles(gaps[gaps <= 1.0], GAP_PERCENTILES),
    )


def medial_widths(free: BoolArray) -> FloatArray:
    """Widths [cells] at every cell of the integer medial axis.

    A width is twice the distance to the nearest blocked cell. The axis is where neighbouring cells
    have blocked cells apart from each other as their nearest, taken on the side of the bisector
    (Hesselink & Roerdink 2008, "Euclidean skeletons ... by the integer medial axis").
    """
    near_y, near_x = ndimage.distance_transform_edt(
        free, return_distances=False, return_indices=True
    )
    axis = np.zeros(free.shape, dtype=bool)
    for dy, dx in ((0, 1), (1, 0)):
        here = np.s_[: free.shape[0] - dy, : free.shape[1] - dx]
        there = np.s_[dy:, dx:]
        apart_y, apart_x = near_y[there] - near_y[here], near_x[there] - near_x[here]
        candidates = np.argwhere(free[here] & free[there] & (apart_y**2 + apart_x**2 > 2))
        y, x = candidates.T
        middle_y = 2 * y + dy - near_y[here][y, x] - near_y[there][y, x]
        middle_x = 2 * x + dx - near_x[here][y, x] - near_x[there][y, x]
        side = apart_y[y, x] * middle_y + apart_x[y, x] * middle_x
        axis[y[side >= 0], x[side >= 0]] = True
        axis[y[side <= 0] + dy, x[side <= 0] + dx] = True
    y, x = np.nonzero(axis)
    widths: FloatArray = 2.0 * np.hypot(near_y[y, x] - y, near_x[y, x] - x)
    return widths


def _percentiles(values: FloatArray, at: tuple[int, ...]) -> tuple[float, ...]:
    if not len(values):
        return ()
    return tuple(np.percentile(values, at).tolist())
